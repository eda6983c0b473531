"""The contact network ahead of the workpiece and behind it, in a corridor along the motion.

The statements of Uhlmann et al. (2015), section 5, that it tests: forces ahead of the workpiece are
above those behind, and the active zone reaches far ahead.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import binned_statistic

from dragchain.arrays import Floats
from dragchain.drag.force import read_counted
from dragchain.errors import TableError
from dragchain.run.kinematics import motion_of, needed
from dragchain.run.paths.circle import Circle
from dragchain.statistics.estimate import Estimate, EstimateColumns
from dragchain.tables.by_step import read_groups
from dragdeck.documents import Part
from evidence.validation.runs_by_bed import Point, over_packings

_WIDTH = 1.0
"""Half width of the corridor beyond the workpiece's radius, in particle diameters."""

_BIN = 0.5
"""Length of a bin along the corridor, in particle diameters."""

_FAR_SIDE = 2.0 * np.pi / 3.0
"""The bed far from the workpiece: seen from the bowl's axis, more than 120 degrees away from it."""


@dataclass(frozen=True)
class Corridor:
    """Mean normal force of the network's contacts, within the workpiece's depth.

    Attributes
    ----------
    edges : (bins + 1,) ndarray
        Distances from the workpiece's surface in particle diameters; bins end where the first of
        both directions meets the bowl.
    ahead, behind : (bins,) ndarray
    far : float
        In the bed far from the workpiece.
    wall : float
        Distance from the workpiece's surface to the bowl along the motion in particle diameters.
    """

    edges: Floats
    ahead: Floats
    behind: Floats
    far: float
    wall: float

    @property
    def half_reach(self) -> float | None:
        """Distance at which the force has fallen halfway to that far away; None if nowhere.

        The force is straight between the middles of the bins.
        """
        middle = 0.5 * (self.edges[1:] + self.edges[:-1])
        excess = (self.ahead - self.far) / (self.ahead[0] - self.far)
        below = np.flatnonzero(excess < 0.5)
        if not below.size:
            return None
        last = int(below[0])
        return float(np.interp(0.5, excess[[last, last - 1]], middle[[last, last - 1]]))


class Network(Part):
    """The corridor over the packings.

    Attributes
    ----------
    edges_diameters, wall_diameters, ahead_n, behind_n, far_n
        As of `Corridor`.
    ratio, at_wall : Estimate
        Ratios of the mean contact force: ahead to behind; at the bowl's wall ahead to far away.
    half_reach_diameters : Estimate or None
        See `Corridor.half_reach`; None unless every packing has it.
    """

    edges_diameters: tuple[float, ...]
    wall_diameters: float
    ahead_n: EstimateColumns
    behind_n: EstimateColumns
    far_n: Estimate
    ratio: Estimate
    at_wall: Estimate
    half_reach_diameters: Estimate | None


def network(corridors: Sequence[Corridor]) -> Network:
    """Average the corridors of the packings."""
    ahead = np.array([one.ahead for one in corridors])
    behind = np.array([one.behind for one in corridors])
    far = [one.far for one in corridors]
    reaches = [one.half_reach for one in corridors]
    reached = [reach for reach in reaches if reach is not None]
    ratios = (ahead.mean(axis=1) / behind.mean(axis=1)).tolist()
    at_wall = (ahead[:, -1] / np.array(far)).tolist()
    return Network(
        edges_diameters=tuple(corridors[0].edges.tolist()),
        wall_diameters=corridors[0].wall,
        ahead_n=bin_by_bin(ahead),
        behind_n=bin_by_bin(behind),
        far_n=over_packings(far),
        ratio=over_packings(ratios, ratio=True),
        at_wall=over_packings(at_wall, ratio=True),
        half_reach_diameters=(
            over_packings(reached, ratio=True) if len(reached) == len(reaches) else None
        ),
    )


def bin_by_bin(curves: Floats) -> EstimateColumns:
    """The mean over packings of a curve per packing, (packings, bins)."""
    return EstimateColumns.of([over_packings(column.tolist()) for column in curves.T])


def corridor(point: Point) -> Corridor:
    """The network's contacts ahead of the workpiece and behind it, within its depth.

    Raises
    ------
    TableError
        The workpiece does not run on a circle about the bowl's axis.
    """
    case = point.case
    path = motion_of(case)
    if case.surface_m is None or not isinstance(path, Circle):
        raise TableError(
            f"{case.run}: the corridor needs a workpiece on a circle about the bowl's axis"
        )
    workpiece, diameter = needed(case.workpiece, "workpiece"), 2.0 * case.media.radius_mean_m
    radius = workpiece.radius_m
    wall = (np.sqrt(case.bowl.radius_m**2 - path.radius_m**2) - radius) / diameter
    edges = np.arange(0.0, wall + 1e-9, _BIN)
    tip = case.surface_m - workpiece.immersion_depth_m
    places: list[Floats] = []
    far: list[Floats] = []
    for contacts in _inner_contacts(point):
        z = contacts["point_z_m"].to_numpy(np.float64)
        inside = (z > tip) & (z < case.surface_m)
        force = contacts["normal_force_n"].to_numpy(np.float64)
        along, across, turned = relative_places(contacts)
        near = inside & (np.abs(across) <= radius + _WIDTH * diameter)
        places.append(np.stack([along[near], force[near]]))
        far.append(force[inside & (np.abs(turned) > _FAR_SIDE)])
    beyond, (along, force) = np.concatenate(far), np.concatenate(places, axis=1)
    distance = (np.abs(along) - radius) / diameter
    ahead, behind = (
        np.asarray(binned_statistic(distance[side], force[side], "mean", edges).statistic, float)
        for side in (along > 0.0, along < 0.0)
    )
    return Corridor(
        edges=edges,
        ahead=ahead,
        behind=behind,
        far=float(beyond.mean()) if beyond.size else np.nan,
        wall=float(wall),
    )


def _inner_contacts(point: Point) -> Iterator[pd.DataFrame]:
    """Counted contacts between particles, with place and heading of the workpiece in their frame.

    They come a row group of the table at a time.
    """
    workpiece = read_counted(point.folder, ("step", "ref_x_m", "ref_y_m", "direction_rad"))
    columns = ["step", "b_id", "point_x_m", "point_y_m", "point_z_m", "normal_force_n"]
    for rows in read_groups(point.folder / "tables" / "contacts.parquet", columns):
        yield rows[rows["b_id"] > 0].merge(workpiece, on="step")


def relative_places(contacts: pd.DataFrame) -> tuple[Floats, Floats, Floats]:
    """Distance along and across the motion, m, and the angle about the bowl's axis."""
    x, y, ref_x, ref_y, heading = (
        contacts[name].to_numpy(np.float64)
        for name in ("point_x_m", "point_y_m", "ref_x_m", "ref_y_m", "direction_rad")
    )
    cos, sin = np.cos(heading), np.sin(heading)
    dx, dy = x - ref_x, y - ref_y
    turned = np.angle(np.exp(1j * (np.arctan2(y, x) - np.arctan2(ref_y, ref_x))))
    return dx * cos + dy * sin, dy * cos - dx * sin, turned
