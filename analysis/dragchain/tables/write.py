"""Parquet tables of one run, made from its raw outputs."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from dragchain.dumps.frame import Columns
from dragchain.errors import RejectedRunError, TableError
from dragchain.files import write_json
from dragchain.run.case import Case
from dragchain.run.kinematics import (
    counted_mask,
    directions,
    needed,
    phase_codes,
    workpiece_frame,
    workpiece_velocity,
    wrap_angle,
)
from dragchain.tables.bed import describe_bed
from dragchain.tables.closure import LIMIT, SHARED_LIMIT, Closure
from dragchain.tables.columns import (
    CONTACTS,
    FORCES,
    KINEMATICS,
    POINT,
    SLIP,
    WORKPIECE_CONTACTS,
    WORKPIECE_FORCE,
)
from dragchain.tables.impacts import IMPACTS, find_impacts
from dragchain.tables.network_contacts import KINDS, ContactRows, contact_rows
from dragchain.tables.parquet import TableWriter, category
from dragchain.tables.run_folder import Run
from dragchain.tables.workpiece_contacts import (
    WallContacts,
    WorkpieceFrame,
    iter_workpiece_frames,
    iter_workpiece_pairs,
)


def write_tables(run_dir: Path | str) -> list[Path]:
    """Make the tables of a run.

    Every table appears under its name only once it is whole. An output that
    ``columns.json`` does not list was not written, and the tables that need it
    are not made.

    Parameters
    ----------
    run_dir : Path or str
        The run folder.

    Returns
    -------
    list of Path
        The files made, in ``tables/``.

    Raises
    ------
    DocumentError, DumpError
        If an input cannot be read.
    TableError
        If the outputs contradict each other.
    """
    run = Run.open(run_dir)
    return [
        run.table(name)
        for name, (needs, write) in _SCENES[run.case.scene].items()
        if run.wrote(*needs) and write(run, run.table(name)) is None
    ]


def _write_thermo(run: Run, file: Path) -> None:
    with TableWriter(file, run.outputs["thermo"].columns) as table:
        for rows in run.prints("thermo"):
            table.write(rows)


def _write_workpiece_force(run: Run, file: Path) -> None:
    with TableWriter(file, WORKPIECE_FORCE) as table:
        for rows in run.prints("workpiece_force"):
            table.write(workpiece_force_rows(rows, run.case))


def workpiece_force_rows(rows: Mapping[str, NDArray[np.generic]], case: Case) -> dict[str, object]:
    """Add phase, workpiece frame and ``counted`` to raw samples of the force on the workpiece."""
    steps = np.asarray(rows["step"], dtype=np.int64)
    heading = directions(steps, np.column_stack([rows["ref_x_m"], rows["ref_y_m"]]), case)
    force = np.column_stack([rows[name] for name in FORCES])
    drag, lateral, vertical = workpiece_frame(force, heading).T
    return {
        **rows,
        "phase": category(phase_codes(steps, case.phases), _phase_names(case)),
        "direction_rad": heading,
        "drag_n": drag,
        "lateral_n": lateral,
        "vertical_n": vertical,
        "in_statistics": counted_mask(steps, case),
    }


def _phase_names(case: Case) -> tuple[str, ...]:
    return tuple(phase.name for phase in case.phases)


class WorkpieceSamples:
    """The force on the workpiece and its place at rising steps.

    Parameters
    ----------
    blocks : iterable of columns
        The blocks of ``workpiece_force``; only one is held at a time.
    """

    def __init__(self, blocks: Iterable[Columns]) -> None:
        self._blocks = iter(blocks)
        self._block = next(self._blocks, None)
        if self._block is None:
            raise TableError("workpiece_force holds no samples")
        self.first_step = int(self._block["step"][0])

    def row(self, step: int) -> dict[str, float] | None:
        """Sample at a step not below the last one asked for; None if there is none."""
        while self._block is not None and self._block["step"][-1] < step:
            self._block = next(self._blocks, None)
        if self._block is None:
            return None
        at = int(np.searchsorted(self._block["step"], step))
        if self._block["step"][at] != step:
            return None
        return {name: float(values[at]) for name, values in self._block.items()}

    def reference(self, step: int) -> NDArray[np.float64]:
        """Horizontal place of the workpiece's reference point, shape (2,), m.

        Before the first sample it is that of the first sample.
        """
        sample = self.row(max(step, self.first_step))
        if sample is None:
            raise TableError(
                f"workpiece_particles has step {step} but workpiece_force does not: the "
                f"period of workpiece_force"
                " must divide that of workpiece_particles"
            )
        return np.array([sample["ref_x_m"], sample["ref_y_m"]])


def _write_workpiece_contacts(run: Run, file: Path) -> None:
    shared = "mesh_id" in run.outputs["workpiece_contacts"].columns
    closure = Closure(limit=SHARED_LIMIT if shared else LIMIT)
    samples = WorkpieceSamples(run.prints("workpiece_force"))
    with TableWriter(file, WORKPIECE_CONTACTS) as table:
        for frame in iter_workpiece_frames(run.folder, run.outputs):
            reference = samples.reference(frame.step)
            applied = _close(closure, frame, samples, run.case)
            rows = workpiece_contact_rows(frame.step, frame.workpiece, reference, run.case)
            table.write(
                rows if applied else {**rows, "in_statistics": np.full(len(frame.workpiece), False)}
            )
        write_json(run.table("closure.json"), closure.content())
        if (problem := closure.problem()) is not None:
            raise RejectedRunError(
                f"{run.folder}: the force closure acceptance check does not hold: {problem};"
                " workpiece_contacts.parquet was not written, closure.json holds the figures"
            )


def _close(closure: Closure, frame: WorkpieceFrame, samples: WorkpieceSamples, case: Case) -> bool:
    sample = samples.row(frame.step) if frame.step >= samples.first_step else None
    force = None if sample is None else np.array([sample[name] for name in FORCES])
    counted = bool(counted_mask(np.array([frame.step]), case)[0])
    return closure.add(frame, force, counted=counted)


def workpiece_contact_rows(
    step: int, contacts: WallContacts, ref_xy_m: NDArray[np.float64], case: Case
) -> dict[str, object]:
    """Rows of ``workpiece_contacts.parquet`` for one step.

    Parameters
    ----------
    step : int
        The step.
    contacts : WallContacts
        N contacts on the workpiece.
    ref_xy_m : (2,) ndarray
        Horizontal place of the workpiece's reference point, m.
    case : Case
        The case, of a process.

    Returns
    -------
    dict of str to (N,) array
        The columns; forces are on the workpiece, velocities those of the particle's
        surface against the workpiece's.
    """
    steps = np.full(len(contacts), step)
    references = np.tile(ref_xy_m, (len(steps), 1))
    heading = directions(steps, references, case)
    relative = contacts.surface_m_s - workpiece_velocity(steps, contacts.point_m, references, case)
    apart = np.einsum("ij,ij->i", relative, contacts.normal)
    x, y = (contacts.point_m[:, :2] - ref_xy_m).T
    return {
        "step": steps,
        "time_s": steps * case.timestep_s,
        "phase": category(phase_codes(steps, case.phases), _phase_names(case)),
        "particle_id": contacts.particle_id,
        "facet_id": contacts.facet_id,
        **_named(POINT, contacts.point_m),
        **_named(FORCES, 0.0 - contacts.force_n),
        "normal_force_n": contacts.normal_force_n(),
        "tangential_force_n": contacts.tangential_force_n(),
        "overlap_m": contacts.overlap_m,
        **_named(SLIP, relative - apart[:, None] * contacts.normal),
        "normal_velocity_m_s": -apart,
        "azimuth_rad": wrap_angle(np.arctan2(y, x) - heading),
        "depth_m": needed(case.surface_m, "surface_m") - contacts.point_m[:, 2],
        "in_statistics": counted_mask(steps, case),
    }


def _named(names: tuple[str, ...], vectors: NDArray[np.float64]) -> dict[str, object]:
    return dict(zip(names, vectors.T, strict=True))


def _write_particles(run: Run, file: Path) -> None:
    with TableWriter(file, ("step", "time_s", *KINEMATICS)) as table:
        for frame in run.frames("particles"):
            order = np.argsort(frame.columns["particle_id"])
            steps = np.full(frame.rows, frame.step)
            rows = {name: frame.columns[name][order] for name in KINEMATICS}
            table.write({"step": steps, "time_s": steps * run.case.timestep_s, **rows})


def _write_contacts(run: Run, file: Path) -> None:
    bowl_radius = needed(run.case.bowl, "bowl").radius_m
    particles = _Follower("particles", run.frames("particles"))
    workpieces = _Follower("workpiece_contacts", iter_workpiece_pairs(run.folder, run.outputs))
    with TableWriter(file, CONTACTS) as table:
        for frame in run.frames("contacts"):
            workpiece = workpieces.at(frame.step).join()
            particle_frame = particles.at(frame.step)
            rows = contact_rows(
                particle_frame, frame, workpiece.workpiece, workpiece.bowl, bowl_radius
            )
            table.write(_contact_columns(frame.step, rows, run.case))


class _Stepped(Protocol):
    @property
    def step(self) -> int: ...


F = TypeVar("F", bound=_Stepped)


class _Follower(Generic[F]):
    """Finds the frame of one output that belongs to a step of another."""

    def __init__(self, name: str, frames: Iterator[F]) -> None:
        self.name = name
        self.frames = frames

    def at(self, step: int) -> F:
        """Frame of a step above the last one asked for."""
        for frame in self.frames:
            if frame.step == step:
                return frame
            if frame.step > step:
                break
        raise TableError(
            f"contacts has step {step} but {self.name} does not: the period of {self.name}"
            " must divide that of contacts"
        )


def _contact_columns(step: int, rows: ContactRows, case: Case) -> dict[str, object]:
    steps = np.full(len(rows.kind), step)
    return {
        "step": steps,
        "time_s": steps * case.timestep_s,
        "kind": category(rows.kind, KINDS),
        "a_id": rows.a_id,
        "b_id": rows.b_id,
        **_named(POINT, rows.point_m),
        **_named(FORCES, rows.force_n),
        "normal_force_n": rows.normal_force_n,
        "tangential_force_n": rows.tangential_force_n,
        "overlap_m": rows.overlap_m,
    }


def _write_impacts(run: Run, file: Path) -> None:
    blocks = list(run.prints("impacts"))
    if not blocks:
        raise TableError(f"{run.folder}: impacts holds no samples")
    rows = {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}
    with TableWriter(file, IMPACTS) as table:
        radius, gravity = run.case.media.radius_mean_m, run.case.gravity_m_s2
        table.write(find_impacts(rows, run.case.timestep_s, radius, gravity))


def _write_filling(run: Run, file: Path) -> None:
    last = deque(run.frames("particles"), maxlen=1)
    if not last:
        raise TableError(f"{run.folder}: particles holds no frames")
    describe_bed(last[0], run.case).write(file)


_Writer = Callable[[Run, Path], None]
_Tables = dict[str, tuple[tuple[str, ...], _Writer]]

_THERMO: _Tables = {"thermo.parquet": (("thermo",), _write_thermo)}
_WORKPIECE = ("workpiece_force", "workpiece_particles", "workpiece_contacts")
_SCENES: dict[str, _Tables] = {
    "drop_test": {**_THERMO, "impacts.parquet": (("impacts",), _write_impacts)},
    "filling": {
        **_THERMO,
        "particles.parquet": (("particles",), _write_particles),
        "packing.json": (("particles",), _write_filling),
    },
    "process": {
        **_THERMO,
        "workpiece_force.parquet": (("workpiece_force",), _write_workpiece_force),
        "workpiece_contacts.parquet": (_WORKPIECE, _write_workpiece_contacts),
        "particles.parquet": (("particles",), _write_particles),
        "contacts.parquet": (("contacts", "particles", *_WORKPIECE[1:]), _write_contacts),
    },
}
"""What is made for each scene: the outputs that a table needs, and how it is made."""
