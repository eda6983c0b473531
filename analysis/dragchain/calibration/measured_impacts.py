"""The impacts in a measured drop test."""

import math
from collections.abc import Sequence
from itertools import groupby

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field
from pydantic.json_schema import SkipJsonSchema
from scipy.ndimage import maximum_filter1d
from scipy.signal import find_peaks, peak_widths

from dragchain.arrays import Floats
from dragchain.calibration.drops import IMPACTS
from dragdeck.documents import Document
from dragdeck.errors import RecordError
from dragdeck.parts import Part
from dragdeck.study.force_record import Note, Record, quiet_line

_QUIET_SAMPLES = 20
"""Samples needed before the first impact, to know baseline and noise."""

_THRESHOLD_STDS = 6.0
"""An impact stands out of the noise by so many standard deviations: white noise
does so once in 5e8 samples."""

_SIGNAL_TO_NOISE = 10.0
"""The first peak is at least so many standard deviations high."""

_DEAD_FRACTION = 0.05
"""What follows an impact within this fraction of the fall time belongs to it: a
sensor rings, and a particle with restitution 0.05 flies for twice as long."""

_MAD_TO_STD = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""

_CENTROID_FRACTION = 0.2
"""Force over peak that counts nothing for the time of an impact: a slow sensor's
tail would be cut by the noise at another fraction of each impact."""

_FLAT_TOP = 0.4
"""Fraction of a pulse's samples above half its height that may lie within 1 % of its
top; 0.13 for an elastic Hertz impact, whose force is nearly (sin)^1.5."""


class Impact(Part):
    """One impact as the sensor shows it.

    Attributes
    ----------
    impact : int
        Its number, from 1.
    peak_time_s : float
        Time of the largest sample, s.
    centroid_s : float
        Mean time of the pulse, s, weighted with the force above a fifth of the peak, so that
        large and small impacts are treated alike.
    peak_n : float
        Largest sample above the baseline, N.
    width_s : float
        Width at half of the largest sample, interpolated between samples, s.
    samples : int
        Samples above the threshold.
    """

    impact: int
    peak_time_s: float
    centroid_s: float
    peak_n: float
    width_s: float
    samples: int


