"""What a run's tables say of one network frame after another.

Nothing is held but the frame at hand, so memory does not grow with the length of a run.
"""

from collections import Counter, defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from dragchain.errors import ExportError, TableError
from dragchain.network.frame import BODY_NAMES, PARTICLE, WORKPIECE, NetworkFrame, frame_of
from dragchain.tables.by_step import RisingSteps, read_steps
from dragchain.tables.columns import CONTACTS, KINEMATICS, ORIENTATION
from dragchain.tables.run_folder import Run, workpiece_places
from dragdeck.study.rotations import Orientations

_BODY = {name: body for body, name in BODY_NAMES.items()}
_PARTICLES = ("step", *KINEMATICS)
MEMBERSHIPS = ("peters_chain", "widest_paths", "dominant")
_CHAINS = ("step", "definition", "particle_ids", "reaches_bowl", "end_kind", "dominant")


@dataclass(frozen=True)
class Membership:
    """Chains of a frame with N particles and M contacts.

    Attributes
    ----------
    particles, contacts : dict of (N,) and of (M,) int
        ``peters_chain``: number of the chain by Peters et al. within the frame, from 1; 0: in
        none. ``widest_paths``: through how many workpiece paths to the bowl it carries load.
        ``dominant``: 1 on the frame's dominant workpiece path, else 0.
    """

    particles: dict[str, Ints]
    contacts: dict[str, Ints]


