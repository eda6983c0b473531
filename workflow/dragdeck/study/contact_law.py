"""The contact law: one row for each coefficient of a pair of materials.

A coefficient is a field of `Pair` with a `Coefficient` in its annotation. Everything else that
deals with coefficients is made from these rows: the study's fields with their limits, LIGGGHTS's
properties and model keywords for particles and walls alike, run ids, what `explain` says, the
numbers that scenes are compared by, and the range of the advisor.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from dragdeck.arrays import Floats, Ints, class_numbers
from dragdeck.parts import omitted
from dragdeck.study.base import Model, Number

_PUSHING = ("hertz", "hertz/stiffness", "hooke", "hooke/stiffness")
"""Normal models whose force, in LIGGGHTS, is the one to which Coulomb's limit refers."""

Attraction = Callable[[Floats | float, Floats, Floats, bool], Floats]
"""Attractive force of (N,) contacts, N, from the coefficient, reduced radii and overlaps, m, to
which it is proportional, and whether the other body is a wall."""

RollingModel = Literal["epsd2", "cdt", "epsd"]

_BASE_MODEL = "hertz tangential history"
"""Hertz-Mindlin with the history of the tangential spring (LIGGGHTS: ``pair gran``)."""

KEYWORDS = ("tangential", "cohesion", "rolling_friction", "surface")
"""Keywords after the normal model, in the only order that LIGGGHTS takes."""


@dataclass(frozen=True)
class Coefficient:
    """A coefficient of a pair, as LIGGGHTS and its readers know it.

    Attributes
    ----------
    engine : str
        LIGGGHTS's property, one number per pair of types.
    words : str
        What it is called in a sentence.
    model : str
        What the contact model needs for it, one of `KEYWORDS` first; nothing where it always
        counts. Fields of `Contact` may stand in it.
    attraction : callable or None
        The attractive force that its model subtracts from the normal force, as cohesion does.
        LIGGGHTS limits friction by the force without it.
    settings : str
        Options of the contact model that go with it.
    compared : {"each", "lowest"}
        Which value of a scene must lie within the measured range: that of each of the pairs
        particle-particle and particle-workpiece, or the lowest of all pairs.
    modulus_power : float
        With moduli times s, it is simulated times s to this power.
    """

    engine: str
    words: str
    model: str = ""
    attraction: Attraction | None = None
    settings: str = ""
    compared: Literal["each", "lowest"] = "each"
    modulus_power: float = 0.0


def softened(value: float, modulus_power: float, scale: float) -> float:
    """A coefficient with moduli times `scale`, to 12 digits."""
    return float(f"{value * scale**modulus_power:.12g}")


def _sjkr2(
    density_j_m3: Floats | float, reduced_m: Floats, overlap_m: Floats, wall: bool
) -> Floats:
    """Cohesion of LIGGGHTS's model ``sjkr2``: a density times the area 2 pi d (2 R*).

    Its area at a wall is half of that, 2 pi d R.
    """
    return (2 if wall else 4) * math.pi * density_j_m3 * reduced_m * overlap_m


class Pair(Model):
    """The contact coefficients of two materials.

    A coefficient with a default is absent at its default: it is then no part of the contact
    model, of the input script, or of a run's name.
    """

    restitution: Annotated[
        Number,
        Field(gt=0.05, le=1),
        Coefficient("coefficientRestitution", "restitution", compared="lowest"),
    ]
    """coefficient of normal restitution"""

    friction: Annotated[Number, Field(ge=0, le=10), Coefficient("coefficientFriction", "friction")]
    """Coulomb friction coefficient"""
    rolling_friction: Annotated[
        Number,
        Field(ge=0, le=10),
        Coefficient(
            "coefficientRollingFriction",
            "rolling friction",
            "rolling_friction {rolling_model}",
            settings="torsionTorque on",
        ),
    ] = 0.0
    """coefficient of rolling friction: largest rolling torque / (normal force x effective
    radius)"""

    rolling_damping: Annotated[
        Number,
        Field(ge=0, le=10),
        Coefficient("coefficientRollingViscousDamping", "damping of rolling"),
    ] = omitted(0.0)
    """damping ratio of the rolling spring; for `epsd` only"""

    cohesion_j_m3: Annotated[
        Number,
        Field(ge=0),
        Coefficient(
            "cohesionEnergyDensity", "cohesion", "cohesion sjkr2", _sjkr2, modulus_power=2 / 3
        ),
    ] = omitted(0.0)
    """cohesion energy density: attractive force / contact area"""

    def softened(self, scale: float) -> "Pair":
        """The pair as it is simulated with moduli times `scale`."""
        rows = present([self]).items()
        powers = {name: row.modulus_power for name, row in rows if row.modulus_power}
        return self.model_copy(
            update={
                name: softened(getattr(self, name), power, scale) for name, power in powers.items()
            }
        )

    def attractive(self) -> dict[str, float]:
        """Coefficients that add an attractive force."""
        rows = present([self]).items()
        return {name: getattr(self, name) for name, row in rows if row.attraction}

    def absent(self) -> set[str]:
        """Coefficients at their default."""
        return {
            name
            for name, field in type(self).model_fields.items()
            if not field.is_required() and getattr(self, name) == field.default
        }


class Contact(Model):
    """Options of the contact law."""

    limit_force: bool = True
    """suppress tensile normal forces (LIGGGHTS: limitForce); for dry particles"""
    rolling_model: RollingModel = omitted("epsd2")
    """model of rolling friction (LIGGGHTS: rolling_friction)"""


@cache
def coefficients() -> Mapping[str, Coefficient]:
    """Every coefficient by the name of its field."""
    return {
        name: next(item for item in field.metadata if isinstance(item, Coefficient))
        for name, field in Pair.model_fields.items()
    }


