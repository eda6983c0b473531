"""Bars of values with their confidence intervals."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes

from dragchain.arrays import Floats
from dragchain.statistics.estimate import EstimateColumns


class Bars(NamedTuple):
    """Values and how far their intervals reach to either side of them, (n,) each."""

    value: Floats
    below: Floats
    above: Floats


def bars_of(columns: EstimateColumns, unit: float = 1.0) -> Bars:
    """Estimates times a unit as bars; an interval that excludes its value reaches up to it."""
    value, low, high = (
        np.array(getattr(columns, name)) * unit for name in ("value", "ci95_low", "ci95_high")
    )
    return Bars(value, value - np.minimum(low, value), np.maximum(high, value) - value)


def depth_bars(axes: Axes, edges_m: Sequence[float], bars: Bars, colour: str) -> None:
    """Draw values in bins of depth (mm on the vertical axis) with their intervals."""
    edges = np.asarray(edges_m) * 1e3
    middle = (edges[:-1] + edges[1:]) / 2
    axes.barh(middle, bars.value, height=0.9 * np.diff(edges), color=colour, alpha=0.75)
    axes.errorbar(
        bars.value, middle, xerr=[bars.below, bars.above], fmt="none", ecolor="black",
        elinewidth=0.9,
    )  # fmt: skip
