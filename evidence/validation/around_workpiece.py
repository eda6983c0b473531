"""Contacts on the workpiece: where they press, and how hard.

The statements of Uhlmann et al. (2015), section 5 and figure 4, that these numbers test: forces
ahead of the workpiece are above those behind; contact forces grow with depth; contacts are most
intense at the front; surfaces that point to the bowl's boundary carry marks.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dragchain.arrays import Floats
from dragchain.drag.around import AZIMUTH_BINS, DEPTH_BINS
from dragchain.drag.azimuth import circumference, parts, to_the_left, within
from dragchain.run.kinematics import motion_of, needed
from dragchain.run.paths.circle import Circle
from dragchain.statistics.estimate import Estimate, EstimateColumns, Real
from dragchain.tables.by_step import read_table
from dragdeck.documents import Part
from dragdeck.records.case import CaseOfRun
from evidence.validation.corridor import Network, bin_by_bin, corridor, network
from evidence.validation.runs_by_bed import Point, over_packings

_FRONT = np.pi / 4.0
"""The front of the workpiece: azimuths within 45 degrees of the motion."""


@dataclass(frozen=True)
class Contacts:
    """Contacts on the workpiece of one packing.

    Attributes
    ----------
    ahead_behind, deep_over_shallow, front_over_flank : float
        Ratios: of the normal force ahead to that behind, of a contact's mean normal force in the
        deepest third to that in the shallowest, of the force on the front quarter to that on the
        two eighths beside it.
    outer_over_inner : float or None
        Ratio of the normal force on the half that points away from the bowl's axis to that on the
        other; None off a circle.
    fraction_ahead, front_fraction : float
        Fraction of the normal force ahead, and on the front quarter.
    front_contact_n, flank_contact_n : float
        Mean normal force of a contact there.
    depth_slope_n_per_m : float
        Slope of a contact's normal force over its depth.
    azimuth, depth : (bins,) ndarray
        Fraction of the force by azimuth; mean normal force of a contact by depth.
    depth_edges_m : (bins + 1,) ndarray
    """

    ahead_behind: float
    fraction_ahead: float
    depth_slope_n_per_m: float
    deep_over_shallow: float
    front_fraction: float
    front_contact_n: float
    flank_contact_n: float
    front_over_flank: float
    outer_over_inner: float | None
    azimuth: Floats
    depth: Floats
    depth_edges_m: Floats


class Profile(Part):
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
    """What the statements are tested by, over the packings: see `Contacts` and `Network`."""

    packings: int
    ahead_behind: Estimate
    fraction_ahead: Estimate
    depth_slope_n_per_m: Estimate
    deep_over_shallow: Estimate
    front_fraction: Estimate
    front_contact_n: Estimate
    flank_contact_n: Estimate
    front_over_flank: Estimate
    outer_over_inner: Estimate | None
    azimuth: Profile
    depth: Profile
    network: Network


_RATIOS = ("ahead_behind", "deep_over_shallow", "front_over_flank", "outer_over_inner")
"""Numbers that are averaged by their logarithms."""

_NUMBERS = (
    "fraction_ahead", "depth_slope_n_per_m", "front_fraction", "front_contact_n", "flank_contact_n",
    *_RATIOS,
)  # fmt: skip


def of_packings(packings: Sequence[Point]) -> Statements:
    """Every number over the packings."""
    around = [contacts_of(point) for point in packings]
    numbers = {name: _together([getattr(one, name) for one in around], name) for name in _NUMBERS}
    profiles = {
        "azimuth": _profile([one.azimuth for one in around], circumference(AZIMUTH_BINS)),
        "depth": _profile([one.depth for one in around], around[0].depth_edges_m),
    }
    corridors = network([corridor(point) for point in packings])
    return Statements.model_validate(
        {"packings": len(packings), **numbers, **profiles, "network": corridors}
    )


def _together(values: Sequence[float | None], name: str) -> Estimate | None:
    known = [value for value in values if value is not None]
    return over_packings(known, ratio=name in _RATIOS) if len(known) == len(values) else None


def _profile(curves: Sequence[Floats], edges: Floats) -> Profile:
    columns = bin_by_bin(np.array(curves))
    return Profile(edges=tuple(edges.tolist()), **vars(columns))


def contacts_of(point: Point) -> Contacts:
    """Measure the contacts with force on the workpiece of one packing.

    Raises
    ------
    TableError
        The case has no workpiece, or a table is missing.
    """
    columns = ["azimuth_rad", "depth_m", "normal_force_n", "in_statistics"]
    table = read_table(point.folder / "tables" / "workpiece_contacts.parquet", columns)
    table = table[table["in_statistics"] & (table["normal_force_n"] > 0.0)]
    azimuth, depth, force = (
        table[name].to_numpy(np.float64) for name in ("azimuth_rad", "depth_m", "normal_force_n")
    )
    ahead = float((force * within(azimuth, np.pi / 2)).sum() / force.sum())
    front = within(azimuth, _FRONT)
    flank = within(azimuth, 2 * _FRONT) - front
    in_front, at_flanks = float((force * front).sum()), float((force * flank).sum())
    immersion = needed(point.case.workpiece, "workpiece").immersion_depth_m
    levels = np.linspace(0.0, immersion, DEPTH_BINS + 1)
    counts, _ = np.histogram(depth, levels)
    sums, _ = np.histogram(depth, levels, weights=force)
    return Contacts(
        ahead_behind=_ratio(ahead, 1.0 - ahead),
        fraction_ahead=ahead,
        depth_slope_n_per_m=float(np.polyfit(depth, force, 1)[0]),
        deep_over_shallow=_mean(force[depth > 2.0 / 3.0 * immersion])
        / _mean(force[depth < immersion / 3.0]),
        front_fraction=in_front / float(force.sum()),
        front_contact_n=_ratio(in_front, float(front.sum())),
        flank_contact_n=_ratio(at_flanks, float(flank.sum())),
        front_over_flank=_ratio(in_front, at_flanks),
        outer_over_inner=_outer_over_inner(point.case, azimuth, force),
        azimuth=_around(azimuth, force),
        depth=sums / np.maximum(counts, 1),
        depth_edges_m=levels,
    )


def _mean(values: Floats) -> float:
    return float(values.mean()) if values.size else float("nan")


def _ratio(one: float, other: float) -> float:
    return one / other if other else float("nan")


def _around(azimuth: Floats, force: Floats) -> Floats:
    """Fraction of the force in each part of the circumference."""
    halves = [np.bincount(part, force, AZIMUTH_BINS) for part in parts(azimuth, AZIMUTH_BINS)]
    return np.asarray(sum(halves) / (2.0 * force.sum()))


def _outer_over_inner(case: CaseOfRun, azimuth: Floats, force: Floats) -> float | None:
    path = motion_of(case)
    if not isinstance(path, Circle):
        return None
    left = float((force * to_the_left(azimuth)).sum() / force.sum())
    outer = left if path.sign < 0 else 1.0 - left
    return _ratio(outer, 1.0 - outer)
