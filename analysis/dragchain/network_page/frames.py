"""The frames that the page shows: which ones, and which particles and contacts of each."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from dragchain.arrays import Floats, Ints
from dragchain.drag.force import read_counted
from dragchain.drag.peaks import Peaks, drag_peaks
from dragchain.errors import TableError
from dragchain.export.frames import FrameData, FrameSeries
from dragchain.network.frame import NetworkFrame
from dragchain.tables.by_step import read_table
from dragchain.tables.run_folder import Run

FRAMES = 100
"""Frames at equal intervals that are shown, or fewer if the run has fewer."""

PEAKS = 10
"""The highest peaks of the drag force, whose nearest frames are shown too."""

MOST_PARTICLES = 2000
"""Of a frame; if it has more, those nearest to the workpiece are shown."""

QUASI_LINEAR, PATH, DOMINANT = 1, 2, 4
"""Flags of a contact: in a quasi-linear chain, on a path to the bowl, on the dominant one."""

BODIES = 0xFFFF
"""Stands for the body 0, the workpiece; others, with negative numbers, come before it."""


@dataclass(frozen=True)
class ShownFrame:
    """A frame with N particles and M contacts as the page shows them.

    Attributes
    ----------
    data : FrameData
        The whole frame.
    particles : (N,) int
        Rows of the shown particles in the frame.
    contacts : (M,) int
        Rows of the shown contacts: those of which no particle is left out.
    a, b : (M,) int
        A contact's particles as places in `particles`; for a body that is no particle, ``b`` is its
        ``b_id`` plus `BODIES`.
    flags : (M,) int
        Sums of `QUASI_LINEAR`, `PATH` and `DOMINANT`.
    """

    data: FrameData
    particles: Ints
    contacts: Ints
    a: Ints
    b: Ints
    flags: Ints


def highest_peaks(run: Run) -> Peaks:
    """The peaks of the drag force in the counted stretch, the highest first, `PEAKS` at most.

    Raises
    ------
    SeriesError
        If the run is too short to have peaks.
    """
    peaks = drag_peaks(read_counted(run.folder, ("time_s", "drag_n")), run.case)
    order = np.argsort(peaks.drag_n, kind="stable")[:PEAKS]
    return Peaks(
        peaks.index[order], peaks.time_s[order], peaks.drag_n[order], peaks.prominence_n[order]
    )


def shown_frames(run: Run, peak_time_s: Floats) -> FrameSeries:
    """`FRAMES` network frames of the counted stretch, and the nearest one to each peak.

    Raises
    ------
    TableError
        If the run wrote no contact network.
    """
    if not run.wrote("contacts", "particles", "workpiece_contacts", "workpiece_particles"):
        raise TableError(
            f"{run.folder}: this {run.case.scene} run wrote no contact network, which the"
            " page requires\n  remedy: use the outputs contacts and particles"
        )
    network = read_table(run.table("network.parquet"), ["step", "time_s"])
    steps, times = network["step"].to_numpy(np.int64), network["time_s"].to_numpy(np.float64)
    even = np.linspace(0, len(steps) - 1, min(FRAMES, len(steps))).round().astype(np.int64)
    nearest = np.abs(times[:, None] - peak_time_s).argmin(axis=0)
    rows = np.union1d(even, nearest)
    series = FrameSeries(run, steps[rows], times[rows])
    if not series.has_chains:
        raise TableError(
            f"{run.folder}: the force chains are missing: run `dragchain chains {run.folder}`"
        )
    return series


def read_shown(series: FrameSeries) -> Iterator[ShownFrame]:
    """Read the frames of a series; errors are those of its iterator."""
    for data in series:
        assert data.network is not None and data.membership is not None
        assert data.contacts is not None and data.workpiece is not None
        kept = _near(data.network, data.workpiece[0])
        place = np.full(kept.size, -1, dtype=np.int64)
        place[kept] = np.arange(kept.sum())
        a, inner = place[data.network.a], data.network.between_particles()
        bodies = BODIES + data.contacts["b_id"].to_numpy(np.int64)
        b = np.where(inner, place[data.network.b], bodies)
        rows = np.flatnonzero((a >= 0) & (b >= 0))
        chain = data.membership
        flags = (
            QUASI_LINEAR * (chain.contact_peters > 0)
            + PATH * (chain.contact_paths > 0)
            + DOMINANT * chain.contact_dominant
        )
        yield ShownFrame(data, np.flatnonzero(kept), rows, a[rows], b[rows], flags[rows])


def _near(frame: NetworkFrame, workpiece_m: Floats) -> NDArray[np.bool_]:
    """The `MOST_PARTICLES` particles that are nearest to the workpiece's axis, (N,) bool."""
    away = np.hypot(*(frame.centre[:, :2] - workpiece_m[:2]).T)
    if away.size <= MOST_PARTICLES:
        return np.ones(away.size, dtype=bool)
    return np.asarray(away < np.partition(away, MOST_PARTICLES)[MOST_PARTICLES])
