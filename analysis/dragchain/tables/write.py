"""Parquet tables of one run, made from its raw outputs."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from dragchain.arrays import Floats, Ints
from dragchain.errors import TableError
from dragchain.run.case import attracting, friction_with
from dragchain.run.kinematics import (
    counted_mask,
    headings,
    needed,
    phase_codes,
    spins,
    workpiece_frame,
    workpiece_rotation,
    workpiece_velocity,
)
from dragchain.tables.bed import describe_bed
from dragchain.tables.bodies import Bodies
from dragchain.tables.closure import LIMIT, SHARED_LIMIT, Closure
from dragchain.tables.columns import (
    ATTRACTION,
    BODY,
    CLASSES,
    CONTACTS,
    FORCES,
    IMPACTS,
    KINEMATICS,
    ORIENTATION,
    POINT,
    REFERENCE,
    SLIP,
    WORKPIECE_CONTACTS,
    WORKPIECE_FORCE,
)
from dragchain.tables.impacts import find_impacts
from dragchain.tables.network_contacts import KINDS, ContactRows, contact_rows
from dragchain.tables.parquet import Rows, category, table_writer
from dragchain.tables.run_folder import ON_WORKPIECE, Run
from dragchain.tables.workpiece_contacts import WallContacts, WorkpieceFrames
from dragdeck.decks.outputs import TOUCHES
from dragdeck.dumps.frame import Columns
from dragdeck.errors import RejectedRunError
from dragdeck.records.case import CaseOfRun
from dragdeck.study.rotations import wrap_angle


@dataclass(frozen=True)
class RunTable:
    """A file in ``tables/``: its name, the raw outputs that it needs, and what writes it."""

    name: str
    needs: tuple[str, ...]
    write: Callable[[Run, Path], None]


def write_tables(run_dir: Path | str) -> list[Path]:
    """Make the tables of a run.

    A table gets its final name only when it is complete. Tables whose outputs are not listed in
    ``columns.json`` are not made.

    Parameters
    ----------
    run_dir : Path or str
        The run folder.

    Returns
    -------
    list of Path
        The files in ``tables/``.

    Raises
    ------
    DocumentError, DumpError
        If an input cannot be read.
    TableError
        If the outputs are inconsistent with each other.
    """
    run = Run.open(run_dir)
    tables = [table for table in _TABLES[run.case.scene] if run.wrote(*table.needs)]
    for table in tables:
        table.write(run, run.file(table.name))
    return [run.file(table.name) for table in tables]


def _write_all(file: Path, columns: Sequence[str], parts: Iterable[Rows]) -> None:
    with table_writer(file, columns) as table:
        for part in parts:
            table.write(part)


# --- the force on the workpiece --------------------------------------------------------------


def _write_workpiece_force(run: Run, file: Path) -> None:
    rows = (workpiece_force_rows(rows, run.case) for rows in run.prints("workpiece_force"))
    _write_all(file, WORKPIECE_FORCE + (BODY if spins(run.case) else ()), rows)


def workpiece_force_rows(rows: Columns, case: CaseOfRun) -> Rows:
    """Add phase, path frame, body frame and ``in_statistics`` to raw samples of the force."""
    steps = np.asarray(rows["step"], dtype=np.int64)
    heading = headings(steps, np.column_stack([rows["ref_x_m"], rows["ref_y_m"]]), case)
    force = np.column_stack([rows[name] for name in FORCES]).astype(np.float64)
    drag, lateral, vertical = workpiece_frame(force, heading).T
    body: Rows = {}
    if spins(case):
        rotation = workpiece_rotation(steps, heading, case)
        body = dict(zip(BODY, (rotation.front_rad, *rotation.into(force).T), strict=True))
    return {
        **rows,
        "phase": _phases(steps, case),
        "direction_rad": heading,
        "drag_n": drag,
        "lateral_n": lateral,
        "vertical_n": vertical,
        "in_statistics": counted_mask(steps, case),
        **body,
    }


def _phases(steps: Ints, case: CaseOfRun) -> pa.Array:
    return category(phase_codes(steps, case.phases), tuple(phase.name for phase in case.phases))


class WorkpieceSamples:
    """The force on the workpiece and its place at some steps.

    Parameters
    ----------
    blocks : iterable of columns
        The blocks of ``workpiece_force``.
    """

    def __init__(self, blocks: Iterable[Columns]) -> None:
        names = ("step", *FORCES, *REFERENCE)
        parts = [np.column_stack([block[name] for name in names]) for block in blocks]
        if not parts:
            raise TableError("workpiece_force contains no samples")
        steps, self._values = np.split(np.concatenate(parts).astype(np.float64), [1], axis=1)
        self._steps = steps[:, 0].astype(np.int64)

    def at(self, steps: Ints) -> tuple[Floats, Floats]:
        """Force and place at N steps, (N, 3) each; before the first sample its place alone.

        The force is NaN there, because nobody wrote it.
        """
        wanted = np.maximum(steps, self._steps[0])
        rows = np.minimum(np.searchsorted(self._steps, wanted), len(self._steps) - 1)
        lost = steps[self._steps[rows] != wanted]
        if lost.size:
            raise TableError(
                f"workpiece_particles has step {lost[0]} but workpiece_force does not: the period "
                "of workpiece_force must divide that of workpiece_particles"
            )
        force, place = np.split(self._values[rows], 2, axis=1)
        return np.where((steps < self._steps[0])[:, None], np.nan, force), place

    def places_between(self, steps: Ints) -> Floats:
        """Places at N steps, (N, 3), on the straight line between the samples around each."""
        columns = (np.interp(steps, self._steps, column) for column in self._values[:, 3:].T)
        return np.stack(list(columns), axis=1)


# --- contacts on the workpiece ---------------------------------------------------------------


def _write_workpiece_contacts(run: Run, file: Path) -> None:
    shared, bodies = run.case.bowl.meshed, Bodies(run.case)
    closure = Closure(limit=SHARED_LIMIT if shared else LIMIT)
    samples = WorkpieceSamples(run.prints("workpiece_force"))
    with ExitStack() as stack:
        files = (file, *([run.file("sphere_contacts.parquet")] if bodies else ()))
        names = _contact_names(run.case)
        tables = [stack.enter_context(table_writer(path, names)) for path in files]
        for frames in run.workpiece_frames():
            force, place = samples.at(frames.step)
            used = closure.add(frames, force)
            for table, (contacts, at) in zip(tables, _contacts(bodies, frames), strict=False):
                rows = workpiece_contact_rows(frames.step[at], contacts, place[at], run.case)
                table.write({**rows, "in_statistics": rows["in_statistics"] & used[at]})
        closure.record().write(run.file("closure.json"))
        if (problem := closure.problem()) is not None:
            raise RejectedRunError(
                f"{run.folder}: the check of force closure failed: {problem};"
                " workpiece_contacts.parquet was not written; closure.json contains the values"
            )


def _write_touches(run: Run, file: Path) -> None:
    samples = WorkpieceSamples(run.prints("workpiece_force"))
    with table_writer(file, _contact_names(run.case)) as table:
        for frames in run.workpiece_frames(TOUCHES):
            *_, (contacts, at) = _contacts(Bodies(run.case), frames)
            steps = frames.step[at]
            place = samples.places_between(steps)
            table.write(workpiece_contact_rows(steps, contacts, place, run.case))


def _contact_names(case: CaseOfRun) -> tuple[str, ...]:
    names = WORKPIECE_CONTACTS + ((ATTRACTION,) if "workpiece" in attracting(case) else ())
    return _with_classes(names, "workpiece_contacts", case)


def _contacts(bodies: Bodies, frames: WorkpieceFrames) -> Iterator[tuple[WallContacts, Ints]]:
    """Contacts of particles with the workpiece and their frames; of clumps also of spheres."""
    contacts, at = frames.workpiece, frames.workpiece_at
    if bodies:
        yield bodies.wall(contacts, at)
        contacts = bodies.of_spheres(contacts)
    yield contacts, at


def workpiece_contact_rows(
    steps: Ints, contacts: WallContacts, references: Floats, case: CaseOfRun
) -> Rows:
    """Rows of ``workpiece_contacts.parquet``.

    Parameters
    ----------
    steps : (N,) ndarray of int64
        The step of each contact.
    contacts : WallContacts
        N contacts on the workpiece.
    references : (N, 3) ndarray
        Place of the workpiece's reference point at each contact's step, m.
    case : CaseOfRun
        The case, of a process.

    Returns
    -------
    mapping of str to (N,) array
        The columns; forces are on the workpiece, velocities those of the particle's
        surface against the workpiece's.
    """
    heading = headings(steps, references[:, :2], case)
    relative = contacts.surface_m_s - workpiece_velocity(steps, contacts.point_m, references, case)
    apart = np.einsum("ij,ij->i", relative, contacts.normal)
    x, y = (contacts.point_m - references)[:, :2].T
    return {
        "step": steps,
        "time_s": steps * case.timestep_s,
        "phase": _phases(steps, case),
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
        ATTRACTION: contacts.attraction_n,
        **_classes("workpiece_contacts", case, contacts.particle_id),
    }


def _named(names: tuple[str, ...], vectors: Floats) -> dict[str, Floats]:
    return dict(zip(names, vectors.T, strict=True))


# --- the contact network ---------------------------------------------------------------------


def _write_particles(run: Run, file: Path) -> None:
    bodies = Bodies(run.case)
    moving = KINEMATICS + (ORIENTATION if bodies else ())
    names = ("step", "time_s", *moving)
    with table_writer(file, _with_classes(names, "particles", run.case)) as table:
        for frame in run.frames("particles"):
            frame = (bodies.frame(frame) if bodies else frame).by_particle()
            steps = np.full(frame.rows, frame.step)
            rows = {name: frame.columns[name] for name in moving}
            classes = _classes("particles", run.case, rows["particle_id"].astype(np.int64))
            time = {"step": steps, "time_s": steps * run.case.timestep_s}
            table.write({**time, **rows, **classes})


def _write_contacts(run: Run, file: Path) -> None:
    particles, pairs = run.frames("particles"), run.workpiece_pairs()
    friction, bodies = friction_with(run.case, "particle"), Bodies(run.case)
    with table_writer(file, _with_classes(CONTACTS, "contacts", run.case)) as table:
        for frame in run.frames("contacts"):
            workpiece = _frame_at(pairs, frame.step, "workpiece_contacts").join()
            beside = _frame_at(particles, frame.step, "particles")
            touching = workpiece.workpiece, workpiece.bowl
            rows = contact_rows(beside, frame, *touching, run.case.bowl.walls, friction)
            rows = bodies.network(rows) if bodies else rows
            table.write(_contact_columns(frame.step, rows, run.case))


def _frame_at(frames: Iterator[Any], step: int, name: str) -> Any:
    """The frame of a step above those asked for before, from frames whose steps rise."""
    frame = next((frame for frame in frames if frame.step >= step), None)
    if frame is None or frame.step > step:
        raise TableError(
            f"contacts has step {step} but {name} does not: the period of {name}"
            " must divide that of contacts"
        )
    return frame


def _contact_columns(step: int, rows: ContactRows, case: CaseOfRun) -> Rows:
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
        **_classes("contacts", case, rows.a_id, rows.b_id),
    }


def _with_classes(names: tuple[str, ...], table: str, case: CaseOfRun) -> tuple[str, ...]:
    return names + (CLASSES[table] if case.classes else ())


def _classes(table: str, case: CaseOfRun, *particle_ids: Ints) -> dict[str, pa.Array]:
    """The columns of a table with the classes of (N,) particles; ids below 1 have none."""
    if not case.classes:
        return {}
    names = (*(class_.name for class_ in case.classes), "none")
    codes = (np.where(ids > 0, case.class_of(ids), len(names) - 1) for ids in particle_ids)
    return {
        column: category(of_column, names)
        for column, of_column in zip(CLASSES[table], codes, strict=True)
    }


# --- drop test and filling -------------------------------------------------------------------


def _write_impacts(run: Run, file: Path) -> None:
    blocks = list(run.prints("impacts"))
    if not blocks:
        raise TableError(f"{run.folder}: impacts contains no samples")
    rows = {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}
    radius, gravity = run.case.media.radius_mean_m, run.case.gravity_m_s2
    _write_all(file, IMPACTS, [find_impacts(rows, run.case.timestep_s, radius, gravity)])


def _write_packing(run: Run, file: Path) -> None:
    last = deque(run.frames("particles"), maxlen=1)
    if not last:
        raise TableError(f"{run.folder}: particles contains no frames")
    bodies, spheres = Bodies(run.case), last[0]
    of_bodies = bodies.frame(spheres) if bodies else spheres
    describe_bed(of_bodies, run.case, spheres).write(file)


_THERMO = RunTable(
    "thermo.parquet",
    ("thermo",),
    lambda run, file: _write_all(file, run.outputs["thermo"].columns, run.prints("thermo")),
)
_PARTICLES = RunTable("particles.parquet", ("particles",), _write_particles)

_TABLES: Mapping[str, tuple[RunTable, ...]] = {
    "drop_test": (_THERMO, RunTable("impacts.parquet", ("impacts",), _write_impacts)),
    "filling": (_THERMO, _PARTICLES, RunTable("packing.json", ("particles",), _write_packing)),
    "process": (
        _THERMO,
        RunTable("workpiece_force.parquet", ("workpiece_force",), _write_workpiece_force),
        _PARTICLES,
        RunTable(
            "workpiece_contacts.parquet",
            ("workpiece_force", *ON_WORKPIECE),
            _write_workpiece_contacts,
        ),
        RunTable("touches.parquet", ("workpiece_force", *TOUCHES), _write_touches),
        RunTable("contacts.parquet", ("contacts", "particles", *ON_WORKPIECE), _write_contacts),
    ),
}
"""What is made of a run of each scene, in this order."""
