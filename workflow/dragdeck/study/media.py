"""The media: spherical particles of one class or several, their sizes and their total.

A class has a material, a distribution of sizes and a fraction of the whole. Sizes are not drawn at
random: they are quantiles of the distribution, so that mean and spread, or the sieve curve, come
out as asked.
"""

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Annotated, Literal, NamedTuple, Self

import numpy as np
from pydantic import Field, model_validator

from dragdeck.arrays import Floats
from dragdeck.parts import omitted
from dragdeck.physics.walls import Container
from dragdeck.study.base import MaterialName, Model, Name, NonNegative, Number, Positive, Whole
from dragdeck.study.shapes import FEWEST_SPHERES, AnyShape, solid_fraction

CUTOFF_STD = 2.5
"""Radii lie within this many standard deviations of the untruncated normal distribution."""

_LARGEST_SPREAD = 0.3
"""Standard deviation over mean of radii: the smallest of a normal distribution stay above zero."""

MOST_SIZES = 5
"""Sizes of a class among media of which some are no spheres: LIGGGHTS inserts each by itself."""

LEVELS = 4096
"""Quantiles from which the moments of a distribution are computed."""

MOST_SIEVES = MOST_CLASSES = 100

_SIZES = ("radius_mean_m", "radius_std_m", "distribution")

_TOTALS = ("count", "mass_kg", "fill_height_m")

INSTEAD_OF: Mapping[str, Sequence[str]] = {
    **{name: [other for other in _TOTALS if other != name] for name in _TOTALS},
    "radius_mean_m": ("sieve", "classes"),
    "sieve": (*_SIZES, "classes"),
    "classes": (*_SIZES, "material", "sieve"),
}
"""Fields that others of a study that is extended give way to."""


class Sieve(NamedTuple):
    """A row of a sieve analysis: diameter, m, and the fraction of the mass that is finer."""

    diameter_m: Positive
    mass_passing: Annotated[Number, Field(ge=0, le=1)]


class Grains(Model):
    """Particles of one material and one distribution of sizes."""

    material: MaterialName | None = None
    """material of the particles: a name under `materials`"""
    radius_mean_m: Positive | None = None
    """mean particle radius, m"""
    radius_std_m: NonNegative = 0.0
    """standard deviation of the particle radii, m"""
    distribution: Literal["normal", "log_normal", "uniform"] = omitted("normal")
    """distribution of the radii"""
    sieve: Annotated[list[Sieve], Field(min_length=2, max_length=MOST_SIEVES)] | None = omitted(
        None
    )
    """sieve analysis instead of radius_mean_m: rows [diameter in m, finer fraction of the mass],
    linear in between; or a CSV file with the columns diameter_m and mass_passing"""
    shape: AnyShape | None = omitted(None)
    """shape of the particles, none: spheres; radii are those of spheres of equal volume"""

    @model_validator(mode="after")
    def _sizes(self) -> Self:
        mean, std = self.radius_mean_m, self.radius_std_m
        if self.sieve is not None:
            if mean is not None or std:
                raise ValueError("give either sieve or radius_mean_m, and not both")
            _check_sieve(self.sieve)
        elif mean is not None and std > _LARGEST_SPREAD * mean:
            raise ValueError(
                f"radius_std_m {std} exceeds {_LARGEST_SPREAD} of radius_mean_m {mean}: the "
                "smallest radii would approach zero"
            )
        return self

    def radii(self, count: int) -> Floats:
        """Radii in ascending order, (count,), m.

        Quantiles of the distribution; those of a mean and a standard deviation are then shifted and
        scaled so that mean and standard deviation (population form) are exact.
        """
        if self.sieve is not None:
            return _sieved(self.sieve, count)
        assert self.radius_mean_m is not None
        return quantiles(self.distribution, self.radius_mean_m, self.radius_std_m, count)

    def most_numerous(self) -> str:
        """The sieves between which most particles are, in words; empty without a sieve analysis."""
        if self.sieve is None:
            return ""
        number = _numbers(self.sieve)[1]
        at = int(number.argmax())
        (low, below), (high, above) = self.sieve[at : at + 2]
        return (
            f", {100 * number[at] / number.sum():.3g} % of these between the sieves of {low:g} and "
            f"{high:g} m ({100 * (above - below):.3g} % of their mass)"
        )

    @property
    def mean_radius_m(self) -> float:
        """Mean radius, m; of a sieve analysis the Sauter mean."""
        if self.radius_mean_m is not None:
            return self.radius_mean_m
        sizes = self.radii(LEVELS)
        return float((sizes**3).sum() / (sizes**2).sum())

    @property
    def mean_volume_m3(self) -> float:
        """Mean volume of a particle, m3."""
        return float(4 / 3 * math.pi * (self.radii(LEVELS) ** 3).mean())


