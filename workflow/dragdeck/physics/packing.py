"""The particles before they fall: their radii and first positions.

The engine gets every particle by name from a data file instead of inserting them at random: the
asked number with the asked sizes, without a chance to fall short, at a cost that grows linearly.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dragdeck.arrays import Floats, Ints
from dragdeck.errors import InputError
from dragdeck.physics.rounding import is_prime
from dragdeck.physics.walls import Container

_SPACING = 1.2
"""Lattice spacing over the largest diameter: room to jitter, and to fall."""

FIRST_SPEED_M_S = 0.3
"""Standard deviation of each component of the particles' first velocities, m/s; the
vertical one points down."""


@dataclass(frozen=True)
class Bed:
    """A settled bed.

    Attributes
    ----------
    surface_m : float
        Its mean height above the floor.
    top_m : float
        The highest point of any particle.
    margin_m : float
        By how much the surface may be lower or higher, if it is an estimate.
    """

    surface_m: float
    top_m: float
    margin_m: float = 0.0

    @property
    def lowest_m(self) -> float:
        """Lowest height of the surface, m."""
        return self.surface_m - self.margin_m

    @property
    def highest_m(self) -> float:
        """Highest height of the surface, m."""
        return self.surface_m + self.margin_m


@dataclass(frozen=True)
class Particles:
    """Particles in the air above the bowl's floor.

    Attributes
    ----------
    classes : (N,) array of int
        Class of each, in ascending order.
    radii_m : (N,) array
    positions_m : (N, 3) array
        Centres; no two particles touch.
    velocities_m_s : (N, 3) array
    """

    classes: Ints
    radii_m: Floats
    positions_m: Floats
    velocities_m_s: Floats

    @cached_property
    def top_m(self) -> float:
        """Height of the highest point, m."""
        return float((self.positions_m[:, 2] + self.radii_m).max())

    @cached_property
    def fastest_m_s(self) -> float:
        """Largest first speed of a particle, m/s."""
        return float(np.linalg.norm(self.velocities_m_s, axis=1).max())


def pour(classes_m: Sequence[Floats], bowl: Container, seed: int) -> Particles:
    """Place particles on a jittered lattice inside a bowl, in random order.

    Parameters
    ----------
    classes_m : sequence of (N,) array
        Radii of the particles of each class.
    bowl : Container
    seed : int
        Of the order of the radii, the jitter and the first velocities.

    Raises
    ------
    InputError
        The largest particle does not fit into the bowl.
    """
    random = np.random.default_rng(seed)
    radii = np.concatenate(classes_m)
    largest = float(radii.max())
    sites = _sites(len(radii), bowl, largest)
    jitter = (_SPACING - 1) * largest * 0.999
    velocities = random.normal(0.0, FIRST_SPEED_M_S, sites.shape)
    velocities[:, 2] = -np.abs(velocities[:, 2])  # none leaves through the top
    order = random.permutation(len(radii))
    positions = sites + random.uniform(-jitter, jitter, sites.shape)
    of_class = np.repeat(
        np.arange(len(classes_m)), [len(class_radii) for class_radii in classes_m]
    )[order]
    by_class = np.argsort(of_class, kind="stable")
    return Particles(
        classes=of_class[by_class],
        radii_m=radii[order][by_class],
        positions_m=positions[by_class],
        velocities_m_s=velocities[by_class],
    )


_INSERTED_FRACTION = 0.2
"""Fraction of a space that the spheres around clumps fill when these are inserted at random places:
half of where random sequential addition of spheres ends, 0.38."""


def room_to_insert(reaches_m: Floats, bowl: Container) -> float:
    """Height of the space in a bowl in which clumps can be inserted at random, m.

    Parameters
    ----------
    reaches_m : (N,) array
        Distance of the farthest point of each from its centre.
    bowl : Container

    Raises
    ------
    InputError
        The largest clump does not fit into the bowl.
    """
    largest = float(reaches_m.max())
    if largest >= bowl.clear_m:
        raise InputError(
            "the largest particle does not fit into the bowl",
            field="media.radius_mean_m",
            value=f"farthest point {largest:.6g} m from the centre of mass",
            limit=f"less than {bowl.clear_m:g} m, {_CLEAR}",
            remedy="use smaller or more compact particles, or a wider bowl",
        )
    volume = float((4 / 3 * reaches_m**3).sum())
    radius = math.sqrt(bowl.levels[-1][1] / math.pi)  # of a circle as wide
    return bowl.rim_m + 2 * largest + volume / (_INSERTED_FRACTION * (radius - largest) ** 2)


def primes(seed: int, count: int) -> list[int]:
    """Different primes above 10000, as LIGGGHTS wants its seeds."""
    numbers: list[int] = []
    candidate = int(np.random.default_rng(seed).integers(10_000, 10_000_000))
    while len(numbers) < count:
        candidate += 1
        if is_prime(candidate):
            numbers.append(candidate)
    return numbers


_CLEAR = "half the width between the walls of the bowl"


def _sites(count: int, bowl: Container, largest_m: float) -> Floats:
    """The lowest `count` points of a square lattice in the bowl, (count, 3)."""
    step = 2 * _SPACING * largest_m
    room = largest_m * (1 + math.sqrt(2) * (_SPACING - 1))  # the jitter is along x and along y
    columns, lines = (_centred(half - room, step) for half in bowl.half_widths_m)
    rows: list[Floats] = []
    for y in lines:  # no more rows of the lowest layer than there are particles for
        places = np.column_stack([columns, np.full(len(columns), y)])
        rows.append(places[bowl.side_distance(places) >= room])
        if sum(map(len, rows)) >= count:
            break
    if not sum(map(len, rows)):
        widest = largest_m * bowl.clear_m / room
        raise InputError(
            "the largest particle does not fit into the bowl with room to fall",
            field="media.radius_mean_m",
            value=f"largest radius {largest_m:.6g} m",
            limit=f"at most {widest:.6g} m with {bowl.clear_m:g} m, {_CLEAR}",
            remedy="use smaller particles or a wider bowl",
        )
    layer = np.concatenate(rows)
    layers = -(-count // len(layer))
    heights = np.repeat(bowl.rim_m + _SPACING * largest_m + step * np.arange(layers), len(layer))
    return np.column_stack([np.tile(layer, (layers, 1)), heights])[:count]


def _centred(reach_m: float, step_m: float) -> Floats:
    """Places a step apart about 0, no farther than a reach."""
    most = np.floor(reach_m / step_m)
    return np.arange(-most, most + 1) * step_m
