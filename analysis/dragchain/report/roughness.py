"""Roughness of the workpiece over time, from the depth of removal of a case."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd

from dragchain.loading.roughness import RaFit, RoughnessCourse, fit_measured, profile_of
from dragchain.report.cases import ReportedCase
from dragchain.report.removal import UM_PER_H, RemovalOfCase
from dragchain.statistics.estimate import Estimate

_SHARES = (0.0, 1 / 16, 1 / 8, 1 / 4, 3 / 8, 1 / 2)
"""Mean depths at which the roughness is told, over the height Rz of the profile before."""


class Moment(NamedTuple):
    """The surface at the mean depth of removal after a time."""

    minutes: float
    depth_um: Estimate
    ra_um: Estimate
    rz_um: float
    plateau: float


@dataclass(frozen=True)
class RoughnessOfCase:
    """The roughness of a case.

    Attributes
    ----------
    course : RoughnessCourse
    fit : RaFit or None
        To the measured Ra, if there are any: its depth per time holds instead of the removal's.
    fitted_share : float
        Its depth per time over that of the removal; 1 without it.
    moments : sequence of Moment
    minutes : mapping
        To the target Ra at the mean depth, and on the slowest 5 % of the area; none without one.
    map_minutes : float
        Time of the map.
    ra : DataFrame
        By facet, ``ra_m`` and the ends of its 95 % interval at that time.
    """

    course: RoughnessCourse
    fit: RaFit | None
    fitted_share: float
    moments: Sequence[Moment]
    minutes: Mapping[str, Estimate]
    map_minutes: float
    ra: pd.DataFrame


def roughness_of(case: ReportedCase, removal: RemovalOfCase) -> RoughnessOfCase | None:
    """The roughness of a case whose study has a profile, None if it has none."""
    roughness = case.first.process.study.roughness
    if roughness is None:
        return None
    profile = profile_of(roughness)
    fit = fit_measured(roughness, profile)
    given = roughness.steady_ra_m or 0.0
    course = RoughnessCourse(profile, fit.steady_m if fit else Estimate(given, given, given))
    predicted = removal.depth_um_h.combined.over(UM_PER_H)
    rate = fit.depth_m_s if fit else predicted
    share = rate.value / predicted.value
    minutes = dict[str, Estimate]()
    if target := roughness.target_ra_m:
        slowest = removal.percentiles_um_h[0].over(UM_PER_H / share)
        rates = {"mean depth": rate, "95 % of the immersed area": slowest}
        minutes = {name: course.time_to(target, of).over(60.0) for name, of in rates.items()}
    start_m = float(profile.rz(0.0))
    moments = [
        _moment(course, rate, part * start_m / rate.value if part else 0.0) for part in _SHARES
    ]
    wanted = minutes["mean depth"].value if minutes else math.inf
    map_s = 60.0 * (wanted if math.isfinite(wanted) else moments[3].minutes)
    return RoughnessOfCase(
        course=course,
        fit=fit,
        fitted_share=share,
        moments=moments,
        minutes=minutes,
        map_minutes=map_s / 60.0,
        ra=_map(course, removal.facets, share * map_s),
    )


def _moment(course: RoughnessCourse, rate: Estimate, seconds: float) -> Moment:
    """At a time."""
    depth = Estimate(*(seconds * of for of in (rate.value, rate.ci95_low, rate.ci95_high)))
    profile, micrometres = course.profile, 1e-6
    return Moment(
        minutes=seconds / 60.0,
        depth_um=depth.over(micrometres),
        ra_um=course.ra_after(depth).over(micrometres),
        rz_um=float(profile.rz(depth.value)) / micrometres,
        plateau=float(profile.plateau(depth.value)),
    )


def _map(course: RoughnessCourse, facets: pd.DataFrame, seconds: float) -> pd.DataFrame:
    """Ra of each facet after so many s at the depths per time of the removal."""
    ends = ("depth_m_s", "depth_ci95_low_m_s", "depth_ci95_high_m_s")
    rates = facets[list(ends)].to_numpy(np.float64)
    told, places = np.unique(rates, axis=0, return_inverse=True)
    values = [course.ra_after(Estimate(*row)) for row in seconds * told]
    columns = {
        "ra_m": [of.value for of in values],
        "ra_ci95_low_m": [of.ci95_low for of in values],
        "ra_ci95_high_m": [of.ci95_high for of in values],
    }
    return pd.DataFrame(columns).iloc[places.ravel()].reset_index(drop=True)
