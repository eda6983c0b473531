"""Removal from a workpiece: what the loads of its packings and the coefficient of a law predict.

The scatter of the load and the uncertainty of the coefficient are kept apart; their relative
half-widths of 95 % intervals add up as squares do (``benchmarks/removal_coverage.py``).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd

from dragchain.arrays import Floats
from dragchain.errors import TableError
from dragchain.loading.wear import TOUCH_QUANTITIES, Wear
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
from dragdeck.study.removal import Removal

IGNORED = (
    "the change of the workpiece's shape and roughness as material is removed",
    "wear of the media",
    "compound, water and abrasive, which are part of the coefficient",
)
"""What every law ignores, in words."""

UM_PER_H = 3600e6
"""A depth per time in micrometres per hour over that in m/s."""

_SLOW_AREA = 0.05
"""Part of the area that a target depth reaches last."""

_ROUNDED_S = 1800.0
"""Time after which the radius of an edge is reported."""


@dataclass(frozen=True)
class Parted:
    """A positive number with the relative half-widths of its two 95 % intervals."""

    value: float
    scatter: float
    coefficient: float

    def _within(self, half: float) -> Estimate:
        return Estimate(self.value, self.value * max(0.0, 1 - half), self.value * (1 + half))

    @property
    def combined(self) -> Estimate:
        """With both together."""
        return self._within(math.hypot(self.scatter, self.coefficient))

    @property
    def of_scatter(self) -> Estimate:
        """With the scatter of the load alone."""
        return self._within(self.scatter)

    @property
    def of_coefficient(self) -> Estimate:
        """With the uncertainty of the coefficient alone."""
        return self._within(self.coefficient)

    def times(self, factor: float) -> "Parted":
        """A multiple."""
        return Parted(factor * self.value, self.scatter, self.coefficient)


class Fit(NamedTuple):
    """Mass loss per time from weighed trials, by weighted least squares through the origin.

    Attributes
    ----------
    rate_kg_s, half : float
        Slope, and relative half-width of its interval; wider by Birge's ratio (1932) if the
        trials scatter significantly more than by their uncertainties.
    residuals : sequence of float
        Measured minus fitted mass loss of each trial in its standard uncertainties.
    """

    rate_kg_s: float
    half: float
    residuals: Sequence[float]


def fit_trials(removal: Removal) -> Fit | None:
    """The fit to the trials of a study, None if its coefficient is given."""
    if removal.calibrate is None:
        return None
    from scipy.special import chdtri

    trials = [(one.mass_loss_kg, one.time_s, one.sd_kg) for one in removal.calibrate]
    mass, time, sd = np.array(trials).T
    information = float(((time / sd) ** 2).sum())
    rate = float((mass * time / sd**2).sum()) / information
    residuals = (mass - rate * time) / sd
    square, degrees = float((residuals**2).sum()), max(len(trials) - 1, 1)
    birge = math.sqrt(square / degrees) if square > chdtri(degrees, 1 - CONFIDENCE) else 1.0
    half = NORMAL_QUANTILE * birge / math.sqrt(information) / rate
    return Fit(rate, half, residuals.tolist())


def predict(removal: Removal, action_w: Estimate, density_kg_m3: float) -> tuple[Parted, Parted]:
    """The coefficient, m2/N, and the removed volume per time, m3/s.

    The volume that a trial of the same process has lost does not depend on the simulated load; the
    coefficient does then, and otherwise the volume.
    """
    load = action_w.relative_half_width
    if fit := fit_trials(removal):
        rate = Parted(fit.rate_kg_s / density_kg_m3, 0.0, fit.half)
        return Parted(rate.value / action_w.value, load, fit.half), rate
    value = removal.coefficient_m2_n or math.nan
    half = NORMAL_QUANTILE * (removal.sd_m2_n or 0.0) / value
    return Parted(value, 0.0, half), Parted(value * action_w.value, load, half)


def patch_means(densities: Floats, errors: Floats) -> tuple[Floats, Floats, float]:
    """Means over P packings of (P, M) values, their standard errors, and Student's quantile.

    Between packings; of one packing by its own standard errors, (P, M).
    """
    packings = len(densities)
    if packings == 1:
        return densities[0], errors[0], student_quantile(SLOW_WAVES)
    error = densities.std(axis=0, ddof=1) / math.sqrt(packings)
    return densities.mean(axis=0), error, student_quantile(packings - 1)


@dataclass(frozen=True)
class RemovalOfCase:
    """The removal of a case.

    Attributes
    ----------
    removal : Removal
    wears : sequence of Wear
        Of its packings.
    facets : DataFrame
        ``area_m2``, ``immersed``, and of the patch of each facet the depth of removal per time
        ``depth_m_s``, its standard error by the scatter of the load ``depth_m_s_se``, and the ends
        of its combined 95 % interval.
    edges : sequence of (str, Estimate, float)
        Of each band along sharp edges: its distances in mm, depth per hour and, after half an
        hour, the radius of the edge, both in micrometres.
    impact_share : Estimate
        Part of the removal that comes from impacts.
    coefficient, rate : Parted
        m2/N, and removed volume per process time, m3/s.
    density_kg_m3 : float
    """

    removal: Removal
    wears: Sequence[Wear]
    facets: pd.DataFrame
    edges: Sequence[tuple[str, Estimate, float]]
    impact_share: Estimate
    coefficient: Parted
    rate: Parted
    density_kg_m3: float

    @property
    def fit(self) -> Fit | None:
        """The fit to the trials, if there are any."""
        return fit_trials(self.removal)

    @property
    def _immersed(self) -> pd.DataFrame:
        found = self.facets[self.facets["immersed"]]
        return found.assign(part=found["area_m2"] / found["area_m2"].sum())

    @property
    def depth(self) -> Parted:
        """Mean depth of removal over the immersed surface, micrometres per hour."""
        return self.rate.times(UM_PER_H / self._immersed["area_m2"].sum())

    @property
    def rows(self) -> list[tuple[str, Parted]]:
        """What a report shows with both intervals."""
        return [
            ("mean depth over the immersed surface (\N{MICRO SIGN}m/h)", self.depth),
            ("mass loss (mg/h)", self.rate.times(UM_PER_H * self.density_kg_m3)),
            ("coefficient (m\N{SUPERSCRIPT TWO}/N)", self.coefficient),
        ]

    @property
    def variation(self) -> tuple[float, float]:
        """Coefficient of variation over the immersed area, and that without the scatter."""
        names = ("depth_m_s", "depth_m_s_se", "part")
        depth, error, part = (self._immersed[name].to_numpy(np.float64) for name in names)
        mean = float(part @ depth)
        square, scatter = float(part @ (depth - mean) ** 2), float(part @ error**2)
        return math.sqrt(square) / mean, math.sqrt(max(0.0, square - scatter)) / mean

    def percentile(self, fraction: float) -> float:
        """Depth below which this part of the immersed area stays, micrometres per hour."""
        depth, weights = (self._immersed[name].to_numpy() for name in ("depth_m_s", "part"))
        found = np.quantile(depth, fraction, weights=weights, method="inverted_cdf")
        return UM_PER_H * float(found)

    @property
    def minutes(self) -> Mapping[str, Estimate]:
        """Minutes to the target depth, on average and where it takes longest."""
        target_um, depth = 1e6 * (self.removal.target_depth_m or 0.0), self.depth
        slow = depth.times(self.percentile(_SLOW_AREA) / depth.value)
        found = {"mean depth": depth, f"{1 - _SLOW_AREA:.0%} of the immersed area": slow}
        return {name: _minutes(target_um, one.combined) for name, one in found.items() if target_um}


def _minutes(target_um: float, depth: Estimate) -> Estimate:
    """Time to a depth; without limit if the depth per time may be zero."""
    ends = (depth.value, depth.ci95_high, depth.ci95_low)
    return Estimate(*(60 * target_um / one if one else math.inf for one in ends))


def removal_of(case: ReportedCase) -> RemovalOfCase | None:
    """The removal of a case whose study has a law, None if it has none.

    Raises
    ------
    TableError
        If a run of it lacks ``wear.json``.
    """
    first, load = case.first.process.case, case.values.of("force_slide")
    removal = first.removal
    if removal is None or load is None:
        return None
    wears = [study.wear for study in case.studies if study.wear]
    if len(wears) < len(case.studies):
        folder = case.first.process.folder
        raise TableError(f"{folder}: no wear.json: make it with: dragchain loading {folder}")
    action, factor = _over_packings([one.action_w for one in wears]), 1.0
    if removal.corrected:
        factor = load.shown.value / load.run.value
        action = load.shown.over(first.fidelity.speed_factor / axis_speed(first))
    density = first.inputs[f"materials.{first.inputs['workpiece.material']}.density_kg_m3"]
    assert isinstance(density, float | int)
    coefficient, rate = predict(removal, action, density)
    scale = coefficient.value * factor
    means, errors = (scale * np.array([getattr(one, name) for one in wears])
                     for name in ("patch_w_m2", "patch_se_w_m2"))  # fmt: skip
    mean, error, quantile = patch_means(means, errors)
    half = np.hypot(quantile * error, mean * rate.coefficient)
    facets = {
        "area_m2": wears[0].area_m2,
        "immersed": wears[0].immersed,
        "depth_m_s": mean,
        "depth_m_s_se": error,
        "depth_ci95_low_m_s": np.maximum(mean - half, 0.0),
        "depth_ci95_high_m_s": mean + half,
    }
    return RemovalOfCase(
        removal=removal,
        wears=wears,
        facets=pd.DataFrame(facets),
        edges=_bands(wears, scale, rate.coefficient),
        impact_share=_over_packings([one.impact_share for one in wears]),
        coefficient=coefficient,
        rate=rate,
        density_kg_m3=density,
    )


def _over_packings(values: Sequence[Estimate]) -> Estimate:
    return values[0] if len(values) == 1 else mean_of([one.value for one in values])


def _bands(
    wears: Sequence[Wear], scale: float, uncertainty: float
) -> list[tuple[str, Estimate, float]]:
    """The bands along sharp edges; see `RemovalOfCase`.

    By volume balance, all removal nearer to the edge than the far side of a band rounds it: an edge
    of the interior angle b with the radius r lacks ``r^2 (1/tan(b/2) - (pi - b)/2)``.
    """
    found, several, summed = list[tuple[str, Estimate, float]](), [one.edges for one in wears], 0.0
    if (edges := several[0]) is None:
        return found
    lacks = 1 / math.tan(edges.angle_rad / 2) - (math.pi - edges.angle_rad) / 2
    for band, area in enumerate(edges.area_m2):
        own = _over_packings([one.action_w.at(band) for one in several if one])
        summed += scale * own.value
        half = own.relative_half_width if own.value else 0.0
        depth = Parted(UM_PER_H * scale * own.value / area, half, uncertainty).combined
        near, far = (1e3 * one for one in edges.distance_m[band : band + 2])
        radius = 1e6 * math.sqrt(summed * _ROUNDED_S / edges.length_m / lacks)
        found.append((f"{near:.2g} to {far:.2g}", depth, radius))
    return found


def touch_rows(case: ReportedCase) -> list[tuple[str, Estimate, Estimate]]:
    """Median and 95th percentile over the first touches, means over packings, in report units."""
    found = [one.wear.touches for one in case.studies if one.wear and one.wear.touches]

    def over(name: str, end: str, factor: float) -> Estimate:
        return mean_of([factor * getattr(one.quantities[name], end) for one in found])

    return [
        (label, over(name, "p50", factor), over(name, "p95", factor))
        for name, (label, factor) in TOUCH_QUANTITIES.items()
        if found
    ]
