"""Rounds of windows: what the windows so far say, and how many more are needed."""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from dragchain.arrays import Floats
from dragchain.quantities.document import (
    MEASURED_FILE,
    LoadMap,
    Need,
    PathQuantities,
    Reached,
    RunQuantities,
)
from dragchain.quantities.known import UNKNOWN, WindowsRecord
from dragchain.quantities.registry import MEASURED, Quantity
from dragchain.statistics.estimate import Estimate
from dragchain.tables.by_step import read_table
from dragchain.windows.estimate import (
    Joined,
    Round,
    WindowOfRun,
    corrected_map,
    joined,
    joined_squares,
    windows_needed,
)

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
    tolerance: float,
    quantities: Sequence[str],
    most: int,
    out: Path,
) -> None:
    """Write what the windows of a run say of its quantities at physical stiffness.

    Parameters
    ----------
    run_dir : Path
        The run with reduced moduli.
    windows : sequence of Path
        Folders of its windows so far.
    tolerance : float
        Relative half-width of the interval at which no further window is run.
    quantities : sequence of str
        To which the tolerance applies.
    most : int
        Number of windows that there can be.
    out : Path
        The file to write.

    Raises
    ------
    DocumentError
        A run has no ``quantities.json``.
    """
    soft = RunQuantities.read(run_dir / MEASURED_FILE)
    measured = [_measured(folder) for folder in windows]
    judged(soft, measured, tolerance, quantities, most, WindowsRecord.shipped()).write(out)


def judged(
    soft: PathQuantities,
    windows: Sequence[WindowOfRun],
    tolerance: float,
    asked: Sequence[str],
    most: int,
    record: WindowsRecord,
) -> Round:
    """The round that these windows are; see `judge_windows`."""
    good = [window for window in windows if not window.refused]
    values, needs = {}, [Need(_FEWEST, 1)]
    for quantity, join in _joined(soft, good, record):
        value = join.estimate(len(good))
        if value.known:
            values[quantity.name] = value
        if quantity.name in asked:
            needs.append(windows_needed(join, len(good), tolerance, most))
    widths = {name: value.relative_half_width for name, value in values.items()}
    reached = len(good) >= _FEWEST and all(
        widths.get(name, math.inf) <= tolerance for name in asked
    )
    need = Need(*(max(numbers) for numbers in zip(*needs, strict=True)))
    last = reached or len(windows) >= most
    wanted = len(windows) + max(1, need.windows - len(good))
    wanted = min(wanted, math.ceil(_MOST_MORE * len(windows)), most)
    return Round(
        values=values,
        tolerance=Reached(
            tolerance=tolerance,
            asked=tuple(asked),
            reached=reached,
            needed=need,
            runs=tuple(window.run for window in good),
            refused={window.run: window.refused for window in windows if window.refused},
        ),
        load_map=_load_map(soft, good, values),
        windows=tuple(windows),
        wanted=len(windows) if last else wanted,
        last=last,
    )


def _load_map(
    soft: PathQuantities, windows: Sequence[WindowOfRun], values: Mapping[str, Estimate]
) -> LoadMap | None:
    total = values.get("normal_load", _NONE)
    runs = soft.arc_m / windows[0].arc_m if windows else math.nan
    return corrected_map(soft.load_map, [window.load_map for window in windows], total, runs)


def _joined(
    soft: PathQuantities, windows: Sequence[WindowOfRun], record: WindowsRecord
) -> Iterator[tuple[Quantity, Joined]]:
    """Each quantity at physical stiffness that the soft run and all windows have."""
    known_of_all = [soft.values(), *(window.values for window in windows)]
    for quantity in MEASURED if len(windows) >= _FEWEST else ():
        if quantity.name == "peaks":  # they stand out of the drag's long waves, which windows lack
            continue
        if all(quantity.name in values for values in known_of_all):
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
    means = blocks.means(max(1, len(blocks.values) // each))
    return means[np.isfinite(means)]


def _measured(folder: Path) -> WindowOfRun:
    """A window with its quantities; refused if it failed or its bed has not come to rest."""
    run = RunQuantities.read(folder / MEASURED_FILE)
    window = WindowOfRun(run=folder.name, cpu_time_s=run.cost.cpu_time_s)
    if not run.complete:
        return window.model_copy(update={"refused": run.why_failed or "not complete"})
    measured = {"arc_m": run.arc_m, "values": run.values(), "refused": unsettled(folder)}
    return window.model_copy(update={**measured, "load_map": run.load_map})


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