@dataclass(frozen=True)
class FrictionLimit:
    """What limits the tangential forces of particles on one body.

    Attributes
    ----------
    friction : float or ndarray
        Coefficient of friction: one, or one per class of particles, (C,), and per class of the
        other particle, (C, C); after `at`, one per contact.
    attractive : mapping
        Coefficients that add an attractive force by name, as simulated; likewise.
    wall : bool
        Whether the body is a wall; otherwise it is another particle.
    first_ids : sequence of int
        First particle of each class, if there are several.
    """

    friction: Floats | float
    attractive: Mapping[str, Floats | float] = field(default_factory=dict)
    wall: bool = True
    first_ids: Sequence[int] = ()

    def at(self, particle_id: Ints, other_id: Ints) -> "FrictionLimit":
        """What limits (N,) contacts; the ids of the other body count if it is a particle."""
        if not self.first_ids:
            return self
        first, second = (class_numbers(ids, self.first_ids) for ids in (particle_id, other_id))
        place = first if self.wall else (first, second)
        attractive = {name: np.asarray(values)[place] for name, values in self.attractive.items()}
        return FrictionLimit(np.asarray(self.friction)[place], attractive, self.wall)

    def attraction_n(self, reduced_radius_m: Floats, overlap_m: Floats) -> Floats:
        """Magnitude of the attractive forces of (N,) contacts, N.

        The reduced radius R* is that of the particle at a wall.
        """
        total = np.zeros_like(overlap_m)
        for name, value in self.attractive.items():
            attraction = coefficients()[name].attraction
            assert attraction is not None, name
            total += attraction(value, reduced_radius_m, np.maximum(overlap_m, 0.0), self.wall)
        return total


def present(pairs: Iterable[Pair]) -> Mapping[str, Coefficient]:
    """The coefficients that some pair has."""
    every = list(pairs)
    absent = set.intersection(*(pair.absent() for pair in every))
    return {name: row for name, row in coefficients().items() if name not in absent}


def contact_model(pairs: Iterable[Pair], contact: Contact) -> str:
    """LIGGGHTS's contact model with what these pairs need."""
    models = [row.model.format(**dict(contact)) for row in present(pairs).values() if row.model]
    models.sort(key=lambda model: KEYWORDS.index(model.split()[0]))
    return " ".join([_BASE_MODEL, *models])


def in_order(law: Iterable[str]) -> bool:
    """Whether the words of a contact law have their keywords in the order of LIGGGHTS."""
    places = [KEYWORDS.index(word) for word in law if word in KEYWORDS]
    return places == sorted(places)


def contact_settings(pairs: Iterable[Pair]) -> list[str]:
    """LIGGGHTS's options of that contact model."""
    return [row.settings for row in present(pairs).values() if row.settings]


def added_forces(law: Sequence[str]) -> list[str]:
    """What a contact law adds to the force by which friction is limited.

    Parameters
    ----------
    law : sequence of str
        Words of LIGGGHTS that set the contact law of particles or of a wall.

    Returns
    -------
    list of str
        The models that add a force, and those that are not known not to.
    """
    words = list(law)
    gran = words[:1] == ["gran"] or words[0].startswith("wall/gran")
    if not gran or "model" not in words[:-1]:
        return [" ".join(words)]
    normal, *models = words[words.index("model") + 1 :]
    forces = [] if normal in _PUSHING else [normal]
    named = dict(pairwise(models))
    if named.get("cohesion", "off") != "off":
        forces.append(f"cohesion {named['cohesion']}")
    if named.get("tangential_reduce", "off") != "off":
        forces.append("tangential_reduce on")
    rows = (row.model for row in coefficients().values() if row.attraction)
    law_words = f"{' '.join(words)} "
    forces += [model for model in rows if f"{model} " in law_words and model not in forces]
    return forces


def modelled(law: Iterable[str]) -> set[str]:
    """Words for the optional coefficients that the words of a contact law model."""
    named = dict(pairwise(law))
    return {
        row.words
        for row in coefficients().values()
        if row.model and named.get(row.model.split()[0], "off") != "off"
    }


def coefficient_words(pairs: Iterable[Pair]) -> tuple[list[str], list[str]]:
    """Words for the optional coefficients that a scene models, and for those it leaves out."""
    there = present(pairs)
    optional = {name: row for name, row in coefficients().items() if row.model}
    return (
        [row.words for name, row in optional.items() if name in there],
        [row.words for name, row in optional.items() if name not in there],
    )


def compared_numbers(particle: Pair, workpiece: Pair, pairs: Iterable[Pair]) -> dict[str, float]:
    """The coefficients by which scenes are compared.

    Parameters
    ----------
    particle, workpiece : Pair
        Of a particle with a particle and with the workpiece.
    pairs : iterable of Pair
        All pairs of the scene.

    Returns
    -------
    dict
        ``particle_<name>`` and ``workpiece_<name>``, or ``lowest_<name>``.
    """
    every = list(pairs)
    numbers: dict[str, float] = {}
    for name, row in present(every).items():
        if row.compared == "lowest":
            numbers[f"lowest_{name}"] = min(getattr(pair, name) for pair in every)
        else:
            numbers[f"particle_{name}"] = getattr(particle, name)
            numbers[f"workpiece_{name}"] = getattr(workpiece, name)
    return numbers


def compared_labels() -> dict[str, str]:
    """Words for every number of `compared_numbers`."""
    labels: dict[str, str] = {}
    for name, row in coefficients().items():
        if row.compared == "lowest":
            labels[f"lowest_{name}"] = f"lowest {row.words}"
        else:
            labels[f"particle_{name}"] = f"{row.words} of particle on particle"
            labels[f"workpiece_{name}"] = f"{row.words} of particle on workpiece"
    return labels
