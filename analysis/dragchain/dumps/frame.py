"""A frame of a dump."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Columns = dict[str, NDArray[np.float64] | NDArray[np.int64]]


@dataclass(frozen=True)
class Frame:
    """What an output holds at one step.

    Attributes
    ----------
    step : int
        The step.
    columns : dict of str to (N,) ndarray
        The columns by our names, N rows in no particular order; ids are int64,
        all else is float64. N may be zero and may change between frames.
    opening : bool
        Whether it is the first frame of its file. If a run starts on a step at
        which frames are due, the engine writes one before it makes a step, and
        the forces in it are evaluated anew rather than the applied ones.
    """

    step: int
    columns: Columns
    opening: bool = False

    @property
    def rows(self) -> int:
        """Number of rows N."""
        return len(next(iter(self.columns.values())))

    def vectors(self, *names: str) -> NDArray[np.float64]:
        """Columns side by side, shape (N, len(names)), float64."""
        return np.column_stack([self.columns[name] for name in names]).astype(np.float64)


def is_integer_column(name: str) -> bool:
    """Whether a column counts or names things, which makes it int64 in tables."""
    return name in ("step", "particles", "id", "type") or name.endswith("_id")
