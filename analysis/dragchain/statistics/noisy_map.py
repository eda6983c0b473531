"""Percentiles of a map whose patches are known with errors.

Errors spread the values of patches, so that a percentile of the measured values lies too far out.
The values are shrunk: a prior distribution of the true values is fitted to the measured ones
(empirical Bayes), and true maps are drawn from the posterior of each patch, for priors fitted to
resampled patches (Laird and Louis 1987, J. Am. Stat. Assoc. 82, 739; Efron 2016, Biometrika 103,
1). A percentile of the drawn maps has their median and, as its interval, their percentiles.

Whether the true values at an end of the map are spread by a part of their errors or all alike, the
measured ones do not show. A prior is wide after a few steps of its fit and narrows with further
ones. The interval spans those of wide and of narrow priors (Imbens and Manski 2004, Econometrica
72, 1845), so that it covers in maps of groups of equal values too.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.special import gammaln

from dragchain.arrays import Floats, Ints
from dragchain.statistics.estimate import CONFIDENCE, Estimate

LARGEST_ERROR = 0.4
"""With a larger relative error of a patch there, a percentile is not available."""

_PRIORS, _DRAWS, _STEPS, _MORE, _SPACING, _MOST = 40, 5, 24, 16, 0.5, 250
"""Fitted priors, maps drawn of each, steps of the fit (EM) of wide ones, and more of narrow ones.

