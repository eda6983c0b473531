"""The impacts in a measured drop test."""

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydantic import ConfigDict, Field
from pydantic.json_schema import SkipJsonSchema

from dragchain.arrays import Floats
from dragchain.documents import Document, Part
from dragchain.errors import RecordError

TIME_COLUMNS = {"time_s": 1.0, "time_ms": 1e-3, "time_us": 1e-6}
FORCE_COLUMNS = {"force_n": 1.0, "force_mn": 1e-3, "force_kn": 1e3}
"""Accepted column names and their units in SI; ``force_mn`` is millinewton."""

_LEAST_SAMPLES = 100
_BLOCKS = 50
"""Blocks of a record whose medians a line is put through: impacts touch few of them."""

_JITTER = 0.25
"""A time may be off an even grid by this fraction of the interval (rounded stamps)."""

Note = Literal["sign_turned", "two_impacts"]
"""What was done to a record, and what its reader should know; the page has the words."""


@dataclass(frozen=True)
class Record:
    """Samples of a force sensor under the plate.

    Attributes
    ----------
    time_s : (N,) ndarray
        Even times, s.
    force_n : (N,) ndarray
        Force, N, compression positive, offset still in it.
    interval_s : float
        Sampling interval, s.
    notes : tuple of str
        What was done to the samples.
    """

    time_s: Floats
    force_n: Floats
    interval_s: float
    notes: tuple[Note, ...] = ()


def read_record(file: Path) -> Record:
    """Read a CSV of force over time.

    Parameters
    ----------
    file : Path
        A header line, then one row per sample; ``,`` or ``;`` or a tab between
        columns, a point in numbers; lines that begin with ``#`` are comments.
        One column of `TIME_COLUMNS` and one of `FORCE_COLUMNS`; others are
        left alone.

    Raises
    ------
    RecordError
        The file cannot be used; `reason` says why: ``file``, ``columns``,
        ``numbers``, ``short``, ``time``, ``uneven``.
    """
    try:
        text = file.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise RecordError("file", f"{file} cannot be read: {error}") from None
    return check_samples(*parse_record(text))


def parse_record(text: str) -> tuple[Floats, Floats]:
    """Times in s and forces in N of a CSV text; see `read_record`."""
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if not lines:
        raise RecordError("columns", "the file is empty", remedy="write a header line and samples")
    separator = next((mark for mark in (";", "\t") if mark in lines[0]), ",")
    names = [name.strip().strip('"').lower() for name in lines[0].split(separator)]
    time_name, force_name = (_column(names, known) for known in (TIME_COLUMNS, FORCE_COLUMNS))
    try:
        table = pd.read_csv(
            io.StringIO("\n".join(lines[1:])), sep=separator, names=names, index_col=False
        )
        time, force = (table[name].to_numpy(np.float64) for name in (time_name, force_name))
    except (ValueError, pd.errors.ParserError) as error:
        raise RecordError(
            "numbers",
            f"a value is not a number: {error}",
            remedy="use a decimal point, and a comma, semicolon or tab between columns",
        ) from None
    return time * TIME_COLUMNS[time_name], force * FORCE_COLUMNS[force_name]


def _column(names: Sequence[str], known: dict[str, float]) -> str:
    found = [name for name in names if name in known]
    if len(found) != 1:
        raise RecordError(
            "columns",
            f"{len(found) or 'no'} column(s) with a recognised name",
            value=", ".join(names)[:200],
            limit=f"one of {', '.join(known)}",
            remedy="name the columns in the first line, for example time_s,force_n",
        )
    return found[0]


def check_samples(time_s: Floats, force_n: Floats) -> Record:
    """Check that samples are numbers at even times, and turn compression positive.

    Raises
    ------
    RecordError
        ``short``, ``numbers``, ``time`` or ``uneven``.
    """
    if len(time_s) < _LEAST_SAMPLES:
        raise RecordError(
            "short", "too few samples", value=str(len(time_s)), limit=f"at least {_LEAST_SAMPLES}"
        )
    bad = np.flatnonzero(~(np.isfinite(time_s) & np.isfinite(force_n)))
    if len(bad):
        raise RecordError(
            "numbers",
            "a sample is not a finite number",
            value=f"{len(bad)} samples, the first in row {bad[0] + 1}",
            remedy="remove these samples, or record again",
        )
    back = np.flatnonzero(np.diff(time_s) <= 0.0)
    if len(back):
        row = int(back[0])
        word = "stands still" if time_s[row + 1] == time_s[row] else "runs backwards"
        raise RecordError(
            "time",
            f"time {word}",
            value=f"{time_s[row]:.9g} s then {time_s[row + 1]:.9g} s, rows {row + 1}, {row + 2}",
            remedy="export a single trigger, with enough decimals in the time",
        )
    interval = float((time_s[-1] - time_s[0]) / (len(time_s) - 1))
    even = time_s[0] + interval * np.arange(len(time_s))
    off = np.abs(time_s - even)
    if float(off.max()) > _JITTER * interval:
        row = int(np.argmax(off))
        raise RecordError(
            "uneven",
            "the sampling interval is not constant",
            value=f"row {row + 1} is {off[row] / interval:.2g} intervals off",
            limit=f"{_JITTER:g} intervals of {interval:.3g} s",
            remedy="export every sample at the sampling rate of the sensor",
        )
    rest = force_n - np.polyval(quiet_line(even, force_n), even)
    if -float(rest.min()) > float(rest.max()):
        return Record(even, -force_n, interval, ("sign_turned",))
    return Record(even, force_n, interval)