class MeasuredImpacts(Document):
    """The impacts of a measured record: ``record.json``.

    Attributes
    ----------
    interval_s : float
        Sampling interval, s.
    offset_n, drift_n_per_s : float
        Baseline at the record's start, N, and its slope, N/s.
    noise_n : float
        Standard deviation of the noise about the baseline, N.
    threshold_n : float
        Least force of an impact above the baseline, N.
    notes : tuple of str
        Corrections of the samples, and remarks for the user.
    impacts : tuple of Impact
        The first two or three.
    first_pulse : (M, 2) ndarray
        Times, s, and forces above the baseline, N, of the first impact; not in the file.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    interval_s: float
    offset_n: float
    drift_n_per_s: float
    noise_n: float
    threshold_n: float
    notes: tuple[Note, ...] = ()
    impacts: tuple[Impact, ...]
    first_pulse: SkipJsonSchema[Floats] = Field(default=np.empty((0, 2)), exclude=True, repr=False)

    def baseline(self, time_s: Floats, start_s: float) -> Floats:
        """Baseline at times, for a record that starts at `start_s`, N."""
        return self.offset_n + self.drift_n_per_s * (time_s - start_s)


def measure_impacts(record: Record, *, fall_time_s: float) -> MeasuredImpacts:
    """Find baseline, noise and the first impacts of a record.

    Parameters
    ----------
    record : Record
    fall_time_s : float
        Time of the free fall before the first impact, s. What follows an
        impact within 0.05 of it counts as its ringing.

    Raises
    ------
    RecordError
        ``baseline``, ``impacts``, ``coarse``, ``clipped`` or ``order``.
    """
    dead = max(1, round(_DEAD_FRACTION * fall_time_s / record.interval_s))
    time = record.time_s - record.time_s[0]
    offset, drift, noise = _baseline(time, record.force_n, dead)
    force = record.force_n - offset - drift * time
    # rounding to the sensor's resolution moves a sample by up to half of it
    threshold = _THRESHOLD_STDS * noise + _quantum(record.force_n) / 2.0
    pulses = _pulses(force, threshold, dead)
    _check_count(pulses, force, noise)
    # at most three, the last of them whole
    whole = [(a, b) for a, b in pulses if b + 2 < len(force)][:IMPACTS]
    if len(whole) < 2:
        raise _too_few(len(whole))
    impacts = tuple(
        pulse(record.time_s, force, ends, record.interval_s, number)
        for number, ends in enumerate(whole, start=1)
    )
    _check_tops(force, record.force_n, whole, noise)
    _check_order(impacts)
    first = slice(max(whole[0][0] - 1, 0), whole[0][1] + 2)
    two: tuple[Note, ...] = ("two_impacts",) if len(impacts) < IMPACTS else ()
    return MeasuredImpacts(
        interval_s=record.interval_s,
        offset_n=offset,
        drift_n_per_s=drift,
        noise_n=noise,
        threshold_n=threshold,
        notes=(*record.notes, *two),
        impacts=impacts,
        first_pulse=np.column_stack([record.time_s[first], force[first]]),
    )


def _baseline(time: Floats, force: Floats, dead: int) -> tuple[float, float, float]:
    """Offset, drift and noise of the quiet samples.

    A line through them, begun with `quiet_line` and fitted again without what
    stands out, until that changes nothing. What stands out is told by the
    median absolute deviation, which the impacts do not touch, or by the
    sensor's resolution where that is coarser. The noise is the standard
    deviation of what is left.
    """
    coarse = _quantum(force) / 2.0
    line, quiet = quiet_line(time, force), np.ones(len(force), dtype=bool)
    for _ in range(20):
        rest, before = force - np.polyval(line, time), quiet
        spread = max(_MAD_TO_STD * float(np.median(np.abs(rest[quiet]))), coarse)
        quiet = ~_widened(np.abs(rest) > _THRESHOLD_STDS * spread, dead)
        if quiet.sum() < _QUIET_SAMPLES or np.array_equal(quiet, before):
            break
        line = np.polyfit(time[quiet], force[quiet], 1)
    noise = float(rest[quiet].std()) if quiet.sum() >= _QUIET_SAMPLES else spread
    return float(line[1]), float(line[0]), max(noise, coarse / math.sqrt(3.0))


def _widened(mask: NDArray[np.bool_], after: int) -> NDArray[np.bool_]:
    """True also for `after` samples after each true one, and two before it."""
    return np.asarray(maximum_filter1d(mask, after + 3, origin=(after - 2) // 2, mode="constant"))


def _quantum(force: Floats) -> float:
    """Smallest difference between two values: the sensor's resolution, N."""
    steps = np.diff(np.unique(force))
    return float(steps.min()) if len(steps) else 0.0


def _pulses(force: Floats, threshold: float, dead: int) -> list[tuple[int, int]]:
    """First and last sample of each pulse above the threshold.

    Of tops within `dead` samples only the highest makes a pulse, which is the unbroken run about
    it: neither noise at its foot nor the sensor's ringing makes another one.
    """
    tops = find_peaks(np.pad(force, 1), height=threshold, distance=dead + 1)[0] - 1
    below = np.flatnonzero(force <= threshold)
    at = np.searchsorted(below, tops)
    first, last = np.append(-1, below)[at] + 1, np.append(below, len(force))[at] - 1
    return list(zip(first.tolist(), last.tolist(), strict=True))


def _too_few(count: int) -> RecordError:
    return RecordError(
        "impacts",
        "fewer than two complete impacts",
        value=str(count),
        limit="at least 2, better 3",
        remedy="record for a longer time, starting before the first impact",
    )


