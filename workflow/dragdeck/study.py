"""The study file: what a user may say, in which unit, within which limits.

A study is plain data. Nothing here knows of the engine's syntax, of files other
than the study itself, or of how a scene is run.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    field_validator,
    model_validator,
)

from dragdeck.errors import InputError

STUDY_FILE = "study.yaml"


def _number(value: object) -> object:
    """Accept ``5e6``, which YAML 1.1 reads as text; refuse truth values."""
    if isinstance(value, bool):
        raise ValueError("a truth value stands where a number belongs")
    if isinstance(value, str):
        try:
            return float(value)
        except ValueError:
            raise ValueError(f"{value!r} is text, not a number") from None
    return value


def _whole(value: object) -> object:
    number = _number(value)
    if isinstance(number, float) and number.is_integer():
        return int(number)
    return number


Number = Annotated[float, BeforeValidator(_number), Field(allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
NonNegative = Annotated[Number, Field(ge=0)]
Whole = Annotated[int, BeforeValidator(_whole)]
Ranks = Annotated[
    Annotated[Literal["auto"], Tag("a-word")] | Annotated[Whole, Field(ge=1), Tag("a-number")],
    Discriminator(lambda value: "a-word" if value == "auto" else "a-number"),
]


class Model(BaseModel):
    """A part of a study: unknown keys are refused, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Material(Model):
    """An elastic material."""

    youngs_modulus_pa: Positive = Field(description="Young's modulus, Pa")
    poissons_ratio: Annotated[Number, Field(gt=-1, lt=0.5)] = Field(
        description="Poisson's ratio, dimensionless; thermodynamics allows (-1, 0.5)"
    )
    density_kg_m3: Positive = Field(description="density, kg/m3")


class Pair(Model):
    """What two materials do to each other."""

    restitution: Annotated[Number, Field(gt=0.05, le=1)] = Field(
        description="coefficient of normal restitution; the engine takes (0.05, 1]"
    )
    friction: Annotated[Number, Field(ge=0, le=10)] = Field(
        description="Coulomb friction coefficient, dimensionless"
    )


class Media(Model):
    """The balls."""

    material: str = Field(description="name among materials")
    count: Annotated[Whole, Field(ge=1)] = Field(description="number of balls")
    radius_mean_m: Positive = Field(description="mean radius, m")
    radius_sd_m: NonNegative = Field(default=0.0, description="standard deviation of the radii, m")

    @model_validator(mode="after")
    def _spread(self) -> Media:
        if self.radius_sd_m > 0.3 * self.radius_mean_m:
            raise ValueError(
                f"radius_sd_m {self.radius_sd_m} exceeds 0.3 of radius_mean_m "
                f"{self.radius_mean_m}: the smallest balls would vanish"
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
    """A generated round tool with flat ends."""

    kind: Literal["cylinder"] = Field(description="a generated rod")
    radius_m: Positive = Field(description="radius, m")
    facet_size_m: Positive = Field(default=0.0015, description="facet edges around the axis, m")
    facet_length_m: Positive = Field(default=0.01, description="facet edges along the axis, m")


class MeshShape(Model):
    """A tool from a mesh file, its axis along z, its lowest point the tip."""

    kind: Literal["mesh"] = Field(description="a mesh from a file")
    file: str = Field(description="STL, OBJ, PLY or VTK; relative to the study or to meshes/")
    unit: Literal["m", "cm", "mm", "um", "in"] = Field(description="unit of the file's numbers")


class Workpiece(Model):
    """The tool that is dragged."""

    material: str = Field(description="name among materials")
    shape: Annotated[CylinderShape | MeshShape, Field(discriminator="kind")]


class CirclePath(Model):
    """A circle about the bowl's axis, begun on the +x axis."""

    kind: Literal["circle"] = Field(description="about the bowl's axis, begun on +x")
    radius_m: Positive = Field(description="radius of the path of the tool's axis, m")
    revolutions: Positive = Field(default=1.0, description="how far, revolutions")
    sense: Literal[1, -1] = Field(default=1, description="1 counter-clockwise from above, -1 not")


class LinePath(Model):
    """A straight line."""

    kind: Literal["line"] = Field(description="a straight line")
    start_m: tuple[Number, Number] = Field(description="x and y where the drag begins, m")
    heading_deg: Number = Field(default=0.0, description="direction of motion from +x, degrees")
    length_m: Positive = Field(description="length of the drag, m")


class Motion(Model):
    """How the tool goes in and where it goes."""

    path: Annotated[CirclePath | LinePath, Field(discriminator="kind")]
    speed_m_s: Positive = Field(description="speed of the tool's axis along the path, m/s")
    submersion_m: Positive = Field(description="depth of the tip below the settled surface, m")
    turns_with_path: bool = Field(
        default=True, description="the tool turns with the path, or keeps its orientation"
    )
    plunge_at_m: tuple[Number, Number] | None = Field(
        default=None,
        description="x and y where the tool goes in, m; none: the bowl's axis for a circle, "
        "the start for a line",
    )
    plunge_speed_m_s: Positive = Field(default=0.05, description="speed of going in, m/s")
    approach_speed_m_s: Positive = Field(
        default=0.02, description="speed from the plunge to the path, m/s"
    )
    run_in_m: NonNegative = Field(
        description="first stretch of the path that no statistic counts, m"
    )


class Drop(Model):
    """The drop test: one mean ball on a plate of the workpiece's material."""

    height_m: Positive = Field(default=0.010, description="free height below the ball, m")
    impacts: Annotated[Whole, Field(ge=1, le=20)] = Field(
        default=3, description="impacts to follow"
    )
    timestep_fraction: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.02, description="time step as a share of the Rayleigh time"
    )


