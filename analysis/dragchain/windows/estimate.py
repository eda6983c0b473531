"""A quantity at physical stiffness from windows and the soft run, and how many windows it takes.

The value is that of the soft run times a ratio. Each window gives the ratio once, adjusted for what
its place shares with the soft run (a regression estimator with a coefficient that is known
beforehand: Cochran, Sampling Techniques, 1977, section 7.3). The variance of the windows is joined
with that of stretches of the soft run as a moderated variance (Smyth, Stat. Appl. Genet. Mol. Biol.
3, 2004, article 3), and the ratio with what other scenes say of it, by precision.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dragchain.arrays import Floats
from dragchain.report.extrapolated import Need
from dragchain.statistics.correlated import MIN_SAMPLES, estimate_mean
from dragchain.statistics.estimate import (
    NORMAL_QUANTILE,
    Estimate,
    mean_of,
    student_quantile,
    t_interval,
)
from dragchain.windows.document import Known

UNKNOWN = Known(
    ratio_log=0.0,
    ratio_log_std=math.inf,
    share=0.0,
    variance_ratio=0.0,
    degrees=0.0,
    packing_std=0.0,
)
"""Of a quantity of which nothing is known beforehand."""

_DOUBT = 2.0
"""Standard deviations between the windows and other scenes beyond which only the windows count."""

_MOST_PACKINGS = 999


@dataclass(frozen=True)
class Ratio:
    """The value at physical stiffness over that of the soft run.

    Attributes
    ----------
    value : float
    window_variance : float
        Of one window.
    other_variance : float
        Of what windows do not reduce: the soft run's own mean.
    prior_precision : float
        One over the variance of what other scenes say; 0 if they do not count.
    packing_variance : float
    degrees : float
        Degrees of freedom of `window_variance`.
    """

    value: float
    window_variance: float
    other_variance: float
    prior_precision: float
    packing_variance: float
    degrees: float

    def variance(self, windows: int) -> float:
        """Of the value with so many windows in one packing."""
        own = self.window_variance / windows + self.other_variance
        return 1.0 / (1.0 / own + self.prior_precision) + self.packing_variance

    def half_width(self, windows: int, packings: int = 1) -> float:
        """Half-width of the 95 % interval, relative."""
        quantile = student_quantile(max(self.degrees, 1.0))
        return quantile * math.sqrt(self.variance(windows) / packings) / abs(self.value)


def ratio(windows: Sequence[float], there: Floats, stretches: Floats, known: Known) -> Ratio:
    """The ratio from K windows.

    Parameters
    ----------
    windows : sequence of K floats
        Values of the windows.
    there : (K,) ndarray
        Values of the soft run at their places, NaN where it has none.
    stretches : (B,) ndarray
        Values of the soft run over stretches as long as a window's sample.
    known : Known
    """
    mean = float(np.mean(stretches))
    soft = float(np.var(stretches / mean, ddof=1)) if len(stretches) > 1 else 0.0
    share = known.share if np.isfinite(there).all() else 0.0
    shared = share * (there / mean - 1.0) if share else np.zeros(len(windows))
    adjusted = np.asarray(windows) / mean
    value = float(np.mean(adjusted))
    residual = adjusted / value - shared
    value *= float(np.mean(residual))
    degrees = known.degrees + len(windows) - 1
    squares = known.degrees * known.variance_ratio * soft
    squares += float(((residual - residual.mean()) ** 2).sum())
    own = squares / degrees if degrees else math.nan
    other = share**2 * soft / len(stretches)
    prior = math.exp(known.ratio_log)
    spread = (prior * known.ratio_log_std) ** 2
    variance = value**2 * (own / len(windows) + other)
    agrees = abs(value - prior) <= _DOUBT * math.sqrt(spread + variance)
    precision = 1.0 / spread if agrees and spread else 0.0
    joined = (value + prior * precision * variance) / (1.0 + precision * variance)
    return Ratio(
        value=joined,
        window_variance=value**2 * own,
        other_variance=value**2 * other,
        prior_precision=precision,
        packing_variance=(joined * known.packing_std) ** 2,
        degrees=degrees,
    )


def of_one_run(blocks: Floats, value: float, known: Known) -> Estimate:
    """A run's value with its interval, from its blocks, (B,), and the scatter between packings."""
    own = estimate_mean(blocks).estimate if len(blocks) >= MIN_SAMPLES else mean_of(blocks)
    half = abs((own.ci95_high - own.ci95_low) / 2 / own.value)
    return Estimate.around(
        value, abs(value) * math.hypot(half, NORMAL_QUANTILE * known.packing_std)
    )


def at_physical_stiffness(found: Ratio, windows: int, soft: float) -> Estimate:
    """The value at physical stiffness from the ratio and the soft run's value."""
    se = abs(soft) * math.sqrt(found.variance(windows))
    return t_interval(found.value * soft, se, max(found.degrees, 1.0))


def needed(found: Ratio, windows: int, tolerance: float, most: int) -> Need:
    """How many windows, at most so many, or else packings bring the half-width to a tolerance."""
    enough = next((n for n in range(1, most + 1) if found.half_width(n) <= tolerance), most)
    packings = 1
    while packings < _MOST_PACKINGS and found.half_width(enough, packings) > tolerance:
        packings += 1
    return Need(max(enough, windows), packings)
