"""Quantities and load map at physical stiffness from windows and the soft run.

`Round` is the document of a round, ``round-<number>.json``.

A window starts from the soft run's own bed and keeps part of its noise: where the soft run is above
its mean, the window is, too. The mean of the windows is therefore moved by what the soft run's mean
over the whole path differs from its mean beside the windows, times the slope of one on the other: a
regression estimator (Cochran, Sampling Techniques, 3rd ed. 1977, chapter 7), or control variate.
The slope of the run is shrunk to that of other scenes, and the variance about it is joined with
theirs as a moderated variance (Smyth, Stat. Appl. Genet. Mol. Biol. 3, 2004, article 3).

Windows are too short for a load map of their own: a bin has few contacts. Each bin is therefore an
empirical Bayes estimate (Efron and Morris, J. Am. Stat. Assoc. 68, 1973, 117): the soft run's map
with the total load of the windows, corrected by the windows' map as far as their scatter allows.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import foldnorm

from dragchain.arrays import Floats
from dragchain.quantities.document import Extrapolated, LoadMap, Need, Reached
from dragchain.statistics.estimate import NORMAL_QUANTILE, Estimate, student_quantile
from dragdeck.parts import Part
from dragdeck.records.windows import Known


class WindowOfRun(Part):
    """A window of a run.

    Attributes
    ----------
    run : str
    refused : str
        Why it does not enter; empty if it does.
    begin_m, arc_m : float
        Where on the path its sample begins, and how long it is, m.
    values : mapping
        Quantities of the sample.
    load_map : tuple of float
        As in `PathQuantities`.
    cpu_time_s : float
    """

    run: str
    refused: str = ""
    begin_m: float = 0.0
    arc_m: float = 0.0
    values: Mapping[str, float] = {}
    load_map: tuple[float, ...] = ()
    cpu_time_s: float


class Round(Extrapolated):
    """The content of ``round-<number>.json``: what the windows so far say, and what comes next.

    Attributes
    ----------
    windows : sequence of WindowOfRun
        So far, in the order in which they were run.
    wanted : int
        How many windows to run in all; as many as there were if no more are wanted.
    whole : bool
        Whether the whole drag is to be run at the physical modulus instead of more windows.
    last : bool
    """

    remedy = "make it with: ./run dragchain step windows"

    tolerance: Reached
    windows: tuple[WindowOfRun, ...]
    wanted: int
    whole: bool = False
    last: bool


# --- estimate ------------------------------------------------------------------------------------


_MOST_PACKINGS = 999

_PASSES = 4
"""In which slope and scatter about it are found from each other."""


@dataclass(frozen=True)
class Paired:
    """A value at physical stiffness; all variances are relative to its square.

    Attributes
    ----------
    value : float
    window_variance : float
        Of one window about the regression on the soft run.
    path_variance : float
        What no window reduces: of the soft run's mean, times the slope, and of the slope itself.
    packing_variance : float
    degrees : float
        Degrees of freedom of `window_variance`.
    whole_variance : float
        To be expected of the mean over the whole path at the physical modulus.
    """

    value: float
    window_variance: float
    path_variance: float
    packing_variance: float
    degrees: float
    whole_variance: float

    def relative_half_width(self, windows: int, packings: int = 1, scatter: float = 1.0) -> float:
        """Of the 95 % interval with so many windows in each packing.

        The scatter along the path may be taken as so many times what was found.
        """
        along = scatter**2 * (self.window_variance / windows + self.path_variance)
        quantile = student_quantile(max(self.degrees, 1.0))
        return quantile * math.sqrt((along + self.packing_variance) / packings)

    def whole_half_width(self, scatter: float = 1.0) -> float:
        """The same, to be expected of the whole drag at the physical modulus."""
        return NORMAL_QUANTILE * math.sqrt(scatter**2 * self.whole_variance + self.packing_variance)

    def estimate(self, windows: int) -> Estimate:
        """The value with its interval."""
        return Estimate.around(self.value, self.relative_half_width(windows) * abs(self.value))

    @property
    def root(self) -> "Paired":
        """The root of the value: half of its relative errors along the path."""
        variances = self.window_variance / 4.0, self.path_variance / 4.0, self.packing_variance
        return Paired(
            math.sqrt(self.value),
            *variances,
            self.degrees,
            whole_variance=self.whole_variance / 4.0,
        )


def expected(stretches: Floats, known: Known) -> Paired:
    """What windows of a soft run are expected to give, by its own scatter and by other scenes.

    Parameters
    ----------
    stretches : (B,) ndarray
        As for `paired`.
    known : Known
    """
    of_stretch, count = _relative_variance(stretches), len(stretches)
    about, of_path = known.variance_ratio * of_stretch, known.slope**2 * of_stretch / count
    of_whole = about / count + of_path
    packing = known.packing_std**2
    return Paired(float(stretches.mean()), about, of_path, packing, known.degrees, of_whole)


def _relative_variance(stretches: Floats) -> float:
    """Variance of a stretch, relative to the square of their mean; 0 of a single one."""
    return float(np.var(stretches / stretches.mean(), ddof=1)) if len(stretches) > 1 else 0.0


def paired(windows: Floats, beside: Floats, stretches: Floats, known: Known) -> Paired:
    """The value from K windows and the soft run.

    Parameters
    ----------
    windows : (K,) ndarray
        Values of the windows.
    beside : (K,) ndarray
        Values of the soft run over the same stretches of the path.
    stretches : (B,) ndarray
        Values of the soft run over all stretches as long as a window's sample.
    known : Known
        Of other scenes.
    """
    count, mean, soft = len(windows), float(windows.mean()), float(stretches.mean())
    here = float(beside.mean())
    away, of_soft = windows / mean - 1.0, beside / here - 1.0
    of_stretch = _relative_variance(stretches)
    degrees = known.degrees + count - 1

    def about(slope: float) -> float:
        squares = known.degrees * known.variance_ratio * of_stretch
        return (squares + float(((away - slope * of_soft) ** 2).sum())) / degrees

    slope, slope_variance, seen = known.slope, known.slope_std**2, float(of_soft @ of_soft)
    for _ in range(_PASSES if slope_variance else 0):
        if variance := about(slope):
            slope_variance = 1.0 / (1.0 / known.slope_std**2 + seen / variance)
            slope = known.slope / known.slope_std**2 + float(of_soft @ away) / variance
            slope *= slope_variance
    move = soft / here - 1.0
    of_path = slope**2 * of_stretch / len(stretches) + slope_variance * move**2
    value = mean * (1.0 + slope * move)
    of_whole = (about(slope) + slope**2 * of_stretch) / len(stretches)
    return Paired(value, about(slope), of_path, known.packing_std**2, degrees, of_whole)


def windows_needed(value: Paired, windows: int, tolerance: float, most: int) -> Need:
    """How many windows, at most so many, bring the half-width to a tolerance.

    If none do, it takes several packings, with as many windows or with the whole drag in each.
    """
    enough = next(
        (n for n in range(1, most + 1) if value.relative_half_width(n) <= tolerance), most
    )
    narrowest = min(value.relative_half_width(enough), value.whole_half_width())
    packings = math.ceil((narrowest / tolerance) ** 2)
    packings = min(max(packings, 1), _MOST_PACKINGS)
    return Need(max(enough, windows), packings)


# --- load map ------------------------------------------------------------------------------------


_FEWEST = 2


def corrected_map(
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
    maps = np.array([window for window in windows if len(window) == len(soft)])
    whole = np.asarray(soft, dtype=np.float64)
    if len(maps) < _FEWEST or not whole.any() or not total.known:
        return None
    mean = maps.mean(axis=0)
    dispersion = maps.var(axis=0, ddof=1).sum() / mean.sum()
    expected = whole * total.value / whole.sum()
    from_soft = dispersion * expected / runs
    from_windows = dispersion * expected / len(maps)
    seen = ((mean * total.value / mean.sum() - expected) ** 2).sum()
    by_chance = (from_soft + from_windows).sum()
    between = max(0.0, (seen - by_chance) / (expected**2).sum())
    prior = between * expected**2 + from_soft
    weight = np.divide(prior, prior + from_windows, out=np.zeros_like(prior), where=prior > 0.0)
    value = expected + weight * (mean * total.value / mean.sum() - expected)
    scale = total.relative_half_width / NORMAL_QUANTILE
    std = np.hypot(np.sqrt(weight * from_windows), value * scale)
    return LoadMap(
        soft=tuple(whole.tolist()),
        value=tuple(value.tolist()),
        std=tuple(std.tolist()),
        soft_error=float(_absolute(whole - value, std).sum() / value.sum()),
        error=float(_absolute(np.zeros_like(std), std).sum() / value.sum()),
    )


def _absolute(mean: Floats, std: Floats) -> Floats:
    """Mean absolute values of normal variables, (M,) each (the folded normal distribution)."""
    away = np.abs(mean)
    scaled = np.divide(away, std, out=np.zeros_like(std), where=std > 0.0)
    return np.where(std > 0.0, std * foldnorm.mean(scaled), away)