Distance of the values of a prior in errors of a patch, and the largest number of values.
"""

_WIDTH = 0.5
"""Of a kernel, in widths of the values of so many patches: chosen by simulated coverage."""


class MapSpread(NamedTuple):
    """How a map is spread over its area, relative to its mean.

    Attributes
    ----------
    percentiles : (Estimate, Estimate)
        Values below which 5 % and 95 % of the area are; NaN where patches are known too badly.
    errors : (float, float)
        Relative errors of a patch of mean size there; infinite where nothing was measured.
    """

    percentiles: tuple[Estimate, Estimate]
    errors: tuple[float, float]


def map_spread(values: Floats, errors: Floats, areas: Floats, patch: Ints) -> MapSpread:
    """The spread of a map that P packings or one have measured on M facets.

    The variance of a patch is ``a m / A + b m^2`` with its mean m and its area A: contact events
    that come by chance, and differences between packings. `a` is from the errors over time, `b`
    from what packings differ by beyond that. The likelihood is a gamma distribution.

    Parameters
    ----------
    values, errors : (P, M) array
        Measured values, alike on the facets of a patch, and their standard errors over time.
    areas : (M,) array
    patch : (M,) array
        The patch of each facet.
    """
    _, first, at = np.unique(patch, return_index=True, return_inverse=True)
    area = np.asarray(np.bincount(at, areas), dtype=np.float64)
    means = np.average(values[:, first], axis=1, weights=area)[:, None]
    if not means.all():
        unknown = Estimate(*[math.nan] * 3)
        return MapSpread((unknown, unknown), (math.inf, math.inf))
    scaled, over_time = values[:, first] / means, errors[:, first] / means
    packings, value = len(scaled), scaled.mean(axis=0)
    events = float((area * over_time**2).sum() / (area * scaled).sum()) / packings
    differences = 0.0
    if packings > 1:
        variance = scaled.var(axis=0, ddof=1) / packings
        beyond = float((area * variance).sum()) - events * float((area * value).sum())
        square = float((area * (value**2 - variance)).sum())
        differences = max(0.0, beyond / square) if square > 0.0 else 0.0
    maps = _drawn(value, area, max(events, 1e-9 * float(area.mean())), differences)
    maps /= np.average(maps, axis=-1, weights=area)[..., None]
    spreads, relative = [], []
    for part in (0.05, 0.95):
        estimate = _estimate(_quantiles(maps, area, part), _quantiles(value, area, part))
        error = math.sqrt(events / float(area.mean()) / max(estimate.value, 1e-300) + differences)
        known = error <= LARGEST_ERROR
        spreads.append(estimate if known else Estimate(*[math.nan] * 3))
        relative.append(error)
    return MapSpread((spreads[0], spreads[1]), (relative[0], relative[1]))


def _estimate(drawn: Floats, measured: float | Floats) -> Estimate:
    """Of numbers drawn from wide and narrow priors, (2, draws): the median of the former.

    An interval joins theirs with the correction of the measured number: the form of prior and
    likelihood are assumptions, so that half of the correction counts as its standard error.
    """
    ends = 0.5 - CONFIDENCE / 2, 0.5, 0.5 + CONFIDENCE / 2
    low, value, high = np.quantile(drawn, ends, axis=1)
    lowest = value - np.hypot(value - low, value - measured)
    highest = value + np.hypot(high - value, value - measured)
    return Estimate(float(value[0]), max(0.0, float(lowest.min())), float(highest.max()))


def _quantiles(maps: Floats, area: Floats, part: float) -> Floats:
    """The values, (...,), that bound a part of the area of maps, (..., M), from below."""
    order = np.argsort(maps, axis=-1)
    until = area[order].cumsum(axis=-1)
    at = (until >= part * (1 - 1e-12) * until[..., -1:]).argmax(axis=-1)[..., None]
    return np.take_along_axis(maps, np.take_along_axis(order, at, -1), -1)[..., 0]


def _drawn(value: Floats, area: Floats, events: float, differences: float) -> Floats:
    """Maps of true values from those measured with these variances.

    Returns
    -------
    (2, draws, M) array
        From wide priors, and from narrow ones.
    """
    root, mean_area = math.sqrt(differences), float(area.mean())

    def true(scale: Floats) -> Floats:
        """The value at a place on a scale on which all errors are one."""
        half = np.asarray(scale) / 2
        whole = np.sinh(root * half) / root if root > 0.0 else half
        return np.asarray(events / mean_area * whole**2)

    highest = 2 * math.sqrt(float(value.max()) * mean_area / events)
    if root > 0.0:
        highest = 2 / root * math.asinh(root * highest / 2)
    count = min(_MOST, math.ceil(1.05 * highest / _SPACING))
    scale = np.linspace(0.0, 1.05 * highest, count + 1)[1:]
    wide = events / area[:, None] + differences * true(scale)
    form = true(scale) / wide
    measured = np.maximum(value, 0.02 * events / area)[:, None]
    chance = (form - 1) * np.log(measured) - measured / wide - gammaln(form) - form * np.log(wide)
    chance = np.exp(chance - chance.max(axis=1, keepdims=True)) + 1e-300
    random = np.random.default_rng(0)
    weights = random.dirichlet(np.ones(len(value)), _PRIORS).T
    prior = np.full((count, _PRIORS), 1 / count)
    priors = list[Floats]()
    for steps in (_STEPS, _MORE):
        for _ in range(steps):
            prior *= chance.T @ (weights / (chance @ prior))
        priors.extend((prior if priors else _smooth(prior, scale, len(value))).T)
    maps = []
    for column in priors:
        summed = (chance * column).cumsum(axis=1)
        for _ in range(_DRAWS):
            place = random.random(len(value)) * summed[:, -1]
            number = (summed < place[:, None]).sum(axis=1)
            within = (random.random(len(value)) - 0.5) * scale[0]
            maps.append(true(np.maximum(scale[number] + within, 0.0)))
    return np.array(maps).reshape(2, -1, len(value))


def _smooth(prior: Floats, scale: Floats, patches: int) -> Floats:
    """Priors, (values, priors), smoothed over the square root of the number of patches.

    A fitted prior has a peak at each patch that stands alone, and drawn from it, the patch would
    seem to be known better than it is. Where many patches are alike, hardly anything is smoothed
    (variable kernels: Breiman, Meisel and Purcell 1977, Technometrics 19, 135).
    """
    below, near = prior.mean(axis=1).cumsum(), patches**-0.5 / 2
    width = np.interp(below + near, below, scale) - np.interp(below - near, below, scale)
    kernel = np.exp(-0.5 * ((scale[:, None] - scale) / (_WIDTH * width + 0.1 * scale[0])) ** 2)
    return np.asarray(kernel / kernel.sum(axis=0) @ prior)
