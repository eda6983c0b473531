"""Load, sliding and friction work on the workpiece along the counted path, and where they act."""

from pathlib import Path

import numpy as np

from dragchain.arrays import Floats
from dragchain.drag.azimuth import parts
from dragchain.loading.contact_events import Thresholds
from dragchain.loading.samples import Sampled, sample
from dragchain.run.case import Case
from dragchain.run.kinematics import needed

MAP_DEPTHS, MAP_AZIMUTHS = 4, 12
"""Bins of a load map: equal parts of the immersion depth, and of the circumference."""


def loading_along(run_dir: Path, case: Case, blocks: int) -> tuple[dict[str, Floats], Floats]:
    """Quantities of loading in each block of the path, and the load map.

    Parameters
    ----------
    run_dir : Path
        With the tables of a complete run.
    case : Case
    blocks : int
        Number of equal blocks B of the counted path.

    Returns
    -------
    blocks : dict of str to (B,) ndarray
        Normal load, N: the sum of the normal forces of all contacts; sliding distance of all
        contacts for a metre of path, m/m; normal force times sliding distance for a metre of path,
        N m/m; friction work for a metre of path, J/m.
    load_map : (MAP_DEPTHS, MAP_AZIMUTHS) ndarray
        Mean normal load by depth and azimuth, N.

    Raises
    ------
    TableError
        If the slip of the contacts is not known, or no particle touches the workpiece.
    """
    counted = sample(run_dir, case, Thresholds())
    block = np.arange(counted.frames) * blocks // counted.frames
    frames = np.bincount(block, minlength=blocks)

    def per_frame(name: str) -> Floats:
        sums = counted.per_frame(counted.rows[name])
        return np.asarray(np.bincount(block, sums, blocks) / frames)

    path_m = counted.path_m / counted.frames
    along = {
        "normal_load": per_frame("normal_impulse_n_s") / counted.interval_s,
        "sliding_distance": per_frame("sliding_m") / path_m,
        "force_slide": per_frame("force_slide_n_m") / path_m,
        "friction_work": per_frame("friction_work_j") / path_m,
    }
    return along, _load_map(counted, needed(case.workpiece, "workpiece").immersion_depth_m)


def _load_map(counted: Sampled, depth_m: float) -> Floats:
    rows = counted.rows
    level = np.floor(rows["depth_m"].to_numpy() / depth_m * MAP_DEPTHS).astype(np.int64)
    level = level.clip(0, MAP_DEPTHS - 1)
    load = rows["normal_impulse_n_s"].to_numpy() / (counted.frames * counted.interval_s)
    found = np.zeros((MAP_DEPTHS, MAP_AZIMUTHS))
    for half in parts(rows["azimuth_rad"].to_numpy(np.float64), MAP_AZIMUTHS):
        np.add.at(found, (level, half), load / 2.0)
    return found
