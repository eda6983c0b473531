"""How many engine processes a run gets, and how its box is split among them.

The engine cuts the box into equal cells, one a rank. What a rank has to do goes with the
balls in its cell and with those near enough to its faces that it must know of them.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dragdeck.errors import InputError

CORES_VARIABLE = "DRAGDECK_CORES"
"""Environment variable: cores that ``ranks: auto`` may count on, if not those seen here."""

FEWEST_BALLS_A_RANK = 5000
"""``ranks: auto`` gives no rank fewer balls. Two ranks of 5,000 balls were measured to take
1.08 times the processor time of one with all (docs/big.md); smaller runs are soon done
anyway, and on a machine that others use too their ranks wait for each other."""

MOST_OVER_MEAN = 1.5
"""A warning is given where the fullest rank has more than this times the mean."""

ENGINE_CHOOSES = "* * 1"
"""The engine splits the floor as evenly as it can, and never the height."""

_POINTS = 129
"""Points across a cell at which the width of the bowl is taken."""

Counts = tuple[int, int, int]
Shares = NDArray[np.float64]


@dataclass(frozen=True)
class Filling:
    """Balls in a round bowl within the engine's box, as far as the split goes.

    Attributes
    ----------
    balls : int
    radius_m, height_m : float
        Of the space they fill, from the floor at z = 0.
    half_width_m, bottom_m, top_m : float
        The box: from minus to plus `half_width_m` along x and y.
    reach_m : float
        How far beyond its cell a rank looks for neighbours.
    """

    balls: int
    radius_m: float
    height_m: float
    half_width_m: float
    bottom_m: float
    top_m: float
    reach_m: float


@dataclass(frozen=True)
class Split:
    """A grid of ranks and the balls it is expected to give them.

    Attributes
    ----------
    grid : (int, int, int)
        Ranks along x, y and z.
    largest : float
        Balls that the fullest rank knows of, its own and its neighbours'.
    balls : list of float
        Own balls of each rank.
    """

    grid: Counts
    largest: float
    balls: list[float]

    @property
    def mean(self) -> float:
        """Own balls a rank."""
        return sum(self.balls) / len(self.balls)

    @property
    def idle(self) -> int:
        """Ranks without a ball to expect."""
        return sum(balls < 0.5 for balls in self.balls)

    @property
    def most_over_mean(self) -> float:
        """Own balls of the fullest rank over the mean."""
        return max(self.balls) / self.mean

    @property
    def line(self) -> str:
        """What the deck's ``processors`` gets; the engine's own choice where it is this one."""
        x, y, z = self.grid
        most_even = min(abs(a - b) for a, b, c in _grids(x * y) if c == 1)
        return ENGINE_CHOOSES if z == 1 and abs(x - y) == most_even else f"{x} {y} {z}"

    def __str__(self) -> str:
        shown = " x ".join(str(count) for count in self.grid)
        if len(self.balls) == 1:
            return f"{shown}: one rank, {self.mean:,.0f} balls"
        return (
            f"{shown}: {min(self.balls):,.0f} to {max(self.balls):,.0f} balls a rank, "
            f"{self.largest:,.0f} with those of its neighbours"
        )


def split(ranks: int, filling: Filling) -> Split:
    """The grid in which the busiest rank has the least to do.

    A flat wide bowl is split along the floor, a tall column along its height, if the box
    has not much room above it.
    """
    found = [_split(grid, filling) for grid in _grids(ranks)]
    return min(found, key=lambda one: (float(f"{one.largest:.6g}"), one.grid[2], -one.grid[0]))


def _grids(ranks: int) -> Iterator[Counts]:
    """All ways to write a number as a product of three."""
    factors = [n for n in range(1, ranks + 1) if ranks % n == 0]
    for x, y in product(factors, factors):
        if ranks % (x * y) == 0:
            yield x, y, ranks // (x * y)


def _split(grid: Counts, filling: Filling) -> Split:
    """What a grid gives each rank."""
    own, known = (
        filling.balls
        * np.outer(_floor_shares(grid, filling, reach), _height_shares(grid[2], filling, reach))
        for reach in (0.0, filling.reach_m)
    )
    return Split(grid, float(known.max()), own.ravel().tolist())


def _floor_shares(grid: Counts, filling: Filling, reach_m: float) -> Shares:
    """Share of the bowl's floor in each cell of x and y, widened by a reach."""
    radius, half_width = filling.radius_m, filling.half_width_m
    x_edges, y_edges = (_edges(n, -half_width, half_width) for n in grid[:2])
    shares = np.empty(grid[:2])
    for i, j in product(range(grid[0]), range(grid[1])):
        x_ends = np.array([x_edges[i] - reach_m, x_edges[i + 1] + reach_m])
        first, last = np.arcsin(np.clip(x_ends / radius, -1, 1))
        angles = np.linspace(first, last, _POINTS)
        chord = radius * np.cos(angles)  # half of it, at x = radius sin(angle)
        low, high = (
            np.clip(y, -chord, chord) for y in (y_edges[j] - reach_m, y_edges[j + 1] + reach_m)
        )
        shares[i, j] = np.trapezoid((high - low) * chord, angles) / (np.pi * radius**2)
    return shares


