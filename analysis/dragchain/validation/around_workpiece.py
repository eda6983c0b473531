"""What the source says of forces around the workpiece, each statement with a number.

The statements of Uhlmann et al. (2015), section 5 and figure 4, that a number
can test: forces ahead of the workpiece are above those behind; the active zone
reaches far ahead; contact forces grow with depth; contacts are most intense at
the front; surfaces that point to the bowl's boundary carry marks.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from dragchain.drag.around import AZIMUTH_BINS, DEPTH_BINS
from dragchain.drag.azimuth import circumference, parts, to_the_left, within
from dragchain.drag.force import read_counted
from dragchain.errors import TableError
from dragchain.run.case import Case, Circle, Workpiece
from dragchain.statistics.estimate import estimate_columns
from dragchain.tables.by_step import read_groups, read_table
from dragchain.validation.runs_by_bed import Point, over_packings

Found = dict[str, Any]

CORRIDOR = 1.0
"""Half width of the corridor along the motion beyond the workpiece's radius, in particle
diameters."""

BIN = 0.5
"""Length of a bin along the corridor, in particle diameters."""

FAR_SIDE = 2.0 * np.pi / 3.0
"""The bed far from the workpiece: seen from the bowl's axis, more than 120 degrees away from it."""

FRONT = np.pi / 4.0
"""The front of the workpiece: azimuths within 45 degrees of the motion."""


def of_packings(packings: Sequence[Point]) -> Found:
    """Every statement with its numbers over the fills."""
    around = [_around_workpiece(point) for point in packings]
    corridors = [_corridor(point) for point in packings]
    return {
        "packings": len(packings),
        "ahead_behind": _together(around, "ratio", ratio=True),
        "fraction_ahead": _together(around, "fraction_ahead"),
        "depth_slope_n_per_m": _together(around, "slope"),
        "deep_over_shallow": _together(around, "deep_over_shallow", ratio=True),
        "front_fraction": _together(around, "front_fraction"),
        "front_contact_n": _together(around, "front_contact_n"),
        "flank_contact_n": _together(around, "flank_contact_n"),
        "front_over_flank": _together(around, "front_over_flank", ratio=True),
        "outer_over_inner": _together(around, "outer_over_inner", ratio=True),
        "azimuth": _profile(around, "azimuth"),
        "depth": _profile(around, "depth"),
        "network": _network(corridors),
    }


def _together(rows: Sequence[Found], name: str, *, ratio: bool = False) -> Found | None:
    values = [row[name] for row in rows]
    return None if None in values else over_packings(values, ratio=ratio).as_json()


def _profile(rows: Sequence[Found], name: str) -> Found:
    """A curve a fill, averaged bin by bin; the bins are those of the first fill."""
    curves = np.array([row[name]["value"] for row in rows])
    found = [over_packings(column.tolist()) for column in curves.T]
    return {"edges": rows[0][name]["edges"], **estimate_columns(found)}


# --- contacts on the workpiece --------------------------------------------------------------------


def _around_workpiece(point: Point) -> Found:
    columns = ["azimuth_rad", "depth_m", "normal_force_n", "in_statistics"]
    table = read_table(point.folder / "tables" / "workpiece_contacts.parquet", columns)
    table = table[table["in_statistics"] & (table["normal_force_n"] > 0.0)]
    azimuth, depth, force = (
        table[name].to_numpy(np.float64) for name in ("azimuth_rad", "depth_m", "normal_force_n")
    )
    ahead = float((force * within(azimuth, np.pi / 2)).sum() / force.sum())
    immersion = _workpiece(point.case).immersion_depth_m
    levels = np.linspace(0.0, immersion, DEPTH_BINS + 1)
    counts, _ = np.histogram(depth, levels)
    sums, _ = np.histogram(depth, levels, weights=force)
    return {
        "ratio": _over(ahead, 1.0 - ahead),
        "fraction_ahead": ahead,
        "slope": float(np.polyfit(depth, force, 1)[0]),
        "deep_over_shallow": _mean(force[depth > 2.0 / 3.0 * immersion])
        / _mean(force[depth < immersion / 3.0]),
        **_front(azimuth, force),
        "outer_over_inner": _outer_over_inner(point.case, azimuth, force),
        "azimuth": {
            "edges": circumference(AZIMUTH_BINS).tolist(),
            "value": _around(azimuth, force).tolist(),
        },
        "depth": {"edges": levels.tolist(), "value": (sums / np.maximum(counts, 1)).tolist()},
    }


def _workpiece(case: Case) -> Workpiece:
    if case.workpiece is None:
        raise TableError(f"{case.run}: case.json has no workpiece, which the statements are about")
    return case.workpiece


def _mean(values: Floats) -> float:
    return float(values.mean()) if values.size else float("nan")


def _around(azimuth: Floats, force: Floats) -> Floats:
    """Share of the force in each part of the circumference."""
    halves = [np.bincount(part, force, AZIMUTH_BINS) for part in parts(azimuth, AZIMUTH_BINS)]
    return np.asarray(sum(halves) / (2.0 * force.sum()))


def _front(azimuth: Floats, force: Floats) -> Found:
    """The front quarter of the workpiece against its two flanks, of a quarter together."""
    front = within(azimuth, FRONT)
    flank = within(azimuth, 2 * FRONT) - front
    in_front, at_flanks = float((force * front).sum()), float((force * flank).sum())
    return {
        "front_fraction": in_front / float(force.sum()),
        "front_contact_n": _over(in_front, float(front.sum())),
        "flank_contact_n": _over(at_flanks, float(flank.sum())),
        "front_over_flank": _over(in_front, at_flanks),
    }


def _over(one: float, other: float) -> float:
    return one / other if other else float("nan")


