"""A simulated force signal beside a measured one: mean, spread and peaks, and a figure.

Both signals are low-pass filtered to the same bandwidth and have the same rate. Each quantity has
an interval that accounts for autocorrelation (`dragchain.statistics.correlated`); that of a
difference joins both.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from scipy.signal import welch

from dragchain.arrays import Floats
from dragchain.drag import find_drag_peaks, peak_separation_s
from dragchain.figures.panels import key, legend_below, new_figure, row_mark, row_names
from dragchain.figures.style import COLOURS, GREEN, GREY, RED, drawing, png
from dragchain.report.cases import ReportedCase, ReportedRun
from dragchain.report.findings import ProcessFindings
from dragchain.run.kinematics import needed, process_time
from dragchain.statistics.correlated import MIN_SAMPLES, estimate_mean, estimates
from dragchain.statistics.estimate import NOT_KNOWN, Estimate, flattened, t_interval
from dragdeck.errors import DragdeckError
from dragdeck.study.driven import directions
from dragdeck.study.process_signal import RATES_PER_BANDWIDTH as PER_HZ
from dragdeck.study.process_signal import MeasuredSignal, low_passed, measured_signal
from dragdeck.study.reference import Signal

# --- statistics ----------------------------------------------------------------------------------


Equivalence = Literal["equivalent", "different", "undecided"]
"""What an interval says of a relative difference, see `Difference`."""

QUANTITIES = {"mean": "N", "standard deviation": "N", "peak rate": "1/s", "mean peak height": "N"}
"""What is compared, with its unit."""


@dataclass(frozen=True)
class Difference:
    """A quantity of both signals, and the relative difference of the simulated one.

    Attributes
    ----------
    label, unit : str
    measured, simulated, relative : Estimate
    margin : float
    """

    label: str
    unit: str
    measured: Estimate
    simulated: Estimate
    relative: Estimate
    margin: float

    @property
    def verdict(self) -> Equivalence:
        """The interval is within the margin; or excludes zero; or neither, or is not reliable."""
        relative = self.relative
        if not (relative.known and relative.reliable):
            return "undecided"
        if -self.margin <= relative.ci95_low and relative.ci95_high <= self.margin:
            return "equivalent"
        return "undecided" if relative.contains(0.0) else "different"


def compared(
    measured_n: Floats,
    simulated_n: Sequence[Floats],
    *,
    low_pass_hz: float,
    separation_s: float,
    margin: float,
) -> list[Difference]:
    """Compare the signals of packings with a measured one.

    Differences are relative to the measured value, that of the mean to the measured standard
    deviation if this is larger.

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
    measured, *simulated = (
        _described(force, PER_HZ * low_pass_hz, separation_s)
        for force in (measured_n, *simulated_n)
    )
    differences = []
    for (label, unit), theirs, *packings in zip(
        QUANTITIES.items(), measured, *simulated, strict=True
    ):
        ours, size = _over_packings(packings), abs(theirs.value)
        if label == "mean":
            size = max(size, float(measured_n.std()))
        half = math.hypot(ours.half_width, theirs.half_width)
        difference = Estimate.around(ours.value - theirs.value, half).over(size)
        relative = replace(difference, reliable=ours.reliable and theirs.reliable)
        differences.append(Difference(label, unit, theirs, ours, relative, margin))
    return differences


def _over_packings(values: Sequence[Estimate]) -> Estimate:
    """The mean over packings; its interval is Student's t for the difference from one more.

    The measured signal has a packing of its own. That of a single packing is along its path.
    """
    count = len(values)
    if count == 1:
        return values[0]
    numbers = np.array([estimate.value for estimate in values])
    scatter = float(numbers.std(ddof=1)) * math.sqrt(1 + 1 / count)
    mean = t_interval(float(numbers.mean()), scatter, count - 1)
    return replace(mean, reliable=all(estimate.reliable for estimate in values))


def _described(force: Floats, rate_hz: float, separation_s: float) -> list[Estimate]:
    """The quantities of a signal in the order of `QUANTITIES`."""
    mean = estimate_mean(force).estimate
    time = np.arange(len(force)) / rate_hz
    peaks = find_drag_peaks(time, -force, min_separation_s=separation_s)
    apart = _mean(np.diff(peaks.time_s))
    rate = Estimate(1 / apart.value, 1 / apart.ci95_high, 1 / apart.ci95_low,
                    reliable=apart.reliable)  # fmt: skip
    spread = estimates((force - force.mean())[:, None] ** 2, np.sqrt)[0]
    return [mean, spread, rate, _mean(-peaks.drag_n)]


