"""The record of reduced stiffness: a law for each quantity, and how well it extrapolates."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from dragchain.arrays import Floats
from dragchain.documents import Document, Part
from dragchain.errors import SeriesError
from dragchain.tradeoff.measures import Measures
from dragchain.tradeoff.quantities import QUANTITIES, Quantity
from dragchain.tradeoff.runs import by_scene, values_within
from dragchain.tradeoff.six_digits import SixDigits
from dragchain.tradeoff.stiffness_law import ScaledRuns, StiffnessLaw, fit_stiffness_law, left_out

_FEWEST_SCENES = 6
"""Scenes below which a law is not believed."""


class LawEntry(Part):
    """The law of a quantity.

    Attributes
    ----------
    scenes : int
        How many it was fitted to.
    path_to_particle : float
        Mean path over particle diameter that `run_std` belongs to.
    """

    label: str
    scenes: int
    path_to_particle: SixDigits
    law: StiffnessLaw


class LeftOutEntry(Part):
    """Errors of a plan's extrapolation in scenes that were left out of the fit.

    Attributes
    ----------
    quantity : str
    runs : mapping of str to int
        Runs at each modulus scale.
    scenes : int
    mean, root_mean_square, largest : float
        Of the relative errors.
    inside : int
        Scenes whose measured value lies within the predicted 95 % interval.
    raw_root_mean_square : float
        Of the value as it is, at the largest modulus of the plan.
    """

    quantity: str
    runs: Mapping[str, int]
    scenes: int
    mean: SixDigits
    root_mean_square: SixDigits
    largest: SixDigits
    inside: int
    raw_root_mean_square: SixDigits


class SceneEntry(Part):
    """A scene of the record: its dimensionless numbers, and its runs at each modulus scale."""

    numbers: Mapping[str, SixDigits]
    runs: Mapping[str, int]
    failed: int


class StiffnessRecord(Document):
    """The content of ``stiffness.json``."""

    made_by = "snakemake stiffness"

    measured: str
    engine_versions: tuple[str, ...]
    scenes: tuple[SceneEntry, ...]
    laws: Mapping[str, LawEntry]
    left_out: tuple[LeftOutEntry, ...]
    without_law: Mapping[str, str]


def scaled_runs(everyone: Sequence[Measures], quantity: Quantity) -> ScaledRuns | None:
    """The complete runs of a scene in a quantity; None if none has it or it changes its sign."""
    complete = [run for run in everyone if run.complete]
    arc = min((run.arc_m for run in complete), default=0.0)
    rows = [(run, values_within(run, arc).get(quantity.name, math.nan)) for run in complete]
    rows = [(run, value) for run, value in rows if math.isfinite(value) and value != 0.0]
    if not rows or len({math.copysign(1.0, value) for _, value in rows}) > 1:
        return None
    return ScaledRuns(
        stiffness_number=complete[0].numbers["stiffness_number"],
        inertial_number=complete[0].numbers["inertial_number"],
        scales=np.array([run.fidelity.youngs_modulus_scale for run, _ in rows]),
        logarithms=np.log(np.abs([value for _, value in rows])),
        path_to_particle=arc / complete[0].particle_diameter_m,
    )


def stiffness_record(
    runs: Sequence[Measures], plans: Sequence[Mapping[float, int]]
) -> StiffnessRecord:
    """Fit a law to each quantity, and leave each scene out once.

    Parameters
    ----------
    runs : sequence of Measures
        Of many scenes, at the physical Young's modulus and at a reduced one.
    plans : sequence of mapping of float to int
        Runs at each modulus scale, for each way to extrapolate that is tried.
    """
    scenes = [everyone for _, everyone in by_scene(runs)]
    laws: dict[str, LawEntry] = {}
    without: dict[str, str] = {}
    errors: list[LeftOutEntry] = []
    for quantity in QUANTITIES:
        found = [scaled_runs(everyone, quantity) for everyone in scenes]
        known = [one for one in found if one is not None]
        try:
            if quantity.signed or len(known) < _FEWEST_SCENES:
                raise SeriesError(f"{len(known)} of {len(scenes)} scenes have it with one sign")
            law = fit_stiffness_law(known)
        except SeriesError as error:
            without[quantity.name] = str(error)
            continue
        rows = [
            _left_out_entry(quantity, plan, np.reshape(of_plan, (-1, 3)))
            for plan, of_plan in zip(plans, left_out(known, plans), strict=True)
        ]
        errors += [row for row, _ in rows]
        law_std = max(std for _, std in rows)
        laws[quantity.name] = LawEntry(
            label=quantity.label,
            scenes=len(known),
            path_to_particle=float(np.mean([one.path_to_particle for one in known])),
            law=replace(law, model_std=law_std),
        )
    return StiffnessRecord(
        measured=max(run.started for run in runs)[:10],
        engine_versions=tuple(sorted({run.versions["engine"] for run in runs})),
        scenes=tuple(map(_scene_entry, scenes)),
        laws=laws,
        left_out=tuple(errors),
        without_law=without,
    )


def _left_out_entry(
    quantity: Quantity, plan: Mapping[float, int], found: Floats
) -> tuple[LeftOutEntry, float]:
    """Errors of a plan, (N, 3), and what they say beyond their standard errors."""
    errors, expected, plain = found.T
    entry = LeftOutEntry(
        quantity=quantity.name,
        runs={f"{level:g}": count for level, count in plan.items()},
        scenes=len(found),
        mean=math.expm1(errors.mean()),
        root_mean_square=math.sqrt(float(np.mean(np.expm1(errors) ** 2))),
        largest=float(np.abs(np.expm1(errors)).max()),
        inside=int((np.abs(errors) <= 1.96 * expected).sum()),
        raw_root_mean_square=math.sqrt(float(np.mean(np.expm1(plain) ** 2))),
    )
    return entry, math.sqrt(max(0.0, float(np.mean(errors**2 - expected**2))))


def _scene_entry(everyone: Sequence[Measures]) -> SceneEntry:
    complete = [run for run in everyone if run.complete]
    scales = sorted({run.fidelity.youngs_modulus_scale for run in complete})
    return SceneEntry(
        numbers=everyone[0].numbers,
        runs={
            f"{scale:g}": sum(run.fidelity.youngs_modulus_scale == scale for run in complete)
            for scale in scales
        },
        failed=len(everyone) - len(complete),
    )


_PLANS = ({1e-3: 1}, {1e-2: 1}, {1e-3: 1, 1e-2: 1})
"""Ways to extrapolate that are tried in scenes left out."""


def stiffness_command(out_file: Path, measures: Sequence[Path]) -> str:
    """Write ``stiffness.json``; a line per quantity and plan."""
    record = stiffness_record([Measures.read(file) for file in measures], _PLANS)
    record.write(out_file)
    return "\n".join(
        f"{row.quantity} from {dict(row.runs)}: rms error {100 * row.root_mean_square:.1f} %, "
        f"{row.inside} of {row.scenes} inside, uncorrected {100 * row.raw_root_mean_square:.1f} %"
        for row in record.left_out
    )
