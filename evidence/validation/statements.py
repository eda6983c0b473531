"""Contacts on the workpiece and in the network about it: tests of the source's statements.

The statements of Uhlmann et al. (2015), section 5 and figure 4: forces ahead of the workpiece are
above those behind, and the active zone reaches far ahead; contact forces grow with depth; contacts
are most intense at the front; surfaces that point to the bowl's boundary carry marks.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import binned_statistic

from dragchain.arrays import Floats
from dragchain.drag import (
    AZIMUTH_BINS,
    DEPTH_BINS,
    circumference,
    parts,
    read_counted,
    to_the_left,
    within_angle,
)
from dragchain.errors import TableError
from dragchain.run.kinematics import motion_of, needed
from dragchain.statistics.estimate import Estimate, EstimateColumns, Real, Verdict
from dragchain.tables.by_step import read_groups, read_table
from dragdeck.documents import Part
from dragdeck.records.case import CaseOfRun
from dragdeck.study.paths.circle import CirclePath
from evidence.validation.runs import MeasuredRun, packing_mean

# --- the network in a corridor along the motion ------------------------------------------------

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
    """The corridor over the packings; see `Corridor`."""

    edges_diameters: tuple[float, ...]
    wall_diameters: float
    ahead_n: EstimateColumns
    behind_n: EstimateColumns


def network_numbers(corridor: Corridor) -> dict[str, float | None]:
    """Numbers of a corridor, as of `Statements`."""
    return {
        "network_ratio": float(corridor.ahead.mean() / corridor.behind.mean()),
        "network_at_wall": float(corridor.ahead[-1]) / corridor.far,
        "far_n": corridor.far,
        "half_reach_diameters": corridor.half_reach,
    }


def bin_by_bin(curves: Floats) -> EstimateColumns:
    """The mean over packings of a curve per packing, (packings, bins)."""
    return EstimateColumns.of([packing_mean(column.tolist()) for column in curves.T])


def corridor(run: MeasuredRun) -> Corridor:
    """The network's contacts ahead of the workpiece and behind it, within its depth.

    Raises
    ------
    TableError
        The workpiece does not run on a circle about the bowl's axis.
    """
    case = run.case
    path = motion_of(case).motion.path
    if case.bowl is None or case.surface_m is None or not isinstance(path, CirclePath):
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
    for contacts in _inner_contacts(run):
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


def _inner_contacts(run: MeasuredRun) -> Iterator[pd.DataFrame]:
    """Counted contacts between particles, with place and heading of the workpiece in their frame.

    They come a row group of the table at a time.
    """
    workpiece = read_counted(run.folder, ("step", "ref_x_m", "ref_y_m", "direction_rad"))
    columns = ["step", "b_id", "point_x_m", "point_y_m", "point_z_m", "normal_force_n"]
    for rows in read_groups(run.folder / "tables" / "contacts.parquet", columns):
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


# --- contacts on the workpiece -----------------------------------------------------------------

_FRONT = np.pi / 4.0
"""The front of the workpiece: azimuths within 45 degrees of the motion."""


@dataclass(frozen=True)
class Around:
    """Contacts on the workpiece of one packing.

    Attributes
    ----------
    numbers : mapping of str to float or None
        As of `Statements`, which has them over the packings.
    azimuth, depth : (bins,) ndarray
        Fraction of the force by azimuth; mean normal force of a contact by depth.
    depth_edges_m : (bins + 1,) ndarray
    """

    numbers: Mapping[str, float | None]
    azimuth: Floats
    depth: Floats
    depth_edges_m: Floats


class PackingProfile(Part):
    """A curve per packing, averaged bin by bin; the bins are those of the first packing."""

    edges: tuple[float, ...]
    value: tuple[Real, ...]
    ci95_low: tuple[Real, ...]
    ci95_high: tuple[Real, ...]

    @property
    def columns(self) -> EstimateColumns:
        """The values without their bins."""
        return EstimateColumns(self.value, self.ci95_low, self.ci95_high)


class Statements(Part):
    """What the statements are tested by, over the packings.

    Attributes
    ----------
    numbers : mapping of str to Estimate or None
        None unless every packing has the number.

        ``ahead_behind``, ``deep_over_shallow``, ``front_over_flank``: ratios of the normal force
        ahead to that behind, of a contact's mean normal force in the deepest third to that in the
        shallowest, of the force on the front quarter to that on the two eighths beside it.
        ``outer_over_inner``: ratio of the normal force on the half that points away from the bowl's
        axis to that on the other, on a circle.
        ``fraction_ahead``, ``front_fraction``: fraction of the normal force ahead, and on the front
        quarter. ``front_contact_n``, ``flank_contact_n``: mean normal force of a contact there.
        ``depth_slope_n_per_m``: slope of a contact's normal force over its depth.
        ``network_ratio``, ``network_at_wall``: ratios of the mean contact force of the corridor,
        ahead to behind, and at the bowl's wall ahead to far away. ``far_n``: that far away.
        ``half_reach_diameters``: see `Corridor.half_reach`.
    azimuth, depth : PackingProfile
        See `Around`.
    network : Network
    """

    packings: int
    numbers: Mapping[str, Estimate | None]
    azimuth: PackingProfile
    depth: PackingProfile
    network: Network


_NO_RATIOS = (
    *("fraction_ahead", "front_fraction", "front_contact_n", "flank_contact_n"),
    *("depth_slope_n_per_m", "far_n"),
)
"""Numbers that are averaged as they are, the others by their logarithms."""


def of_packings(packings: Sequence[MeasuredRun]) -> Statements:
    """Every number over the packings."""
    around, corridors = [contacts_of(run) for run in packings], [corridor(run) for run in packings]
    numbers_of_each = [
        {**packing.numbers, **network_numbers(corridor)}
        for packing, corridor in zip(around, corridors, strict=True)
    ]
    return Statements(
        packings=len(packings),
        numbers={
            name: _together(name, [numbers[name] for numbers in numbers_of_each])
            for name in numbers_of_each[0]
        },
        azimuth=_profile([packing.azimuth for packing in around], circumference(AZIMUTH_BINS)),
        depth=_profile([packing.depth for packing in around], around[0].depth_edges_m),
        network=Network(
            edges_diameters=tuple(corridors[0].edges.tolist()),
            wall_diameters=corridors[0].wall,
            ahead_n=bin_by_bin(np.array([corridor.ahead for corridor in corridors])),
            behind_n=bin_by_bin(np.array([corridor.behind for corridor in corridors])),
        ),
    )


def _together(name: str, values: Sequence[float | None]) -> Estimate | None:
    """The mean over the packings; None unless every packing has the number."""
    known = [value for value in values if value is not None]
    ratio = name not in _NO_RATIOS
    return packing_mean(known, ratio=ratio) if len(known) == len(values) else None


def _profile(curves: Sequence[Floats], edges: Floats) -> PackingProfile:
    columns = bin_by_bin(np.array(curves))
    return PackingProfile(edges=tuple(edges.tolist()), **vars(columns))


def contacts_of(run: MeasuredRun) -> Around:
    """Measure the contacts with force on the workpiece of one packing.

    Raises
    ------
    TableError
        The case has no workpiece, or a table is missing.
    """
    columns = ["azimuth_rad", "depth_m", "normal_force_n", "in_statistics"]
    table = read_table(run.folder / "tables" / "workpiece_contacts.parquet", columns)
    table = table[table["in_statistics"] & (table["normal_force_n"] > 0.0)]
    azimuth, depth, force = (
        table[name].to_numpy(np.float64) for name in ("azimuth_rad", "depth_m", "normal_force_n")
    )
    ahead = float((force * within_angle(azimuth, np.pi / 2)).sum() / force.sum())
    front = within_angle(azimuth, _FRONT)
    flank = within_angle(azimuth, 2 * _FRONT) - front
    in_front, at_flanks = float((force * front).sum()), float((force * flank).sum())
    immersion = needed(run.case.workpiece, "workpiece").immersion_depth_m
    levels = np.linspace(0.0, immersion, DEPTH_BINS + 1)
    counts, _ = np.histogram(depth, levels)
    sums, _ = np.histogram(depth, levels, weights=force)
    numbers = {
        "ahead_behind": _ratio(ahead, 1.0 - ahead),
        "fraction_ahead": ahead,
        "depth_slope_n_per_m": float(np.polyfit(depth, force, 1)[0]),
        "deep_over_shallow": (
            _mean(force[depth > 2.0 / 3.0 * immersion]) / _mean(force[depth < immersion / 3.0])
        ),
        "front_fraction": in_front / float(force.sum()),
        "front_contact_n": _ratio(in_front, float(front.sum())),
        "flank_contact_n": _ratio(at_flanks, float(flank.sum())),
        "front_over_flank": _ratio(in_front, at_flanks),
        "outer_over_inner": _outer_over_inner(run.case, azimuth, force),
    }
    return Around(
        numbers=numbers,
        azimuth=_around(azimuth, force),
        depth=sums / np.maximum(counts, 1),
        depth_edges_m=levels,
    )


def _mean(values: Floats) -> float:
    return float(values.mean()) if values.size else float("nan")


def _ratio(first: float, other: float) -> float:
    return first / other if other else float("nan")


def _around(azimuth: Floats, force: Floats) -> Floats:
    """Fraction of the force in each part of the circumference."""
    halves = [np.bincount(part, force, AZIMUTH_BINS) for part in parts(azimuth, AZIMUTH_BINS)]
    return np.asarray(sum(halves) / (2.0 * force.sum()))


def _outer_over_inner(case: CaseOfRun, azimuth: Floats, force: Floats) -> float | None:
    path = motion_of(case).motion.path
    if not isinstance(path, CirclePath):
        return None
    left = float((force * to_the_left(azimuth)).sum() / force.sum())
    outer = left if path.sign < 0 else 1.0 - left
    return _ratio(outer, 1.0 - outer)


# --- the statements, each with its number and a verdict by one rule ----------------------------


class Claim(Part):
    """A statement and the number that tests it.

    Attributes
    ----------
    statement, number : str
        Their names; the page has the words.
    null : float
        The value of no effect; the statement says that the number is above it.
    unit : str
    verdict : str
        See `Estimate.exceeds`.
    estimate : Estimate
        The number over the packings.
    """

    statement: str
    number: str
    null: float
    unit: str
    verdict: Verdict
    estimate: Estimate


_CLAIMS = (
    ("ahead_above_behind", "ahead_behind", 1.0, ""),
    ("network_ahead_above_behind", "network_ratio", 1.0, ""),
    ("active_zone_reaches_far", "network_at_wall", 1.0, ""),
    ("forces_grow_with_depth", "depth_slope_n_per_m", 0.0, "N/m"),
    ("forces_grow_with_depth", "deep_over_shallow", 1.0, ""),
    ("most_intense_at_front", "front_over_flank", 1.0, ""),
    ("outer_surfaces_hit_hardest", "outer_over_inner", 1.0, ""),
)
"""Statements of Uhlmann et al. (2015): name, number that tests it, no effect, unit."""


def claims(statements: Statements) -> tuple[Claim, ...]:
    """The statements that have a number here."""
    return tuple(
        Claim(
            statement=statement,
            number=number,
            null=null,
            unit=unit,
            verdict=estimate.exceeds(null),
            estimate=estimate,
        )
        for statement, number, null, unit in _CLAIMS
        if (estimate := statements.numbers[number]) is not None
    )


def claim_table(rows: tuple[Claim, ...]) -> pd.DataFrame:
    """The claims as a table, one row per number."""
    known = [dict(row) | vars(row.estimate) for row in rows]
    return pd.DataFrame(known).drop(columns=["estimate", "reliable"])
