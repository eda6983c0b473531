"""Whether the advisor's promise holds on scenes that it was not measured on.

In each scene the runs that were asked for by a tolerance are compared with
runs at full stiffness. A promise is confirmed if the whole interval of the error
lies within the tolerance, contradicted if it lies outside, and not confirmed otherwise.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.arrays import Floats
from dragchain.documents import Document, Part
from dragchain.errors import TableError
from dragchain.files import write_text
from dragchain.statistics.estimate import Verdict
from dragchain.tradeoff.compare import Error, relative_error
from dragchain.tradeoff.measures import Asked, Measures
from dragchain.tradeoff.quantities import QUANTITIES
from dragchain.tradeoff.runs import Setting, by_scene, values_within
from dragchain.tradeoff.stiffness_document import ExtrapolationErrors, LawEntry, StiffnessRecord
from dragchain.tradeoff.stiffness_errors import errors_in_new_scenes


class Promise(Part):
    """A prediction of the advisor in one scene.

    Attributes
    ----------
    scene : mapping
        Inputs that distinguish the scene from the others of the plan.
    numbers : mapping
        Its dimensionless numbers.
    quantity : str
    tolerance : float
    held_to : float
        Error for which the settings were chosen: less than the tolerance outside the measured
        range.
    youngs_modulus_scale, timestep_fraction, speed_factor : float
        Settings that the advisor selected.
    runs, failed, reference_runs : int
    error : Error
    verdict : str
    met : bool
        Whether no run failed and the 95 % CI of the error is within `held_to`.
    """

    scene: Mapping[str, str]
    numbers: Mapping[str, float]
    quantity: str
    tolerance: float
    held_to: float
    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float
    runs: int
    failed: int
    reference_runs: int
    error: Error
    verdict: Verdict
    met: bool

    @property
    def setting(self) -> Setting:
        """Settings that the advisor selected."""
        return Setting.of(self)

    @property
    def place(self) -> str:
        """The scene as text."""
        return ", ".join(f"{name} {value}" for name, value in self.scene.items()) or "other beds"


class FailedRun(Part):
    """A run that failed: scene, settings and the first acceptance check that did not pass."""

    scene: Mapping[str, str]
    asked: bool
    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float
    check: str
    seen: str


class PromisesFile(Document):
    """The content of ``promises.json``."""

    made_by = "snakemake tradeoff --config plan=promises"

    promises: tuple[Promise, ...]
    failed: tuple[FailedRun, ...] = ()
    extrapolations: tuple[ExtrapolationErrors, ...] = ()


def verdict(error: Error, tolerance: float) -> Verdict:
    """Whether an error with its interval keeps a tolerance."""
    if -tolerance <= error.ci95_low and error.ci95_high <= tolerance:
        return "confirmed"
    if error.ci95_low > tolerance or error.ci95_high < -tolerance:
        return "contradicted"
    return "not confirmed"


@dataclass(frozen=True)
class _Pair:
    """The runs of one promise, and those at full stiffness in the same scene."""

    scene: Mapping[str, str]
    asked: Asked
    own: Sequence[Measures]
    references: Sequence[Measures]
    failed: int

    law: LawEntry | None

    def logarithms(self) -> tuple[Floats, Floats]:
        """Of the quantity in the promised runs, extrapolated if asked, and at full stiffness."""
        arc = min(run.arc_m for run in (*self.own, *self.references))
        values, references = (
            [abs(values_within(run, arc)[self.asked.quantity]) for run in runs]
            for runs in (self.own, self.references)
        )
        if self.law is None:
            return np.log(values), np.log(references)
        diameters = arc / self.own[0].particle_diameter_m
        own = [
            self.law.at_physical_modulus(
                value, run.numbers, run.fidelity.youngs_modulus_scale, diameters
            ).logarithm
            for run, value in zip(self.own, values, strict=True)
        ]
        return np.array(own), np.log(references)


def check_promises(
    runs: Sequence[Measures], laws: Mapping[str, LawEntry] | None = None
) -> list[Promise]:
    """Compare every promise among the runs of a plan with the full stiffness of its scene.

    A scene whose runs at full stiffness all failed has nothing to compare with;
    `failures` lists them. The scatter of runs is taken to be the same, relatively,
    in all scenes and settings: for each quantity it is pooled over them, because few
    runs are made of each.

    Parameters
    ----------
    runs : sequence of Measures
        Of the reference, which asks nothing, and of runs that ask for a tolerance.
    laws : mapping of str to LawEntry, optional
        Law of each quantity that runs extrapolate.

    Raises
    ------
    TableError
        If a scene was not run at full stiffness, a quantity may change its sign,
        or there are too few runs for an interval.
    """
    pairs = list(_pairs(runs, laws or {}))
    scatters = {
        name: _pooled([pair for pair in pairs if pair.asked.quantity == name])
        for name in {pair.asked.quantity for pair in pairs}
    }
    return [_promise_of(pair, *scatters[pair.asked.quantity]) for pair in pairs]


def _pooled(pairs: Sequence[_Pair]) -> tuple[float, int]:
    """Standard deviation of the logarithm in one run, and its degrees of freedom."""
    groups = [group for pair in pairs for group in pair.logarithms()]
    degrees = sum(len(group) - 1 for group in groups)
    if degrees < 1:
        raise TableError(
            "the scatter cannot be estimated from one run of each setting: run more seeds"
        )
    return math.sqrt(sum(float(((g - g.mean()) ** 2).sum()) for g in groups) / degrees), degrees


def _pairs(runs: Sequence[Measures], laws: Mapping[str, LawEntry]) -> Iterator[_Pair]:
    signed = {quantity.name for quantity in QUANTITIES if quantity.signed}
    for scene, everyone in by_scene(runs):
        if all(run.asked for run in everyone):
            raise TableError(
                f"scene {scene}: no run with the physical Young's modulus to compare with"
            )
        references = [run for run in everyone if _is_reference(run)]
        for asked in _asked(everyone) if references else ():
            own = [run for run in everyone if run.asked and run.asked.same(asked)]
            complete = [run for run in own if run.complete]
            if asked.quantity in signed:
                raise TableError(
                    f"{asked.quantity} may change its sign, so nothing is predicted for it"
                )
            law = laws[asked.quantity] if asked.extrapolated else None
            yield _Pair(scene, asked, complete, references, len(own) - len(complete), law)


def _is_reference(run: Measures) -> bool:
    """Whether it is a complete run at full stiffness."""
    return run.complete and not run.asked and run.fidelity.youngs_modulus_scale == 1.0


def _asked(runs: Iterable[Measures]) -> list[Asked]:
    """What the complete ones of some runs ask for, each once."""
    found: list[Asked] = []
    for run in runs:
        if run.complete and run.asked and not any(map(run.asked.same, found)):
            found.append(run.asked)
    return found


def failures(runs: Sequence[Measures]) -> list[FailedRun]:
    """The runs that failed."""
    return [
        FailedRun(
            scene=scene,
            asked=run.asked is not None,
            **Setting.of(run.fidelity).parameters(),
            check=run.failure[0].name,
            seen=run.failure[0].seen,
        )
        for scene, everyone in by_scene(runs)
        for run in everyone
        if not run.complete
    ]


def _promise_of(pair: _Pair, scatter: float, degrees: int) -> Promise:
    own, references = pair.logarithms()
    difference = float(own.mean() - references.mean())
    uncertainty = scatter * math.sqrt(1 / len(own) + 1 / len(references))
    error = relative_error(difference, uncertainty, degrees)
    tolerance = pair.asked.tolerance
    held_to = tolerance if pair.asked.held_to is None else pair.asked.held_to
    return Promise(
        scene=pair.scene,
        numbers=pair.own[0].numbers,
        quantity=pair.asked.quantity,
        tolerance=tolerance,
        held_to=held_to,
        **Setting.of(pair.own[0].fidelity).parameters(),
        runs=len(own),
        failed=pair.failed,
        reference_runs=len(references),
        error=error,
        verdict=verdict(error, tolerance),
        met=not pair.failed and verdict(error, held_to) == "confirmed",
    )


def write_promises(out_dir: Path, files: Sequence[Path], record: Path) -> list[Promise]:
    """Write ``promises.json`` and ``promises.csv`` and return what they hold."""
    runs = [Measures.read(file) for file in files]
    laws = StiffnessRecord.read(record).laws
    promises = check_promises(runs, laws)
    document = PromisesFile(
        promises=tuple(promises),
        failed=tuple(failures(runs)),
        extrapolations=tuple(errors_in_new_scenes(runs, laws)),
    )
    document.write(out_dir / "promises.json")
    table = pd.DataFrame([_columns(promise) for promise in promises])
    write_text(out_dir / "promises.csv", table.to_csv(index=False))
    return promises


def _columns(promise: Promise) -> dict[str, object]:
    """A promise as a row of ``promises.csv``."""
    row = promise.model_dump(exclude={"numbers", "error", "verdict", "met"})
    return {**row, **promise.error.columns(), "verdict": promise.verdict, "met": promise.met}


def promises_command(out_dir: Path, measures: Sequence[Path], record: Path) -> str:
    """Check promises as the command line asks for; a line per promise."""
    lines = []
    for promise in write_promises(out_dir, measures, record):
        error = promise.error
        lines.append(
            f"{promise.place}: {promise.quantity} within {promise.tolerance:g} by"
            f" {promise.setting}: {error.value:+.3f} ({error.ci95_low:+.3f} to"
            f" {error.ci95_high:+.3f}), {promise.verdict}"
        )
    return "\n".join(lines)
