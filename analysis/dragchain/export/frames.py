"""What a run's tables say of one network frame after another.

Nothing is held but the frame at hand, so memory does not grow with the length of a run.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.arrays import Floats, Ints
from dragchain.errors import ExportError, TableError
from dragchain.network.frame import KINDS, WORKPIECE, NetworkFrame, frame_of
from dragchain.tables.by_step import RisingSteps, read_groups, read_steps
from dragchain.tables.columns import CONTACTS, KINEMATICS
from dragchain.tables.run_folder import WORKPIECE_COLUMNS, Run, workpiece_place
from dragdeck.records.case import CaseOfRun
from dragdeck.study.rotation import Rotation

_BODY = {name: body for body, name in KINDS.items()}


@dataclass(frozen=True)
class Membership:
    """Chains of a frame with N particles and M contacts.

    Attributes
    ----------
    particle_peters, contact_peters : (N,) and (M,) int
        Number of the chain by Peters et al. within the frame, from 1; 0: in none.
    particle_paths, contact_paths : (N,) and (M,) int
        Through how many workpiece paths to the bowl a particle or contact carries load.
    particle_dominant, contact_dominant : (N,) and (M,) int
        1 on the frame's dominant workpiece path, else 0.
    """

    particle_peters: Ints
    contact_peters: Ints
    particle_paths: Ints
    contact_paths: Ints
    particle_dominant: Ints
    contact_dominant: Ints


def chain_membership(frame: NetworkFrame, chains: pd.DataFrame) -> Membership:
    """Which particles and contacts are in the chains of a frame.

    Parameters
    ----------
    frame : NetworkFrame
        The frame.
    chains : DataFrame
        Its rows of ``chains.parquet``, in the order of the table.

    Raises
    ------
    TableError
        If a chain names a particle or a contact that the frame does not have.
    """
    found = Membership(
        *(np.zeros(size, dtype=np.int64) for _ in range(3) for size in _sizes(frame))
    )
    links = _Links(frame)
    peters = chains[chains["definition"] == "peters"]
    for number, ids in enumerate(peters["particle_ids"], start=1):
        particles = links.particles(ids)
        found.particle_peters[particles] = number
        found.contact_peters[links.between(particles)] = number
    for particles, contacts, dominant in _paths(
        links, chains[chains["definition"] == "widest_path"]
    ):
        found.particle_paths[particles] += 1
        found.contact_paths[contacts] += 1
        if dominant:
            found.particle_dominant[particles] = 1
            found.contact_dominant[contacts] = 1
    return found


def _sizes(frame: NetworkFrame) -> tuple[int, int]:
    return frame.particle_id.size, frame.normal_force.size


def _paths(links: "_Links", paths: pd.DataFrame) -> Iterator[tuple[Ints, Ints, bool]]:
    """Yield particles and contacts of every workpiece path that reaches the bowl.

    A path has a row for each strong workpiece contact, by falling force: of several rows that
    begin at one particle, the n-th belongs to its n-th strongest contact with the workpiece. At the
    bowl a path ends in the particle's strongest contact of its kind.
    """
    begun: dict[int, int] = {}
    columns = [paths[name] for name in ("particle_ids", "reaches_bowl", "end_kind", "dominant")]
    for ids, reaches_bowl, end_kind, dominant in zip(*columns, strict=True):
        particles = links.particles(ids)
        first, last = int(particles[0]), int(particles[-1])
        rank = begun.get(first, 0)
        begun[first] = rank + 1
        if reaches_bowl:
            workpiece = links.with_body(first, WORKPIECE, rank)
            bowl = links.with_body(last, _BODY[end_kind], 0)
            yield particles, np.array([workpiece, *links.between(particles), bowl]), bool(dominant)


class _Links:
    """Finds the contacts of a frame by what they are between."""

    def __init__(self, frame: NetworkFrame) -> None:
        self._frame = frame
        inner = np.flatnonzero(frame.between_particles())
        keys = self._keys(frame.a[inner], frame.b[inner])
        order = np.argsort(keys)
        self._inner, self._sorted = inner[order], keys[order]
        self._walls = np.flatnonzero(~frame.between_particles())

    def _keys(self, first: Ints, second: Ints) -> Ints:
        size = self._frame.particle_id.size
        return np.minimum(first, second) * size + np.maximum(first, second)

    def particles(self, ids: NDArray[np.int64]) -> Ints:
        """Rows of particles by their ids."""
        return self._found(self._frame.particle_id, np.asarray(ids, dtype=np.int64), "particle")

    def between(self, particles: Ints) -> Ints:
        """Contacts of each particle of a chain with the next."""
        return self._inner[
            self._found(self._sorted, self._keys(particles[:-1], particles[1:]), "contact")
        ]

    def _found(self, known: Ints, wanted: Ints, what: str) -> Ints:
        at = np.minimum(np.searchsorted(known, wanted), max(known.size - 1, 0))
        if wanted.size and (not known.size or (known[at] != wanted).any()):
            raise self._missing(what)
        return at

    def with_body(self, particle: int, body: int, rank: int) -> int:
        """Contact of a particle with workpiece, floor or side; `rank` 0 is the strongest."""
        frame, walls = self._frame, self._walls
        rows = walls[(frame.a[walls] == particle) & (frame.other[walls] == body)]
        if rank >= rows.size:
            raise self._missing("contact")
        return int(rows[np.argsort(-frame.normal_force[rows], kind="stable")[rank]])

    def _missing(self, what: str) -> TableError:
        return TableError(
            f"a chain of step {self._frame.step} has a {what} that is missing in "
            "particles.parquet or"
            " contacts.parquet\n  remedy: make the chains again with `dragchain chains`"
        )


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


def _inside(times_s: Floats, selection: Selection, case: CaseOfRun) -> np.ndarray:
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