def chain_membership(frame: NetworkFrame, chains: pd.DataFrame) -> Membership:
    """Which particles and contacts are in the chains of a frame.

    A path has a row for each strong workpiece contact, by falling force: of several rows that
    begin at one particle, the n-th belongs to its n-th strongest contact with the workpiece. At the
    bowl a path ends in the particle's strongest contact of its kind. Only paths that reach the
    bowl count.

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
    sizes = (frame.particle_id.size, frame.normal_force.size)
    membership = Membership(
        *({name: np.zeros(size, np.int64) for name in MEMBERSHIPS} for size in sizes)
    )
    row = {number: k for k, number in enumerate(frame.particle_id.tolist())}
    between = _contacts(frame)

    def links(particles: list[int]) -> list[int]:
        return [between[PARTICLE, *sorted(pair)][0] for pair in pairwise(particles)]

    begun: Counter[int] = Counter()
    columns = [chains[name] for name in _CHAINS[1:]]
    peters = 0
    try:
        for definition, ids, reaches_bowl, end_kind, dominant in zip(*columns, strict=True):
            particles = [row[number] for number in ids]
            if definition == "peters":
                peters += 1
                membership.particles["peters_chain"][particles] = peters
                membership.contacts["peters_chain"][links(particles)] = peters
                continue
            first, last = particles[0], particles[-1]
            begun[first] += 1
            if reaches_bowl:
                start = between[WORKPIECE, -1, first][begun[first] - 1]
                contacts = [start, *links(particles), between[_BODY[end_kind], -1, last][0]]
                for of, rows in (
                    (membership.particles, particles),
                    (membership.contacts, contacts),
                ):
                    of["widest_paths"][rows] += 1
                    of["dominant"][rows] |= bool(dominant)
    except (KeyError, IndexError):
        raise TableError(
            f"a chain of step {frame.step} has a particle or a contact that is missing in"
            " particles.parquet or contacts.parquet\n"
            "  remedy: make the chains again with `./run dragchain chains`"
        ) from None
    return membership


def _contacts(frame: NetworkFrame) -> dict[tuple[int, ...], list[int]]:
    """The contacts between two bodies, the strongest first.

    Their key is the kind of the second body, and the rows of the particles, -1 for another body.
    """
    order = np.argsort(-frame.normal_force, kind="stable")
    bodies = defaultdict[tuple[int, ...], list[int]](list)
    columns = (order, frame.other[order], *np.sort([frame.a[order], frame.b[order]], axis=0))
    for contact, *key in zip(*(column.tolist() for column in columns), strict=True):
        bodies[tuple(key)].append(contact)
    return dict(bodies)


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
    workpiece : (3,) float and Orientations, or None
        The workpiece's reference point in m and its orientation; None if there is no workpiece.
    """

    step: int
    time_s: float
    particles: pd.DataFrame
    contacts: pd.DataFrame | None
    network: NetworkFrame | None
    membership: Membership | None
    workpiece: tuple[Floats, Orientations] | None


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
    def of(
        cls, run: Run, first_s: float | None = None, last_s: float | None = None, every: int = 1
    ) -> "FrameSeries":
        """Find frames.

        Parameters
        ----------
        run : Run
        first_s, last_s : float, optional
            First and last simulated time, ``time_s`` of the tables; None: no limit.
        every : int
            Every how many frames of that stretch one is taken, beginning with its first.

        Raises
        ------
        ExportError
            If the run wrote no particles, or none in the interval.
        TableError
            If ``particles.parquet`` is not there.
        """
        if every < 1:
            raise ExportError(f"--every must be at least 1, but is {every}")
        if not run.wrote("particles"):
            raise ExportError(
                f"{run.folder}: this {run.case.scene} run wrote no output particles, so there is "
                "nothing to export\n  remedy: export a filling or a process that lists particles "
                "in its outputs"
            )
        steps, times_s = _frame_times(run.file("particles.parquet"))
        half = 0.5 * run.case.timestep_s  # no difference
        low = -np.inf if first_s is None else first_s - half
        high = np.inf if last_s is None else last_s + half
        wanted = (times_s >= low) & (times_s <= high)
        if not wanted.any():
            ends = f"{times_s[0]:g} to {times_s[-1]:g} s" if times_s.size else "no time"
            raise ExportError(
                f"{run.folder}: there is no frame from {low:g} to {high:g} s\n"
                f"  limit:  the {times_s.size} frames are of {ends}\n"
                "  remedy: give --from-time and --to-time as simulated time, time_s of the tables"
            )
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
        return self.has_contacts and all(self.run.file(name).is_file() for name in tables)

    def __iter__(self) -> Iterator[FrameData]:
        """Yield the frames in the order of their steps.

        Raises
        ------
        TableError
            If a table is missing or the tables contradict each other.
        """
        run, steps = self.run, self.steps
        moving = _PARTICLES + (ORIENTATION if run.case.bodies else ())
        particles = RisingSteps(run.file("particles.parquet"), moving, steps)
        contacts = chains = None
        if self.has_contacts:
            contacts = RisingSteps(run.file("contacts.parquet"), CONTACTS, steps)
        if self.has_chains:
            chains = RisingSteps(run.file("chains.parquet"), _CHAINS, steps)
        network_file = run.file("network.parquet")
        searched = set(_frame_times(network_file)[0].tolist()) if chains is not None else set()
        place = workpiece_places(run.folder, run.case) if run.case.workpiece is not None else None
        for step, time_s in zip(steps.tolist(), self.times_s.tolist(), strict=True):
            of_particles = particles.at(step).sort_values("particle_id", ignore_index=True)
            of_contacts = None if contacts is None else contacts.at(step)
            network = membership = None
            if of_contacts is not None:
                network = frame_of(of_contacts, of_particles, step, time_s, np.nan)
            if chains is not None and network is not None and step in searched:
                membership = chain_membership(network, chains.at(step))
            workpiece = None if place is None else place(step)
            yield FrameData(step, time_s, of_particles, of_contacts, network, membership, workpiece)
        for rows in (particles, contacts, chains):
            if rows is not None:
                rows.finish()


# --- tables, step by step --------------------------------------------------------------------


def _frame_times(file: Path) -> tuple[Ints, Floats]:
    """The rising steps of a table's frames and their times in s."""
    steps: list[int] = []
    times_s: list[float] = []
    for step, rows in read_steps(file, ["step", "time_s"]):
        steps.append(step)
        times_s.append(rows["time_s"].iloc[0])
    return np.array(steps, dtype=np.int64), np.array(times_s, dtype=np.float64)