def _mean(series: Floats) -> Estimate:
    """The mean of a series in the order of time, not known if it is too short."""
    if len(series) < MIN_SAMPLES:
        return NOT_KNOWN
    return estimate_mean(series).estimate


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
        return Counter(difference.verdict for difference in self.differences)

    def counted(self, force_n: Floats) -> Floats:
        """What of a signal is compared, positive in the direction in which peaks are counted."""
        sign = -1.0 if self.signal.component == "drag" else 1.0
        rate = PER_HZ * self.signal.low_pass_hz
        kept = force_n[math.ceil(self.transient_s * rate - 1e-9) :]
        return sign * kept[np.isfinite(kept)]

    def table(self) -> pd.DataFrame:
        """One row per quantity; the intervals are those of the report."""
        names = ("label", "unit", "measured", "simulated", "relative", "verdict")
        return pd.DataFrame(
            {"case": self.case.name}
            | flattened({name: getattr(difference, name) for name in names})
            for difference in self.differences
        )

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
        heading = partial(directions, case.first.process.study.motion)
        measured = measured_signal(file, signal, heading, transient_s)
        simulated = tuple(_simulated(study.process, signal) for study in case.studies)
        comparison = SignalComparison(case, signal, "", measured, simulated, transient_s)
        differences = compared(
            comparison.counted(measured.force_n),
            [comparison.counted(force) for force in simulated],
            low_pass_hz=signal.low_pass_hz,
            separation_s=factor * peak_separation_s(first),
            margin=signal.margin,
        )
    except DragdeckError as error:
        return SignalComparison(case, signal, str(error))
    return replace(comparison, differences=tuple(differences))


def _simulated(run: ReportedRun[ProcessFindings], signal: Signal) -> Floats:
    column = f"{signal.component}_n"
    table = run.table("workpiece_force", ["time_s", "phase", column])
    table = table[table["phase"] == "drag"]
    time_s, force = (table[name].to_numpy(np.float64) for name in ("time_s", column))
    return low_passed(process_time(time_s, run.case), force, signal.low_pass_hz)[1]


_MARKS = {"equivalent": GREEN, "different": RED, "undecided": GREY}


def _drawn(comparison: SignalComparison) -> Figure:
    """Both signals over time, their power spectra, and the differences with their intervals."""
    signal, measured = comparison.signal, needed(comparison.measured, "measured signal")
    rate = PER_HZ * signal.low_pass_hz
    figure = new_figure(6.4)
    grid = figure.add_gridspec(2, 2, width_ratios=(1, 1.15), height_ratios=(1, 1.2))
    above, left, right = map(figure.add_subplot, (grid[0, :], grid[1, 0], grid[1, 1]))
    every = {"experiment": measured.force_n, "drag": comparison.simulated[0]}
    for (name, force), label in zip(every.items(), ("measured", "simulated"), strict=True):
        above.plot(np.arange(len(force)) / rate, force, color=COLOURS[name], lw=0.8, label=label)
        frequency, power = welch(comparison.counted(force), rate, nperseg=min(len(force) // 4, 512))
        left.loglog(frequency[1:], power[1:], color=COLOURS[name], label=label)
    end, grey = min(map(len, every.values())) / rate, COLOURS["transient"]
    above.axvspan(0, comparison.transient_s, color=grey, alpha=0.6, lw=0, label="transient")
    above.set(xlabel="process time (s)", ylabel=f"{signal.component} force (N)", xlim=(0, end))
    left.axvline(signal.low_pass_hz, color=GREY, ls=":", label="bandwidth")
    left.set(xlabel="frequency (Hz)", ylabel="power spectral density (N²/Hz)")
    right.axvspan(-100 * signal.margin, 100 * signal.margin, color=GREEN, alpha=0.12, lw=0)
    for place, difference in enumerate(comparison.differences):
        relative = difference.relative.over(0.01)
        row_mark(right, place, relative, _MARKS[difference.verdict])
    for verdict, colour in _MARKS.items():
        key(right, verdict, color=colour)
    row_names(right, [difference.label for difference in comparison.differences])
    right.set(xlabel="relative difference (%)", xlim=(-100, 100))
    return legend_below(figure)