class Calibration(Model):
    """A measured drop test, to find the restitution of ball on workpiece material."""

    record: str = Field(description="CSV of force over time; relative to the study's folder")
    height_sd_m: Positive = Field(
        default=1e-4, description="standard uncertainty of drop.height_m in the test, m"
    )
    peaks: Literal["auto", "yes", "no"] = Field(
        default="auto",
        description="fit the ratios of the peak forces too; auto: if the sensor was fast enough",
    )


class Fill(Model):
    """When a bed counts as settled."""

    energy_ratio: Positive = Field(
        default=1e-5, description="mean kinetic energy of a ball over m g d, below which it rests"
    )
    longest_s: Positive = Field(default=10.0, description="give up after this much time, s")


class Contact(Model):
    """Options of the contact law."""

    limit_force: bool = Field(
        default=True, description="no attraction at the end of an impact (dry balls do not stick)"
    )


class Outputs(Model):
    """How often a process run writes; every rate is a lower bound, in process time."""

    tool_force_hz: Positive = Field(default=1000.0, description="total force and torque, Hz")
    tool_contacts_hz: Positive = Field(default=200.0, description="contacts on the tool, Hz")
    network_hz: Positive = Field(default=20.0, description="all contacts and balls, Hz")
    checkpoints: Annotated[Whole, Field(ge=0)] = Field(
        default=50, description="restart points over the run"
    )

    @model_validator(mode="after")
    def _order(self) -> Outputs:
        if not self.tool_force_hz >= self.tool_contacts_hz >= self.network_hz:
            raise ValueError(
                "rates must fall from tool_force_hz over tool_contacts_hz to network_hz, because "
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
    fill_timestep_fraction: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.25, description="time step of the fill over the Rayleigh time"
    )
    speed_factor: Annotated[Number, Field(ge=1, le=100)] = Field(
        default=1.0, description="factor on the speed of the tool, dimensionless"
    )
    skin_m: Positive | None = Field(
        default=None, description="neighbour skin, m; none: 0.1 of the mean radius"
    )
    ranks: Ranks = Field(
        default=2, description="engine processes; auto: by balls, cases and cores (docs/big.md)"
    )


