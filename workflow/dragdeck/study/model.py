"""The study file: fields, units and limits.

A study is plain data, independent of the syntax of LIGGGHTS, of other files and of how a scene is
run.
"""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag, model_validator

from dragdeck.parts import omitted
from dragdeck.study.base import (
    Distinct,
    Json,
    Line,
    MaterialName,
    Model,
    Name,
    Number,
    Positive,
    Whole,
    flat,
    without_fields,
)
from dragdeck.study.bowls.annulus import AnnulusBowl
from dragdeck.study.bowls.cylinder import CylinderBowl
from dragdeck.study.bowls.mesh import MeshBowl
from dragdeck.study.bowls.revolved import RevolvedBowl
from dragdeck.study.bowls.trough import TroughBowl
from dragdeck.study.calibration import Calibration
from dragdeck.study.contact_law import Contact, Pair
from dragdeck.study.fidelity import BUILT_IN_FIDELITIES, AnyFidelity, Fidelity, Tolerance
from dragdeck.study.media import MOST_CLASSES, Media, class_counts
from dragdeck.study.motion import Motion
from dragdeck.study.reduction import Reduction
from dragdeck.study.reference import Reference
from dragdeck.study.removal import Removal
from dragdeck.study.roughness import Roughness
from dragdeck.study.search import Search
from dragdeck.study.workpiece import Carousel, Material, Station, Workpiece

AnyBowl = (
    Annotated[CylinderBowl, Tag("cylinder")]
    | Annotated[AnnulusBowl, Tag("annulus")]
    | Annotated[TroughBowl, Tag("trough")]
    | Annotated[RevolvedBowl, Tag("revolved")]
    | Annotated[MeshBowl, Tag("mesh")]
)
"""The registry of bowls."""


def _kind_of_bowl(value: object) -> object:
    """A bowl without a kind is a cylinder."""
    if isinstance(value, Mapping):
        return value.get("kind", "cylinder")
    return getattr(value, "kind", "cylinder")


class Compound(Model):
    """A liquid at rest in the bowl: it carries a part of the particles' weight.

    Nothing else of it is modelled. `pairs` has the coefficients of wet contacts.
    """

    density_kg_m3: Positive
    """density of the liquid, kg/m3"""
    level_m: Positive | None = None
    """height of the liquid above the floor, m; none: up to the rim of the bowl"""


class DropTest(Model):
    """The drop test: one mean particle on a plate of the workpiece's material."""

    height_m: Positive = 0.010
    """gap between particle and plate at the start, m"""
    impacts: Annotated[Whole, Field(ge=1, le=20)] = 3
    """number of impacts"""
    timestep_fraction: Annotated[Number, Field(gt=0, le=1)] = 0.02
    """time step as a fraction of the Rayleigh time"""


class Filling(Model):
    """When a packing counts as settled."""

    energy_ratio: Annotated[Number, Field(gt=0, le=1e-3)] = 1e-5
    """settling criterion: largest mean kinetic energy per particle / (m g d)"""
    max_time_s: Positive = 10.0
    """simulated time after which an unsettled packing is rejected, s"""


class Outputs(Model):
    """Sampling rates of a process run; each is a lower bound, in process time."""

    workpiece_force_hz: Positive = 1000.0
    """minimum sampling rate of force and torque on the workpiece, Hz"""
    workpiece_contacts_hz: Positive = 200.0
    """minimum sampling rate of the contacts on the workpiece, Hz"""
    network_hz: Positive = 20.0
    """minimum sampling rate of all contacts and particles, Hz"""
    n_checkpoints: Annotated[Whole, Field(ge=0, le=1000)] = 50
    """number of checkpoints of a run, from which it can be resumed"""
    first_touch_fraction: Annotated[Number, Field(ge=0, le=1)] = omitted(0)
    """fraction of the drag, at its end, in which contacts on the workpiece are written at every
    step, for the velocity at first touch"""

    @model_validator(mode="after")
    def _order(self) -> "Outputs":
        if not self.workpiece_force_hz >= self.workpiece_contacts_hz >= self.network_hz:
            raise ValueError(
                "the rates must not increase from workpiece_force_hz to workpiece_contacts_hz to "
                "network_hz: each frame of a slower output is compared with one of a faster output"
            )
        return self


