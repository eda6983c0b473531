"""The contact network frame by frame, as arrays that the network and chain measures share."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.arrays import Columns, Floats, Ints, places
from dragchain.errors import TableError
from dragchain.tables.by_step import RisingSteps, read_steps, read_table
from dragchain.tables.columns import CENTRE, FORCES, POINT

PARTICLE, WORKPIECE, FLOOR, SIDE = 1, 0, -1, -2
"""The other body of a contact; the last three are the ``b_id`` of the contacts table."""

BODY_NAMES = {PARTICLE: "particle", WORKPIECE: "workpiece", FLOOR: "floor", SIDE: "side"}

_CONTACTS = ["step", "a_id", "b_id", *POINT, *FORCES, "normal_force_n"]
_PARTICLES = ["step", "time_s", "particle_id", *CENTRE, "radius_m"]


@dataclass(frozen=True)
class NetworkFrame:
    """One frame of the contact network; N particles and M contacts.

    Attributes
    ----------
    step, time_s, direction_rad
        When the frame was written, and the workpiece's direction of motion in the xy plane then.
    particle_id : (N,) int
        The particles, sorted.
    centre, radius : (N, 3) and (N,) float
        Their centres and radii in m.
    a, b : (M,) int
        A contact's particle and its other body, as rows of the particle arrays; ``b`` is -1 where
        the other body is no particle.
    other : (M,) int
        What the other body is: `WORKPIECE`, `FLOOR`, `SIDE` or `PARTICLE`.
    point, force : (M, 3) float
        Contact point in m and the force on particle ``a`` in N.
    normal_force : (M,) float
        Normal force in N, positive in compression.
    """

    step: int
    time_s: float
    direction_rad: float
    particle_id: Ints
    centre: Floats
    radius: Floats
    a: Ints
    b: Ints
    other: Ints
    point: Floats
    force: Floats
    normal_force: Floats

    def between_particles(self) -> NDArray[np.bool_]:
        """Which contacts are between two particles, (M,) bool."""
        return np.equal(self.other, PARTICLE)

    def mean_force_n(self) -> float:
        """The mean normal force of all contacts in N, 0 for a frame without contacts."""
        return float(self.normal_force.mean()) if self.normal_force.size else 0.0


def frame_of(
    contacts: pd.DataFrame | Columns,
    particles: pd.DataFrame | Columns,
    step: int,
    time_s: float,
    direction_rad: float,
) -> NetworkFrame:
    """The frame that rows of the contacts and particles tables of one step describe.

    Raises
    ------
    TableError
        If a contact names a particle that the frame does not have, or a particle has two rows.
    """
    particle_id = np.array(particles["particle_id"], dtype=np.int64)
    centre, radius = _vectors(particles, CENTRE), np.array(particles["radius_m"], dtype=np.float64)
    if (np.diff(particle_id) <= 0).any():
        order = np.argsort(particle_id)
        particle_id, centre, radius = particle_id[order], centre.T[:, order].T, radius[order]
    twice = np.flatnonzero(np.diff(particle_id) == 0)
    if twice.size:
        raise TableError(
            f"particles.parquet contains particle {particle_id[twice[0]]} twice in step {step}"
        )
    b_id = np.asarray(contacts["b_id"], dtype=np.int64)
    b = np.full(b_id.shape, -1, dtype=np.int64)
    b[b_id > 0] = _rows_of(b_id[b_id > 0], particle_id, step)
    return NetworkFrame(
        step=step,
        time_s=time_s,
        direction_rad=direction_rad,
        particle_id=particle_id,
        centre=centre,
        radius=radius,
        a=_rows_of(np.asarray(contacts["a_id"], dtype=np.int64), particle_id, step),
        b=b,
        other=np.where(b_id > 0, PARTICLE, b_id),
        point=_vectors(contacts, POINT),
        force=_vectors(contacts, FORCES),
        normal_force=np.array(contacts["normal_force_n"], dtype=np.float64),
    )


def _vectors(table: pd.DataFrame | Columns, names: Iterable[str]) -> Floats:
    """Return three columns as vectors, (n, 3), each column in one piece."""
    return np.array([table[name] for name in names], dtype=np.float64).T


def _rows_of(ids: Ints, particle_id: Ints, step: int) -> Ints:
    """The row of each id in the sorted `particle_id`."""
    rows = places(ids, particle_id)
    unknown = ids[rows < 0]
    if unknown.size:
        raise TableError(
            f"contacts of step {step} contain particle {unknown[0]}, which is missing in "
            f"particles.parquet in that step: make the tables again from complete dumps"
        )
    return rows


def counted_range(workpiece_force: pd.DataFrame) -> tuple[int, int]:
    """The first and the last step of the drag that statistics count.

    Raises
    ------
    TableError
        If no sample is counted, or if the counted samples are not one stretch.
    """
    counted = workpiece_force["in_statistics"].to_numpy(bool)
    where = np.flatnonzero(counted)
    if not where.size:
        raise TableError(
            "workpiece_force.parquet contains no sample of the statistics: the run ended "
            "before the "
            "transient of the drag was over; use a longer path or a shorter motion.transient_m"
        )
    if not counted[where[0] : where[-1] + 1].all():
        raise TableError(
            "the samples of workpiece_force.parquet in the statistics are not contiguous"
        )
    step = workpiece_force["step"].to_numpy(np.int64)
    return int(step[where[0]]), int(step[where[-1]])


def network_frames(run_dir: Path, steps: tuple[int, int] | None = None) -> Iterator[NetworkFrame]:
    """Yield the network frames of a process run in the order of their steps.

    The tables are read row group by row group: of each no more is held than a frame and the row
    groups that it lies in, however long the run is.

    Parameters
    ----------
    run_dir
        The folder of the run, with ``tables/`` made.
    steps
        First and last step to read; by default the stretch that statistics count.

    Raises
    ------
    TableError
        If a table is missing or the tables contradict each other.
    """
    tables = run_dir / "tables"
    workpiece_force = read_table(
        tables / "workpiece_force.parquet", ["step", "direction_rad", "in_statistics"]
    )
    first, last = counted_range(workpiece_force) if steps is None else steps
    contacts = RisingSteps(tables / "contacts.parquet", _CONTACTS, (first, last))
    heading_step = workpiece_force["step"].to_numpy(np.int64)
    heading = np.unwrap(workpiece_force["direction_rad"].to_numpy(np.float64))
    particles = read_steps(tables / "particles.parquet", _PARTICLES, (first, last))
    for step, of_step in particles:
        yield frame_of(
            contacts.at(step),
            of_step,
            step,
            float(of_step["time_s"].iloc[0]),
            float(np.interp(step, heading_step, heading)),
        )
