"""Curves of the paper, as others read them off its figures.

``published.csv`` holds points of the figures of Chung and Ooi (2011) that the
authors of Kratos Multiphysics digitised for their own benchmarks (its
``DEMApplication``, folder ``paper_data``), rounded to four digits. They could
not be compared with the paper here, so they are shown and never judged.
"""

from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np
import pandas as pd
from numpy.typing import NDArray


@dataclass(frozen=True)
class Curve:
    """Points of a curve in order of x; there may be none."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]

    def spans(self, x: float) -> bool:
        """Whether x lies between the first and the last point."""
        return len(self.x) > 1 and float(self.x[0]) <= x <= float(self.x[-1])

    def at(self, x: float) -> float:
        """Value at x, by linear interpolation."""
        return float(np.interp(x, self.x, self.y))


@cache
def _table() -> pd.DataFrame:
    with resources.files("evidence.verification").joinpath("published.csv").open() as file:
        return pd.read_csv(file, comment="#")


def published(test: str, series: str, quantity: str) -> Curve:
    """The published curve of a series, or an empty one."""
    table = _table()
    rows = table[
        (table["test"] == test) & (table["series"] == series) & (table["quantity"] == quantity)
    ].sort_values("x")
    return Curve(rows["x"].to_numpy(np.float64), rows["y"].to_numpy(np.float64))
