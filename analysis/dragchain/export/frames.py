"""What a run's tables say of one network frame after another.

Nothing is held but the frame at hand, so memory does not grow with the length of a run.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from dragchain.errors import ExportError, TableError
from dragchain.export.chain_membership import Membership, chain_membership
from dragchain.network.frame import NetworkFrame, frame_of
from dragchain.run.case import Case
from dragchain.tables.by_step import RisingSteps, read_groups, read_steps
from dragchain.tables.columns import CONTACTS, KINEMATICS
from dragchain.tables.run_folder import Run
from dragchain.tables.workpiece_pose import WORKPIECE_COLUMNS, workpiece_place
from dragdeck.study.rotation import Rotation

_PARTICLES = ("step", *KINEMATICS)
_CHAINS = ("step", "definition", "particle_ids", "reaches_bowl", "end_kind", "dominant")


@dataclass(frozen=True)
class Selection:
    """Which frames are wanted.

    Attributes
    ----------
    first_s, last_s : float or None
        First and last simulated time, ``time_s`` of the tables; None: no limit.
    every : int
        Every how many frames of that stretch one is taken, beginning with its first.
    """

    first_s: float | None = None
    last_s: float | None = None
    every: int = 1


@dataclass(frozen=True)
class FrameData:
    """One frame: what there is of particles, contacts, chains and the workpiece.

    Attributes
    ----------
    step, time_s
        When it was written.
    particles : DataFrame
        Rows of ``particles.parquet``, by rising ``particle_id``.
    contacts : DataFrame or None
        Rows of ``contacts.parquet``; None if the run wrote no contacts.
    network : NetworkFrame or None
        The same particles and contacts as arrays, in the same order.
    membership : Membership or None
        What is in a chain; None if there are no chain tables, or if they do not
        reach this frame.
    workpiece : (3,) float and Rotation, or None
        The workpiece's reference point in m and its orientation; None if there is no workpiece.
    """

    step: int
    time_s: float
    particles: pd.DataFrame
    contacts: pd.DataFrame | None
    network: NetworkFrame | None
    membership: Membership | None
    workpiece: tuple[Floats, Rotation] | None


@dataclass(frozen=True)
class FrameSeries:
    """The wanted frames of a run.

    Attributes
    ----------
    run : Run
        The run.
    steps, times_s : (N,) arrays
        When the frames were written; N is at least 1.
    """

    run: Run
    steps: Ints
    times_s: Floats

    @classmethod
    def of(cls, run: Run, selection: Selection) -> "FrameSeries":
        """Find the frames of a selection.

        Raises
        ------
        ExportError
            If the run wrote no particles, or none in the interval.
        TableError
            If ``particles.parquet`` is not there.
        """
        if selection.every < 1:
            raise ExportError(f"--every must be at least 1, but is {selection.every}")
        if not run.wrote("particles"):
            raise ExportError(
                f"{run.folder}: this {run.case.scene} run wrote no output particles, so there is"
                " nothing to export\n  remedy: export a filling or a process that lists "
                "particles in"
                " its outputs"
            )
        steps, times_s = _frame_times(run.table("particles.parquet"))
        wanted = _inside(times_s, selection, run.case)
        if not wanted.any():
            raise ExportError(_nothing(run, times_s, selection))
        every = selection.every
        return cls(run, steps[wanted][::every], times_s[wanted][::every])

    def __len__(self) -> int:
        """The number of frames N."""
        return self.steps.size

    @property
    def has_contacts(self) -> bool:
        """Whether the run wrote its contacts."""
        return self.run.wrote("contacts", "workpiece_particles", "workpiece_contacts")

    @property
    def has_chains(self) -> bool:
        """Whether chains were looked for."""
        tables = ("network.parquet", "chains.parquet")
        return self.has_contacts and all(self.run.table(name).is_file() for name in tables)

    def __iter__(self) -> Iterator[FrameData]:
        """Yield the frames in the order of their steps.

        Raises
        ------
        TableError
            If a table is missing or the tables contradict each other.
        """
        run, steps = self.run, self.steps
        particles = RisingSteps(run.table("particles.parquet"), _PARTICLES, steps)
        contacts = chains = None
        if self.has_contacts:
            contacts = RisingSteps(run.table("contacts.parquet"), CONTACTS, steps)
        if self.has_chains:
            chains = RisingSteps(run.table("chains.parquet"), _CHAINS, steps)
        searched = _steps(run.table("network.parquet")) if chains is not None else frozenset()
        track = _Track(run) if run.case.workpiece is not None else None
        for step, time_s in zip(steps.tolist(), self.times_s.tolist(), strict=True):
            of_particles = particles.at(step).sort_values("particle_id", ignore_index=True)
            of_contacts = None if contacts is None else contacts.at(step)
            network = membership = None
            if of_contacts is not None:
                network = frame_of(of_contacts, of_particles, step, time_s, np.nan)
            if chains is not None and network is not None and step in searched:
                membership = chain_membership(network, chains.at(step))
            workpiece = None if track is None else track.at(step)
            yield FrameData(step, time_s, of_particles, of_contacts, network, membership, workpiece)
        for rows in (particles, contacts, chains):
            if rows is not None:
                rows.finish()


def _inside(times_s: Floats, selection: Selection, case: Case) -> np.ndarray:
    """Which times are in the interval; half a step is no difference."""
    low = -np.inf if selection.first_s is None else selection.first_s
    high = np.inf if selection.last_s is None else selection.last_s
    half = 0.5 * case.timestep_s
    return (times_s >= low - half) & (times_s <= high + half)


def _nothing(run: Run, times_s: Floats, selection: Selection) -> str:
    if not times_s.size:
        return f"{run.table('particles.parquet')} contains no frames, so there is nothing to export"
    wanted = [
        f"{word} {value:g} s"
        for word, value in (("from", selection.first_s), ("to", selection.last_s))
        if value is not None
    ]
    return (
        f"{run.folder}: there is no frame {' '.join(wanted)}\n"
        f"  limit:  the {times_s.size} frames are of {times_s[0]:g} to {times_s[-1]:g} s\n"
        "  remedy: give --from-time and --to-time as simulated time, time_s of the tables"
    )


# --- tables, step by step --------------------------------------------------------------------


def _frame_times(file: Path) -> tuple[Ints, Floats]:
    """The rising steps of a table's frames and their times in s."""
    steps: list[int] = []
    times_s: list[float] = []
    for step, rows in read_steps(file, ["step", "time_s"]):
        steps.append(step)
        times_s.append(rows["time_s"].iloc[0])
    return np.array(steps, dtype=np.int64), np.array(times_s, dtype=np.float64)


def _steps(file: Path) -> frozenset[int]:
    return frozenset(_frame_times(file)[0].tolist())


class _Track:
    """Where the workpiece is at steps that rise.

    A stretch of ``workpiece_force.parquet`` is held.
    """

    def __init__(self, run: Run) -> None:
        self._case = run.case
        self._blocks = read_groups(run.table("workpiece_force.parquet"), WORKPIECE_COLUMNS)
        first = next(self._blocks, None)
        if first is None:
            raise TableError(f"{run.table('workpiece_force.parquet')} contains no samples")
        self._rows = first

    def at(self, step: int) -> tuple[Floats, Rotation]:
        """Return reference point in m and orientation."""
        while self._rows["step"].iloc[-1] < step:
            following = next(self._blocks, None)
            if following is None:
                break
            self._rows = pd.concat([self._rows.iloc[-1:], following])
        return workpiece_place(self._rows, step, self._case)