def _check_sieve(rows: Sequence[Sieve]) -> None:
    diameters, passing = zip(*rows, strict=True)
    if any(b <= a for a, b in pairwise(diameters)):
        raise ValueError("the diameters of the sieve analysis do not increase")
    if any(b < a for a, b in pairwise(passing)):
        raise ValueError("the mass passing decreases from a sieve to the next larger one")
    if passing[0] != 0 or passing[-1] != 1:
        raise ValueError(
            f"the mass passing goes from {passing[0]:g} to {passing[-1]:g}: the first sieve must "
            "pass 0, the last one 1"
        )


def quantiles(distribution: str, mean_m: float, std_m: float, count: int) -> Floats:
    """Radii of a distribution whose sample mean and spread are exact, (count,), ascending, m."""
    if count == 1 or std_m == 0:
        return np.full(count, mean_m)
    return _SPREAD[distribution](mean_m, std_m, count)


def _normal_scores(count: int) -> Floats:
    from scipy.special import ndtr, ndtri

    tail = float(ndtr(-CUTOFF_STD))
    return np.asarray(ndtri(tail + (1 - 2 * tail) * (np.arange(count) + 0.5) / count))


def _scaled(scores: Floats, mean_m: float, std_m: float) -> Floats:
    scores = (scores - scores.mean()) / scores.std()
    return np.asarray(mean_m + std_m * scores, dtype=np.float64)


def _normal(mean_m: float, std_m: float, count: int) -> Floats:
    """A normal distribution cut at `CUTOFF_STD`."""
    return _scaled(_normal_scores(count), mean_m, std_m)


def _uniform(mean_m: float, std_m: float, count: int) -> Floats:
    return _scaled((np.arange(count) + 0.5) / count, mean_m, std_m)


def _log_normal(mean_m: float, std_m: float, count: int) -> Floats:
    """A log-normal distribution cut at `CUTOFF_STD` of the logarithm."""
    from scipy.optimize import brentq

    scores = _normal_scores(count)

    def spread(width: float) -> float:
        sizes = np.exp(width * scores)
        return float(sizes.std() / sizes.mean() - std_m / mean_m)

    sizes = np.exp(brentq(spread, 0.0, 2.0, xtol=1e-14) * scores)
    return np.asarray(mean_m * sizes / sizes.mean())


_SPREAD = {"normal": _normal, "uniform": _uniform, "log_normal": _log_normal}


def _numbers(rows: Sequence[Sieve]) -> tuple[Floats, Floats]:
    """``1 / d^2`` of sieves, and what is proportional to the numbers between each and the next."""
    diameter, passing = np.array(rows, dtype=np.float64).T
    inverse = diameter**-2
    return inverse, np.diff(passing) / np.diff(diameter) * (inverse[:-1] - inverse[1:])


def _sieved(rows: Sequence[Sieve], count: int) -> Floats:
    """Radii whose mass follows a sieve analysis.

    Between two sieves a and b the mass is uniform in the diameter d, so that the number density
    goes as ``1 / d^3`` and the number finer than d as ``1 / a^2 - 1 / d^2``.
    """
    inverse, number = _numbers(rows)
    finer = np.concatenate([[0.0], np.cumsum(number)])
    level = finer[-1] * (np.arange(count) + 0.5) / count
    at = np.searchsorted(finer, level, side="right") - 1
    part = (level - finer[at]) / number[at]
    return np.asarray((inverse[at] - part * (inverse[at] - inverse[at + 1])) ** -0.5 / 2)


class MediaClass(Grains):
    """One of several classes of particles."""

    fraction: Annotated[Number, Field(gt=0, le=1)]
    """fraction of the class; all fractions sum to 1"""