class Scaling(Model):
    """A power law of the mean drag as a function of one sweep field."""

    field: str
    """dotted name of the `sweep` field; its values must be above 0"""
    expected_exponent: Number | None = None
    """expected exponent"""
    source: str | None = None
    """source of the expected exponent"""
    fit_range: tuple[Positive, Positive] | None = None
    """lowest and highest value of the fit; none: all"""

    @model_validator(mode="after")
    def _order(self) -> "Scaling":
        if self.field == "seed":
            raise ValueError("a power law cannot be fitted as a function of the seed")
        if self.fit_range is not None and self.fit_range[0] >= self.fit_range[1]:
            raise ValueError(
                f"fit_range must increase, but goes from {self.fit_range[0]:g} to "
                f"{self.fit_range[1]:g}"
            )
        return self


class Assumption(Model):
    """A value that the source of the study does not give."""

    field: str
    """dotted name of the field whose value is assumed"""
    why: str
    """what the source reports, and the reason for the value"""
    std: Positive | None = None
    """standard uncertainty of the value; of depth, speed, radius of the workpiece, or friction on
    it, the report says how uncertain it makes the mean drag"""


class Accepted(Model):
    """Limits that a study goes beyond on purpose."""

    unsafe_timestep: Line | None = None
    """reason for a time step that is forecast to be unstable, and for accepting its run; shown in
    the report"""
    cases: Annotated[Whole, Field(ge=1)] = 200
    """largest number of cases of `sweep`"""


OF_NO_RUN = (
    *("accepted", "assumptions", "calibration", "licence", "reference", "removal"),
    *("roughness", "scaling", "search", "sweep", "title"),
)
"""Blocks that no input script depends on. A block that is missing here only makes runs anew."""


