"""Impacts of one particle that is dropped on a plate."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dragchain.arrays import Floats, Ints
from dragchain.errors import TableError
from dragchain.tables.by_step import read_table
from dragchain.tables.parquet import Rows
from dragdeck.dumps.frame import Columns
from dragdeck.parts import Part


def speed_at_plate(speed_m_s: Floats, gap_m: Floats, gravity_m_s2: float) -> Floats:
    """Speed with which a particle in free flight passes the plate's surface, m/s.

    ``sqrt(v^2 + 2 g gap)``, exact without drag. The restitution of an impact is the ratio
    of two such speeds: gravity between the surface and a sample is not in it.

    Parameters
    ----------
    speed_m_s, gap_m : (N,) ndarray
        Speed and height of the particle's lowest point above the surface, m/s and m.
    gravity_m_s2 : float
    """
    return np.asarray(np.sqrt(np.square(speed_m_s) + 2 * gravity_m_s2 * np.asarray(gap_m)))


def find_impacts(rows: Columns, timestep_s: float, radius_m: float, gravity_m_s2: float) -> Rows:
    """Measure every impact in the samples around them.

    The samples are split where steps are missing. In each stretch an impact is
    an unbroken run of samples with a force, the short pull at the end included
    that an unlimited damper gives; it starts with the first of them and lasts
    as many steps as there are. The speeds are those at the plate's surface, from the
    sample before and the sample after it, both in free flight (`speed_at_plate`).

    Parameters
    ----------
    rows : dict of str to (N,) ndarray
        ``step time_s z_m vz_m_s force_n``, steps increasing.
    timestep_s : float
        The time step, s.
    radius_m : float
        Of the particle; the plate's surface is at z = 0.
    gravity_m_s2 : float

    Returns
    -------
    dict of str to (M,) ndarray
        The columns of ``impacts.parquet``, M impacts numbered from 1 in order
        of time. ``restitution`` is ``speed_out_m_s / speed_in_m_s``.

    Raises
    ------
    TableError
        If there is no impact, a stretch holds none, or one begins or ends
        inside an impact.
    """
    steps = np.asarray(rows["step"], dtype=np.int64)
    stretch = np.cumsum(np.diff(steps, prepend=steps[:1] - 1) != 1)
    touching = np.asarray(rows["force_n"]) != 0.0
    _check_stretches(steps, stretch, touching)
    first, last = _runs(touching)
    speed = np.asarray(rows["vz_m_s"], dtype=np.float64)
    if not ((speed[first - 1] < 0.0) & (speed[last + 1] > 0.0)).all():
        raise TableError(
            "the velocity before or after an impact does not have the sign of an impact"
        )
    gap = np.asarray(rows["z_m"], dtype=np.float64) - radius_m
    speed_in, speed_out = (
        speed_at_plate(speed[near], gap[near], gravity_m_s2) for near in (first - 1, last + 1)
    )
    start = np.asarray(rows["time_s"], dtype=np.float64)[first]
    force = np.asarray(rows["force_n"], dtype=np.float64)
    return {
        "impact": np.arange(1, len(first) + 1),
        "start_time_s": start,
        "duration_s": (last - first + 1) * timestep_s,
        "peak_force_n": np.maximum.reduceat(force, first),
        "speed_in_m_s": speed_in,
        "speed_out_m_s": speed_out,
        "restitution": speed_out / speed_in,
        "time_since_first_s": start - start[0],
    }


def _check_stretches(steps: Ints, stretch: Ints, touching: NDArray[np.bool_]) -> None:
    if not touching.any():
        raise TableError(
            "impacts contains no sample with a force: the particle never touched the plate"
        )
    begins = np.flatnonzero(np.diff(stretch, prepend=stretch[0] - 1))
    ends = np.append(begins[1:], len(steps)) - 1
    for begin, end in zip(begins, ends, strict=True):
        where = f"impacts, steps {steps[begin]} to {steps[end]}"
        if not touching[begin : end + 1].any():
            raise TableError(f"{where}: no force; the window does not contain the impact")
        if touching[begin] or touching[end]:
            raise TableError(f"{where}: the window starts or ends during an impact; widen it")


def _runs(mask: NDArray[np.bool_]) -> tuple[Ints, Ints]:
    """First and last index of each run of true values."""
    edges = np.diff(mask.astype(np.int8), prepend=0, append=0)
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1


class Restitution(Part):
    """Restitution of all impacts of a drop.

    Attributes
    ----------
    mean, lowest, highest : float
        Over the impacts.
    impacts : int
        Number of impacts.
    """

    mean: float
    lowest: float
    highest: float
    impacts: int


def effective_restitution(run_dir: Path | str) -> Restitution:
    """Restitution that a drop shows, which need not be the one in its deck.

    With ``limitForce on`` the engine cuts the attractive end of every impact,
    and with it some of the damping, so a particle rebounds faster than the deck's
    coefficient says.

    Parameters
    ----------
    run_dir : Path or str
        The run folder of a drop, with its tables made.

    Returns
    -------
    Restitution
        Over all impacts.

    Raises
    ------
    TableError
        If ``impacts.parquet`` is not there.
    """
    file = Path(run_dir) / "tables" / "impacts.parquet"
    ratio = read_table(file, ["restitution"])["restitution"].to_numpy()
    mean, lowest, highest = ratio.mean(), ratio.min(), ratio.max()
    return Restitution(mean=mean, lowest=lowest, highest=highest, impacts=len(ratio))