def _height_shares(count: int, filling: Filling, reach_m: float) -> Shares:
    """Share of the bed's height in each layer of cells, widened by a reach."""
    edges = _edges(count, filling.bottom_m, filling.top_m)
    low = np.clip(edges[:-1] - reach_m, 0, filling.height_m)
    high = np.clip(edges[1:] + reach_m, 0, filling.height_m)
    return np.asarray((high - low) / filling.height_m)


def _edges(count: int, low: float, high: float) -> Shares:
    return np.linspace(low, high, count + 1)


def warnings(found: Split) -> list[str]:
    """What a user should know of a split before the run."""
    ranks = len(found.balls)
    if found.idle:
        return [
            f"{found.idle} of {ranks} ranks would have no ball, in a grid of "
            f"{' x '.join(map(str, found.grid))}: take another number (fidelity.ranks)"
        ]
    if found.most_over_mean > MOST_OVER_MEAN:
        return [
            f"the fullest of {ranks} ranks would have {found.most_over_mean:.2g} times the mean "
            f"number of balls, more than {MOST_OVER_MEAN:g}: a number with more factors splits "
            "more evenly (fidelity.ranks)"
        ]
    return []


def auto_ranks(balls: int, cases: int, cores: int) -> int:
    """Ranks of a run of a study with that many cases.

    Ranks wait for each other, cases do not: where there are as many cases as cores, each
    gets one. The cores that are left share a case as long as each has enough balls.

    Parameters
    ----------
    balls : int
        In one run.
    cases : int
        That can run beside each other.
    cores : int
        Of the machine.
    """
    return max(1, min(cores // cases, balls // FEWEST_BALLS_A_RANK))


def cores_here() -> int:
    """Cores that this process may use, or the number in `CORES_VARIABLE`.

    Raises
    ------
    InputError
        The variable is no number above zero.
    """
    told = os.environ.get(CORES_VARIABLE)
    if told is None:
        return len(os.sched_getaffinity(0))
    if not told.isdecimal() or int(told) < 1:
        raise InputError(
            "not a number of cores",
            field=CORES_VARIABLE,
            value=told,
            limit="a whole number, at least 1",
            remedy="correct the environment variable, or unset it",
        )
    return int(told)


def decomposition(screen: str) -> dict[str, Any] | None:
    """The split that the engine made, from what it printed; None where it says nothing.

    Returns
    -------
    dict
        ``grid``, ranks along x, y and z; ``balls``, the ``mean``, ``most`` and ``least`` of
        a rank at the end of the last ``run`` command, or None before one has ended.
    """
    grids = re.findall(r"^ *(\d+) by (\d+) by (\d+) MPI processor grid$", screen, re.MULTILINE)
    if not grids:
        return None
    loads = re.findall(r"^Nlocal: +(\S+) ave (\d+) max (\d+) min$", screen, re.MULTILINE)
    balls = None
    if loads:
        mean, most, least = loads[-1]
        balls = {"mean": float(mean), "most": int(most), "least": int(least)}
    return {"grid": [int(count) for count in grids[-1]], "balls": balls}
