"""The study file: what a user may say, in which unit, within which limits.

A study is plain data. Nothing here knows of the engine's syntax, of files other
than the study itself, or of how a scene is run.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import (
    Discriminator,
    Field,
    Tag,
    field_validator,
    model_validator,
)

from dragdeck.study.base import Model, NonNegative, Number, Positive, Whole
from dragdeck.study.contact_law import Contact, Pair
from dragdeck.study.material import Material
from dragdeck.study.reference import Reference

STUDY_FILE = "study.yaml"


Ranks = Annotated[
    Annotated[Literal["auto"], Tag("a-word")] | Annotated[Whole, Field(ge=1), Tag("a-number")],
    Discriminator(lambda value: "a-word" if value == "auto" else "a-number"),
]


class Media(Model):
    """The particles."""

    material: str = Field(description="name among materials")
    count: Annotated[Whole, Field(ge=1)] = Field(description="number of particles")
    radius_mean_m: Positive = Field(description="mean radius, m")
    radius_std_m: NonNegative = Field(default=0.0, description="standard deviation of the radii, m")

    @model_validator(mode="after")
    def _spread(self) -> Media:
        if self.radius_std_m > 0.3 * self.radius_mean_m:
            raise ValueError(
                f"radius_std_m {self.radius_std_m} exceeds 0.3 of radius_mean_m "
                f"{self.radius_mean_m}: the smallest particles would vanish"
            )
        return self


class Bowl(Model):
    """A flat-bottomed cylindrical bowl about the z axis, floor at z = 0."""

    material: str = Field(description="name among materials")
    radius_m: Positive = Field(description="inner radius, m")
    height_m: Positive = Field(description="inner height from the floor to the rim, m")
    facet_size_m: Positive | None = Field(
        default=None,
        description="edge length of the bowl's facets, m; none: an exact plane and cylinder",
    )


class CylinderShape(Model):
    """A generated round workpiece with flat ends."""

    kind: Literal["cylinder"] = Field(description="a generated workpiece")
    radius_m: Positive = Field(description="radius, m")
    facet_size_m: Positive = Field(default=0.0015, description="facet edges around the axis, m")
    facet_length_m: Positive = Field(default=0.01, description="facet edges along the axis, m")


class MeshShape(Model):
    """A workpiece from a mesh file, its axis along z, its lowest point the tip."""

    kind: Literal["mesh"] = Field(description="a mesh from a file")
    file: str = Field(description="STL, OBJ, PLY or VTK; relative to the study or to meshes/")
    unit: Literal["m", "cm", "mm", "um", "in"] = Field(description="unit of the file's numbers")


class Workpiece(Model):
    """The workpiece that is dragged."""

    material: str = Field(description="name among materials")
    shape: Annotated[CylinderShape | MeshShape, Field(discriminator="kind")]


class CirclePath(Model):
    """A circle about the bowl's axis, begun on the +x axis."""

    kind: Literal["circle"] = Field(description="about the bowl's axis, begun on +x")
    radius_m: Positive = Field(description="radius of the path of the workpiece's axis, m")
    revolutions: Positive = Field(default=1.0, description="how far, revolutions")
    direction: Literal["ccw", "cw"] = Field(
        default="ccw", description="direction seen from above: ccw (counter-clockwise) or cw"
    )

    @property
    def sign(self) -> int:
        """1 for a counter-clockwise path, -1 for a clockwise one."""
        return 1 if self.direction == "ccw" else -1


class LinePath(Model):
    """A straight line."""

    kind: Literal["line"] = Field(description="a straight line")
    start_m: tuple[Number, Number] = Field(description="x and y where the drag begins, m")
    direction_deg: Number = Field(default=0.0, description="direction of motion from +x, degrees")
    length_m: Positive = Field(description="length of the drag, m")


class Motion(Model):
    """How the workpiece goes in and where it goes."""

    path: Annotated[CirclePath | LinePath, Field(discriminator="kind")]
    speed_m_s: Positive = Field(description="speed of the workpiece's axis along the path, m/s")
    immersion_depth_m: Positive = Field(description="depth of the tip below the settled surface, m")
    orientation: Literal["follow_path", "fixed"] = Field(
        default="follow_path",
        description="follow_path: the workpiece turns with its path; fixed: it does not turn",
    )
    plunge_at_m: tuple[Number, Number] | None = Field(
        default=None,
        description="x and y where the workpiece goes in, m; none: the bowl's axis for a circle, "
        "the start for a line",
    )
    plunge_speed_m_s: Positive = Field(default=0.05, description="speed of going in, m/s")
    approach_speed_m_s: Positive = Field(
        default=0.02, description="speed from the plunge to the path, m/s"
    )
    transient_m: NonNegative = Field(
        description="first stretch of the path that no statistic counts, m"
    )


