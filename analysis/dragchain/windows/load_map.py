"""The load map at physical stiffness from windows and the soft run.

Windows are too short for a map of their own: a bin has few contacts. Each bin is therefore an
empirical Bayes estimate (Efron and Morris, J. Am. Stat. Assoc. 68, 1973, 117): the soft run's map
with the total load of the windows, corrected by the windows' map as far as their scatter allows.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import erf

from dragchain.arrays import Floats
from dragchain.report.values import LoadMap
from dragchain.statistics.estimate import NORMAL_QUANTILE, Estimate

_FEWEST = 2


def corrected(
    soft: Sequence[float], windows: Sequence[Sequence[float]], total: Estimate, runs: float
) -> LoadMap | None:
    """The load map at physical stiffness, None without a map of the run and of two windows.

    The variance of a bin is taken as proportional to its mean, as that of a sum of rare events.

    Parameters
    ----------
    soft : sequence of M floats
        Map of the soft run, N.
    windows : K sequences of M floats
        Maps of the windows, N.
    total : Estimate
        Sum of the map at physical stiffness.
    runs : float
        Length of the soft run in lengths of a window.
    """
    maps = np.array([one for one in windows if len(one) == len(soft)])
    own = np.asarray(soft, dtype=np.float64)
    if len(maps) < _FEWEST or not own.any() or not total.known:
        return None
    mean = maps.mean(axis=0)
    dispersion = maps.var(axis=0, ddof=1).sum() / mean.sum()
    expected = own * total.value / own.sum()
    from_soft = dispersion * expected / runs
    from_windows = dispersion * expected / len(maps)
    seen = ((mean * total.value / mean.sum() - expected) ** 2).sum()
    by_chance = (from_soft + from_windows).sum()
    between = max(0.0, (seen - by_chance) / (expected**2).sum())
    prior = between * expected**2 + from_soft
    weight = np.divide(prior, prior + from_windows, out=np.zeros_like(prior), where=prior > 0.0)
    value = expected + weight * (mean * total.value / mean.sum() - expected)
    scale = (total.ci95_high - total.value) / NORMAL_QUANTILE / total.value
    std = np.hypot(np.sqrt(weight * from_windows), value * scale)
    return LoadMap(
        soft=tuple(own.tolist()),
        value=tuple(value.tolist()),
        std=tuple(std.tolist()),
        soft_error=float(_absolute(own - value, std).sum() / value.sum()),
        error=float(_absolute(np.zeros_like(std), std).sum() / value.sum()),
    )


def _absolute(mean: Floats, std: Floats) -> Floats:
    """Mean absolute values of normal variables, (M,) each (the folded normal distribution)."""
    away = np.abs(mean)
    scaled = np.divide(away, std, out=np.full_like(std, math.inf), where=std > 0.0)
    found = std * math.sqrt(2.0 / math.pi) * np.exp(-(scaled**2) / 2.0)
    return np.asarray(found + away * erf(scaled / math.sqrt(2.0)))
