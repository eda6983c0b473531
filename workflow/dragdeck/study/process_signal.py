"""Measured force signals of a process: read, corrected, filtered and turned into its directions."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.signal import butter, correlate, sosfiltfilt

from dragdeck.arrays import Floats, Ints
from dragdeck.errors import RecordError
from dragdeck.study.force_record import BLOCKS, JITTER, even_times, force_series, with_holes
from dragdeck.study.reference import Signal, Span
from dragdeck.study.rows import MOST_MISSING
from dragdeck.study.table import user_table

RATES_PER_BANDWIDTH = 5.0
"""Least ratio of a sampling rate to the bandwidth, and that of the common rate."""

_ORDER = 4
_ONSET_STDS, _QUIET_STDS = 6.0, 3.0
_RISE = 0.35
"""Rise time of a low-pass filter from 10 to 90 %, times its bandwidth."""

_LEAST_LENGTHS = 20.0
"""Least duration of the counted signal, in its correlation times."""

_MISSING_WEIGHT = 0.1
"""Part of the weight of the filter on missing samples above which a value is left out."""

_SAME_DIRECTION_RAD = math.radians(1)
_OTHER_TURN = 0.1
"""By which part the turn of an angle in a file may differ from that of the study, beside 10 deg."""

_CLIPPED = 4, 0.125
"""Equal extreme samples in a row that no signal has: so many, and for so long times bandwidth."""


@dataclass(frozen=True)
class MeasuredSignal:
    """A measured force signal during the drag, corrected and low-pass filtered.

    Attributes
    ----------
    time_s, force_n : (N,) ndarray
        Times from the start of the drag, s, and the force along the axis of its component, N, at
        `RATES_PER_BANDWIDTH` samples per period of the bandwidth.
    start_s, start_error_s : float
        Start of the drag in the time of the file, and its uncertainty, s.
    """

    time_s: Floats
    force_n: Floats
    start_s: float
    start_error_s: float


def low_passed(time_s: Floats, force_n: Floats, low_pass_hz: float) -> tuple[Floats, Floats]:
    """A signal at the common rate of a comparison, low-pass filtered without a shift in time.

    A Butterworth filter of fourth order is applied forwards and backwards: the power at
    `low_pass_hz` becomes a quarter.

    Parameters
    ----------
    time_s, force_n : (N,) ndarray
        Even times, s, and forces, N.
    low_pass_hz : float

    Returns
    -------
    (M,) ndarray, (M,) ndarray
        Times from 0 on, s, and forces, N: NaN before the first sample.

    Raises
    ------
    RecordError
        ``slow``: the sampling rate is less than `RATES_PER_BANDWIDTH` times the bandwidth;
        ``short``: the signal is shorter than a period of the bandwidth.
    """
    span, least = time_s[-1] - time_s[0] if len(time_s) else 0.0, 1.0 / low_pass_hz
    if len(time_s) < BLOCKS or span < least:
        problem, remedy = "too short for the bandwidth", "increase low_pass_hz, or use a longer one"
        value, limit = f"{span:.3g} s, {len(time_s)} samples", f"{least:.3g} s, {BLOCKS} samples"
        raise RecordError("short", problem, value=value, limit=f"at least {limit}", remedy=remedy)
    rate = (len(time_s) - 1) / (time_s[-1] - time_s[0])
    if rate < RATES_PER_BANDWIDTH * low_pass_hz * (1 - 1e-6):
        problem, remedy = "sampled too slowly for the bandwidth", "reduce low_pass_hz"
        value, limit = f"{rate:.4g} Hz", f"at least {RATES_PER_BANDWIDTH * low_pass_hz:.4g} Hz"
        raise RecordError("slow", problem, value=value, limit=limit, remedy=remedy)
    smooth = sosfiltfilt(butter(_ORDER, low_pass_hz, fs=rate, output="sos"), force_n)
    grid = np.arange(0.0, time_s[-1], 1.0 / (RATES_PER_BANDWIDTH * low_pass_hz))
    return grid, np.asarray(CubicSpline(time_s, smooth, extrapolate=False)(grid))


def measured_signal(
    file: Path, signal: Signal, directions: Callable[[Floats], Floats], transient_s: float
) -> MeasuredSignal:
    """Read a measured force signal, and refuse one that no comparison can use.

    Parameters
    ----------
    file : Path
        As for `read_record`, with the columns that `signal` names.
    signal : Signal
    directions : function
        Direction of motion, (N,) in rad, at times from the start of the drag, (N,) in s, by which
        the columns of a fixed sensor are turned (`dragdeck.study.driven.directions`).
    transient_s : float
        Time from the start of the drag that no statistic includes, s.

    Raises
    ------
    InputError
        The file is no such table.
    RecordError
        ``angle``, ``axes``, ``columns``, ``missing``, ``time``, ``uneven``, ``short``, ``start``,
        ``clipped`` or ``slow``.
    """
    table, angle = user_table(file), signal.angle_column
    lines, time, values = force_series(table, signal.columns, signal.rate_hz, angle, gaps=True)
    time, values, missing, interval = _gathered(time, values, lines, bool(angle))
    raws = values[: len(signal.columns)]
    rests = [_within(time, span, "rest_s") for span in signal.rest_s]
    forces = np.array([signal.sign * (raw - _baseline(time, raw, rests)) for raw in raws])
    start, error = _start(time, forces, signal, interval)
    end = float(time[-1]) if signal.ends_at_s is None else signal.ends_at_s
    if signal.ends_at_s is None and len(rests) > 1 and signal.rest_s[1][0] > start:
        end = signal.rest_s[1][0]
    _within(time, (start, end), "starts_at_s, ends_at_s")
    used = _within(time, (start + transient_s, end), "starts_at_s, ends_at_s")
    if any(begin < end and stop > start for begin, stop in signal.rest_s):
        problem, value = "the drag overlaps a stretch without load", f"{start:.6g} to {end:.6g} s"
        remedy = "correct rest_s, starts_at_s or ends_at_s"
        raise RecordError("start", problem, value=value, remedy=remedy)
    for raw in raws:
        _check_clipped(raw[used], interval, signal.low_pass_hz)
    kept = time <= end
    since = time[kept] - start
    turned = values[-1, kept] if angle else None
    force = _along(forces[:, kept], turned, signal, directions(since))
    grid, filtered = low_passed(since, force, signal.low_pass_hz)
    if missing.any():
        weight = low_passed(since, missing[kept].astype(np.float64), signal.low_pass_hz)[1]
        filtered[np.abs(weight) > _MISSING_WEIGHT] = np.nan
    _check_length(filtered[(grid >= transient_s) & np.isfinite(filtered)], signal.low_pass_hz)
    return MeasuredSignal(grid, filtered, start, error)


def _gathered(
    time: Floats, values: Floats, lines: Ints, has_angle: bool
) -> tuple[Floats, Floats, NDArray[np.bool_], float]:
    """Even times, (N,) in s; columns, (k, N), missing samples interpolated; where; interval, s."""
    filled_time, filled = with_holes(time, values)
    holes = len(filled_time) > len(time)
    even, interval = even_times(filled_time, None if holes else lines)
    missing = np.asarray(~np.isfinite(filled).all(axis=0))
    if np.count_nonzero(missing) > MOST_MISSING * len(missing):
        value = f"{np.count_nonzero(missing)} of {len(missing)} samples"
        limit, remedy = f"at most {100 * MOST_MISSING:g} %", "record again, or export every sample"
        raise RecordError("missing", "samples are missing", value=value, limit=limit, remedy=remedy)
    rows = [row[~missing] for row in filled]
    if has_angle:
        rows[-1] = np.unwrap(rows[-1])
    joined = np.array([np.interp(even, even[~missing], row) for row in rows])
    return even, joined, missing, interval


def _refuse_single_axis(signal: Signal, direction: Floats) -> None:
    """Refuse a single horizontal axis on a path that turns, unless the sensor turns with it."""
    if signal.fits(turning=bool(np.ptp(direction) > _SAME_DIRECTION_RAD)):
        return
    problem = "it is not stated whether the axes of the sensor turn with the path"
    if signal.orientation:
        problem = "the path turns: the force along one fixed axis is not that along the motion"
    limit = "the columns of two horizontal axes, or one axis that turns with the path"
    remedy = (
        "name the columns of both horizontal axes of a fixed sensor, such as column: [fx_n, fy_n]; "
        "or state orientation: follow_path, if the axis of the sensor turns with the path"
    )
    raise RecordError("axes", problem, value=signal.columns[0], limit=limit, remedy=remedy)


def _along(forces: Floats, angle: Floats | None, signal: Signal, direction: Floats) -> Floats:
    """The component of the force of all axes of a sensor, (k, N), at (N,) directions of motion."""
    if len(forces) == 1:
        _refuse_single_axis(signal, direction)
        return np.asarray(forces[0])
    if signal.component == "vertical":
        return np.asarray(forces[2])
    if angle is not None:
        _refuse_other_turn(angle, direction)
        direction = angle
    if signal.orientation == "follow_path":
        direction = np.zeros_like(direction)
    direction = direction - math.radians(signal.x_axis_deg)
    (x, y), cosine, sine = forces[:2], np.cos(direction), np.sin(direction)
    ahead = signal.component == "drag"
    return np.asarray(x * cosine + y * sine if ahead else y * cosine - x * sine)


def _refuse_other_turn(angle: Floats, direction: Floats) -> None:
    """Refuse an angle that turns otherwise than the path of the study."""
    moving = np.flatnonzero(np.diff(direction, prepend=direction[0]) != 0.0)
    first, last = (moving[0], moving[-1]) if len(moving) else (0, -1)
    ours, theirs = (math.degrees(a[last] - a[first]) for a in (direction, angle))
    if abs(theirs - ours) > _OTHER_TURN * abs(ours) + 10.0:
        problem = "the angles in the file turn otherwise than the path of the study"
        value, limit = f"{theirs:.4g} degrees", f"about {ours:.4g} degrees"
        remedy = (
            "an angle counts counter-clockwise seen from above; correct motion.path or "
            "starts_at_s, or leave out angle_column: the motion of the study is used then"
        )
        raise RecordError("angle", problem, value=value, limit=limit, remedy=remedy)


def _within(time: Floats, span: Span, field: str) -> slice:
    """The samples between two times within the file; at least `BLOCKS` of them."""
    first, last = np.searchsorted(time, span)
    near = (1 + JITTER) * (time[1] - time[0])
    problem = f"too few samples from {span[0]:.6g} to {span[1]:.6g} s"
    if span[0] < time[0] - near or span[1] > time[-1] + near:
        problem = f"the file does not reach from {span[0]:.6g} to {span[1]:.6g} s"
    elif last - first >= BLOCKS:
        return slice(int(first), int(last))
    limit = f"at least {BLOCKS}; the file is from {time[0]:.6g} to {time[-1]:.6g} s"
    value, remedy = f"{max(last - first, 0)}", f"correct {field}, or record for a longer time"
    raise RecordError("short", problem, value=value, limit=limit, remedy=remedy)


def _baseline(time: Floats, force: Floats, rests: Sequence[slice]) -> Floats:
    """Offset and drift at all times, from the means of stretches without load."""
    if not rests:
        return np.zeros(len(time))
    at, level = ([float(values[rest].mean()) for rest in rests] for values in (time, force))
    return np.asarray(np.polyval(np.polyfit(at, level, len(rests) - 1), time))


def _start(time: Floats, forces: Floats, signal: Signal, interval: float) -> tuple[float, float]:
    """When the drag starts, and the uncertainty of that, s.

    A force leaves the noise where it first exceeds six standard deviations of the rest. The
    uncertainty is the time since it was last below three of them, at least the rise time of the
    filter. The filter itself, which spreads a step to both sides, is not applied before.
    """
    if signal.starts_at_s is not None:
        return signal.starts_at_s, interval
    remedy = "add starts_at_s: the time in the file at which the drag starts"
    if not signal.rest_s:
        raise RecordError("start", "neither starts_at_s nor rest_s is given", remedy=remedy)
    rest = (time >= signal.rest_s[0][0]) & (time <= signal.rest_s[0][1])
    noise, after = forces[:, rest].std(axis=1), time > signal.rest_s[0][1]

    def beyond(stds: float) -> NDArray[np.bool_]:
        return np.asarray((np.abs(forces) > stds * noise[:, None]).any(axis=0))

    onset = np.flatnonzero(after & beyond(_ONSET_STDS))
    if not len(onset):
        value = f"standard deviation {', '.join(f'{std:.3g}' for std in noise)} N"
        problem = "the force never leaves the noise of rest_s"
        raise RecordError("start", problem, value=value, remedy=remedy)
    quiet = np.flatnonzero(~beyond(_QUIET_STDS)[: onset[0]])
    last = time[quiet[-1]] if len(quiet) else time[0]
    return float(time[onset[0]]), max(float(time[onset[0]] - last), _RISE / signal.low_pass_hz)


def _check_clipped(raw: Floats, interval: float, low_pass_hz: float) -> None:
    """Refuse runs of identical extreme values."""
    least, long = _CLIPPED
    most = max(least, long / low_pass_hz / interval)
    for extreme in (raw.max(), raw.min()):
        ends = np.flatnonzero(np.diff(np.pad((raw == extreme).astype(int), 1)))
        longest = int(np.max(ends[1::2] - ends[::2]))
        if longest >= most:
            problem = "the signal is clipped: sensor or amplifier reached its limit"
            value, limit = f"{longest} samples of {extreme:.6g} in a row", f"fewer than {most:.0f}"
            remedy = "measure in a wider range"
            raise RecordError("clipped", problem, value=value, limit=limit, remedy=remedy)


def _check_length(force: Floats, low_pass_hz: float) -> None:
    """Refuse a signal of few correlation times: lags at which the autocorrelation is 1/e."""
    rest = force - force.mean() if len(force) else np.zeros(1)
    products = correlate(rest, rest, method="fft")[len(rest) - 1 :]
    lag = max(int(np.argmax(products < products[0] / np.e)), 1)
    if len(force) < _LEAST_LENGTHS * lag or not products[0] > 0.0:
        step = 1.0 / (RATES_PER_BANDWIDTH * low_pass_hz)
        problem = "after the transient it is too short for its own correlation"
        value = f"{len(force) * step:.3g} s, correlation time {lag * step:.3g} s"
        limit, remedy = f"at least {_LEAST_LENGTHS * lag * step:.3g} s", "record for a longer time"
        raise RecordError("short", problem, value=value, limit=limit, remedy=remedy)
