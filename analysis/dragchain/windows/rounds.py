"""Rounds of windows: what the windows so far say, and how many more are needed."""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from dragchain.arrays import Floats
from dragchain.run.case import load_case
from dragchain.run.completeness import read_accepted
from dragchain.tables.by_step import read_table
from dragchain.tradeoff.measures import PathQuantities
from dragchain.tradeoff.path_blocks import quantities_along
from dragchain.tradeoff.quantities import QUANTITIES, Quantity
from dragchain.windows.document import Refused, Round, WindowedQuantity
from dragchain.windows.estimate import joined, needed

FIRST = 3
"""Windows of the first round, at least."""

_MOST_MORE = 2.0
"""A round has at most so many times the windows of the one before."""

_PLATEAU = 0.15
"""Largest relative change of the coordination number within a window's sample."""


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
        The run with reduced moduli, with tables and chains.
    windows : sequence of Path
        Its windows so far, with tables and chains.
    tolerance : float
        Relative half-width of the interval at which no further window is run.
    quantities : sequence of str
        To which the tolerance applies.
    most : int
        Number of windows that there can be.
    out : Path
        The file to write.
    """
    soft = quantities_along(run_dir, load_case(run_dir))
    refused = [one for folder in windows for one in _refused(folder)]
    bad = {one.run for one in refused}
    good = [folder for folder in windows if folder.name not in bad]
    values = [quantities_along(folder, load_case(folder)).values() for folder in good]
    found = list(_windowed(soft, values, quantities))
    asked = [one for one in found if one.asked]
    reached = bool(good) and all(one.half_width <= tolerance for one in asked)
    enough = max(
        (needed(soft.of_blocks(one.name), one.windows, tolerance) for one in asked), default=FIRST
    )
    wanted = min(most, len(windows) + max(1, enough - len(good)))
    if windows:
        wanted = min(wanted, math.ceil(_MOST_MORE * len(windows)))
    last = reached or len(windows) >= most
    Round(
        tolerance=tolerance,
        windows=tuple(folder.name for folder in good),
        refused=tuple(refused),
        wanted=len(windows) if last else max(wanted, min(FIRST, most)),
        last=last,
        reached=reached,
        enough=enough,
        quantities=tuple(found),
    ).write(out)


def _windowed(
    soft: PathQuantities, values: Sequence[Mapping[str, float]], asked: Sequence[str]
) -> Iterator[WindowedQuantity]:
    whole = soft.values()
    for quantity in QUANTITIES:
        if quantity.name not in whole:
            continue
        own = [one[quantity.name] for one in values if quantity.name in one]
        blocks = _window_like(soft, quantity)
        found = joined(blocks, own) if own else None
        yield WindowedQuantity(
            name=quantity.name,
            label=quantity.label,
            unit=quantity.unit,
            asked=quantity.name in asked,
            soft=whole[quantity.name],
            value=found.value if found else math.nan,
            ci95_low=found.ci95_low if found else math.nan,
            ci95_high=found.ci95_high if found else math.nan,
            windows=tuple(own),
        )


def _window_like(soft: PathQuantities, quantity: Quantity) -> Floats:
    """Values of a quantity over stretches of the soft run as long as a window's sample."""
    blocks = soft.of_blocks(quantity.name)
    return np.sqrt(blocks) if quantity.squared else blocks


def _refused(folder: Path) -> Iterator[Refused]:
    """Why a window does not enter, if it does not."""
    read_accepted(folder)
    network = read_table(folder / "tables" / "network.parquet")
    number = network["coordination_number"].to_numpy(np.float64)
    half = len(number) // 2
    first, second = float(number[:half].mean()), float(number[half:].mean())
    if abs(second / first - 1) > _PLATEAU:
        change = f"{first:.2f} to {second:.2f}"
        yield Refused(
            run=folder.name,
            why=f"the bed does not come to rest after its moduli were raised: its coordination "
            f"number changes from {change} within the window",
        )
