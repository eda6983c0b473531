"""Rounds of windows: what the windows so far say, and how many more are needed."""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from dragchain.arrays import Floats
from dragchain.run.case import load_case
from dragchain.tradeoff.measures import Measures, PathQuantities
from dragchain.tradeoff.path_blocks import quantities_along
from dragchain.tradeoff.quantities import QUANTITIES, Quantity
from dragchain.windows.document import Refused, Round, WindowedQuantity
from dragchain.windows.estimate import joined, needed

FIRST = 3
"""Windows of the first round, at least."""

_MOST_MORE = 2.0
"""A round has at most so many times the windows of the one before."""


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
        ``measures.json`` of its windows so far.
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
    measured = [Measures.read(file) for file in windows]
    refused = [one for run in measured for one in _refused(run)]
    bad = {one.run for one in refused}
    good = [run for run in measured if run.run not in bad]
    values = [run.values() for run in good]
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
        windows=tuple(run.run for run in good),
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


def _refused(window: Measures) -> Iterator[Refused]:
    """Why a window does not enter, if it does not."""
    if not window.complete:
        check = window.telling_failure
        yield Refused(
            run=window.run, why=f"{check.name}: {check.seen}" if check else "not complete"
        )
