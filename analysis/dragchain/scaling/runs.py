"""The runs of a scaling, from their tables."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dragchain.drag.force import FORCES, read_counted, summarise_forces
from dragchain.errors import TableError
from dragchain.run.case import Case, load_case
from dragchain.run.kinematics import motion_of, needed
from dragchain.scaling.document import ScaledRun
from dragdeck.study.paths.circle import CirclePath

_UNLIKE = frozenset({"seed"})
"""Inputs that runs of one scaling may differ in, beside its field."""


@dataclass(frozen=True)
class Run:
    """One run of a scaling: its row in ``scaling.json``, and its case."""

    row: ScaledRun
    case: Case

    @property
    def gap_particles(self) -> float | None:
        """Gap between workpiece and bowl wall in mean particle diameters; None off a circle."""
        path = motion_of(self.case).motion.path
        if not isinstance(path, CirclePath):
            return None
        bowl, workpiece = needed(self.case.bowl, "bowl"), needed(self.case.workpiece, "workpiece")
        gap = bowl.radius_m - path.radius_m - workpiece.radius_m
        return gap / (2.0 * self.case.media.radius_mean_m)

    @property
    def floor_particles(self) -> float:
        """Gap between tip and floor in mean particle diameters."""
        depth = needed(self.case.workpiece, "workpiece").immersion_depth_m
        gap = needed(self.case.surface_m, "surface_m") - depth
        return gap / (2.0 * self.case.media.radius_mean_m)


def read_runs(run_dirs: Sequence[Path], field: str) -> list[Run]:
    """Read the runs of a scaling from their tables, ordered by level and bed.

    Raises
    ------
    TableError
        If a run has no such field or no number there, the mean drag does not
        point against the motion, or runs differ in more than the field and the seed.
    """
    runs = [_read_run(folder, field) for folder in run_dirs]
    _check_alike([run.case for run in runs], field)
    return sorted(runs, key=lambda run: (run.row.level, run.row.bed))


def _read_run(folder: Path, field: str) -> Run:
    case = load_case(folder)
    level = case.inputs.get(field)
    if isinstance(level, bool) or not isinstance(level, int | float) or level <= 0:
        raise TableError(f"{folder}: field {field} is {level!r}, a power law needs numbers above 0")
    drag = summarise_forces(read_counted(folder, FORCES))["drag_n"]
    if drag.mean >= 0.0:
        raise TableError(f"{folder}: the mean drag is {drag.mean:+.3g} N, along the motion")
    workpiece = needed(case.workpiece, "workpiece")
    weight = case.media.density_kg_m3 * case.gravity_m_s2 * 2.0 * workpiece.radius_m
    row = ScaledRun(
        run=case.run,
        seed=case.inputs.get("seed"),
        level=float(level),
        drag_n=-drag.mean,
        standard_error_n=drag.se,
        reliable=drag.reliable,
        eta=-drag.mean / (weight * workpiece.immersion_depth_m**2),
        bed=case.upstream.get("filling", case.run),
    )
    return Run(row, case)


def _check_alike(cases: Sequence[Case], field: str) -> None:
    first, *others = cases
    wanted = {**first.inputs, "fidelity": first.fidelity}
    for case in others:
        same = {**case.inputs, "fidelity": case.fidelity}
        for name, value in wanted.items():
            if name not in (field, *_UNLIKE) and same.get(name) != value:
                raise TableError(
                    f"{case.run}: {name} is {same.get(name)!r}, in {first.run} it is {value!r}; "
                    f"the runs of a scaling differ in {field} and seed only"
                )
