"""Whether the intervals of extrapolations include the truth as often as they say.

    python benchmarks/law_coverage.py docs/data/benchmarks/law_coverage.csv

Data whose law is known are made in the scenes of the record, with as many runs at each modulus as
there. The law is fitted as the record's is: scenes left out of the fit say what it does not
explain. Runs in new scenes, drawn over the same ranges, are then extrapolated. Amplitudes and
scatter are those that the record has for the number of contacts on the workpiece. The coverage is
that of 95 % intervals, its own interval that of the mean over the trials; the bias is that of the
extrapolated value.
"""

import argparse
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.arrays import Floats
from dragchain.statistics.estimate import NORMAL_QUANTILE, student_quantile
from dragchain.tradeoff.stiffness_document import StiffnessRecord
from dragchain.tradeoff.stiffness_errors import PLANS
from dragchain.tradeoff.stiffness_law import (
    COEFFICIENTS,
    ScaledRuns,
    StiffnessLaw,
    extrapolate,
    fit_stiffness_law,
    left_out,
    with_misfit,
)

ROOT = Path(__file__).resolve().parents[1]
RECORD = ROOT / "workflow/dragdeck/data/stiffness.json"

NEW_SCENES = 4
"""Scenes of a trial that are extrapolated."""

SINGLE = [plan for plan in PLANS if sum(plan.values()) == 1]


@dataclass(frozen=True)
class Truth:
    """A known law.

    Attributes
    ----------
    effect : callable
        What the amplitude is multiplied with at a stiffness number, relative to the physical one.
    amplitude : (3,) ndarray
        Mean of the amplitudes, and their slopes over inertial number and logarithm of friction.
    amplitude_std, run_std : float
    stiffness_power : float
        The quantity also goes as one over the stiffness number to this power.
    """

    effect: Callable[[Floats, float], Floats]
    amplitude: Floats
    amplitude_std: float
    run_std: float
    stiffness_power: float = 0.0

    def runs(self, scene: ScaledRuns, rng: np.random.Generator) -> ScaledRuns:
        """Runs of a scene; the logarithm of the quantity at the physical modulus is 0."""
        kappa = scene.stiffness_number * scene.scales ** (2.0 / 3.0)
        amplitude = rng.normal(float(scene.of_amplitude @ self.amplitude), self.amplitude_std)
        logarithms = amplitude * self.effect(kappa, scene.stiffness_number)
        logarithms -= self.stiffness_power * np.log(kappa / scene.stiffness_number)
        logarithms += rng.normal(0.0, self.run_std, len(kappa))
        return replace(scene, logarithms=logarithms, stiffness_power=self.stiffness_power)


def power_law(rate: float) -> Callable[[Floats, float], Floats]:
    """(kappa^-b - kappa_full^-b) / b, over what it is for E x 0.001 at kappa_full = 5e4."""
    unit = ((5e4 * 0.01) ** -rate - 5e4**-rate) / rate

    def effect(kappa: Floats, full: float) -> Floats:
        return np.asarray((kappa**-rate - full**-rate) / rate / unit)

    return effect


def logarithm(kappa: Floats, full: float) -> Floats:
    """The limit of the power law for a rate of 0."""
    return np.asarray(np.log(full / kappa) / math.log(100.0))


def truths(record: StiffnessRecord) -> Iterator[tuple[str, Truth]]:
    """The laws that are tried, by name."""
    known = record.laws["workpiece_contacts"].law
    like = np.array(known.amplitude), known.amplitude_std, known.run_std
    yield "rate 0, the logarithm", Truth(logarithm, *like)
    for rate in (0.1, 0.5, 1.0):
        yield f"rate {rate:g}", Truth(power_law(rate), *like)
    yield "1 / kappa", Truth(logarithm, np.zeros(3), 0.0, known.run_std, stiffness_power=1.0)


def designed_scenes(record: StiffnessRecord) -> list[ScaledRuns]:
    """The scenes of the record with their runs, without values."""
    return [
        _scene(one.numbers, np.repeat([float(s) for s in one.runs], list(one.runs.values())))
        for one in record.scenes
    ]


def _scene(numbers: Mapping[str, float], scales: Floats) -> ScaledRuns:
    names = ("stiffness_number", "inertial_number", "particle_friction")
    return ScaledRuns(*(numbers[name] for name in names), scales, np.zeros(len(scales)), 15.0)


def new_scene(scenes: list[ScaledRuns], scale: float, rng: np.random.Generator) -> ScaledRuns:
    """A scene with one run, drawn over the ranges of some others, evenly in the logarithms."""
    names = ("stiffness_number", "inertial_number", "friction")
    ranges = [np.log([getattr(one, name) for one in scenes]) for name in names]
    drawn = [math.exp(rng.uniform(one.min(), one.max())) for one in ranges]
    return ScaledRuns(*drawn, np.array([scale]), np.zeros(1), 15.0)


def fitted(scenes: list[ScaledRuns]) -> StiffnessLaw:
    """The law of some scenes as the record has it."""
    found = zip(SINGLE, left_out(scenes, SINGLE), strict=True)
    return with_misfit(fit_stiffness_law(scenes), {min(plan): errors for plan, errors in found})


def coverage(
    record: StiffnessRecord, truth: Truth, trials: int, seed: int
) -> Iterator[dict[str, float]]:
    """Coverage and bias of extrapolations from each modulus scale."""
    rng = np.random.default_rng(seed)
    scenes = designed_scenes(record)
    quantile = student_quantile(len(scenes) - COEFFICIENTS)
    scales = [min(plan) for plan in SINGLE]
    inside = np.zeros((len(scales), trials, NEW_SCENES))
    errors = np.zeros_like(inside)
    for trial in range(trials):
        law = fitted([truth.runs(one, rng) for one in scenes])
        for at, scale in enumerate(scales):
            for number in range(NEW_SCENES):
                found = extrapolate(law, truth.runs(new_scene(scenes, scale, rng), rng))
                errors[at, trial, number] = math.expm1(found.logarithm)
                inside[at, trial, number] = abs(found.logarithm) <= found.half_width(quantile)
    for at, scale in enumerate(scales):
        means = inside[at].mean(axis=1)
        half = NORMAL_QUANTILE * float(means.std(ddof=1)) / math.sqrt(trials)
        yield {
            "youngs_modulus_scale": scale,
            "trials": trials,
            "coverage": float(means.mean()),
            "ci95_low": float(means.mean()) - half,
            "ci95_high": float(means.mean()) + half,
            "bias": float(errors[at].mean()),
        }


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    parser.add_argument(
        "--trials", type=int, default=300, help="of each law (default: %(default)s)"
    )
    parser.add_argument("--seed", type=int, default=20261124)
    asked = parser.parse_args()
    record = StiffnessRecord.read(RECORD)
    rows = []
    for name, truth in truths(record):
        for row in coverage(record, truth, asked.trials, asked.seed):
            rows.append({"kind": name, **row})
            print(rows[-1], flush=True)
    pd.DataFrame(rows).to_csv(asked.out, index=False, float_format="%.4g")


if __name__ == "__main__":
    main()
