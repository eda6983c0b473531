"""A run folder: its case, its raw outputs and its tables."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest
from pathlib import Path
from typing import Self

import numpy as np
import pandas as pd

from dragchain.arrays import Floats
from dragchain.errors import TableError
from dragchain.run.case import friction_with, study_of
from dragchain.run.kinematics import needed, workpiece_rotation
from dragchain.run.run_parts import iter_frames, iter_prints
from dragchain.tables.by_step import read_table
from dragchain.tables.workpiece_contacts import Meshes, WorkpieceFrames, join_workpiece_frames
from dragdeck.decks.outputs import OutputOfRun, load_outputs
from dragdeck.dumps.frame import Columns, Frame
from dragdeck.records.case import CaseOfRun, load_case
from dragdeck.study.contact_law import FrictionLimit
from dragdeck.study.model import Study
from dragdeck.study.rotations import Orientations

ON_WORKPIECE = ("workpiece_particles", "workpiece_contacts")
"""The outputs that are joined, unless others of their columns are asked for."""

_BATCH_ROWS = 8192
"""Contacts on the workpiece that are joined at once, but for those of the last frame."""


@dataclass(frozen=True)
class WorkpiecePair:
    """``workpiece_particles`` and ``workpiece_contacts`` of one step, not joined yet."""

    particles: Frame
    contacts: Frame
    friction: tuple[FrictionLimit, FrictionLimit]
    meshes: Meshes

    @property
    def step(self) -> int:
        """The step."""
        return self.particles.step

    def join(self, *, merge: bool = True) -> WorkpieceFrames:
        """Give every contact the force that its particle received; see `join_workpiece_frames`."""
        return _joined([self], merge=merge)


def _joined(pairs: Sequence[WorkpiecePair], *, merge: bool = True) -> WorkpieceFrames:
    particles, contacts = ([pair.particles for pair in pairs], [pair.contacts for pair in pairs])
    first = pairs[0]
    return join_workpiece_frames(particles, contacts, first.friction, first.meshes, merge=merge)


@dataclass(frozen=True)
class Run:
    """A run folder, whose outputs and tables are read when they are needed.

    Attributes
    ----------
    folder : Path
        The run folder.
    case : CaseOfRun
        What the run models.
    """

    folder: Path
    case: CaseOfRun

    @classmethod
    def open(cls, run_dir: Path | str) -> Self:
        """Open a run folder; `DocumentError` if it contains no ``case.json``."""
        return cls(Path(run_dir), load_case(run_dir))

    @cached_property
    def outputs(self) -> Mapping[str, OutputOfRun]:
        """The raw outputs that it wrote."""
        return load_outputs(self.folder)

    @property
    def study(self) -> Study:
        """The study of a process run."""
        return study_of(self.case)

    def wrote(self, *names: str) -> bool:
        """Whether the run wrote all these outputs."""
        return all(name in self.outputs for name in names)

    def file(self, name: str) -> Path:
        """Path of a table, or of a document beside the tables."""
        return self.folder / "tables" / name

    def table(self, name: str, columns: list[str] | None = None) -> pd.DataFrame:
        """A table of the run, or some of its columns."""
        return read_table(self.file(f"{name}.parquet"), columns)

    @property
    def raw(self) -> Path:
        """Folder of the raw outputs: its own, or that of the run whose workpiece this is."""
        return self.folder.parent / self.case.output_of if self.case.output_of else self.folder

    def frames(self, name: str) -> Iterator[Frame]:
        """Frames of a dump."""
        return iter_frames(self.raw, self.outputs[name])

    def prints(self, name: str) -> Iterator[Columns]:
        """Blocks of rows of a ``fix print`` output."""
        return iter_prints(self.raw, self.outputs[name])

    def workpiece_pairs(self, names: tuple[str, str] = ON_WORKPIECE) -> Iterator[WorkpiecePair]:
        """What `workpiece_frames` joins, for those who need some steps only."""
        friction = friction_with(self.case, "workpiece"), friction_with(self.case, "bowl")
        workpiece = needed(self.case.workpiece, "workpiece")
        meshes = Meshes(max(workpiece.number, 1) - 1, workpiece.count)
        pairs = zip_longest(*map(self.frames, names))
        for particles, contacts in pairs:
            if particles is None or contacts is None:
                raise TableError(f"one of {names[0]} and {names[1]} ends before the other")
            yield WorkpiecePair(particles, contacts, friction, meshes)

    def workpiece_frames(self, names: tuple[str, str] = ON_WORKPIECE) -> Iterator[WorkpieceFrames]:
        """Contacts on the workpiece in a pair of outputs, a batch of steps at a time.

        Raises
        ------
        TableError
            If the two outputs have different steps, or a particle comes twice.
        DumpError
            If one of them cannot be read.
        """
        batch, rows = [], 0
        for pair in self.workpiece_pairs(names):
            batch.append(pair)
            rows += pair.contacts.rows
            if rows >= _BATCH_ROWS:
                yield _joined(batch)
                batch, rows = [], 0
        if batch:
            yield _joined(batch)


# --- place of the workpiece ----------------------------------------------------------------------


WorkpiecePlaces = Callable[[int], tuple[Floats, Orientations]]

_WORKPIECE = ["step", "ref_x_m", "ref_y_m", "ref_z_m", "direction_rad"]
"""Columns of ``workpiece_force.parquet`` that say where the workpiece is."""


def workpiece_places(run_dir: Path, case: CaseOfRun) -> WorkpiecePlaces:
    """A function of a step: the workpiece's reference point in m, (3,), and its orientation.

    Raises
    ------
    TableError
        If ``workpiece_force.parquet`` is not there, or empty.
    """
    file = run_dir / "tables" / "workpiece_force.parquet"
    table = read_table(file, _WORKPIECE)
    if table.empty:
        raise TableError(f"{file} contains no samples")
    return lambda step: (_reference_point(table, step), _workpiece_rotation(table, step, case))


def _reference_point(workpiece: pd.DataFrame, step: int) -> Floats:
    """The reference point at a step, between the samples around it."""
    at = workpiece["step"].to_numpy(np.float64)
    point = workpiece[["ref_x_m", "ref_y_m", "ref_z_m"]].to_numpy(np.float64)
    return np.array([np.interp(step, at, column) for column in point.T])


def _workpiece_rotation(workpiece: pd.DataFrame, step: int, case: CaseOfRun) -> Orientations:
    """The workpiece's orientation at a step, its direction of motion that of the nearest sample."""
    nearest = [int(np.abs(workpiece["step"].to_numpy(np.int64) - step).argmin())]
    direction = workpiece["direction_rad"].to_numpy(np.float64)[nearest]
    return workpiece_rotation(np.array([step]), direction, case)