class DropTest(Model):
    """The drop test: one mean particle on a plate of the workpiece's material."""

    height_m: Positive = Field(default=0.010, description="free height below the particle, m")
    impacts: Annotated[Whole, Field(ge=1, le=20)] = Field(
        default=3, description="impacts to follow"
    )
    timestep_fraction: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.02, description="time step as a share of the Rayleigh time"
    )


class Calibration(Model):
    """A measured drop test, to find the restitution of particle on workpiece material."""

    record: str = Field(description="CSV of force over time; relative to the study's folder")
    height_std_m: Positive = Field(
        default=1e-4, description="standard uncertainty of drop_test.height_m in the test, m"
    )
    peaks: Literal["auto", "yes", "no"] = Field(
        default="auto",
        description="fit the ratios of the peak forces too; auto: if the sensor was fast enough",
    )


class Filling(Model):
    """When a bed counts as settled."""

    energy_ratio: Positive = Field(
        default=1e-5,
        description="mean kinetic energy of a particle over m g d, below which it rests",
    )
    max_time_s: Positive = Field(default=10.0, description="give up after this much time, s")


class Outputs(Model):
    """How often a process run writes; every rate is a lower bound, in process time."""

    workpiece_force_hz: Positive = Field(default=1000.0, description="total force and torque, Hz")
    workpiece_contacts_hz: Positive = Field(
        default=200.0, description="contacts on the workpiece, Hz"
    )
    network_hz: Positive = Field(default=20.0, description="all contacts and particles, Hz")
    n_checkpoints: Annotated[Whole, Field(ge=0)] = Field(
        default=50, description="restart points over the run"
    )

    @model_validator(mode="after")
    def _order(self) -> Outputs:
        if not self.workpiece_force_hz >= self.workpiece_contacts_hz >= self.network_hz:
            raise ValueError(
                "rates must fall from workpiece_force_hz over workpiece_contacts_hz to "
                "network_hz, because "
                "each frame of a slower output is compared with one of the faster"
            )
        return self


class Fidelity(Model):
    """What a user trades between speed and accuracy."""

    youngs_modulus_scale: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=1.0, description="factor on every Young's modulus, dimensionless"
    )
    timestep_fraction: Annotated[Number, Field(gt=0, le=2)] = Field(
        default=0.2, description="time step of the process over the Rayleigh time"
    )
    filling_timestep_fraction: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.25, description="time step of the fill over the Rayleigh time"
    )
    speed_factor: Annotated[Number, Field(ge=1, le=100)] = Field(
        default=1.0, description="factor on the speed of the workpiece, dimensionless"
    )
    skin_m: Positive | None = Field(
        default=None, description="neighbour skin, m; none: 0.1 of the mean radius"
    )
    ranks: Ranks = Field(
        default=2, description="engine processes; auto: by particles, cases and cores (docs/big.md)"
    )


Quantity = Literal[
    "drag_mean",
    "drag_std",
    "vertical_mean",
    "workpiece_contacts",
    "contact_force_mean",
    "contact_force_p90",
    "coordination_number",
    "chain_count",
    "chain_length",
    "restitution",
]
"""What a tolerance can be about; docs/trade.md defines each."""


class Tolerance(Model):
    """An error to stay within, instead of settings; the advisor finds them."""

    tolerance: Annotated[Number, Field(gt=0, lt=1)] = Field(
        description="largest relative error that the settings may cause, dimensionless"
    )
    quantity: Quantity = Field(default="drag_mean", description="what the error is about")


def _form(value: object) -> str:
    """Which of its three forms a fidelity has."""
    if isinstance(value, Tolerance) or (isinstance(value, Mapping) and "tolerance" in value):
        return "a-tolerance"
    return "settings" if isinstance(value, Mapping | Fidelity) else "a-name"


