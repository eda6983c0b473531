"""The frames that the page shows."""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from dragchain.arrays import Floats
from dragchain.drag import drag_peaks, read_counted
from dragchain.errors import TableError
from dragchain.export.frames import FrameSeries
from dragchain.network.frame import BODY_NAMES, NetworkFrame
from dragchain.tables.columns import CENTRE
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
class Shown:
    """What is shown of F frames: the rows of all frames, one frame after another.

    Attributes
    ----------
    particles : DataFrame
        Rows of ``particles.parquet``, and ``frame``, 0 to F - 1.
    contacts : DataFrame
        Rows of ``contacts.parquet`` of which no particle is left out; ``frame``; ``a`` and ``b``,
        places of the particles in their frame, where a body that is no particle is its ``b_id``
        plus `BODIES`; and ``flags``, sums of `QUASI_LINEAR`, `PATH` and `DOMINANT`.
    poses : (F, 7) float
        The workpiece's reference point in m, and its orientation as a quaternion.
    most : int
        Particles of the frame that has most, with those that are left out.
    """

    particles: pd.DataFrame
    contacts: pd.DataFrame
    poses: Floats
    most: int

    def touching(self) -> pd.DataFrame:
        """The contacts on workpiece and bowl."""
        return self.contacts[self.contacts["b"] > BODIES - len(BODY_NAMES)]

    def reach_m(self) -> float:
        """How far the particles of the first frame are from the workpiece's axis, at most."""
        first = self.particles[self.particles["frame"] == 0][list(CENTRE)].to_numpy()
        return float(np.hypot(*(first - self.poses[0, :3])[:, :2].T).max())


def highest_peaks(run: Run) -> pd.DataFrame:
    """The peaks of the drag force in the counted stretch, the highest first, `PEAKS` at most.

    Raises
    ------
    SeriesError
        If the run is too short to have peaks.
    """
    peaks = drag_peaks(read_counted(run.folder, ("time_s", "drag_n")), run.case)
    peak_rows = pd.DataFrame({"time_s": peaks.time_s, "drag_n": peaks.drag_n})
    return peak_rows.nsmallest(PEAKS, "drag_n")


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
    network = run.table("network", ["step", "time_s"])
    steps, times = network["step"].to_numpy(np.int64), network["time_s"].to_numpy(np.float64)
    even = np.linspace(0, len(steps) - 1, min(FRAMES, len(steps))).round().astype(np.int64)
    nearest = np.abs(times[:, None] - peak_time_s).argmin(axis=0)
    rows = np.union1d(even, nearest)
    series = FrameSeries(run, steps[rows], times[rows])
    if not series.has_chains:
        raise TableError(
            f"{run.folder}: the force chains are missing: run `./run dragchain chains {run.folder}`"
        )
    return series


def read_shown(series: FrameSeries) -> Shown:
    """Read the frames of a series; errors are those of its iterator."""
    particles, contacts, poses, most = [], [], [], 0
    for number, data in enumerate(series):
        network, membership = data.network, data.membership
        assert network is not None and membership is not None
        assert data.contacts is not None and data.workpiece is not None
        kept, chain = _near(network, data.workpiece[0]), membership.contacts
        place = np.where(kept, np.cumsum(kept) - 1, -1)
        bodies = BODIES + data.contacts["b_id"].to_numpy(np.int64)
        shown = data.contacts.assign(
            frame=number,
            a=place[network.a],
            b=np.where(network.between_particles(), place[network.b], bodies),
            flags=QUASI_LINEAR * (chain["peters_chain"] > 0)
            + PATH * (chain["widest_paths"] > 0)
            + DOMINANT * chain["dominant"],
        )
        particles.append(data.particles[kept].assign(frame=number))
        contacts.append(shown[(shown["a"] >= 0) & (shown["b"] >= 0)])
        turn = Rotation.from_matrix(data.workpiece[1].matrices[0]).as_quat()
        poses.append([*data.workpiece[0], *turn])
        most = max(most, kept.size)
    return Shown(pd.concat(particles), pd.concat(contacts), np.array(poses), most)


def _near(frame: NetworkFrame, workpiece_m: Floats) -> NDArray[np.bool_]:
    """The `MOST_PARTICLES` particles that are nearest to the workpiece's axis, (N,) bool."""
    away = np.hypot(*(frame.centre[:, :2] - workpiece_m[:2]).T)
    if away.size <= MOST_PARTICLES:
        return np.ones(away.size, dtype=bool)
    return np.asarray(away < np.partition(away, MOST_PARTICLES)[MOST_PARTICLES])
