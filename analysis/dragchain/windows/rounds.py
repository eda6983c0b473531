"""Rounds of windows: what the windows so far say, and how many more are needed."""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from dragchain.arrays import Floats
from dragchain.quantities.along import PathQuantities, quantities_along
from dragchain.quantities.document import ExtrapolatedQuantity, LoadMap, Need, Reached
from dragchain.quantities.registry import COMPARED, Quantity
from dragchain.statistics.estimate import Estimate
from dragchain.tables.by_step import read_table
from dragchain.tradeoff.measure_run import make_tables, read_outcome
from dragchain.tradeoff.measures import checks_in_words
from dragchain.windows.estimate import (
    UNKNOWN,
    Joined,
    Round,
    WindowOfRun,
    WindowsRecord,
    corrected_map,
    joined,
    joined_squares,
    windows_needed,
)
from dragdeck.records.case import load_case

_FEWEST = 2
"""Windows of which one alone says nothing of its scatter."""

_MOST_MORE = 2.0
"""A round has at most so many times the windows of the one before."""

_NONE = Estimate(math.nan, math.nan, math.nan)

_PLATEAU = 0.15
"""Largest relative difference of the coordination number in the first third of a sample from that
in the rest: a bed that was thrown up by the ramp differs by far more (docs/evidence/windows.md)."""


def judge_windows(
    run_dir: Path,
    windows: Sequence[Path],
    before: Path | None,
    tolerance: float,
    quantities: Sequence[str],
    most: int,
    record: Path,
    out: Path,
) -> None:
    """Write what the windows of a run say of its quantities at physical stiffness.

    Parameters
    ----------
    run_dir : Path
        The run with reduced moduli, with tables and chains.
    windows : sequence of Path
        Folders of its windows so far, those of the round before first.
    before : Path or None
        That round, whose windows are not measured again; None for the first.
    tolerance : float
        Relative half-width of the interval at which no further window is run.
    quantities : sequence of str
        To which the tolerance applies.
    most : int
        Number of windows that there can be.
    record : Path
        ``windows.json``.
    out : Path
        The file to write.

    Raises
    ------
    TableError
        A run has no outcome, or its outputs cannot be read.
    """
    soft = quantities_along(run_dir, load_case(run_dir))
    known = Round.read(before).windows if before else ()
    found = (*known, *(_measured(folder) for folder in windows[len(known) :]))
    judged(soft, found, tolerance, quantities, most, WindowsRecord.read(record)).write(out)


def judged(
    soft: PathQuantities,
    windows: Sequence[WindowOfRun],
    tolerance: float,
    asked: Sequence[str],
    most: int,
    record: WindowsRecord,
) -> Round:
    """The round that these windows are; see `judge_windows`."""
    good = [one for one in windows if not one.refused]
    rows, needs = [], [Need(_FEWEST, 1)]
    values = soft.values()
    for quantity, found in _joined(soft, values, good, record):
        value = found.estimate(len(good)) if found else _NONE
        rows.append(
            ExtrapolatedQuantity(
                name=quantity.name,
                label=quantity.label,
                unit=quantity.unit,
                measured=Estimate(values[quantity.name], math.nan, math.nan),
                value=value if value.known else None,
            )
        )
        if quantity.name in asked and found:
            needs.append(windows_needed(found, len(good), tolerance, most))
    widths = {one.name: one.value.relative_half_width for one in rows if one.value}
    reached = len(good) >= _FEWEST and all(
        widths.get(name, math.inf) <= tolerance for name in asked
    )
    need = Need(*(max(numbers) for numbers in zip(*needs, strict=True)))
    last = reached or len(windows) >= most
    wanted = len(windows) + max(1, need.windows - len(good))
    wanted = min(wanted, math.ceil(_MOST_MORE * len(windows)), most)
    return Round(
        quantities=tuple(rows),
        tolerance=Reached(
            tolerance=tolerance,
            asked=tuple(asked),
            reached=reached,
            needed=need,
            runs=tuple(one.run for one in good),
            refused={one.run: one.refused for one in windows if one.refused},
        ),
        load_map=_load_map(soft, good, rows),
        windows=tuple(windows),
        wanted=len(windows) if last else wanted,
        last=last,
    )


def _load_map(
    soft: PathQuantities, windows: Sequence[WindowOfRun], rows: Sequence[ExtrapolatedQuantity]
) -> LoadMap | None:
    total = next((one.value for one in rows if one.name == "normal_load"), None) or _NONE
    runs = soft.arc_m / windows[0].arc_m if windows else math.nan
    return corrected_map(soft.load_map, [one.load_map for one in windows], total, runs)


def _joined(
    soft: PathQuantities,
    values: Mapping[str, float],
    windows: Sequence[WindowOfRun],
    record: WindowsRecord,
) -> Iterator[tuple[Quantity, Joined | None]]:
    """Each quantity of the soft run at physical stiffness, None if not all windows have it."""
    for quantity in COMPARED:
        if quantity.name not in values:
            continue
        if any(quantity.name not in one.values for one in windows) or len(windows) < _FEWEST:
            yield quantity, None
        else:
            join = joined_squares if quantity.squared else joined
            known = record.quantities.get(quantity.name, UNKNOWN)
            stretches = _stretches(soft, quantity.name, windows[0].arc_m)
            yield quantity, join(_of_windows(quantity, windows), stretches, known)


def _of_windows(quantity: Quantity, windows: Sequence[WindowOfRun]) -> Floats:
    """A quantity in each window, its square where its blocks hold squares.

    In a window, the drag deviates from a mean of its own. What waves longer than its sample add to
    the variance is how far that mean is from that of all windows.
    """
    own = np.array([one.values[quantity.name] for one in windows]) ** (1 + quantity.squared)
    if quantity.name != "drag_std":
        return own
    means = np.array([one.values["drag_mean"] for one in windows])
    away = (means - means.mean()) ** 2 * len(means) / (len(means) - 1)
    return np.asarray(own + away)


def _stretches(soft: PathQuantities, name: str, arc_m: float) -> Floats:
    """Means of a quantity's blocks over stretches of the soft run as long as a window's sample."""
    blocks = soft.of_blocks(name)
    each = max(1, round(arc_m / soft.block_m))
    count = max(1, len(blocks) // each)
    return np.array([one.mean() for one in np.array_split(blocks, count)])


def _measured(folder: Path) -> WindowOfRun:
    """A window with its quantities; refused if it failed or its bed has not come to rest."""
    outcome, case = read_outcome(folder), load_case(folder)
    window = WindowOfRun(run=folder.name, cpu_time_s=outcome.processor_time_s)
    if not outcome.complete:
        why = checks_in_words(outcome.failed_checks) or "not complete"
        return window.model_copy(update={"refused": why})
    make_tables(folder)
    along = quantities_along(folder, case)
    found = {"arc_m": along.arc_m, "values": along.values(), "refused": unsettled(folder)}
    return window.model_copy(update={**found, "load_map": along.load_map})


def unsettled(folder: Path) -> str:
    """Why a window's bed has not come to its plateau, empty if it has."""
    contacts = read_table(folder / "tables" / "network.parquet")["coordination_number"]
    first = max(1, len(contacts) // 3)
    early, late = contacts[:first].mean(), contacts[first:].mean()
    if abs(early / late - 1.0) <= _PLATEAU:
        return ""
    return (
        f"the bed has not settled: its coordination number is {early:.3g} in the first third of "
        f"the sample and {late:.3g} in the rest"
    )