AnyFidelity = Annotated[
    Annotated[str, Tag("a-name")]
    | Annotated[Fidelity, Tag("settings")]
    | Annotated[Tolerance, Tag("a-tolerance")],
    Discriminator(_form),
]


class Assumption(Model):
    """A value that the source of the study does not give."""

    field: str = Field(description="dotted name of the assumed value")
    why: str = Field(description="what the source says or does not, and why this value")


class Scaling(Model):
    """A power law to look for in the mean drag over the levels of one sweep field."""

    field: str = Field(description="dotted name of a field of sweep, its levels numbers above 0")
    expected_exponent: Number | None = Field(
        default=None, description="exponent to compare the fitted one with"
    )
    source: str | None = Field(default=None, description="where that exponent comes from")
    fit_range: tuple[Positive, Positive] | None = Field(
        default=None,
        description="levels from ... to, where the exponent is expected; none: everywhere",
    )

    @model_validator(mode="after")
    def _order(self) -> Scaling:
        if self.field == "seed":
            raise ValueError("the seed is no field to fit a power law over")
        if self.fit_range is not None and self.fit_range[0] >= self.fit_range[1]:
            raise ValueError(
                f"fit_range goes from {self.fit_range[0]:g} to {self.fit_range[1]:g}: not up"
            )
        return self


BUILT_IN_FIDELITIES: Mapping[str, Fidelity] = {
    "draft": Fidelity(youngs_modulus_scale=1e-3, timestep_fraction=0.6),
    "standard": Fidelity(youngs_modulus_scale=1e-2, timestep_fraction=0.5),
    "fine": Fidelity(youngs_modulus_scale=0.1, timestep_fraction=0.5),
    "full": Fidelity(youngs_modulus_scale=1.0, timestep_fraction=0.5),
    "reference": Fidelity(youngs_modulus_scale=1.0, timestep_fraction=0.2),
}


class Study(Model):
    """A whole study file."""

    title: str = Field(description="for headings")
    gravity_m_s2: Positive = Field(default=9.81, description="gravity along -z, m/s2")
    materials: dict[str, Material]
    pairs: dict[str, Pair] = Field(description="'a-b': what materials a and b do to each other")
    media: Media
    bowl: Bowl
    workpiece: Workpiece
    motion: Motion
    contact: Contact = Contact()
    drop_test: DropTest = DropTest()
    calibration: Calibration | None = None
    filling: Filling = Filling()
    outputs: Outputs = Outputs()
    fidelity: AnyFidelity = Field(
        default="standard",
        description="name of a fidelity; or its settings; or a tolerance to find settings for",
    )
    fidelities: dict[str, Fidelity] = Field(default_factory=dict)
    seed: Annotated[Whole, Field(ge=0, lt=2**32)] = Field(
        default=1, description="of the first positions and velocities of the particles"
    )
    sweep: dict[str, list[Any]] = Field(
        default_factory=dict, description="dotted field: values; every combination is a case"
    )
    scaling: Scaling | None = None
    assumptions: list[Assumption] = Field(default_factory=list)
    reference: Reference | None = None

    @field_validator("materials")
    @classmethod
    def _plain_names(cls, materials: dict[str, Material]) -> dict[str, Material]:
        for name in materials:
            if "-" in name or not name:
                raise ValueError(f"material name {name!r} must not be empty or hold a dash")
        return materials

    @model_validator(mode="after")
    def _names_exist(self) -> Study:
        for owner in ("media", "bowl", "workpiece"):
            name = getattr(self, owner).material
            if name not in self.materials:
                raise ValueError(
                    f"{owner}.material {name!r} is not among materials: {', '.join(self.materials)}"
                )
        for other in self.type_names():
            self.pair(self.media.material, other)
        if not isinstance(self.fidelity, Tolerance):
            self.chosen_fidelity()
        return self

    def type_names(self) -> list[str]:
        """Materials in the order of the engine's types: particle, bowl, workpiece, each once."""
        owners = (self.media, self.bowl, self.workpiece)
        return list(dict.fromkeys(owner.material for owner in owners))

    def pair(self, first: str, second: str) -> Pair:
        """What two materials do to each other.

        Raises
        ------
        ValueError
            The study has no such pair.
        """
        for key in (f"{first}-{second}", f"{second}-{first}"):
            if key in self.pairs:
                return self.pairs[key]
        raise ValueError(f"pairs has no entry '{first}-{second}', and these two will touch")

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
