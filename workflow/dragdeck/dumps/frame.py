"""A frame of a dump, and the layout of an output."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Columns = dict[str, NDArray[np.float64] | NDArray[np.int64]]


class Layout(Protocol):
    """What a reader must know of an output file."""

    @property
    def kind(self) -> str:
        """``print``, ``custom`` or ``local``: the LIGGGHTS command that writes it."""

    @property
    def binary(self) -> bool:
        """Whether it is a binary dump."""

    @property
    def foreign(self) -> bool:
        """Whether a user's script wrote it: its dumps may have words, nan, and a column twice."""

    @property
    def columns(self) -> Sequence[str]:
        """Name of each column."""

    @property
    def header(self) -> Sequence[str]:
        """Name of each column in the header of a text file."""


@dataclass(frozen=True)
class Frame:
    """The content of an output at one step.

    Attributes
    ----------
    step : int
        Number of the time step.
    columns : dict of str to (N,) ndarray
        Columns by name, N rows in no particular order; ids are int64, all others float64. N may be
        zero and may differ between frames.
    opening : bool
        Whether it is the first frame of its file. If a run starts at a step with output, LIGGGHTS
        writes this frame before its first step; its forces are re-evaluated, not those applied.
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
        return np.array([self.columns[name] for name in names], dtype=np.float64).T.copy()

    def ids(self, name: str) -> NDArray[np.int64]:
        """A column of ids, shape (N,)."""
        return np.asarray(self.columns[name], dtype=np.int64)

    @property
    def centres(self) -> NDArray[np.float64]:
        """Centres of N particles, (N, 3)."""
        return self.vectors("x_m", "y_m", "z_m")

    @property
    def radii(self) -> NDArray[np.float64]:
        """Radii of N particles, (N,)."""
        return self.vectors("radius_m")[:, 0]

    def by_particle(self) -> "Frame":
        """The rows in the order of particle ids."""
        return self.take(np.argsort(self.ids("particle_id")))

    def take(self, order: NDArray[np.int64]) -> "Frame":
        """Some rows, in the given order."""
        columns: Columns = {name: values[order] for name, values in self.columns.items()}
        return Frame(self.step, columns, self.opening)

    def replaced(self, names: Sequence[str], vectors: NDArray[np.float64]) -> "Frame":
        """The same rows with other values in some columns, (N, len(names))."""
        columns = self.columns | dict(zip(names, vectors.T, strict=True))
        return Frame(self.step, columns, self.opening)


def is_integer_column(name: str) -> bool:
    """Whether a column contains counts or identifiers, which are int64 in tables."""
    return name in ("step", "n_particles", "id", "type") or name.endswith("_id")
