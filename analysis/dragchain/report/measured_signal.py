"""A simulated force signal beside a measured one: quantities, their differences, and a figure.

Both signals are low-pass filtered to the same bandwidth and have the same rate. Each quantity has
an interval that accounts for autocorrelation (`dragchain.statistics.correlated`). The interval of
a difference follows from the two intervals (method of variance estimates recovery: Zou, Donner
2008, Stat. Med. 27, 1693), on the logarithms where the difference is a ratio. All intervals
together contain all true differences in 95 % of comparisons (Bonferroni).
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from scipy.signal import butter, sosfiltfilt, welch
from scipy.special import chdtri, ndtri

from dragchain.arrays import Floats
from dragchain.drag import find_drag_peaks, peak_separation_s
from dragchain.errors import SeriesError
from dragchain.figures.panels import key, legend_below, new_figure, row, row_names
from dragchain.figures.style import COLOURS, GREEN, GREY, RED, drawing, png
from dragchain.report.cases import ReportedCase, ReportedRun
from dragchain.report.findings import ProcessFindings
from dragchain.report.values import mean_over_packings
from dragchain.run.kinematics import needed, process_time
from dragchain.statistics.correlated import MIN_SAMPLES, autocovariance, estimate_mean, estimates
from dragchain.statistics.estimate import CONFIDENCE, Estimate, flattened, student_quantile
from dragdeck.errors import DragdeckError
from dragdeck.study.force_record import RATES_PER_BANDWIDTH as PER_HZ
from dragdeck.study.force_record import MeasuredSignal, low_passed, measured_signal
from dragdeck.study.reference import Signal

# --- statistics ----------------------------------------------------------------------------------


Equivalence = Literal["equivalent", "different", "undecided"]
"""What an interval says of a relative difference, see `Difference`."""


class SignalQuantity(NamedTuple):
    """What of a signal is compared: a difference is relative to the measured value if `ratio`.

    Else it is relative to the mean of the measured signal, or its standard deviation if larger.
    """

    label: str
    unit: str
    ratio: bool = True


_QUANTILES = (0.05, 0.5, 0.95)
_BANDS = (0.0625, 0.125, 0.25, 0.5, 1.0)
"""Edges of the octaves of the power spectrum, relative to the bandwidth."""

SIGNAL_QUANTITIES = (
    SignalQuantity("mean", "N", ratio=False),
    SignalQuantity("standard deviation", "N"),
    *(SignalQuantity(f"{100 * part:g} % quantile", "N", ratio=False) for part in _QUANTILES),
    SignalQuantity("peak rate", "1/s"),
    SignalQuantity("mean peak height", "N"),
    SignalQuantity("correlation time", "s"),
    *(SignalQuantity(f"amplitude, {a:g} to {b:g} of bandwidth", "N") for a, b in pairwise(_BANDS)),
)

JOINT = 1.0 - (1.0 - CONFIDENCE) / len(SIGNAL_QUANTITIES)
"""Level of a single interval."""

_POWER, _NORMAL = float(ndtri(0.95)), float(ndtri(0.5 + 0.5 * JOINT))
_BLOCKS, _LONGEST_LAG = 12, 4
"""Blocks of the jackknife of the correlation time, and lags that it reads, in that time."""

_MOST_SAID = 100
_BEYOND = 0.2
"""Chance with which packings without scatter of their own are taken to have some."""


@dataclass(frozen=True)
class Difference:
    """A quantity of both signals, and the relative difference of the simulated one.

    Attributes
    ----------
    quantity : SignalQuantity
    measured, simulated, relative : Estimate
        Intervals of the level `JOINT`.
    margin : float
    between : bool
        Whether the interval includes scatter between packings beyond that within each.
    """

    quantity: SignalQuantity
    measured: Estimate
    simulated: Estimate
    relative: Estimate
    margin: float
    between: bool

    @property
    def verdict(self) -> Equivalence:
        """The interval is within the margin; or excludes zero; or neither, or is not reliable."""
        one = self.relative
        if not (one.known and one.reliable):
            return "undecided"
        if -self.margin <= one.ci95_low and one.ci95_high <= self.margin:
            return "equivalent"
        return "undecided" if one.contains(0.0) else "different"

    @property
    def needs(self) -> float | None:
        """How many times the length decides in 95 % of cases on a difference of the margin.

        A difference that large is then found, and one of zero is called equivalent.
        """
        one = self.relative
        if self.verdict != "undecided" or not one.known:
            return None
        half = max(one.value - one.ci95_low, one.ci95_high - one.value)
        return (half / self.margin * (1.0 + _POWER / _NORMAL)) ** 2

    @property
    def said(self) -> str:
        """The verdict in words."""
        more, times = "packings" if self.between else "length", self.needs or 0.0
        size = f"{times:.2g}" if times < _MOST_SAID else f"more than {_MOST_SAID}"
        return self.verdict + (f": needs {size} times the {more}" if times else "")


def compared(
    measured_n: Floats,
    simulated_n: Sequence[Floats],
    *,
    low_pass_hz: float,
    separation_s: float,
    margin: float,
) -> list[Difference]:
    """Compare the signals of packings with a measured one.

    Parameters
    ----------
    measured_n, simulated_n : (N,) ndarray, sequence of (M,) ndarray
        Counted samples in N, positive upwards in a peak, at `RATES_PER_BANDWIDTH` per period of
        the bandwidth.
    low_pass_hz : float
    separation_s : float
        Least time between two peaks, s.
    margin : float
        Largest relative difference that counts as equivalent.

    Raises
    ------
    SeriesError
        If a signal is too short.
    """
    theirs = _described(measured_n, low_pass_hz, separation_s)
    described = [_described(force, low_pass_hz, separation_s) for force in simulated_n]
    each = zip(*described, strict=True)
    scale = max(abs(float(measured_n.mean())), float(measured_n.std()))
    found = []
    for quantity, one, packings in zip(SIGNAL_QUANTITIES, theirs, each, strict=True):
        ours, between = _over_packings(packings)
        relative = _difference(ours, one, None if quantity.ratio else scale)
        found.append(Difference(quantity, one, ours, relative, margin, between))
    return found


def _difference(ours: Estimate, theirs: Estimate, scale: float | None) -> Estimate:
    with np.errstate(invalid="ignore", divide="ignore"):
        a, b = (one.mapped(np.log) if scale is None else one.over(scale) for one in (ours, theirs))
    value = a.value - b.value
    below = math.hypot(a.value - a.ci95_low, b.ci95_high - b.value)
    above = math.hypot(a.ci95_high - a.value, b.value - b.ci95_low)
    reliable = ours.reliable and theirs.reliable
    found = Estimate(value, value - below, value + above, reliable=reliable)
    return found.exp(minus=1.0) if scale is None else found


def _over_packings(values: Sequence[Estimate]) -> tuple[Estimate, bool]:
    """The mean over packings, and whether these scatter by more than their own intervals say.

    The interval then is Student's t between packings, for the difference from one more: the
    measured signal has a packing of its own.
    """
    if len(values) == 1:
        return values[0], False
    within, count = mean_over_packings(values), len(values)
    reliable = all(one.reliable for one in values)
    own = np.mean([one.half_width**2 for one in values]) / _NORMAL**2
    variance = float(np.var([one.value for one in values], ddof=1))
    half = within.half_width
    between = variance * (count - 1) > own * chdtri(count - 1, _BEYOND)
    if between:
        reach = student_quantile(count - 1, JOINT) * math.sqrt(variance * (1 + 1 / count))
        half = max(half, reach)
    return replace(Estimate.around(within.value, half), reliable=reliable), bool(between)


def _described(force: Floats, low_pass_hz: float, separation_s: float) -> list[Estimate]:
    """The quantities of a signal in the order of `SIGNAL_QUANTITIES`."""
    if len(force) < MIN_SAMPLES:
        raise SeriesError(f"after the transient, {len(force)} samples of the bandwidth remain")
    rate, rest = PER_HZ * low_pass_hz, force - force.mean()
    time = np.arange(len(force)) / rate
    peaks = find_drag_peaks(time, -force, min_separation_s=separation_s)
    apart = _mean(np.diff(peaks.time_s))
    edges = np.array(_BANDS) * low_pass_hz
    filters = (butter(2, both, "bandpass", fs=rate, output="sos") for both in pairwise(edges))
    return [
        _mean(force),
        _rms(rest),
        *(_quantile(force, part) for part in _QUANTILES),
        Estimate(1 / apart.value, 1 / apart.ci95_high, 1 / apart.ci95_low, reliable=apart.reliable),
        _mean(-peaks.drag_n),
        _correlation_time(rest, rate),
        *(_rms(sosfiltfilt(one, rest)) for one in filters),
    ]


def _mean(series: Floats) -> Estimate:
    """The mean of a series in the order of time, not known if it is too short."""
    if len(series) < MIN_SAMPLES:
        return Estimate(math.nan, math.nan, math.nan)
    return estimate_mean(series, confidence=JOINT).estimate


def _rms(series: Floats) -> Estimate:
    """The root mean square of a series."""
    return estimates(series[:, None] ** 2, np.sqrt, confidence=JOINT)[0]


def _quantile(force: Floats, part: float) -> Estimate:
    """A quantile; its interval from that of the fraction below it (Woodruff 1952)."""
    value = float(np.quantile(force, part))
    below = estimate_mean((force <= value).astype(np.float64), confidence=JOINT)
    half = below.ci95_high - below.mean
    low, high = np.quantile(force, np.clip([part - half, part + half], 0.0, 1.0))
    inside = half <= min(part, 1.0 - part)
    return Estimate(value, float(low), float(high), reliable=below.reliable and inside)


def _correlation_time(rest: Floats, rate_hz: float) -> Estimate:
    """The time after which the autocorrelation is 1/e, between two lags on a straight line.

    The interval is that of a jackknife over blocks of the logarithm (Kuensch 1989, Ann. Stat. 17,
    1217), with Student's t: linear in the autocovariances, as of the other quantities, it is too
    narrow for so skewed a ratio.
    """
    covariance = autocovariance(rest)
    lag = int(np.argmax(covariance < covariance[0] / math.e))
    lags = range(_LONGEST_LAG * lag + 2)
    rows = len(rest) - len(lags)
    if rows < MIN_SAMPLES * _BLOCKS:
        return Estimate(math.nan, math.nan, math.nan)
    products = np.stack([rest[:rows] * rest[one : one + rows] for one in lags], axis=1)
    parts = np.array([part.mean(axis=0) for part in np.array_split(products, _BLOCKS)])
    rho = np.vstack([parts.mean(axis=0), (parts.sum(axis=0) - parts) / (_BLOCKS - 1)])
    rho /= rho[:, :1]
    below = rho < 1 / math.e
    after = np.where(below.any(axis=1), np.maximum(np.argmax(below, axis=1), 1), len(lags) - 1)
    above, under = (rho[np.arange(len(rho)), after + shift] for shift in (-1, 0))
    whole, *others = np.log((after - 1 + (above - 1 / math.e) / (above - under)) / rate_hz)
    se = math.sqrt((_BLOCKS - 1) * np.var(others))
    half = student_quantile(_BLOCKS - 1, JOINT) * se
    reliable = estimate_mean(rest**2).reliable
    return replace(Estimate.around(float(whole), half), reliable=reliable).exp()


# --- report --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SignalComparison:
    """The measured force signal beside that of a case, or why they are not compared.

    Attributes
    ----------
    case : ReportedCase
    signal : Signal
    problem : str
        Empty if they are compared.
    measured : MeasuredSignal or None
    simulated : tuple of (N,) ndarray
        Low-pass filtered force of each packing during the drag, N, at the same rate.
    transient_s : float
        Time from the start of the drag that is not compared, s.
    differences : tuple of Difference
    """

    case: ReportedCase
    signal: Signal
    problem: str = ""
    measured: MeasuredSignal | None = None
    simulated: tuple[Floats, ...] = ()
    transient_s: float = 0.0
    differences: tuple[Difference, ...] = ()

    @property
    def verdicts(self) -> Counter[Equivalence]:
        """Number of quantities with each verdict."""
        return Counter(one.verdict for one in self.differences)

    def counted(self, force_n: Floats) -> Floats:
        """What of a signal is compared, positive in the direction in which peaks are counted."""
        sign = -1.0 if self.signal.component == "drag" else 1.0
        rate = PER_HZ * self.signal.low_pass_hz
        kept = force_n[math.ceil(self.transient_s * rate - 1e-9) :]
        return sign * kept[np.isfinite(kept)]

    def table(self) -> pd.DataFrame:
        """One row per quantity; the intervals are those of the report."""
        names = ("measured", "simulated", "relative", "verdict", "needs")
        rows = (
            {"case": self.case.name, **one.quantity._asdict()} | {k: getattr(one, k) for k in names}
            for one in self.differences
        )
        return pd.DataFrame(map(flattened, rows))

    def picture(self) -> bytes:
        """The figure as PNG."""
        with drawing():
            return png(_drawn(self))


def compare_signal(case: ReportedCase, file: Path | None) -> SignalComparison | None:
    """Compare the force on the workpiece in a case with a measured signal, if the study has one.

    Times of a faster workpiece are process times: in a slow drag the force follows the path, and
    its fluctuations take as much longer as the path does.
    """
    first = case.first.process.case
    reference = case.first.process.study.reference
    signal = reference.signal if reference else None
    if signal is None:
        return None
    if file is None:
        return SignalComparison(case, signal, f"{signal.file} was not given (option --signal)")
    factor = first.fidelity.speed_factor
    transient_s = factor * needed(first.statistics, "statistics").transient_s
    try:
        measured = measured_signal(file, signal, transient_s)
        simulated = tuple(_simulated(study.process, signal) for study in case.studies)
        found = SignalComparison(case, signal, "", measured, simulated, transient_s)
        differences = compared(
            found.counted(measured.force_n),
            [found.counted(force) for force in simulated],
            low_pass_hz=signal.low_pass_hz,
            separation_s=factor * peak_separation_s(first),
            margin=signal.margin,
        )
    except DragdeckError as error:
        return SignalComparison(case, signal, str(error))
    return replace(found, differences=tuple(differences))


def _simulated(run: ReportedRun[ProcessFindings], signal: Signal) -> Floats:
    column = f"{signal.component}_n"
    table = run.table("workpiece_force", ["time_s", "phase", column])
    table = table[table["phase"] == "drag"]
    time_s, force = (table[name].to_numpy(np.float64) for name in ("time_s", column))
    return low_passed(process_time(time_s, run.case), force, signal.low_pass_hz)[1]


_MARKS = {"equivalent": GREEN, "different": RED, "undecided": GREY}


def _drawn(found: SignalComparison) -> Figure:
    """Both signals over time, their power spectra, and the differences with their intervals."""
    signal, measured = found.signal, needed(found.measured, "measured signal")
    rate = PER_HZ * signal.low_pass_hz
    figure = new_figure(6.4)
    grid = figure.add_gridspec(2, 2, width_ratios=(1, 1.15), height_ratios=(1, 1.2))
    above, left, right = map(figure.add_subplot, (grid[0, :], grid[1, 0], grid[1, 1]))
    every = {"experiment": measured.force_n, "drag": found.simulated[0]}
    for (name, force), label in zip(every.items(), ("measured", "simulated"), strict=True):
        above.plot(np.arange(len(force)) / rate, force, color=COLOURS[name], lw=0.8, label=label)
        frequency, power = welch(found.counted(force), rate, nperseg=min(len(force) // 4, 512))
        left.loglog(frequency[1:], power[1:], color=COLOURS[name], label=label)
    end, grey = min(map(len, every.values())) / rate, COLOURS["transient"]
    above.axvspan(0, found.transient_s, color=grey, alpha=0.6, lw=0, label="transient")
    above.set(xlabel="process time (s)", ylabel=f"{signal.component} force (N)", xlim=(0, end))
    left.axvline(signal.low_pass_hz, color=GREY, ls=":", label="bandwidth")
    left.set(xlabel="frequency (Hz)", ylabel="power spectral density (N²/Hz)")
    right.axvspan(-100 * signal.margin, 100 * signal.margin, color=GREEN, alpha=0.12, lw=0)
    for place, one in enumerate(found.differences):
        relative = one.relative.over(0.01)
        row(right, place, relative.value, relative, _MARKS[one.verdict])
    for verdict, colour in _MARKS.items():
        key(right, verdict, color=colour)
    row_names(right, [one.quantity.label for one in found.differences])
    right.set(xlabel="relative difference (%)", xlim=(-100, 100))
    return legend_below(figure)