class Study(Model):
    """A whole study file."""

    title: Line
    """title of the study in one line, used in headings"""
    licence: Line | None = None
    """licence of the results, as an SPDX name or an address; the RO-Crate states it"""
    gravity_m_s2: Positive = 9.81
    """gravitational acceleration along -z, m/s2"""
    materials: dict[MaterialName, Material] = Field(max_length=MOST_CLASSES)
    pairs: dict[str, Pair]
    """'a-b': contact coefficients of the materials a and b"""
    media: Media
    bowl: Annotated[AnyBowl, Discriminator(_kind_of_bowl)]
    compound: Compound | None = omitted(None)
    workpiece: Workpiece
    workpieces: Carousel | None = None
    motion: Motion
    reduction: Reduction | None = omitted(None)
    contact: Contact = Contact()
    drop_test: DropTest = DropTest()
    calibration: Calibration | None = None
    filling: Filling = Filling()
    outputs: Outputs = Outputs()
    fidelity: AnyFidelity = "standard"
    """settings for speed and accuracy: a name, a block, or a tolerance"""
    fidelities: dict[Name, Fidelity] = Field(default_factory=dict)
    seed: Annotated[Whole, Field(ge=0, lt=2**32)] = 1
    """random seed of the initial positions and velocities; one seed is one packing"""
    sweep: dict[str, Annotated[list[Any], Distinct]] = Field(default_factory=dict)
    """dotted field name: list of values; every combination is a case"""
    scaling: Scaling | None = None
    accepted: Accepted = Accepted()
    assumptions: Annotated[list[Assumption], Distinct] = Field(default_factory=list)
    reference: Reference | None = None
    removal: Removal | None = omitted(None)
    roughness: Roughness | None = omitted(None)
    search: Search | None = omitted(None)

    def of_each_workpiece(self) -> Sequence["Study"]:
        """The study of each workpiece alone, its path and its place of immersion turned.

        Several workpieces are immersed where their drag begins unless the study says otherwise.
        """
        if not self._stations:
            return [self]
        return [
            self.model_copy(
                update={
                    "workpiece": self.workpiece.model_copy(
                        update={"shape": station.shape or self.workpiece.shape}
                    ),
                    "motion": self.motion.turned(station.angle_deg, station.immersion_depth_m),
                    "workpieces": None,
                }
            )
            for station in self._stations
        ]

    @property
    def _stations(self) -> Sequence[Station]:
        """The workpieces of the carousel; none where one stands as the study gives it."""
        stations = self.workpieces.stations if self.workpieces else ()
        differ = len(stations) > 1 or any(
            station.angle_deg or station.shape or station.immersion_depth_m for station in stations
        )
        return stations if differ else ()

    def absent(self) -> set[str]:
        """The carousel, too, where it has one workpiece as the study gives it."""
        return super().absent() | (set() if self._stations else {"workpieces"})

    def of_runs(self, *materials: str) -> dict[str, Any]:
        """Plain values of all blocks that a run may depend on, with the settings that hold.

        Of materials and pairs, those that meet: particles, and what is made of `materials`.
        """
        particles = set(self.media.materials)
        names = {*particles, *materials}
        met = {name: set(name.split("-")) for name in self.pairs}
        return {
            **without_fields(self.plain(), *OF_NO_RUN, "fidelities"),
            "materials": {
                name: material.plain() for name, material in self.materials.items() if name in names
            },
            "pairs": {
                "-".join(sorted(both)): self.pairs[name].plain()
                for name, both in met.items()
                if both <= names and both & particles
            },
            "fidelity": self.chosen_fidelity().plain(),
        }

    def inputs(self) -> Json:
        """Values of all fields that results depend on, by dotted name, without the fidelity."""
        return flat(without_fields(self.plain(), *OF_NO_RUN, "fidelities", "fidelity"))

    def type_names(self) -> list[str]:
        """Materials in the order of the engine's types: particles, bowl, workpiece, each once."""
        walls = (self.bowl.material, self.workpiece.material)
        return list(dict.fromkeys((*self.media.materials, *walls)))

    @property
    def class_counts(self) -> Mapping[str, int]:
        """Number of particles of each class of the media."""
        densities = tuple(
            self.materials[str(part.material)].density_kg_m3 for part in self.media.parts.values()
        )
        return class_counts(self.media, densities, self.bowl.container)

    @property
    def particle_count(self) -> int:
        """Number of particles."""
        return sum(self.class_counts.values())

    @property
    def sphere_count(self) -> int:
        """Number of spheres in LIGGGHTS: more than that of particles if these are clumps."""
        media = self.media
        return sum(
            count * media.spheres_of(media.parts[name]) for name, count in self.class_counts.items()
        )

    def pair(self, first: str, second: str) -> Pair:
        """The contact coefficients of two materials.

        Raises
        ------
        ValueError
            The study has no such pair.
        """
        for key in (f"{first}-{second}", f"{second}-{first}"):
            if key in self.pairs:
                return self.pairs[key]
        raise ValueError(f"pairs has no entry '{first}-{second}', although these come into contact")

    @property
    def liquid_level_m(self) -> float:
        """Height of the compound's surface above the floor, m; 0 without compound."""
        compound = self.compound
        return (compound.level_m or self.bowl.height_m) if compound else 0.0

    @property
    def bowl_facet_size_m(self) -> float | None:
        """Edge length of the bowl's facets, m; None for exact walls, which cannot move."""
        size = self.bowl.own_facet_size_m
        bowl = self.motion.bowl
        if size is None and (self.motion.bowl_rad_s or (bowl and any(bowl.reach_m))):
            return 2 * self.media.typical_radius_m
        return size

    def chosen_fidelity(self) -> Fidelity:
        """The settings in ``fidelity``, or those it names; the study's own go before the built-in.

        Raises
        ------
        ValueError
            No fidelity has that name, or a tolerance was not resolved: `load_cases` does.
        """
        if isinstance(self.fidelity, Fidelity):
            return self.fidelity
        if isinstance(self.fidelity, Tolerance):
            raise ValueError("the tolerance has not been resolved to settings")
        known = {**BUILT_IN_FIDELITIES, **self.fidelities}
        if self.fidelity not in known:
            raise ValueError(f"unknown fidelity {self.fidelity!r}; known: {', '.join(known)}")
        return known[self.fidelity]

    def at_start(self) -> "Study":
        """The study with the settings of what leads to its statistics."""
        return self._at(self.chosen_fidelity().of_start)

    def at_filling(self) -> "Study":
        """The study with the settings of its filling."""
        return self._at(self.chosen_fidelity().of_filling)

    def _at(self, settings: Fidelity) -> "Study":
        """With these settings; itself, with the name of its fidelity, if they are its own."""
        if settings is self.chosen_fidelity():
            return self
        return self.model_copy(update={"fidelity": settings})