def _check_count(pulses: Sequence[tuple[int, int]], force: Floats, noise: float) -> None:
    if not pulses:
        raise _too_few(0)
    first = pulses[0][0]
    if first < _QUIET_SAMPLES:
        raise RecordError(
            "baseline",
            "no quiet baseline before the first impact",
            value=f"{first} samples",
            limit=f"at least {_QUIET_SAMPLES}",
            remedy="trigger earlier, so that the record starts before the first impact",
        )
    if float(force.max()) < _SIGNAL_TO_NOISE * noise:
        raise RecordError(
            "baseline",
            "no quiet baseline: the signal-to-noise ratio of the impacts is too low",
            value=f"largest force {force.max():.3g} N, noise {noise:.3g} N (standard deviation)",
            limit=f"a ratio of at least {_SIGNAL_TO_NOISE:g}",
            remedy="use a larger drop height, or a more sensitive range",
        )


def pulse(
    time: Floats, force: Floats, ends: tuple[int, int], interval: float, number: int = 1
) -> Impact:
    """Measure one impact.

    Parameters
    ----------
    time, force : (N,) ndarray
        Times, s, and forces above the baseline, N.
    ends : (int, int)
        First and last sample above the threshold.
    interval : float
        Sampling interval, s.
    number : int
        Of the impact.

    Raises
    ------
    RecordError
        ``coarse``: there is one sample only.
    """
    first, last = ends
    if last - first < 1:
        raise RecordError(
            "coarse",
            "the sampling rate is too low to resolve an impact",
            value=f"one sample at {time[first]:.6g} s, interval {interval:.3g} s",
            limit="at least 2 samples per impact",
            remedy="record at a higher rate",
        )
    top = first + int(np.argmax(force[first : last + 1]))
    foot, end = max(first - 1, 0), min(last + 1, len(force) - 1)
    near = slice(foot, end + 1)
    weight = np.maximum(force[near] - _CENTROID_FRACTION * force[top], 0.0)
    from_zero = (force[[top]], np.array([foot]), np.array([end]))
    width = float(peak_widths(force, [top], 0.5, prominence_data=from_zero)[0][0])
    return Impact(
        impact=number,
        peak_time_s=float(time[top]),
        centroid_s=float(np.sum(weight * time[near]) / np.sum(weight)),
        peak_n=float(force[top]),
        width_s=max(1.0, width) * interval,
        samples=last - first + 1,
    )


def _check_tops(
    force: Floats, raw: Floats, pulses: Sequence[tuple[int, int]], noise: float
) -> None:
    """Refuse clipped peaks.

    Three signs, each enough: four equal samples in a row at the top, though
    the noise is four times the resolution; a top too flat for an impact; the
    same largest value in two impacts, which a rebound cannot have.
    """
    fine = noise > 4 * _quantum(raw)
    tops = [raw[first : last + 1] for first, last in pulses]
    largest = [float(samples.max()) for samples in tops]
    for number, ((first, last), samples) in enumerate(zip(pulses, tops, strict=True), start=1):
        high = samples[samples >= samples.max() - 0.5 * force[first : last + 1].max()]
        flat = int(np.sum(high >= samples.max() - 0.01 * force[first : last + 1].max()))
        equal = max(len(list(run)) for top, run in groupby(samples == samples.max()) if top)
        least = 3 if len(high) <= 4 else 4  # of so few, no three are near the top of an impact
        if (equal >= 4 and fine) or (flat >= least and flat > _FLAT_TOP * len(high)):
            raise _clipped(f"impact {number} has {max(flat, equal)} samples at its top", largest)
    if largest[0] == largest[1]:
        raise _clipped("impacts 1 and 2 have the same largest value", largest)


def _clipped(problem: str, largest: Sequence[float]) -> RecordError:
    return RecordError(
        "clipped",
        f"{problem}: the sensor or its amplifier reached its limit",
        value=", ".join(f"{value:.6g} N" for value in largest),
        remedy="use a wider range, or a smaller drop height",
    )


def _check_order(impacts: Sequence[Impact]) -> None:
    """Refuse impacts that cannot be one particle's: a flight longer than the one before."""
    flights = np.diff([impact.centroid_s for impact in impacts])
    if len(flights) > 1 and flights[1] > flights[0] * (1.0 + 1e-3):
        raise RecordError(
            "order",
            "the second flight is longer than the first, which is impossible for rebounds",
            value=f"{flights[0] * 1e3:.3g} ms, then {flights[1] * 1e3:.3g} ms",
            remedy="remove everything before the first impact, and after the particle was caught",
        )
