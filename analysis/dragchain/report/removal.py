"""Removal from a workpiece: what the loads of its packings and the coefficient of a law predict.

The scatter of the load and the uncertainty of the coefficient are kept apart, and joined by the
approximation of Welch (1947) and Satterthwaite (1946); coverage in simulated processes stands in
``docs/data/loading/removal_coverage.csv``.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike
from scipy.special import stdtrit

from dragchain.arrays import Floats
from dragchain.errors import TableError
from dragchain.loading.wear import TOUCH_QUANTITIES, TouchesOfRun, Wear
from dragchain.report.cases import ReportedCase
from dragchain.run.kinematics import axis_speed
from dragchain.statistics.correlated import SLOW_WAVES
from dragchain.statistics.estimate import (
    CONFIDENCE,
    NORMAL_QUANTILE,
    Estimate,
    mean_of,
    student_quantile,
)
from dragchain.statistics.noisy_map import MapSpread, map_spread
from dragdeck.study.removal import Removal, TrialsFit, fit_trials

UM_PER_H = 3600e6
"""A depth per time in micrometres per hour over that in m/s."""

_ROUNDED_S = 1800.0
"""Time after which the radius of an edge is reported."""


def joined_half_width(
    scatter: ArrayLike, known: ArrayLike, degrees: float, known_degrees: float = math.inf
) -> Floats:
    """Half-widths of 95 % intervals, (...,), of two errors with such degrees of freedom, as one.

    With few degrees, the approximation adds too many: not narrower than either alone.
    """
    parts = (np.asarray(scatter), degrees), (np.asarray(known), known_degrees)
    squares = [(half / student_quantile(of)) ** 2 for half, of in parts]
    total = np.maximum(sum(squares), 1e-120)
    with np.errstate(divide="ignore"):
        both = total**2 / sum(term**2 / of for term, (_, of) in zip(squares, parts, strict=True))
    half = stdtrit(both, 0.5 + CONFIDENCE / 2) * total**0.5
    return np.asarray(np.maximum(np.maximum(half, scatter), known))


class Parted(NamedTuple):
    """A positive number with the relative half-widths of its two 95 % intervals.

    `degrees`, `coefficient_degrees`: degrees of freedom of that by the scatter of the load, and of
    that by the coefficient.
    """

    value: float
    scatter: float
    coefficient: float
    degrees: float = math.inf
    coefficient_degrees: float = math.inf

    def within(self, half: float) -> Estimate:
        """With an interval of this relative half-width, not below zero."""
        return Estimate(self.value, self.value * max(0.0, 1 - half), self.value * (1 + half))

    @property
    def combined(self) -> Estimate:
        """With both together."""
        return self.within(float(joined_half_width(*self[1:])))

    def times(self, factor: float) -> "Parted":
        """A multiple."""
        return self._replace(value=factor * self.value)


def predict(
    removal: Removal, action_w: Estimate, density_kg_m3: float, degrees: float = math.inf
) -> tuple[Parted, Parted]:
    """The coefficient, m2/N, and the removed volume per time, m3/s.

    The volume that a trial of the same process has lost does not depend on the simulated load; the
    coefficient does then, and otherwise the volume. `degrees` are those of the interval of the
    action.
    """
    load = action_w.relative_half_width
    if fit := fit_trials(removal):
        half = student_quantile(fit.degrees) * fit.error
        rate = Parted(fit.rate_kg_s / density_kg_m3, 0.0, half, coefficient_degrees=fit.degrees)
        return rate._replace(value=rate.value / action_w.value, scatter=load, degrees=degrees), rate
    value = removal.coefficient_m2_n or math.nan
    half = NORMAL_QUANTILE * (removal.sd_m2_n or 0.0) / value
    return Parted(value, 0.0, half), Parted(value * action_w.value, load, half, degrees)


def patch_means(densities: Floats, errors: Floats) -> tuple[Floats, Floats, int]:
    """Means over P packings of (P, M) values, their standard errors, and degrees of freedom.

    Between packings; of one packing by its own standard errors, (P, M).
    """
    packings = len(densities)
    if packings == 1:
        return densities[0], errors[0], SLOW_WAVES
    error = densities.std(axis=0, ddof=1) / math.sqrt(packings)
    return densities.mean(axis=0), error, packings - 1


@dataclass(frozen=True)
class RemovalOfCase:
    """The removal of a case.

    Attributes
    ----------
    removal : Removal
    fit : TrialsFit or None
        To the trials, if there are any.
    edges : sequence of (str, Estimate or None, Estimate or None)
        Of each band along sharp edges: its distances in mm, depth per hour and, after half an
        hour, the radius of the edge, both in micrometres; None where there is no surface.
    edge_length_m : float
    facets : DataFrame
        ``area_m2``, ``immersed``, and of the patch of each facet the depth of removal per time
        ``depth_m_s``, its standard error by the scatter of the load ``depth_m_s_se``, and the ends
        of its combined 95 % interval; in each row the settings of the run, and whether windows
        corrected the load.
    impact_share : Estimate
        Part of the removal that comes from impacts.
    depth_um_h, mass_mg_h, coefficient_m2_n : Parted
        Mean depth over the immersed surface and mass loss per process time, and the coefficient.
    variation : (float, float)
        Coefficient of variation of the depth over the immersed area, and that without the scatter.
    wears : sequence of Wear
        Of the packings.
    """

    removal: Removal
    fit: TrialsFit | None
    edges: Sequence[tuple[str, Estimate | None, Estimate | None]]
    edge_length_m: float
    facets: pd.DataFrame
    impact_share: Estimate
    depth_um_h: Parted
    mass_mg_h: Parted
    coefficient_m2_n: Parted
    variation: tuple[float, float]
    wears: Sequence[Wear]

    @cached_property
    def spread(self) -> MapSpread:
        """The spread of the depth over the immersed area, relative to its mean."""
        immersed = np.flatnonzero(self.wears[0].immersed)
        maps = ([wear.patch_w_m2, wear.patch_se_w_m2] for wear in self.wears)
        values, errors = np.swapaxes(np.array(list(maps))[..., immersed], 0, 1)
        areas, patch = np.array(self.wears[0].area_m2), np.array(self.wears[0].patch)
        return map_spread(values, errors, areas[immersed], patch[immersed])

    @property
    def percentiles_um_h(self) -> tuple[Estimate, Estimate]:
        """Depths below which 5 % and 95 % of the immersed area stay; NaN if not available."""
        mean, half = self.depth_um_h.value, self.depth_um_h.combined.relative_half_width
        low, high = (
            Estimate(
                mean * end.value,
                mean * max(0.0, end.value - math.hypot(end.value - end.ci95_low, half * end.value)),
                mean * (end.value + math.hypot(end.ci95_high - end.value, half * end.value)),
            )
            for end in self.spread.percentiles
        )
        return low, high

    @property
    def minutes(self) -> Mapping[str, Estimate]:
        """Minutes to the target depth, on average and where it takes longest; NaN if not known."""
        target_um = 1e6 * (self.removal.target_depth_m or 0.0)
        if not target_um:
            return {}
        rates = {
            "mean depth": self.depth_um_h.combined,
            "95 % of the immersed area": self.percentiles_um_h[0],
        }
        return {name: _time_to(target_um, rate) for name, rate in rates.items()}


def _time_to(depth_um: float, um_h: Estimate) -> Estimate:
    """Minutes to a depth; without limit if the depth per time may be zero."""
    ends = (um_h.value, um_h.ci95_high, um_h.ci95_low)
    return Estimate(*(60 * depth_um / end if end else math.inf for end in ends))


def removal_of(case: ReportedCase) -> RemovalOfCase | None:
    """The removal of a case whose study has a law, None if it has none.

    Raises
    ------
    TableError
        If a run of it lacks ``wear.json``, or nothing that the law reads has happened.
    """
    first, load = case.first.process.case, case.values.of("force_slide")
    study = case.first.process.study
    removal, wears = study.removal, [study.wear for study in case.studies if study.wear]
    if removal is None or load is None:
        return None
    folder, factor = case.first.process.folder, 1.0
    if len(wears) < len(case.studies):
        raise TableError(f"{folder}: no wear.json: make it with: ./run dragchain loading {folder}")
    action = _over_packings([wear.action_w for wear in wears])
    if not removal.laws[-1].impact:  # of impacts, windows give nothing
        factor = load.shown.value / load.run.value
        action = load.shown.over(first.fidelity.speed_factor / axis_speed(first))
    if not action.value:
        raise TableError(f"{folder}: the law {removal.law} finds no action: use a longer path or a "
                         "larger outputs.first_touch_fraction")  # fmt: skip
    density = study.materials[study.workpiece.material].density_kg_m3
    between = len(wears) > 1 and not load.corrected
    degrees = len(wears) - 1 if between else math.inf
    coefficient, rate = predict(removal, action, density, degrees)
    facets = _facets(wears, coefficient.value * factor, rate)
    immersed = facets[facets["immersed"]]
    _, variation = depth_spread(immersed)
    removed = facets["depth_m_s"] * facets["area_m2"]
    share = float(removed[facets["immersed"]].sum() / removed.sum())
    edges = wears[0].edges
    return RemovalOfCase(
        removal=removal,
        fit=fit_trials(removal),
        edges=() if removal.laws[0].impact else edge_rows(wears, coefficient.value * factor, rate),
        edge_length_m=edges.length_m if edges else 0.0,
        facets=facets.assign(
            youngs_modulus_scale=first.fidelity.youngs_modulus_scale,
            timestep_fraction=first.fidelity.timestep_fraction,
            speed_factor=first.fidelity.speed_factor,
            corrected=load.corrected and not removal.laws[-1].impact,
        ),
        impact_share=_over_packings([wear.impact_share for wear in wears]),
        depth_um_h=rate.times(UM_PER_H * share / float(immersed["area_m2"].sum())),
        mass_mg_h=rate.times(UM_PER_H * density),
        coefficient_m2_n=coefficient,
        variation=variation,
        wears=wears,
    )


def depth_spread(facets: pd.DataFrame) -> tuple[float, tuple[float, float]]:
    """Mean depth over facets, um/h, and coefficients of variation (`RemovalOfCase`)."""
    depth, error, area = facets[["depth_m_s", "depth_m_s_se", "area_m2"]].to_numpy(np.float64).T
    mean = float(np.average(depth, weights=area))
    square, scatter = (float(np.average(x**2, weights=area)) for x in (depth - mean, error))
    variation = (math.sqrt(square) / mean, math.sqrt(max(0.0, square - scatter)) / mean)
    return UM_PER_H * mean, variation


def _facets(wears: Sequence[Wear], scale: float, rate: Parted) -> pd.DataFrame:
    """The map of the depth of removal per time; see `RemovalOfCase` and `edge_rows`."""
    maps = [np.array([wear.patch_w_m2, wear.patch_se_w_m2]) for wear in wears]
    densities, errors = scale * np.swapaxes(maps, 0, 1)
    mean, error, degrees = patch_means(densities, errors)
    half = joined_half_width(
        student_quantile(degrees) * error,
        mean * rate.coefficient,
        degrees,
        rate.coefficient_degrees,
    )
    columns = {
        "area_m2": wears[0].area_m2,
        "immersed": wears[0].immersed,
        "depth_m_s": mean,
        "depth_m_s_se": error,
        "depth_ci95_low_m_s": np.maximum(mean - half, 0.0),
        "depth_ci95_high_m_s": mean + half,
    }
    return pd.DataFrame(columns)


def _over_packings(values: Sequence[Estimate]) -> Estimate:
    return values[0] if len(values) == 1 else mean_of([value.value for value in values])


def edge_rows(
    wears: Sequence[Wear], scale: float, rate: Parted
) -> list[tuple[str, Estimate | None, Estimate | None]]:
    """The bands along sharp edges but the last; see `RemovalOfCase`.

    By volume balance, what is removed nearer to the edge than the far side of a band beyond the
    depth of the next band rounds it: an edge of the interior angle b with the radius r lacks
    ``r^2 (1/tan(b/2) - (pi - b)/2)``. Where that is not significantly above zero, the radius is an
    upper limit: its interval starts at zero. `scale` is the removed volume per action, m2/N, and
    the uncertainty of the coefficient that of `rate`.
    """
    bands = [wear.edges for wear in wears if wear.edges]
    if not bands:
        return []
    edges, degrees = bands[0], len(bands) - 1 or math.inf

    def removed(columns: str, band: int, per: float) -> Estimate | None:
        action = _over_packings([getattr(edges, columns).at(band) for edges in bands])
        if not per or math.isnan(action.value):
            return None
        known = abs(action.value) * rate.coefficient
        half = joined_half_width(action.half_width, known, degrees, rate.coefficient_degrees)
        return Estimate.around(action.value, float(half)).over(per / scale)

    lacks = 1 / math.tan(edges.angle_rad / 2) - (math.pi - edges.angle_rad) / 2
    rows = list[tuple[str, Estimate | None, Estimate | None]]()
    for band, (near, far) in enumerate(pairwise(edges.distance_m[:-1])):
        depth = removed("action_w", band, edges.area_m2[band] / UM_PER_H)
        square = removed("excess_w", band, edges.length_m * lacks / _ROUNDED_S)
        radius = square.mapped(lambda size: 1e6 * math.sqrt(max(size, 0.0))) if square else None
        rows.append((f"{1e3 * near:.2g} to {1e3 * far:.2g}", depth, radius))
    return rows


def _touches(case: ReportedCase) -> list[TouchesOfRun]:
    """The first touches of the packings that have some."""
    wears = (study.wear for study in case.studies)
    return [wear.touches for wear in wears if wear and wear.touches]


def touches_per_s(case: ReportedCase) -> tuple[int, Estimate]:
    """Number of first touches in all packings, and their mean rate, 1/s."""
    packings = _touches(case)
    rates = [touches.per_s for touches in packings]
    rate = rates[0] if len(rates) == 1 else mean_of([rate.value for rate in rates])
    return sum(touches.events for touches in packings), rate


def touch_rows(case: ReportedCase) -> list[tuple[str, Estimate, Estimate]]:
    """Median and 95th percentile over the first touches, means over packings, in report units."""
    packings = [touches.quantities for touches in _touches(case)]
    rows = list[tuple[str, Estimate, Estimate]]()
    for name, (label, factor) in TOUCH_QUANTITIES.items() if packings else ():
        p50, p95 = (mean_of([factor * getattr(quantiles[name], end) for quantiles in packings])
                    for end in ("p50", "p95"))  # fmt: skip
        rows.append((label, p50, p95))
    return rows