def _outer_over_inner(case: Case, azimuth: Floats, force: Floats) -> float | None:
    """Normal force on the half that points away from the bowl's axis over that on the other."""
    if not isinstance(case.motion, Circle):
        return None
    left = float((force * to_the_left(azimuth)).sum() / force.sum())
    outer = left if case.motion.sign < 0 else 1.0 - left
    return _over(outer, 1.0 - outer)


# --- the network around the workpiece -------------------------------------------------------------


@dataclass(frozen=True)
class _Corridor:
    """Mean normal force along the corridor, bin by bin from the workpiece's surface."""

    edges: Floats
    ahead: Floats
    behind: Floats
    far: float
    wall: float


def _corridor(point: Point) -> _Corridor:
    """The network's contacts ahead of the workpiece and behind it, within its depth.

    Bins end where the first of both directions meets the bowl; ``wall`` is the distance from the
    workpiece's surface to the bowl along the motion, in particle diameters.
    """
    case = point.case
    if case.bowl is None or case.surface_m is None or not isinstance(case.motion, Circle):
        raise TableError(
            f"{case.run}: the corridor needs a workpiece on a circle about the bowl's axis"
        )
    diameter = 2.0 * case.media.radius_mean_m
    radius = _workpiece(case).radius_m
    wall = (np.sqrt(case.bowl.radius_m**2 - case.motion.radius_m**2) - radius) / diameter
    edges = np.arange(0.0, wall + 1e-9, BIN)
    tip = case.surface_m - _workpiece(case).immersion_depth_m
    ahead, behind = _Bins.of(edges), _Bins.of(edges)
    far: list[Floats] = []
    for contacts in _inner_contacts(point):
        z = contacts["point_z_m"].to_numpy(np.float64)
        within = (z > tip) & (z < case.surface_m)
        force = contacts["normal_force_n"].to_numpy(np.float64)
        along, across, turned = _relative(contacts)
        corridor = within & (np.abs(across) <= radius + CORRIDOR * diameter)
        distance = (np.abs(along) - radius) / diameter
        ahead.add(distance, force, corridor & (along > 0.0))
        behind.add(distance, force, corridor & (along < 0.0))
        far.append(force[within & (np.abs(turned) > FAR_SIDE)])
    return _Corridor(
        edges=edges,
        ahead=ahead.means(),
        behind=behind.means(),
        far=_mean(np.concatenate(far)),
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


def _relative(contacts: pd.DataFrame) -> tuple[Floats, Floats, Floats]:
    """Distance along and across the motion, and the angle about the bowl's axis."""
    x, y, ref_x, ref_y, heading = (
        contacts[name].to_numpy(np.float64)
        for name in ("point_x_m", "point_y_m", "ref_x_m", "ref_y_m", "direction_rad")
    )
    cos, sin = np.cos(heading), np.sin(heading)
    dx, dy = x - ref_x, y - ref_y
    turned = np.angle(np.exp(1j * (np.arctan2(y, x) - np.arctan2(ref_y, ref_x))))
    return dx * cos + dy * sin, dy * cos - dx * sin, turned


@dataclass(frozen=True)
class _Bins:
    """Sums and numbers of forces between edges, gathered piece by piece."""

    edges: Floats
    sums: Floats
    counts: Ints

    @classmethod
    def of(cls, edges: Floats) -> _Bins:
        return cls(edges, np.zeros(len(edges) - 1), np.zeros(len(edges) - 1, dtype=np.int64))

    def add(self, distance: Floats, force: Floats, chosen: np.ndarray[Any, Any]) -> None:
        """Add the chosen forces, one after the other."""
        number: Ints = np.digitize(distance[chosen], self.edges) - 1
        inside = (number >= 0) & (number < len(self.sums))
        np.add.at(self.sums, number[inside], force[chosen][inside])
        np.add.at(self.counts, number[inside], 1)

    def means(self) -> Floats:
        """Mean force between the edges, NaN where there is none."""
        with np.errstate(invalid="ignore"):
            return np.asarray(self.sums / self.counts)


def _network(corridors: Sequence[_Corridor]) -> Found:
    """Ahead against behind in the network, and how far ahead the workpiece is felt.

    The reach is the distance at which the force, straight between the middles of the
    bins, has fallen halfway to that of the bed far from the workpiece; where it never does
    before the bowl's wall, the wall is the answer and said to be a lower limit.
    """
    edges = corridors[0].edges
    ahead = np.array([one.ahead for one in corridors])
    behind = np.array([one.behind for one in corridors])
    far = [one.far for one in corridors]
    half = [_half_reach(one) for one in corridors]
    reached = [reach for reach in half if reach is not None]
    return {
        "edges_diameters": edges.tolist(),
        "wall_diameters": corridors[0].wall,
        "ahead_n": estimate_columns([over_packings(column.tolist()) for column in ahead.T]),
        "behind_n": estimate_columns([over_packings(column.tolist()) for column in behind.T]),
        "far_n": over_packings(far).as_json(),
        "ratio": over_packings(
            (ahead.mean(axis=1) / behind.mean(axis=1)).tolist(), ratio=True
        ).as_json(),
        "at_wall": over_packings((ahead[:, -1] / np.array(far)).tolist(), ratio=True).as_json(),
        "half_reach_diameters": over_packings(reached, ratio=True).as_json()
        if len(reached) == len(half)
        else None,
    }


def _half_reach(corridor: _Corridor) -> float | None:
    middle = 0.5 * (corridor.edges[1:] + corridor.edges[:-1])
    excess = (corridor.ahead - corridor.far) / (corridor.ahead[0] - corridor.far)
    below = np.flatnonzero(excess < 0.5)
    if not below.size:
        return None
    last = int(below[0])
    return float(np.interp(0.5, excess[[last, last - 1]], middle[[last, last - 1]]))
