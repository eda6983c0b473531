"""Roughness of a surface whose peaks are cut: Ra, Rz and material ratio against removed depth.

By volume balance, a removed mean height d cuts all that is above a level: the mean line falls by d,
and the profile below the level stays. With the mean height ``m`` before,

    Ra(d) = 2 E[max(m - d - z, 0)],

since deviations above and below the mean line have the same mean. Of a triangle, that is
``4 Ra0 (1/2 - d / (8 Ra0))^2`` (the heights are even from 0 to 4 Ra0). Cutting peaks is the
transient period of the geometry-based model of Uhlmann, Dethlefs and Eulitz (Int. J. Adv. Manuf.
Technol. 75, 2014, 815); a steady roughness ends it. New scratches and smearing are left out.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from dragchain.arrays import Floats
from dragchain.statistics.estimate import Estimate, student_quantile
from dragdeck.study.roughness import SAMPLING_LENGTHS, Roughness


@dataclass(frozen=True)
class RoughnessProfile:
    """Heights of a surface.

    Attributes
    ----------
    z_m : (N,) ndarray
        Along the profile, m.
    lengths : int
        Sampling lengths of equal size that it is divided into, of which Rz is a mean.
    """

    z_m: Floats
    lengths: int = 1

    @cached_property
    def _sorted(self) -> Floats:
        return np.sort(self.z_m)

    @cached_property
    def _mean(self) -> float:
        return float(self.z_m.mean())

    @cached_property
    def _below(self) -> Floats:
        """Mean of what lies below each of the sorted heights, (N,), m."""
        z = self._sorted
        return np.asarray((np.arange(len(z)) * z - (np.cumsum(z) - z)) / len(z))

    @cached_property
    def _above(self) -> Floats:
        """Mean of what lies above each of the sorted heights, (N,), m."""
        return np.asarray(self._below + self._mean - self._sorted)

    def ra(self, depth_m: ArrayLike) -> Floats:
        """Arithmetic mean deviation after a depth of removal; any shape, m."""
        return np.asarray(
            2.0 * np.interp(self._mean - np.asarray(depth_m), self._sorted, self._below)
        )

    def depth_to(self, ra_m: ArrayLike) -> Floats:
        """Depth of removal at which Ra has fallen to a value, any shape, m; 0 where it is lower."""
        depths = np.maximum(self._mean - self._sorted, 0.0)
        return np.asarray(np.interp(np.asarray(ra_m), 2.0 * self._below, depths))

    def level(self, depth_m: ArrayLike) -> Floats:
        """Height at which the peaks are cut, m; below the valleys, all has gone."""
        depth = np.asarray(depth_m)
        level = np.interp(depth, self._above[::-1], self._sorted[::-1])
        return np.asarray(level - np.maximum(depth - self._above[0], 0.0))

    def rz(self, depth_m: ArrayLike) -> Floats:
        """Mean over the sampling lengths of the largest height less the lowest, any shape, m."""
        parts = np.array_split(self.z_m, self.lengths)
        level = self.level(depth_m)
        heights = [np.minimum(part.max(), level) - np.minimum(part.min(), level) for part in parts]
        return np.asarray(np.mean(heights, axis=0))

    def plateau(self, depth_m: ArrayLike) -> Floats:
        """Material ratio at the level of the cut: the part of the surface that is flat."""
        below = np.searchsorted(self._sorted, self.level(depth_m), side="left")
        return np.asarray(1.0 - below / len(self.z_m))

    @cached_property
    def half_width(self) -> float:
        """Relative half-width of the 95 % interval of Ra, between the sampling lengths."""
        if self.lengths < 2:
            return 0.0
        of_lengths = [
            float(RoughnessProfile(part).ra(0.0)) for part in np.array_split(self.z_m, self.lengths)
        ]
        error = float(np.std(of_lengths, ddof=1)) / math.sqrt(self.lengths)
        return student_quantile(self.lengths - 1) * error / float(self.ra(0.0))


def profile_of(roughness: Roughness) -> RoughnessProfile:
    """The profile before the process."""
    return RoughnessProfile(roughness.heights_m, SAMPLING_LENGTHS if roughness.profile else 1)


@dataclass(frozen=True)
class RoughnessCourse:
    """How the roughness falls with process time.

    Attributes
    ----------
    profile : RoughnessProfile
    steady_m : Estimate
        Ra of the scratches that the process leaves, m; zero if that is not known. The mean squares
        of both profiles add up, as those of independent ones do.
    """

    profile: RoughnessProfile
    steady_m: Estimate

    def ra_after(self, depth_m: Estimate) -> Estimate:
        """Ra after a depth of removal, with the errors of depth, profile and steady value."""
        steady, half = self.steady_m.value, self.steady_m.half_width
        cut, low, high = (
            float(self.profile.ra(of))
            for of in (depth_m.value, depth_m.ci95_high, depth_m.ci95_low)
        )
        value = math.hypot(cut, steady)
        error = self.profile.half_width * cut**2
        spread = math.hypot(error, steady * half) / value if value else half
        below = math.hypot(value - math.hypot(low, steady), spread)
        above = math.hypot(math.hypot(high, steady) - value, spread)
        return Estimate(value, max(value - below, 0.0), value + above)

    def time_to(self, ra_m: float, depth_m_s: Estimate) -> Estimate:
        """Seconds until Ra has fallen to a value; infinite where it never does."""
        shares = [1.0 - self.profile.half_width, 1.0 + self.profile.half_width]
        value, *of_profile = (
            self._time(ra_m, self.steady_m.value, share, depth_m_s.value)
            for share in (1.0, *shares)
        )
        of_steady = [
            self._time(ra_m, steady, 1.0, depth_m_s.value)
            for steady in (self.steady_m.ci95_low, self.steady_m.ci95_high)
        ]
        of_depth = [
            self._time(ra_m, self.steady_m.value, 1.0, rate)
            for rate in (depth_m_s.ci95_high, depth_m_s.ci95_low)
        ]
        if not math.isfinite(value):
            return Estimate(value, value, value)
        ends = zip(of_profile, of_steady, of_depth, strict=True)
        below, above = (math.hypot(*(time - value for time in times)) for times in ends)
        return Estimate(value, max(value - below, 0.0), value + above)

    def _time(self, ra_m: float, steady_m: float, share: float, depth_m_s: float) -> float:
        """The same, for heights of so many times those of the profile."""
        if ra_m <= steady_m or depth_m_s <= 0.0:
            return math.inf
        cut = math.sqrt(ra_m**2 - steady_m**2)
        return share * float(self.profile.depth_to(cut / share)) / depth_m_s


@dataclass(frozen=True)
class RaFit:
    """Depth per time, m/s, and steady Ra, m, by Ra that was measured during the process."""

    depth_m_s: Estimate
    steady_m: Estimate


def fit_measured(roughness: Roughness, profile: RoughnessProfile) -> RaFit | None:
    """The fit to the measured Ra, None if there are none.

    By least squares of the logarithms, with Student's t intervals from their scatter (Seber and
    Wild, Nonlinear Regression, 1989, section 5.1).
    """
    if not roughness.measured:
        return None
    times = np.array([row.time_s for row in roughness.measured])
    logs = np.log([row.ra_m for row in roughness.measured])
    lowest = float(np.exp(logs.min()))
    given = roughness.steady_ra_m

    def misfit(logarithms: Floats) -> Floats:
        steady = given or math.exp(logarithms[1])
        ra = profile.ra(math.exp(logarithms[0]) * times)
        return np.asarray(np.log(np.hypot(ra, steady)) - logs)

    depths = profile.depth_to(np.exp(logs)) / times
    start = [math.log(max(float(np.median(depths)), 1e-15)), math.log(lowest)]
    fit = least_squares(misfit, start[: 1 if given else 2], method="lm")
    degrees = len(times) - len(fit.x)
    variance = float(fit.fun @ fit.fun) / degrees
    jacobian = np.asarray(fit.jac, dtype=np.float64)
    errors = np.sqrt(np.diag(np.linalg.pinv(jacobian.T @ jacobian)) * variance)
    ends = student_quantile(degrees) * errors
    rate, *steady = (
        Estimate(log, log - half, log + half).exp() for log, half in zip(fit.x, ends, strict=True)
    )
    return RaFit(rate, steady[0] if steady else Estimate(given or 0.0, given or 0.0, given or 0.0))