def quiet_line(time_s: Floats, force_n: Floats) -> Floats:
    """A first line through what lies between the impacts, however steep the drift.

    Its slope is the median of the slopes between the medians of all pairs of blocks (Theil-Sen
    estimator), its offset the median of what is left.

    Parameters
    ----------
    time_s, force_n : (N,) ndarray
        Times, s, and forces, N; at least two samples per block.

    Returns
    -------
    (2,) ndarray
        Slope, N/s, and force at time 0, N.
    """
    time = np.array([np.mean(block) for block in np.array_split(time_s, _BLOCKS)])
    force = np.array([np.median(block) for block in np.array_split(force_n, _BLOCKS)])
    one, other = np.triu_indices(_BLOCKS, 1)
    slope = float(np.median((force[other] - force[one]) / (time[other] - time[one])))
    return np.array([slope, float(np.median(force_n - slope * time_s))])


IMPACTS = 3
"""Impacts compared at the most (Uhlmann et al. 2015, section 4)."""

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
    start_s : float
        Time of the first sample above the threshold, s.
    peak_time_s : float
        Time of the largest sample, s.
    centroid_s : float
        Mean time of the pulse, s, weighted with the force above a fifth of the peak, so that
        large and small impacts are treated alike.
    peak_n : float
        Largest sample above the baseline, N.
    width_s : float
        Width at half of the largest sample, interpolated between samples, s.
    impulse_n_s : float
        Sum of force over time, N s.
    samples : int
        Samples above the threshold.
    """

    impact: int
    start_s: float
    peak_time_s: float
    centroid_s: float
    peak_n: float
    width_s: float
    impulse_n_s: float
    samples: int


class Measured(Document):
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


def measure(record: Record, *, fall_time_s: float) -> Measured:
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
    return Measured(
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
    line = quiet_line(time, force)
    spread = _MAD_TO_STD * float(np.median(np.abs(force - np.polyval(line, time))))
    out = np.zeros(len(force), dtype=bool)
    for _ in range(20):
        before = out
        rest = force - np.polyval(line, time)
        out = _widened(np.abs(rest) > _THRESHOLD_STDS * max(spread, coarse), dead)
        if len(out) - out.sum() < _QUIET_SAMPLES or np.array_equal(out, before):
            break
        line = np.polyfit(time[~out], force[~out], 1)
        spread = _MAD_TO_STD * float(np.median(np.abs((force - np.polyval(line, time))[~out])))
    quiet = (force - np.polyval(line, time))[~out]
    noise = float(quiet.std()) if len(quiet) >= _QUIET_SAMPLES else spread
    return float(line[1]), float(line[0]), max(noise, coarse / math.sqrt(3.0))


def _widened(mask: NDArray[np.bool_], after: int) -> NDArray[np.bool_]:
    """True also for `after` samples after each true one, and two before it."""
    counts = np.zeros(len(mask) + 1, dtype=np.int64)
    where = np.flatnonzero(mask)
    np.add.at(counts, np.maximum(where - 2, 0), 1)
    np.add.at(counts, np.minimum(where + after + 1, len(mask)), -1)
    return np.cumsum(counts[:-1]) > 0


def _quantum(force: Floats) -> float:
    """Smallest difference between two values: the sensor's resolution, N."""
    steps = np.diff(np.unique(force))
    return float(steps.min()) if len(steps) else 0.0


def _pulses(force: Floats, threshold: float, dead: int) -> list[tuple[int, int]]:
    """First and last sample of each pulse above the threshold.

    What follows its first sample within `dead` samples belongs to a pulse: its
    unbroken run about the largest of these counts, so that neither noise at its
    foot nor the sensor's ringing makes another one.
    """
    above = force > threshold
    below = np.flatnonzero(~above)
    found: list[tuple[int, int]] = []
    place = 0
    for begin in np.flatnonzero(above & ~np.roll(above, 1)).tolist():
        if begin < place:
            continue
        place = begin + dead + 1
        top = begin + int(np.argmax(force[begin:place]))
        at = int(np.searchsorted(below, top))
        first = int(below[at - 1]) + 1 if at > 0 else 0
        last = int(below[at]) - 1 if at < len(below) else len(force) - 1
        found.append((first, last))
    return found


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
    near = slice(max(first - 1, 0), last + 2)
    weight = np.maximum(force[near] - _CENTROID_FRACTION * force[top], 0.0)
    return Impact(
        impact=number,
        start_s=float(time[first]),
        peak_time_s=float(time[top]),
        centroid_s=float(np.sum(weight * time[near]) / np.sum(weight)),
        peak_n=float(force[top]),
        width_s=_width(force, top, first, last) * interval,
        impulse_n_s=float(np.sum(force[near])) * interval,
        samples=last - first + 1,
    )


def _width(force: Floats, top: int, first: int, last: int) -> float:
    """Width at half height in samples, interpolated linearly; never below one."""
    half = 0.5 * force[top]
    left, right = top, top
    while left > max(first - 1, 0) and force[left - 1] >= half:
        left -= 1
    while right < min(last + 1, len(force) - 1) and force[right + 1] >= half:
        right += 1
    before = _crossing(force[left - 1], force[left], half) if left > 0 else 0.0
    after = _crossing(force[right + 1], force[right], half) if right + 1 < len(force) else 0.0
    return max(1.0, right - left + before + after)


def _crossing(outside: float, inside: float, half: float) -> float:
    """How far outside the sample above it a level is crossed, in samples."""
    return float(np.clip((inside - half) / (inside - outside), 0.0, 1.0))


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
        if (equal >= 4 and fine) or (flat >= 4 and flat > _FLAT_TOP * len(high)):
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
