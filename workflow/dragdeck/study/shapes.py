"""Shapes of particles: a body's proportions and the number of spheres that stand for it.

A shape has no size of its own: `radius_mean_m` and its like are the radius of the sphere of equal
volume. Bodies are convex, each the convex hull of its corners. A new shape is a class here and its
name in `AnyShape`.
"""

import math
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from dragdeck.arrays import Floats
from dragdeck.parts import omitted
from dragdeck.physics.estimates import SOLID_FRACTION_ESTIMATE
from dragdeck.study.base import Model, Number, Positive, Whole

SOLID_FRACTION_STD = 0.03
"""Standard deviation of measured solid fractions over those of `solid_fraction`, less 1
(docs/data/scenes/solid_fraction.csv)."""

_ONE_SIZE, _WIDEST, _BY_SPREAD = 0.05, 0.47, (0.23, 0.55)
"""Spread of the radii (standard deviation over mean) up to which particles count as of about one
size; the widest that was measured; parts by which the solid fraction grows with what the spread is
above the former, and with its square."""


def solid_fraction(radii_m: Floats, numbers: Floats, denser: float) -> float:
    """Solid fraction of a poured bed before it exists, from docs/data/scenes/solid_fraction.csv.

    Parameters
    ----------
    radii_m, numbers : (N,) array
        Radii of spheres of equal volume, and how many there are of each.
    denser : float
        Solid fraction of the shapes over that of spheres.
    """
    mean = np.average(radii_m, weights=numbers)
    spread = math.sqrt(np.average((radii_m / mean - 1) ** 2, weights=numbers))
    wider = min(max(spread, _ONE_SIZE), _WIDEST) - _ONE_SIZE
    growth = _BY_SPREAD[0] * wider + _BY_SPREAD[1] * wider**2
    return SOLID_FRACTION_ESTIMATE * denser * (1 + growth)


FEWEST_SPHERES, MOST_SPHERES = 2, 40
"""Spheres of a clump: LIGGGHTS accepts no single one, and more cost more than a shape is worth."""

_SIDES = 96
"""Floats of the polygon that stands for a circle: its area is 0.07 % too small."""

MOST_CORNERS = 1000
"""A body with more corners is described more finely than its spheres can be."""

MOST_ASPECT = 5

_Aspect = Annotated[Number, Field(ge=1 / MOST_ASPECT, le=MOST_ASPECT)]


class ParticleShape(Model):
    """A convex body as a clump of overlapping spheres.

    Mass and inertia are those of the body; spheres stand for its surface only.

    Attributes
    ----------
    denser : float
        Measured solid fraction of a poured bed over that of spheres in the same bowl; where none
        was measured, the mean of all shapes (docs/data/scenes/solid_fraction.csv).
    """

    denser: ClassVar[float] = 1.04

    spheres: Annotated[Whole, Field(ge=FEWEST_SPHERES, le=MOST_SPHERES)]
    """number of spheres; `./run dragdeck shapes` lists the errors"""

    def corners(self) -> Floats:
        """Points whose convex hull is the body, (N, 3); their scale is of no importance."""
        raise NotImplementedError


def _ring(height: float, cut: float = 0.0) -> Floats:
    """A circle of diameter 1 about z, in a plane that is inclined about y by a slope."""
    angle = math.tau * np.arange(_SIDES) / _SIDES
    x, y = 0.5 * np.cos(angle), 0.5 * np.sin(angle)
    return np.column_stack([x, y, height + cut * x])


class CylinderParticle(ParticleShape):
    """A cylinder, its ends straight or cut at an angle."""

    denser: ClassVar[float] = 1.06

    kind: Literal["cylinder"]
    """cylinder with straight ends, or cut at an angle"""
    aspect: _Aspect
    """length / diameter"""
    cut_deg: Annotated[Number, Field(ge=0, le=60)] = omitted(0.0)
    """angle of the two parallel end faces from those of a straight cylinder, degrees"""

    def corners(self) -> Floats:
        """The rims of both ends."""
        cut = math.tan(math.radians(self.cut_deg))
        return np.vstack([_ring(-self.aspect / 2, cut), _ring(self.aspect / 2, cut)])


class ConeParticle(ParticleShape):
    """A circular cone."""

    denser: ClassVar[float] = 1.07

    kind: Literal["cone"]
    """circular cone"""
    aspect: _Aspect
    """height / diameter of the base"""

    def corners(self) -> Floats:
        """The rim of the base and the tip."""
        return np.vstack([_ring(0.0), [[0.0, 0.0, self.aspect]]])


class TetrahedronParticle(ParticleShape):
    """A regular tetrahedron."""

    denser: ClassVar[float] = 1.01

    kind: Literal["tetrahedron"]
    """regular tetrahedron"""

    def corners(self) -> Floats:
        """Four corners of a cube."""
        return np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=np.float64)


class PrismParticle(ParticleShape):
    """A straight prism on an equilateral triangle."""

    denser: ClassVar[float] = 1.01

    kind: Literal["triangular_prism"]
    """straight prism on an equilateral triangle"""
    aspect: _Aspect
    """length / side of the triangle"""

    def corners(self) -> Floats:
        """Three corners of each end."""
        x, y = [-0.5, 0.5, 0.0], [0.0, 0.0, math.sqrt(0.75)]
        ends = [np.column_stack([x, y, np.full(3, end)]) for end in (0.0, self.aspect)]
        return np.vstack(ends)


class EllipsoidParticle(ParticleShape):
    """An ellipsoid."""

    denser: ClassVar[float] = 1.06

    kind: Literal["ellipsoid"]
    """ellipsoid"""
    axes: tuple[Positive, Positive, Positive]
    """proportions of the half-axes, such as [2, 1, 1]; ratio at most 5"""

    @model_validator(mode="after")
    def _proportion(self) -> Self:
        ratio = max(self.axes) / min(self.axes)
        if ratio > MOST_ASPECT:
            raise ValueError(
                f"the largest half-axis is {ratio:.3g} times the smallest, more than {MOST_ASPECT}"
            )
        return self

    def corners(self) -> Floats:
        """Points spread evenly over the unit sphere by the golden angle, stretched."""
        count = MOST_CORNERS
        z = 1 - (2 * np.arange(count) + 1) / count
        turn = math.pi * (3 - math.sqrt(5)) * np.arange(count)
        across = np.sqrt(1 - z**2)
        return np.column_stack([across * np.cos(turn), across * np.sin(turn), z]) * self.axes


class MeshParticle(ParticleShape):
    """A body of the user's; its size in the file is of no importance."""

    kind: Literal["mesh"]
    """convex body from a mesh file"""
    points: Annotated[
        tuple[tuple[Number, Number, Number], ...], Field(min_length=4, max_length=MOST_CORNERS)
    ]
    """file beside the study with a closed, convex surface, for example STL; or a list of corners"""

    def corners(self) -> Floats:
        """As given."""
        return np.array(self.points, dtype=np.float64)


AnyShape = Annotated[
    CylinderParticle
    | ConeParticle
    | TetrahedronParticle
    | PrismParticle
    | EllipsoidParticle
    | MeshParticle,
    Field(discriminator="kind"),
]
"""Every shape by its `kind`: the registry."""