class Media(Grains):
    """The media: spherical particles of one class, or of several."""

    count: Annotated[Whole, Field(ge=1)] | None = None
    """number of particles"""
    mass_kg: Positive | None = omitted(None)
    """total mass, kg, instead of count"""
    fill_height_m: Positive | None = omitted(None)
    """expected height of the bed, m, instead of count; the report states the height obtained"""
    classes: Annotated[dict[Name, MediaClass], Field(max_length=MOST_CLASSES)] = omitted({})
    """several classes by name, each with material, sizes and fraction, instead of material and
    sizes here"""
    fractions_of: Literal["number", "mass", "volume"] = omitted("mass")
    """quantity to which the fractions of the classes refer"""

    @model_validator(mode="after")
    def _whole(self) -> Self:
        if sum(getattr(self, name) is not None for name in _TOTALS) != 1:
            raise ValueError("give one of count, mass_kg and fill_height_m")
        for name, grains in self.parts.items():
            where = f"class {name}: " if name else ""
            if grains.material is None:
                raise ValueError(f"{where}a material is missing")
            if grains.radius_mean_m is None and grains.sieve is None:
                raise ValueError(f"{where}radius_mean_m or sieve is missing")
        if self.classes:
            if self.material or self.radius_mean_m or self.sieve:
                raise ValueError("with classes, material and sizes stand in each of them")
            total = sum(class_.fraction for class_ in self.classes.values())
            if abs(total - 1) > 1e-6:
                raise ValueError(f"the fractions of the classes sum to {total:.6g}, not to 1")
        return self

    def __hash__(self) -> int:
        """Of what the study says, as it has parts that have no hash."""
        return hash(self.model_dump_json())

    @property
    def total(self) -> str:
        """Name of the field that states how many particles there are."""
        return next(name for name in _TOTALS if getattr(self, name) is not None)

    @property
    def parts(self) -> Mapping[str, Grains]:
        """The classes by name; one without a name where the study has none."""
        return self.classes or {"": self}

    @property
    def main(self) -> Grains:
        """The first class: drop test, skin and dimensionless numbers refer to it."""
        return next(iter(self.parts.values()))

    @property
    def main_material(self) -> str:
        """Material of the first class."""
        return str(self.main.material)

    @property
    def typical_radius_m(self) -> float:
        """Mean radius of the first class, m; of a sieve analysis the Sauter mean."""
        return self.main.mean_radius_m

    @property
    def typical_std_m(self) -> float:
        """Standard deviation of the radii of the first class, m."""
        main = self.main
        return main.radius_std_m if main.sieve is None else float(main.radii(LEVELS).std())

    @property
    def clumped(self) -> bool:
        """Whether some particles are no spheres; then all are clumps."""
        return any(part.shape is not None for part in self.parts.values())

    def solid_fraction(self, radii_m: Floats, numbers: Floats) -> float:
        """That of a poured bed, an estimate.

        Parameters
        ----------
        radii_m, numbers : (N,) array
            Class by class, each with as many entries.
        """
        parts = list(self.parts.values())
        denser = [part.shape.denser if part.shape else 1.0 for part in parts]
        volumes = np.array_split(numbers * radii_m**3, len(parts))
        whole = float(np.average(denser, weights=[volume.sum() for volume in volumes]))
        return solid_fraction(radii_m, numbers, whole)

    def spheres_of(self, part: Grains) -> int:
        """Spheres of which a particle of a class consists in LIGGGHTS."""
        if part.shape is not None:
            return part.shape.spheres
        return FEWEST_SPHERES if self.clumped else 1

    @property
    def materials(self) -> Sequence[str]:
        """Materials of the classes in their order, each once."""
        return list(dict.fromkeys(str(part.material) for part in self.parts.values()))


@lru_cache(maxsize=16)
def class_counts(
    media: Media, densities_kg_m3: tuple[float, ...], bowl: Container
) -> Mapping[str, int]:
    """Number of particles of each class.

    Parameters
    ----------
    media : Media
    densities_kg_m3 : tuple of float
        Of each class.
    bowl : Container
        In which a fill height stands.
    """
    volume = {name: part.mean_volume_m3 for name, part in media.parts.items()}
    densities = dict(zip(volume, densities_kg_m3, strict=True))
    mass = {name: volume[name] * densities[name] for name in volume}
    per_particle = {"number": dict.fromkeys(volume, 1.0), "mass": mass, "volume": volume}
    fractions = {name: class_.fraction for name, class_ in media.classes.items()} or {"": 1.0}
    by_number = {
        name: share / per_particle[media.fractions_of][name] for name, share in fractions.items()
    }
    if media.count is not None:
        scale = media.count / sum(by_number.values())
    else:
        weight = volume if media.mass_kg is None else mass
        of_all = sum(number * weight[name] for name, number in by_number.items())
        total = media.mass_kg
        if media.fill_height_m is not None:
            radii = np.concatenate([part.radii(LEVELS) for part in media.parts.values()])
            numbers = np.repeat(list(by_number.values()), LEVELS)
            total = bowl.volume_m3(media.fill_height_m) * media.solid_fraction(radii, numbers)
        assert total is not None
        scale = total / of_all
    return _whole_numbers({name: scale * number for name, number in by_number.items()})


def few_sizes(radii_m: Floats) -> Floats:
    """Ascending radii in at most `MOST_SIZES` sizes, each the mean by volume of some of them."""
    parts = np.array_split(radii_m, min(MOST_SIZES, len(np.unique(radii_m))))
    return np.concatenate([np.full(len(part), np.cbrt((part**3).mean())) for part in parts])


def _whole_numbers(wanted: Mapping[str, float]) -> dict[str, int]:
    """Whole numbers with the rounded total of all: the largest remainders are rounded up."""
    numbers = {name: math.floor(number) for name, number in wanted.items()}
    missing = round(sum(wanted.values())) - sum(numbers.values())
    for name in sorted(wanted, key=lambda candidate: numbers[candidate] - wanted[candidate])[
        :missing
    ]:
        numbers[name] += 1
    return numbers
