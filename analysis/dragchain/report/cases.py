"""The runs that a report is of, read once, and its cases.

Process runs that differ in the packing (seed) alone are one case.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Generic, TypeVar

import numpy as np

from dragchain.loading.document import LOADING_FILE, Loading
from dragchain.loading.wear import WEAR_FILE, Wear
from dragchain.quantities.document import EXTRAPOLATED, MEASURED_FILE, Extrapolated, RunQuantities
from dragchain.report.findings import (
    FINDINGS_FILE,
    DropFindings,
    FillingFindings,
    Findings,
    ProcessFindings,
)
from dragchain.report.page import TIMES, fixed, number, with_interval
from dragchain.report.values import Values, values_of, values_over_packings
from dragchain.run.case import changed_inputs, study_of, upstream_folders, with_changes
from dragchain.run.kinematics import axis_speed, drag_phase, motion_of, needed, path_passed
from dragchain.statistics.estimate import mean_of
from dragchain.tables.run_folder import Run
from dragdeck.documents import Document
from dragdeck.errors import DocumentError, RejectedRunError
from dragdeck.records.bed import ClassOfRun
from dragdeck.records.case import CaseOfRun, load_case
from dragdeck.records.run import RunRecord, read_accepted
from dragdeck.study.media import Grains
from dragdeck.study.workpiece import CylinderShape

# --- what was simulated --------------------------------------------------------------------------


def set_up(
    case: CaseOfRun,
    packings: int,
    filling: FillingFindings | None,
    findings: Sequence[ProcessFindings],
) -> list[tuple[str, str]]:
    """Workpiece, path, speed, media, bowl and settings of a case.

    Parameters
    ----------
    case : CaseOfRun
        A process run.
    packings : int
        Number of packings (seeds) that are averaged.
    filling : FillingFindings or None
        Of its packing.
    findings : sequence of ProcessFindings
        One per packing.

    Returns
    -------
    list of (str, str)
        Name and text of each line.
    """
    return [
        ("Workpiece", "; ".join(_workpiece(case))),
        ("Path and depth", "; ".join(_path(case))),
        ("Speed", "; ".join(_speed(case))),
        ("Media", "; ".join(_media(case))),
        *((f"Class {kind.name}", "; ".join(_class(kind, case, findings))) for kind in case.classes),
        ("Bowl", "; ".join(_bowl(case, filling))),
        ("Settings", "; ".join(_settings(case, packings))),
    ]


def _workpiece(case: CaseOfRun) -> Iterator[str]:
    simulated, workpiece = needed(case.workpiece, "workpiece"), study_of(case).workpiece
    material, shape = workpiece.material, workpiece.shape
    if isinstance(shape, CylinderShape):  # the reach of an inclined one is larger
        radius = simulated.radius_m if simulated.kind == "cylinder" else shape.radius_m
        yield f"{material} cylinder, diameter {_mm(2 * radius)}"
    else:
        yield f"{material} part {shape.file}, up to {_mm(simulated.radius_m)} from its axis"
    if simulated.remeshed:
        yield simulated.remeshed
    if simulated.count > 1:
        yield f"number {simulated.number} of {simulated.count}"


def _path(case: CaseOfRun) -> Iterator[str]:
    yield motion_of(case).motion.path.words(number)
    end_s = np.array([drag_phase(case).end_step * case.timestep_s])
    yield f"{_mm(float(path_passed(end_s, case)[0]))} long"
    yield f"immersed {_mm(needed(case.workpiece, 'workpiece').immersion_depth_m)}"
    if tilt := study_of(case).motion.tilt_deg:
        yield f"inclined by {tilt:g}\N{DEGREE SIGN}"
    yield from (f"with {motion.kind}" for motion in case.superposed)


def _speed(case: CaseOfRun) -> Iterator[str]:
    simulated, factor = axis_speed(case), case.fidelity.speed_factor
    yield f"{number(1e3 * simulated / factor)} mm/s"
    if factor != 1.0:
        yield f"simulated at {number(1e3 * simulated)} mm/s"


def _media(case: CaseOfRun) -> Iterator[str]:
    media, grains = case.media, study_of(case).media.main
    if case.classes:
        what = "particles" if case.bodies else "spheres"
        yield f"{number(media.count)} {what} in {len(case.classes)} classes"
        return
    what, diameter = _shape(grains)
    yield f"{number(media.count)} {grains.material} {what}"
    spread = (
        f" \N{PLUS-MINUS SIGN} {_mm(2 * media.radius_std_m)} (standard deviation)"
        if media.radius_std_m
        else ""
    )
    yield f"{diameter} {_mm(2 * media.radius_mean_m)}{spread}"


def _shape(grains: Grains) -> tuple[str, str]:
    """What particles are, and what their diameter is."""
    if grains.shape is None:
        return "spheres", "diameter"
    return f"particles ({grains.shape.kind.replace('_', ' ')})", "diameter of equal volume"


def _class(kind: ClassOfRun, case: CaseOfRun, findings: Sequence[ProcessFindings]) -> Iterator[str]:
    """Asked and obtained amounts of a class, how it moves in the bed and loads the workpiece."""
    amounts: Mapping[str, Mapping[str, float]] = {
        "number": {part.name: part.count for part in case.classes},
        "volume": {part.name: part.volume_m3 for part in case.classes},
        "mass": {part.name: part.density_kg_m3 * part.volume_m3 for part in case.classes},
    }
    media = study_of(case).media
    of, requested = media.fractions_of, media.classes[kind.name]
    what, diameter = _shape(requested)
    yield f"{number(kind.count)} {kind.material} {what}"
    mean, spread = _mm(2 * kind.radius_mean_m), _mm(2 * kind.radius_std_m)
    yield f"{diameter} {mean} \N{PLUS-MINUS SIGN} {spread} (standard deviation)"
    got = amounts[of][kind.name] / sum(amounts[of].values())
    yield f"{number(100 * got)} % of the {of} (asked: {number(100 * requested.fraction)} %)"
    shift = np.array([run.segregation[kind.name] for run in findings if run.segregation])
    if len(shift):
        start, end = (fixed(value, 3, sign=True) for value in shift.mean(axis=0))
        change = np.diff(shift, axis=1)[:, 0]
        scatter = f" (standard deviation of the change {change.std(ddof=1):.3f})"
        packings = scatter if len(shift) > 1 else ""
        yield f"segregation {start} at the start of the drag, {end} at its end{packings}"
    if loads := [run.by_class[kind.name] for run in findings if run.by_class]:
        contacts, force, part = (
            values[0] if len(values) == 1 else mean_of([value.value for value in values])
            for values in zip(*loads, strict=True)
        )
        part = part.within_one if len(loads) > 1 else part
        yield (
            f"{with_interval(contacts)} contacts on the workpiece at a time of "
            f"{with_interval(force, 'N')} each: {with_interval(part.over(0.01), '%')} of the load"
        )


def _bowl(case: CaseOfRun, filling: FillingFindings | None) -> Iterator[str]:
    study = study_of(case)
    yield f"{study.bowl.material} {study.bowl.words(_mm)}"
    if study.motion.bowl is not None:
        yield f"{study.motion.bowl.kind}: {study.motion.bowl.words()}"
    if filling is not None and "bed_height_m" in filling.bed:
        fraction = filling.bed.get("solid_fraction")
        solid = f", solid fraction {number(fraction)}" if fraction is not None else ""
        yield f"filled to {_mm(float(filling.bed['bed_height_m']))}{solid}"
    if study.compound:
        yield f"compound of {study.compound.density_kg_m3} kg/m³ (buoyancy only)"


def _settings(case: CaseOfRun, packings: int) -> Iterator[str]:
    fidelity = case.fidelity
    yield (
        f"{fidelity.name}: Young's modulus {TIMES} {number(fidelity.youngs_modulus_scale)}, "
        f"time step {number(100 * fidelity.timestep_fraction)} % of the Rayleigh time, "
        f"speed {TIMES} {number(fidelity.speed_factor)}"
    )
    yield f"{packings} packings (seeds)" if packings > 1 else "one packing (seed)"


def _mm(length_m: float) -> str:
    return f"{number(1e3 * length_m)} mm"


# --- runs ----------------------------------------------------------------------------------------


D = TypeVar("D", bound=Document)
F = TypeVar("F", bound=Findings, covariant=True)


@dataclass(frozen=True)
class ReportedRun(Run, Generic[F]):
    """A run that counts, with its findings and ``run.json``."""

    findings: F
    record: RunRecord


def case_title(case: CaseOfRun, packings: int) -> str:
    """A case by its stiffness, the values that a sweep gives it and its packings."""
    name, fidelity = case.case or case.run, case.fidelity
    if not name.startswith(fidelity.name):
        return name
    swept = dict(re.findall(r"_([a-z_]+?)-([^_]+)", name.removeprefix(fidelity.name)))
    seed = swept.pop(_SEED, "")
    stiffness = "physical stiffness" if fidelity.youngs_modulus_scale == 1.0 else "soft"
    settings = [
        f"E {TIMES} {fidelity.youngs_modulus_scale:g}",
        f"step {fidelity.timestep_fraction:g}",
    ]
    settings += [f"speed {TIMES} {fidelity.speed_factor:g}"] if fidelity.speed_factor != 1.0 else []
    how = ", ".join(settings) if fidelity.name.startswith("E") else fidelity.name.replace("-", " ")
    packing = f"packing {seed}" if seed else "one packing"
    values = [f"{field.replace('_', ' ')} {value}" for field, value in swept.items()]
    return ", ".join(
        [f"{stiffness} ({how})", *values, packing if packings == 1 else f"{packings} packings"]
    )


@dataclass(frozen=True)
class StudyRuns:
    """A process run with the filling and the drop test it belongs to, None where it names none.

    `measured`: its quantities; `loading`: fractions and types of the contacts on the workpiece;
    `extrapolated`: its quantities at the physical Young's modulus; `wear`: what laws of removal
    read. Each of the last three is None where it was not computed.
    """

    process: ReportedRun[ProcessFindings]
    filling: ReportedRun[FillingFindings] | None
    drop_test: ReportedRun[DropFindings] | None
    measured: RunQuantities
    loading: Loading | None = None
    extrapolated: Extrapolated | None = None
    wear: Wear | None = None

    @property
    def name(self) -> str:
        """Name of the case."""
        return self.process.case.case or self.process.case.run

    @property
    def title(self) -> str:
        """The case in words."""
        return case_title(self.process.case, 1)

    @cached_property
    def values(self) -> Values:
        """The quantities of the process run, each with what it says of the process."""
        return values_of(self.process.case, self.measured.values_of_run, self.extrapolated)

    @property
    def runs(self) -> list[ReportedRun[Findings]]:
        """The runs that there are, the process first."""
        runs: list[ReportedRun[Findings] | None] = [self.process, self.filling, self.drop_test]
        return [run for run in runs if run is not None]


def read_study_runs(run_dir: Path) -> StudyRuns:
    """Read a process run with its filling and drop test.

    A drop test without a result is left out: the process does not start from it.

    Raises
    ------
    RejectedRunError
        If the process or its filling is not complete, or did not pass an acceptance check.
    DocumentError
        If a document of one of them is missing or cannot be used.
    """
    process = read_reported(run_dir, ProcessFindings)
    process = replace(process, case=with_changes(run_dir, process.case))
    upstream = upstream_folders(run_dir, process.case)
    filling = drop_test = None
    if "filling" in upstream:
        filling = read_reported(upstream["filling"], FillingFindings)
    with suppress(RejectedRunError, DocumentError):
        if "drop_test" in upstream:
            drop_test = read_reported(upstream["drop_test"], DropFindings)
    return StudyRuns(
        process,
        filling,
        drop_test,
        RunQuantities.read(run_dir / MEASURED_FILE),
        read_if_there(Loading, run_dir / LOADING_FILE),
        read_if_there(Extrapolated, run_dir / EXTRAPOLATED),
        read_if_there(Wear, run_dir / WEAR_FILE),
    )


def read_if_there(document: type[D], file: Path) -> D | None:
    """Read a document, None if there is none; `DocumentError` if it cannot be used."""
    return document.read(file) if file.is_file() else None


def read_reported(run_dir: Path, findings: type[F]) -> ReportedRun[F]:
    """Read a run with findings of this type; errors are those of `read_study_runs`."""
    record = read_accepted(run_dir)
    return ReportedRun(run_dir, load_case(run_dir), findings.read(run_dir / FINDINGS_FILE), record)


# --- cases ---------------------------------------------------------------------------------------


_SEED = "seed"
_IN_NAME = re.compile(rf"_?{_SEED}-[0-9]+")


@dataclass(frozen=True)
class ReportedCase:
    """A case: one process run, or several that differ in their seeds alone."""

    studies: tuple[StudyRuns, ...]

    @property
    def first(self) -> StudyRuns:
        """The first of its packings."""
        return self.studies[0]

    @property
    def key(self) -> str:
        """Name of its place on the page."""
        return self.first.process.case.run

    @property
    def name(self) -> str:
        """Name of the case, without the seed if it is a mean over packings."""
        name = self.first.name
        return _IN_NAME.sub("", name).lstrip("_") if len(self.studies) > 1 else name

    @property
    def title(self) -> str:
        """The case in words."""
        return case_title(self.first.process.case, len(self.studies))

    @cached_property
    def values(self) -> Values:
        """Its quantities, means over the packings."""
        return values_over_packings([study.values for study in self.studies])

    @cached_property
    def set_up(self) -> list[tuple[str, str]]:
        """What was simulated, in six lines."""
        filling = self.first.filling
        bed = filling.findings if filling else None
        findings = [study.process.findings for study in self.studies]
        return set_up(self.first.process.case, len(self.studies), bed, findings)


def cases_of(studies: Iterable[StudyRuns]) -> list[ReportedCase]:
    """Group process runs by all inputs but the seed, in the order of the first ones.

    A run that is given again, perhaps as a copy elsewhere, is the same packing: it counts once.
    One that another input script made is not the same.
    """
    groups: list[list[StudyRuns]] = []
    known: set[tuple[str, str, str]] = set()
    for study in studies:
        case = study.process.case
        identity = case.study_name, case.run, study.process.record.inputs
        if identity in known:
            continue
        known.add(identity)
        for group in groups:
            if _same_but_seed(group[0], study):
                group.append(study)
                break
        else:
            groups.append([study])
    return [ReportedCase(tuple(group)) for group in groups]


def _same_but_seed(first: StudyRuns, other: StudyRuns) -> bool:
    a, b = first.process.case, other.process.case
    numbers = [case.workpiece.number if case.workpiece else 0 for case in (a, b)]
    settings = [{**dict(case.fidelity), "ranks": 0} for case in (a, b)]  # the computer decides them
    changed = changed_inputs(first.process.study.inputs(), other.process.study.inputs())
    return changed.keys() == {_SEED} and settings[0] == settings[1] and numbers[0] == numbers[1]
