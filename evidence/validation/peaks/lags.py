"""Event-triggered averages: the strength of the dominant chain before and after the peaks."""

from collections.abc import Mapping, Sequence

import numpy as np

from dragchain.arrays import Floats, Ints
from dragchain.documents import Part
from dragchain.statistics.estimate import Real
from evidence.validation.peaks.run_series import RunSeries
from evidence.validation.peaks.settings import DEFAULTS, Definition
from evidence.validation.peaks.shift_test import band, joint, standardised

_LAG_S = 0.5
"""The averages reach this far before and after a peak."""

_BAND_SHIFTS = 2000
"""Shifts from which the band comes."""

_LAGGED = ("bottleneck_over_mean", "stands_out", "exists")
"""Numbers of the chain that are averaged."""


class LagCurve(Part):
    """A number of the chain around all peaks, in standard deviations of each run.

    Attributes
    ----------
    mean : sequence of float
        Over the runs, for each lag.
    by_run : sequence of sequence of float
    band : float
        95 % of shifted data sets stay within it at all lags.
    peak_lag_s : float
        Where the mean is largest.
    above_s : (float, float) or None
        From when to when around the peak it is above the band; None if it is not at the peak.
    """

    mean: tuple[Real, ...]
    by_run: tuple[tuple[Real, ...], ...]
    band: Real
    peak_lag_s: Real
    above_s: tuple[float, float] | None


class LagCurves(Part):
    """The curves of every definition at its default thresholds, beside that of the resistance."""

    lag_s: tuple[float, ...]
    drag: tuple[Real, ...]
    curves: Mapping[Definition, Mapping[str, LagCurve]]


def lag_curves(runs: Sequence[RunSeries], shifts: Ints) -> LagCurves:
    """Average the chains and the resistance around all peaks, by lag."""
    interval_s = min(run.interval_s for run in runs)
    lags = np.arange(-round(_LAG_S / interval_s), round(_LAG_S / interval_s) + 1)
    lag_s = interval_s * lags.astype(np.float64)
    resistance = _by_shift(runs, [run.resistance_n for run in runs])
    curves = {
        definition: {
            name: _curve(
                _by_shift(runs, [run.chain(at, name) for run in runs]), lags, lag_s, shifts
            )
            for name in _LAGGED
        }
        for definition, at in DEFAULTS.items()
    }
    return LagCurves(
        lag_s=tuple(lag_s.tolist()), drag=tuple(_mean(resistance, lags).tolist()), curves=curves
    )


def _by_shift(runs: Sequence[RunSeries], series: Sequence[Floats]) -> list[Floats]:
    return [
        standardised(one, run.around_peaks(one, "all", 0.0, 0.0))
        for run, one in zip(runs, series, strict=True)
    ]


def _mean(by_shift: Sequence[Floats], lags: Ints) -> Floats:
    return joint(by_shift, np.repeat(lags[:, None], len(by_shift), axis=1))


def _curve(by_shift: Sequence[Floats], lags: Ints, lag_s: Floats, shifts: Ints) -> LagCurve:
    mean, width = _mean(by_shift, lags), band(by_shift, shifts[:_BAND_SHIFTS], lags)
    return LagCurve(
        mean=tuple(mean.tolist()),
        by_run=tuple(tuple(run[lags % len(run)].tolist()) for run in by_shift),
        band=width,
        peak_lag_s=float(lag_s[np.nanargmax(mean)]) if np.isfinite(mean).any() else np.nan,
        above_s=_above(np.nan_to_num(mean) > width, lag_s),
    )


def _above(above: np.typing.NDArray[np.bool_], lag_s: Floats) -> tuple[float, float] | None:
    """First and last lag of the stretch around the peak that is above the band."""
    middle = len(above) // 2
    if not above[middle]:
        return None
    below = np.flatnonzero(~above)
    first = below[below < middle].max(initial=-1) + 1
    last = below[below > middle].min(initial=len(above)) - 1
    return float(lag_s[first]), float(lag_s[last])