Quantity = Literal[
    "drag_mean",
    "drag_sd",
    "vertical_mean",
    "rod_contacts",
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


class Reference(Model):
    """Published figures to stand beside the results."""

    source: str = Field(description="where the figures come from")
    measured_drag_mean_n: Number | None = Field(
        default=None, description="measured mean drag, N; negative: against the motion"
    )
    measured_drag_sd_n: NonNegative | None = Field(
        default=None, description="its standard deviation, N"
    )
    published_drag_mean_n: Number | None = Field(
        default=None, description="simulated mean drag as published, N"
    )
    published_drag_sd_n: NonNegative | None = Field(
        default=None, description="its standard deviation, N"
    )


class Scaling(Model):
    """A power law to look for in the mean drag over the levels of one matrix field."""

    field: str = Field(description="dotted name of a field of matrix, its levels numbers above 0")
    expected_exponent: Number | None = Field(
        default=None, description="exponent to compare the fitted one with"
    )
    source: str | None = Field(default=None, description="where that exponent comes from")
    within: tuple[Positive, Positive] | None = Field(
        default=None,
        description="levels from ... to, where the exponent is expected; none: everywhere",
    )

    @model_validator(mode="after")
    def _order(self) -> Scaling:
        if self.field == "seed":
            raise ValueError("the seed is no field to fit a power law over")
        if self.within is not None and self.within[0] >= self.within[1]:
            raise ValueError(f"within goes from {self.within[0]:g} to {self.within[1]:g}: not up")
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
    drop: Drop = Drop()
    calibration: Calibration | None = None
    fill: Fill = Fill()
    outputs: Outputs = Outputs()
    fidelity: AnyFidelity = Field(
        default="standard",
        description="name of a fidelity; or its settings; or a tolerance to find settings for",
    )
    fidelities: dict[str, Fidelity] = Field(default_factory=dict)
    seed: Annotated[Whole, Field(ge=0, lt=2**32)] = Field(
        default=1, description="of the first positions and velocities of the balls"
    )
    matrix: dict[str, list[Any]] = Field(
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
        """Materials in the order of the engine's types: ball, bowl, workpiece, each once."""
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


class _Loader(yaml.SafeLoader):
    """YAML that refuses a key given twice."""


def _mapping(loader: _Loader, node: yaml.MappingNode) -> dict[Any, Any]:
    seen: set[Any] = set()
    for key_node, _ in node.value:
        key = loader.construct_object(key_node)
        if key in seen:
            raise yaml.constructor.ConstructorError(
                None, None, f"key {key!r} is given twice", key_node.start_mark
            )
        seen.add(key)
    return loader.construct_mapping(node, deep=True)


_Loader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _mapping)


def read_yaml(file: Path) -> dict[str, Any]:
    """Read a study file as plain data.

    Raises
    ------
    InputError
        The file is missing, is not YAML, or is not a mapping.
    """
    try:
        text = file.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError("no such study file", file=file, remedy=_studies_nearby(file)) from None
    try:
        data = yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else "?"
        raise InputError(f"not YAML: {error.problem}", file=file, field=f"line {line}") from None
    if not isinstance(data, dict):
        raise InputError("a study is a mapping of fields", file=file, value=type(data).__name__)
    return data


def _studies_nearby(file: Path) -> str:
    names = sorted(found.parent.name for found in file.parent.parent.glob(f"*/{STUDY_FILE}"))
    return f"choose one of: {', '.join(names)}" if names else "check the path"


def validate(data: Mapping[str, Any], file: Path | str) -> Study:
    """Check plain data against the study model.

    Raises
    ------
    InputError
        Names the first field that is wrong, its value, its limit and a remedy.
    """
    try:
        return Study.model_validate(data)
    except ValidationError as error:
        raise explained(error, file) from None


_FORMS = ("cylinder", "circle", "line", "a-name", "a-number", "a-word", "settings", "a-tolerance")
"""Names of alternatives, which are no part of a field's dotted name."""

_LIMITS = {
    "greater_than": "greater than {gt}",
    "greater_than_equal": "at least {ge}",
    "less_than": "less than {lt}",
    "less_than_equal": "at most {le}",
    "finite_number": "a finite number",
}


def explained(error: ValidationError, file: Path | str) -> InputError:
    """The first problem that a model found in a file, as an error for the user."""
    issues = error.errors()
    first = issues[0]
    kind = first["type"]
    field = ".".join(str(part) for part in first["loc"] if part not in _FORMS)
    limit = _LIMITS[kind].format(**first.get("ctx", {})) if kind in _LIMITS else None
    problem, remedy = first["msg"].removeprefix("Value error, "), None
    value: object = first["input"]
    if kind == "extra_forbidden":
        problem, remedy = "unknown key", "remove it, or check its spelling against docs/study.md"
    elif kind == "missing":
        problem, remedy, value = "a required key is missing", "add it", None
    elif isinstance(value, Mapping | BaseModel):
        value = None
    if len(issues) > 1:
        more = f"{len(issues) - 1} more problem(s) stand in this file"
        remedy = f"{remedy}; {more}" if remedy else more
    return InputError(
        problem, file=file, field=field or None, value=_shown(value), limit=limit, remedy=remedy
    )


def _shown(value: object) -> str | None:
    if value is None:
        return None
    if isinstance(value, float) and math.isnan(value):
        return "NaN"
    return repr(value)
