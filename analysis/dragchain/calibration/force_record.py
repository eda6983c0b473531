"""A measured drop test as a CSV: force over time."""

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from scipy.stats import theilslopes

from dragchain.arrays import Floats
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
    slope = float(theilslopes(force, time).slope)
    return np.array([slope, float(np.median(force_n - slope * time_s))])
