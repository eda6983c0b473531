"""Measured forces over time as CSV files, of drop tests and of a process."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.stats import theilslopes

from dragdeck.arrays import Floats, Ints
from dragdeck.errors import InputError, RecordError
from dragdeck.study.reference import Signal
from dragdeck.study.rows import MOST_MISSING, Table
from dragdeck.study.table import column_name, user_table

TIME_COLUMNS = {"time_s": 1.0, "time_ms": 1e-3, "time_us": 1e-6}
FORCE_COLUMNS = {"force_n": 1.0, "force_mn": 1e-3, "force_kn": 1e3}
"""Accepted column names and their units in SI; ``force_mn`` is millinewton."""

FORCE_UNITS = {name.removeprefix("force"): unit for name, unit in FORCE_COLUMNS.items()}
ANGLE_UNITS = {"_deg": math.radians(1), "_rad": 1.0}

_LEAST_SAMPLES = 100
BLOCKS = 50
"""Blocks of a record whose medians a line is put through: impacts touch few of them."""

JITTER = 0.25
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
    """Read a CSV of a drop test.

    Parameters
    ----------
    file : Path
        As for `user_table`: one column of `TIME_COLUMNS`, and a single one with a unit of
        force, or one of `FORCE_COLUMNS`; others are left alone.

    Raises
    ------
    InputError
        The file is no such table.
    RecordError
        The record cannot be used; `reason` says why: ``short``, ``time``, ``uneven``.
    """
    return check_samples(*read_samples(file))


def read_samples(
    file: Path, column: str | None = None, rate_hz: float | None = None
) -> tuple[Floats, Floats, Ints]:
    """Times in s, forces in N and lines of a CSV file; see `read_record`.

    `column` names the force where it is not one of `FORCE_COLUMNS`; `rate_hz` stands in for times.
    """
    table = user_table(file)
    name = _force(table) if column is None else column
    lines, time, forces = force_series(table, [name], rate_hz)
    return time, forces[0], lines


def force_series(
    table: Table, columns: Sequence[str], rate_hz: float | None, angle: str | None = None, *,
    gaps: bool = False,
) -> tuple[Ints, Floats, Floats]:  # fmt: skip
    """Lines, (N,), times, s, and columns, (k, N) in N, an angle in rad at last; `gaps` as NaN.

    Raises
    ------
    InputError
        As `Table.numbers`.
    """
    units = _units(table, columns, angle)
    names = [_column(table, {name: unit}) for name, unit in units.items()]
    missing = names if gaps else ()
    if rate_hz is None or {*table.names} & {*TIME_COLUMNS}:
        time_name = _column(table, TIME_COLUMNS)
        lines, (time, *values) = table.numbers([time_name, *names], missing)
        time *= TIME_COLUMNS[time_name]
    else:
        lines, values = table.numbers(names, missing)
        table.refuse_gaps(lines)
        time = np.arange(len(values[0])) / rate_hz
    if rate_hz is not None:
        _refuse_other_rate(time, rate_hz, table.file)
    return lines, time, np.array(values) * np.array([*units.values()])[:, None]


def in_words(file: Path, signal: Signal | None = None) -> str:
    """How a record is read: columns, rate, first and last row, and what is missing of it."""
    table, gaps = user_table(file), signal is not None
    angle, rate_hz = (signal.angle_column, signal.rate_hz) if signal else (None, None)
    columns = signal.columns if signal else [_force(table)]
    lines, time, values = force_series(table, columns, rate_hz, angle, gaps=gaps)
    rate = (len(time) - 1) / (time[-1] - time[0]) if len(time) > 1 else math.nan
    forces = values[: len(columns)]
    ends = " to ".join(
        ", ".join([f"{time[row]:.6g} s", *(f"{force:.6g} N" for force in forces[:, row])])
        + f" (line {lines[row]})"
        for row in (0, -1)
    )
    names = ", ".join(_units(table, columns, angle))
    _, filled = with_holes(time, values) if gaps else (time, values)
    missing = np.count_nonzero(~np.isfinite(filled).all(axis=0))
    left_out = f"; {missing} of {filled.shape[1]:,} samples missing, left out" if missing else ""
    where = f"{file.name} read as {names}: {len(time):,} rows at {rate:.5g} Hz, {ends}"
    return where + left_out


def _units(table: Table, columns: Sequence[str], angle: str | None) -> dict[str, float]:
    """Names of columns of forces, and of one of an angle at last, with their units in N or rad."""
    units = dict(_unit(table, name, FORCE_UNITS) for name in columns)
    if len(units) < len(columns):
        raise RecordError("columns", "a column is named twice", value=", ".join(columns))
    if angle is not None:
        units |= [_unit(table, angle, ANGLE_UNITS)]
    return units


def _unit(table: Table, column: str, units: Mapping[str, float]) -> tuple[str, float]:
    """Name of a column with its unit at the end, and the unit in N or rad.

    A column may be asked for without the unit that it has in the file.
    """
    name = column_name(column)
    for end, unit in units.items():
        if name.endswith(end):
            return name, unit
    known = [(f"{name}{end}", unit) for end, unit in units.items() if f"{name}{end}" in table.names]
    if len(known) == 1:
        return known[0]
    limit = f"a name that ends in {', '.join(units)}"
    if known:
        limit = f"one of {', '.join(with_unit for with_unit, _ in known)}"
    elif name not in table.names:
        limit += f"; line {table.header_line} has {', '.join(table.names)[:200]}"
    remedy = "give the column its unit in the file, as in Fx [N]"
    raise RecordError("columns", "the column has no unit", value=column, limit=limit, remedy=remedy)


def _force(table: Table) -> str:
    """The only column whose unit is one of forces, or else that which is named a force."""
    forces = [name for name in table.names if name.endswith(tuple(FORCE_UNITS))]
    return forces[0] if len(forces) == 1 else _column(table, FORCE_COLUMNS)


def _column(table: Table, known: Mapping[str, float]) -> str:
    columns = [name for name in table.names if name in known]
    if len(columns) != 1:
        names, remedy = table.names, "name the columns in the first line, such as time_s,force_n"
        quoted = {*names} & {*TIME_COLUMNS, *FORCE_COLUMNS, *known}
        raise InputError(
            f"{len(columns) or 'no'} column(s) with a recognised name", file=table.file,
            line=table.header_line, value=", ".join(names)[:200] if quoted else None,
            limit=f"one of {', '.join(known)}", remedy=remedy,
        )  # fmt: skip
    return columns[0]


def _refuse_other_rate(time: Floats, rate_hz: float, file: Path) -> None:
    """Refuse a sampling rate that the times of the file contradict."""
    even = time[:1] + np.arange(len(time)) / rate_hz
    if np.any(np.abs(time - even) > JITTER / rate_hz):
        mean = (len(time) - 1) / (time[-1] - time[0]) if time[-1] > time[0] else math.nan
        problem, remedy = "rate_hz contradicts the times in the file", "remove or correct rate_hz"
        limit = f"{mean:.6g} Hz, the mean rate of the times"
        raise InputError(problem, file=file, value=f"{rate_hz:g} Hz", limit=limit, remedy=remedy)


def check_samples(time_s: Floats, force_n: Floats, lines: Ints | None = None) -> Record:
    """Check that samples are numbers at even times, and turn compression positive.

    Parameters
    ----------
    time_s, force_n : (N,) ndarray
        Times, s, and forces, N.
    lines : (N,) array, optional
        Where they stand in their file; none: numbers of samples, from 1.

    Raises
    ------
    RecordError
        ``short``, ``numbers``, ``time`` or ``uneven``.
    """
    word, places = _places(len(time_s), lines)
    bad = np.flatnonzero(~(np.isfinite(time_s) & np.isfinite(force_n)))
    if len(bad):
        raise RecordError(
            "numbers", "a sample is not a finite number",
            value=f"{len(bad)} samples, the first is {word} {places[bad[0]]}",
            remedy="remove these samples, or record again",
        )  # fmt: skip
    even, interval = even_times(time_s, lines)
    rest = force_n - np.polyval(quiet_line(even, force_n), even)
    if -float(rest.min()) > float(rest.max()):
        return Record(even, -force_n, interval, ("sign_turned",))
    return Record(even, force_n, interval)


def _places(count: int, lines: Ints | None) -> tuple[str, Ints]:
    """What samples are called in messages, and their numbers; a few are refused."""
    if count < _LEAST_SAMPLES:
        raise RecordError(
            "short", "too few samples", value=str(count), limit=f"at least {_LEAST_SAMPLES}"
        )
    return ("sample", np.arange(1, count + 1)) if lines is None else ("line", lines)


def even_times(time_s: Floats, lines: Ints | None) -> tuple[Floats, float]:
    """Even times and their interval, s; errors are those of `check_samples`."""
    word, places = _places(len(time_s), lines)
    back = np.flatnonzero(np.diff(time_s) <= 0.0)
    if len(back):
        row = int(back[0])
        verb = "stands still" if time_s[row + 1] == time_s[row] else "runs backwards"
        times = f"{time_s[row]:.9g} s then {time_s[row + 1]:.9g} s"
        value = f"{times}, {word}s {places[row]} and {places[row + 1]}"
        remedy = "export a single trigger, with enough decimals in the time"
        raise RecordError("time", f"time {verb}", value=value, remedy=remedy)
    interval = float((time_s[-1] - time_s[0]) / (len(time_s) - 1))
    even = time_s[0] + interval * np.arange(len(time_s))
    off = np.abs(time_s - even)
    if float(off.max()) > JITTER * interval:
        row = int(np.argmax(off))
        raise RecordError(
            "uneven", "the sampling interval is not constant",
            value=f"{word} {places[row]} is {off[row] / interval:.2g} intervals off",
            limit=f"{JITTER:g} intervals of {interval:.3g} s",
            remedy="export every sample at the sampling rate of the sensor",
        )  # fmt: skip
    return even, interval


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
    time = np.array([np.mean(block) for block in np.array_split(time_s, BLOCKS)])
    force = np.array([np.median(block) for block in np.array_split(force_n, BLOCKS)])
    slope = float(theilslopes(force, time).slope)
    return np.array([slope, float(np.median(force_n - slope * time_s))])


def with_holes(time: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Times, (N,) in s, and columns, (k, N), with NaN for absent rows between others.

    Times that are even, or that are no multiples of an interval, are returned as they are.
    """
    step = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if not step > 0:
        return time, values
    place = np.rint((time - time[0]) / step)
    count = int(place[-1]) + 1
    if not 0 < count - len(time) <= MOST_MISSING * count or (np.diff(place) < 1).any():
        return time, values
    off = np.abs(time - time[0] - (time[-1] - time[0]) / (count - 1) * place)
    if off.max() > JITTER * step:
        return time, values
    filled = np.full((len(values), count), np.nan)
    filled[:, place.astype(int)] = values
    return np.interp(np.arange(count), place, time), filled
