"""Quantities and load map at physical stiffness from windows and the soft run.

`Round` is the document of a round, ``round-<number>.json``.

Two estimates are joined by precision: the mean of the windows, and the value of the soft run times
the ratio that other scenes had, if they agree. The variance of the windows is joined with that of
stretches of the soft run as a moderated variance (Smyth, Stat. Appl. Genet. Mol. Biol. 3, 2004,
article 3).

Windows are too short for a load map of their own: a bin has few contacts. Each bin is therefore an
empirical Bayes estimate (Efron and Morris, J. Am. Stat. Assoc. 68, 1973, 117): the soft run's map
with the total load of the windows, corrected by the windows' map as far as their scatter allows.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import erf

from dragchain.arrays import Floats
from dragchain.quantities.document import Extrapolated, LoadMap, Need, Reached
from dragchain.quantities.known import Known
from dragchain.statistics.estimate import NORMAL_QUANTILE, Estimate, student_quantile
from dragdeck.documents import Part


class WindowOfRun(Part):
    """A window of a run.

    Attributes
    ----------
    run : str
    refused : str
        Why it does not enter; empty if it does.
    arc_m : float
        Path of the sample, m.
    values : mapping
        Quantities of the sample.
    load_map : tuple of float
        As in `PathQuantities`.
    cpu_time_s : float
    """

    run: str
    refused: str = ""
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
        How many windows to run in all; as many as there were if this round is the last.
    last : bool
    """

    remedy = "make it with: ./run dragchain step windows"

    tolerance: Reached
    windows: tuple[WindowOfRun, ...]
    wanted: int
    last: bool


# --- estimate ------------------------------------------------------------------------------------


_CAUTION, _DOUBT = 1.5, 1.5
"""Factor on the standard deviation between scenes, since a user's differs more from designed ones
than they do from each other; and standard deviations between the windows and other scenes beyond
which only the windows count. Both keep the level in scenes like no other (benchmarks)."""

_MOST_PACKINGS = 999

_RELATIVE = ("ratio_log", "ratio_log_std", "packing_std")


@dataclass(frozen=True)
class Joined:
    """A value at physical stiffness, and what it is made of.

    Attributes
    ----------
    value : float
    window_variance : float
        Of one window.
    other_precision : float
        One over the variance of the value by other scenes; 0 if they do not count.
    packing_variance : float
    degrees : float
        Degrees of freedom of `window_variance`.
    """

    value: float
    window_variance: float
    other_precision: float
    packing_variance: float
    degrees: float

    def half_width(self, windows: int, packings: int = 1) -> float:
        """Half-width of the 95 % interval with so many windows in each packing."""
        precision = windows / self.window_variance + self.other_precision
        variance = (1.0 / precision + self.packing_variance) / packings
        return student_quantile(max(self.degrees, 1.0)) * math.sqrt(variance)

    def estimate(self, windows: int) -> Estimate:
        """The value with its interval."""
        return Estimate.around(self.value, self.half_width(windows))


def joined(windows: Sequence[float] | Floats, stretches: Floats, known: Known) -> Joined:
    """The value from K windows and the soft run.

    Parameters
    ----------
    windows : sequence of K floats
        Values of the windows.
    stretches : (B,) ndarray
        Values of the soft run over stretches as long as a window's sample.
    known : Known
    """
    value, soft = float(np.mean(windows)), float(np.mean(stretches))
    relative = float(np.var(stretches / soft, ddof=1)) if len(stretches) > 1 else 0.0
    degrees = known.degrees + len(windows) - 1
    squares = known.degrees * known.variance_ratio * relative
    squares += float(((np.asarray(windows) / value - 1.0) ** 2).sum())
    own = value**2 * squares / degrees
    other = soft * math.exp(known.ratio_log)
    std = _CAUTION * known.ratio_log_std
    spread = other**2 * (std**2 + relative / len(stretches))
    agrees = abs(value - other) <= _DOUBT * math.sqrt(spread + own / len(windows))
    precision = 1.0 / spread if agrees else 0.0
    weight = len(windows) / own
    mean = (weight * value + precision * other) / (weight + precision) if precision else value
    return Joined(mean, own, precision, (mean * known.packing_std) ** 2, degrees)


def joined_squares(windows: Floats, stretches: Floats, known: Known) -> Joined:
    """The root of a mean square, from the squares of windows and of the soft run's stretches.

    `known` is of the root, whose relative errors are half of those of the square.
    """
    doubled = {name: 2.0 * getattr(known, name) for name in _RELATIVE}
    found = joined(windows, stretches, known.model_copy(update=doubled))
    scale = 4.0 * found.value  # the square of the derivative of the square by its root
    return Joined(
        math.sqrt(found.value),
        found.window_variance / scale,
        found.other_precision * scale,
        found.packing_variance / scale,
        found.degrees,
    )


def windows_needed(found: Joined, windows: int, tolerance: float, most: int) -> Need:
    """How many windows, at most so many, or else packings bring the half-width to a tolerance."""
    limit = tolerance * abs(found.value)
    enough = next((n for n in range(1, most + 1) if found.half_width(n) <= limit), most)
    packings = 1
    while packings < _MOST_PACKINGS and found.half_width(enough, packings) > limit:
        packings += 1
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
    scale = total.relative_half_width / NORMAL_QUANTILE
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
