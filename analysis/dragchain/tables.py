"""Parquet tables of one run, made from its raw outputs."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from dragchain.case import Case, Output, load_case, load_outputs
from dragchain.closure import LIMIT, SHARED_LIMIT, Closure
from dragchain.contacts import KINDS, ContactRows, contact_rows
from dragchain.drop import IMPACTS, find_impacts
from dragchain.dumps import iter_frames, iter_prints
from dragchain.errors import GateError, TableError
from dragchain.fill import describe_bed
from dragchain.forces import (
    counted_mask,
    headings,
    needed,
    phase_codes,
    tool_velocity,
    workpiece_frame,
    wrap_angle,
)
from dragchain.formats import Columns, Frame
from dragchain.parquet import TableWriter, category, write_json
from dragchain.rod import RodFrame, WallContacts, iter_rod_frames, iter_rod_pairs

FORCES = ("force_x_n", "force_y_n", "force_z_n")
POINT = ("point_x_m", "point_y_m", "point_z_m")
TORQUES = ("torque_x_nm", "torque_y_nm", "torque_z_nm")
SLIP = ("slip_x_m_s", "slip_y_m_s", "slip_z_m_s")
REFERENCE = ("ref_x_m", "ref_y_m", "ref_z_m")
KINEMATICS = (
    *("ball_id", "x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s"),
    *("wx_rad_s", "wy_rad_s", "wz_rad_s", "radius_m"),
)
ROD_FORCE = (
    *("step", "time_s", "phase", *FORCES, *TORQUES, *REFERENCE),
    *("heading_rad", "drag_n", "lateral_n", "vertical_n", "counted"),
)
ROD_CONTACTS = (
    *("step", "time_s", "phase", "ball_id", "facet_id", *POINT, *FORCES),
    *("normal_force_n", "tangential_force_n", "overlap_m", *SLIP, "approach_m_s"),
    *("bearing_rad", "depth_m", "counted"),
)
CONTACTS = (
    *("step", "time_s", "kind", "a_id", "b_id", *POINT, *FORCES),
    *("normal_force_n", "tangential_force_n", "overlap_m"),
)


@dataclass(frozen=True)
class Run:
    """A run folder with what its two JSON files say.

    Attributes
    ----------
    folder : Path
        The run folder.
    case : Case
        What the run models.
    outputs : mapping of str to Output
        The raw outputs that it wrote.
    """

    folder: Path
    case: Case
    outputs: Mapping[str, Output]

    @classmethod
    def open(cls, run_dir: Path | str) -> Run:
        """Read ``case.json`` and ``columns.json`` of a run folder."""
        return cls(Path(run_dir), load_case(run_dir), load_outputs(run_dir))

    def wrote(self, *names: str) -> bool:
        """Whether the run wrote all these outputs."""
        return all(name in self.outputs for name in names)

    def table(self, name: str) -> Path:
        """Path of a table."""
        return self.folder / "tables" / name

    def frames(self, name: str) -> Iterator[Frame]:
        """Frames of a dump."""
        return iter_frames(self.folder, self.outputs[name])

    def prints(self, name: str) -> Iterator[Columns]:
        """Blocks of rows of a ``fix print`` output."""
        return iter_prints(self.folder, self.outputs[name])


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
    CaseError, DumpError
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


def _write_rod_force(run: Run, file: Path) -> None:
    with TableWriter(file, ROD_FORCE) as table:
        for rows in run.prints("rod_force"):
            table.write(rod_force_rows(rows, run.case))


def rod_force_rows(rows: Mapping[str, NDArray[np.generic]], case: Case) -> dict[str, object]:
    """Add phase, workpiece frame and ``counted`` to raw samples of the force on the tool."""
    steps = np.asarray(rows["step"], dtype=np.int64)
    heading = headings(steps, np.column_stack([rows["ref_x_m"], rows["ref_y_m"]]), case)
    force = np.column_stack([rows[name] for name in FORCES])
    drag, lateral, vertical = workpiece_frame(force, heading).T
    return {
        **rows,
        "phase": category(phase_codes(steps, case.phases), _phase_names(case)),
        "heading_rad": heading,
        "drag_n": drag,
        "lateral_n": lateral,
        "vertical_n": vertical,
        "counted": counted_mask(steps, case),
    }


def _phase_names(case: Case) -> tuple[str, ...]:
    return tuple(phase.name for phase in case.phases)


class ToolSamples:
    """The force on the tool and its place at rising steps.

    Parameters
    ----------
    blocks : iterable of columns
        The blocks of ``rod_force``; only one is held at a time.
    """

    def __init__(self, blocks: Iterable[Columns]) -> None:
        self._blocks = iter(blocks)
        self._block = next(self._blocks, None)
        if self._block is None:
            raise TableError("rod_force holds no samples")
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
        """Horizontal place of the tool's reference point, shape (2,), m.

        Before the first sample it is that of the first sample.
        """
        sample = self.row(max(step, self.first_step))
        if sample is None:
            raise TableError(
                f"rod_balls has step {step} but rod_force does not: the period of rod_force"
                " must divide that of rod_balls"
            )
        return np.array([sample["ref_x_m"], sample["ref_y_m"]])


def _write_rod_contacts(run: Run, file: Path) -> None:
    shared = "mesh_id" in run.outputs["rod_contacts"].columns
    closure = Closure(limit=SHARED_LIMIT if shared else LIMIT)
    samples = ToolSamples(run.prints("rod_force"))
    with TableWriter(file, ROD_CONTACTS) as table:
        for frame in iter_rod_frames(run.folder, run.outputs):
            reference = samples.reference(frame.step)
            applied = _close(closure, frame, samples, run.case)
            rows = rod_contact_rows(frame.step, frame.rod, reference, run.case)
            table.write(rows if applied else {**rows, "counted": np.full(len(frame.rod), False)})
        write_json(run.table("closure.json"), closure.content())
        if (problem := closure.problem()) is not None:
            raise GateError(
                f"{run.folder}: the force closure gate does not hold: {problem};"
                " rod_contacts.parquet was not written, closure.json holds the figures"
            )


def _close(closure: Closure, frame: RodFrame, samples: ToolSamples, case: Case) -> bool:
    sample = samples.row(frame.step) if frame.step >= samples.first_step else None
    force = None if sample is None else np.array([sample[name] for name in FORCES])
    counted = bool(counted_mask(np.array([frame.step]), case)[0])
    return closure.add(frame, force, counted=counted)


def rod_contact_rows(
    step: int, contacts: WallContacts, ref_xy_m: NDArray[np.float64], case: Case
) -> dict[str, object]:
    """Rows of ``rod_contacts.parquet`` for one step.

    Parameters
    ----------
    step : int
        The step.
    contacts : WallContacts
        N contacts on the tool.
    ref_xy_m : (2,) ndarray
        Horizontal place of the tool's reference point, m.
    case : Case
        The case, of a process.

    Returns
    -------
    dict of str to (N,) array
        The columns; forces are on the tool, velocities those of the ball's
        surface against the tool's.
    """
    steps = np.full(len(contacts), step)
    references = np.tile(ref_xy_m, (len(steps), 1))
    heading = headings(steps, references, case)
    relative = contacts.surface_m_s - tool_velocity(steps, contacts.point_m, references, case)
    apart = np.einsum("ij,ij->i", relative, contacts.normal)
    x, y = (contacts.point_m[:, :2] - ref_xy_m).T
    return {
        "step": steps,
        "time_s": steps * case.timestep_s,
        "phase": category(phase_codes(steps, case.phases), _phase_names(case)),
        "ball_id": contacts.ball_id,
        "facet_id": contacts.facet_id,
        **_named(POINT, contacts.point_m),
        **_named(FORCES, 0.0 - contacts.force_n),
        "normal_force_n": contacts.normal_force_n(),
        "tangential_force_n": contacts.tangential_force_n(),
        "overlap_m": contacts.overlap_m,
        **_named(SLIP, relative - apart[:, None] * contacts.normal),
        "approach_m_s": -apart,
        "bearing_rad": wrap_angle(np.arctan2(y, x) - heading),
        "depth_m": needed(case.surface_m, "surface_m") - contacts.point_m[:, 2],
        "counted": counted_mask(steps, case),
    }


def _named(names: tuple[str, ...], vectors: NDArray[np.float64]) -> dict[str, object]:
    return dict(zip(names, vectors.T, strict=True))


def _write_balls(run: Run, file: Path) -> None:
    with TableWriter(file, ("step", "time_s", *KINEMATICS)) as table:
        for frame in run.frames("balls"):
            order = np.argsort(frame.columns["ball_id"])
            steps = np.full(frame.rows, frame.step)
            rows = {name: frame.columns[name][order] for name in KINEMATICS}
            table.write({"step": steps, "time_s": steps * run.case.timestep_s, **rows})


def _write_contacts(run: Run, file: Path) -> None:
    bowl_radius = needed(run.case.bowl, "bowl").radius_m
    balls = _Follower("balls", run.frames("balls"))
    rods = _Follower("rod_contacts", iter_rod_pairs(run.folder, run.outputs))
    with TableWriter(file, CONTACTS) as table:
        for frame in run.frames("contacts"):
            rod = rods.at(frame.step).join()
            ball_frame = balls.at(frame.step)
            rows = contact_rows(ball_frame, frame, rod.rod, rod.bowl, bowl_radius)
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
        table.write(find_impacts(rows, run.case.timestep_s))


def _write_fill(run: Run, file: Path) -> None:
    last = deque(run.frames("balls"), maxlen=1)
    if not last:
        raise TableError(f"{run.folder}: balls holds no frames")
    write_json(file, describe_bed(last[0], run.case))


_Writer = Callable[[Run, Path], None]
_Tables = dict[str, tuple[tuple[str, ...], _Writer]]

_THERMO: _Tables = {"thermo.parquet": (("thermo",), _write_thermo)}
_ROD = ("rod_force", "rod_balls", "rod_contacts")
_SCENES: dict[str, _Tables] = {
    "drop": {**_THERMO, "impacts.parquet": (("impacts",), _write_impacts)},
    "fill": {
        **_THERMO,
        "balls.parquet": (("balls",), _write_balls),
        "fill.json": (("balls",), _write_fill),
    },
    "process": {
        **_THERMO,
        "rod_force.parquet": (("rod_force",), _write_rod_force),
        "rod_contacts.parquet": (_ROD, _write_rod_contacts),
        "balls.parquet": (("balls",), _write_balls),
        "contacts.parquet": (("contacts", "balls", *_ROD[1:]), _write_contacts),
    },
}
"""What is made for each scene: the outputs that a table needs, and how it is made."""
