"""How LIGGGHTS splits its box among ranks, and how many particles each gets."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from dragdeck.errors import Caution
from dragdeck.physics.walls import Container

_MOST_OVER_MEAN = 1.5
"""A warning is given where the fullest rank has more than this times the mean."""

ENGINE_CHOOSES = "* * 1"
"""The engine splits the floor as evenly as it can, and never the height."""

_POINTS = 129
"""Points across a cell at which the width of the bowl is taken."""

Counts = tuple[int, int, int]
_Fractions = NDArray[np.float64]


@dataclass(frozen=True)
class FilledBowl:
    """Particles in a bowl within the engine's box, as far as the split goes.

    Attributes
    ----------
    particles : int
    bowl : Container
    height_m : float
        Of the space they fill, from the floor at z = 0.
    half_widths_m, bottom_m, top_m
        The box: along x and y from minus to plus `half_widths_m`.
    reach_m : float
        How far beyond its cell a rank looks for neighbours.
    """

    particles: int
    bowl: Container
    height_m: float
    half_widths_m: tuple[float, float]
    bottom_m: float
    top_m: float
    reach_m: float


@dataclass(frozen=True)
class Split:
    """A grid of ranks and the particles it is expected to give them.

    Attributes
    ----------
    grid : (int, int, int)
        Ranks along x, y and z.
    largest : float
        Particles that the fullest rank knows of, its own and its neighbours'.
    particles : list of float
        Own particles of each rank.
    """

    grid: Counts
    largest: float
    particles: list[float]

    @property
    def mean(self) -> float:
        """Own particles of each rank."""
        return sum(self.particles) / len(self.particles)

    @property
    def idle(self) -> int:
        """Ranks without a particle to expect."""
        return sum(particles < 0.5 for particles in self.particles)

    @property
    def most_over_mean(self) -> float:
        """Own particles of the fullest rank over the mean."""
        return max(self.particles) / self.mean

    @property
    def line(self) -> str:
        """What the deck's ``processors`` gets; the engine's own choice where it is this one."""
        x, y, z = self.grid
        most_even = min(abs(a - b) for a, b, c in _grids(x * y) if c == 1)
        return ENGINE_CHOOSES if z == 1 and abs(x - y) == most_even else f"{x} {y} {z}"

    def __str__(self) -> str:
        shown = " x ".join(str(count) for count in self.grid)
        if len(self.particles) == 1:
            return f"{shown}: one rank"
        return (
            f"{shown}: {min(self.particles):,.0f} to {max(self.particles):,.0f} particles per "
            f"rank, {self.largest:,.0f} with those of its neighbours"
        )


@lru_cache(maxsize=16)
def split(ranks: int, filled: FilledBowl) -> Split:
    """The grid in which the busiest rank has the least to do.

    A flat wide bowl is split along the floor, a tall column along its height, if the box
    has not much room above it.
    """
    splits = [_split(grid, filled) for grid in _grids(ranks)]
    return min(splits, key=lambda part: (float(f"{part.largest:.6g}"), part.grid[2], -part.grid[0]))


def _grids(ranks: int) -> Iterator[Counts]:
    """All ways to write a number as a product of three."""
    factors = [n for n in range(1, ranks + 1) if ranks % n == 0]
    for x, y in product(factors, factors):
        if ranks % (x * y) == 0:
            yield x, y, ranks // (x * y)


def _split(grid: Counts, filled: FilledBowl) -> Split:
    """What a grid gives each rank."""
    most, known = (
        filled.particles
        * np.outer(_floor_fractions(grid, filled, reach), _height_fractions(grid[2], filled, reach))
        for reach in (0.0, filled.reach_m)
    )
    return Split(grid, float(known.max()), most.ravel().tolist())


def _floor_fractions(grid: Counts, filled: FilledBowl, reach_m: float) -> _Fractions:
    """Share of the bowl's floor in each cell of x and y, widened by a reach."""
    halves = zip(grid[:2], filled.half_widths_m, strict=True)
    x_edges, y_edges = (_edges(n, -half, half) for n, half in halves)
    radius, area = filled.bowl.half_widths_m[0], filled.bowl.levels[-1][1]
    fractions = np.empty(grid[:2])
    for i, j in product(range(grid[0]), range(grid[1])):
        x_ends = np.array([x_edges[i] - reach_m, x_edges[i + 1] + reach_m])
        first, last = np.arcsin(np.clip(x_ends / radius, -1, 1))
        angles = np.linspace(first, last, _POINTS)
        within = y_edges[j] - reach_m, y_edges[j + 1] + reach_m
        chord = filled.bowl.chord(radius * np.sin(angles), *within)
        fractions[i, j] = np.trapezoid(chord * radius * np.cos(angles), angles) / area
    return fractions


def _height_fractions(count: int, filled: FilledBowl, reach_m: float) -> _Fractions:
    """Share of the bed's height in each layer of cells, widened by a reach."""
    edges = _edges(count, filled.bottom_m, filled.top_m)
    low = np.clip(edges[:-1] - reach_m, 0, filled.height_m)
    high = np.clip(edges[1:] + reach_m, 0, filled.height_m)
    return np.asarray((high - low) / filled.height_m)


def _edges(count: int, low: float, high: float) -> _Fractions:
    return np.linspace(low, high, count + 1)


def rank_warnings(domain_split: Split) -> list[Caution]:
    """What a user should know of a split before the run; a single rank has none."""
    ranks, text = len(domain_split.particles), ""
    if domain_split.idle:
        text = (
            f"{domain_split.idle} of {ranks} MPI ranks would have no particle, in a grid of "
            f"{' x '.join(map(str, domain_split.grid))}: use another number (fidelity.ranks)"
        )
    elif domain_split.most_over_mean > _MOST_OVER_MEAN:
        text = (
            f"the fullest of {ranks} MPI ranks would have "
            f"{domain_split.most_over_mean:.2g} times the "
            f"mean number of particles, more than {_MOST_OVER_MEAN:g}: a number with more factors "
            "splits more evenly (fidelity.ranks)"
        )
    return [Caution("ranks", text, {"ranks": 1})] if text else []
