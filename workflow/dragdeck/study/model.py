"""The study file: fields, units and limits.

A study is plain data, independent of the syntax of LIGGGHTS, of other files and of how a scene is
run.
"""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import numpy as np
from pydantic import Discriminator, Field, Tag, model_validator

from dragdeck.study.base import (
    Json,
    Line,
    MaterialName,
    Model,
    Name,
    NonNegative,
    Number,
    Positive,
    Whole,
    flat,
    without_fields,
)
from dragdeck.study.bowl_motions.registry import AnyBowlMotion
from dragdeck.study.bowls.annulus import AnnulusBowl
from dragdeck.study.bowls.cylinder import CylinderBowl
from dragdeck.study.bowls.mesh import MeshBowl
from dragdeck.study.bowls.revolved import RevolvedBowl
from dragdeck.study.bowls.trough import TroughBowl
from dragdeck.study.calibration import Calibration
from dragdeck.study.contact_law import Contact, Pair
from dragdeck.study.drive import about_vertical
from dragdeck.study.media import MOST_CLASSES, Media, class_counts
from dragdeck.study.paths.circle import CirclePath
from dragdeck.study.paths.figure_eight import FigureEightPath
from dragdeck.study.paths.line import LinePath
from dragdeck.study.paths.path import as_rows, turned
from dragdeck.study.paths.rest import RestPath
from dragdeck.study.paths.waypoints import WaypointsPath
from dragdeck.study.quantities import QUANTITIES
from dragdeck.study.reduction import Reduction
from dragdeck.study.reference import Reference
from dragdeck.study.removal import Removal
from dragdeck.study.roughness import Roughness
from dragdeck.study.search import Search
from dragdeck.study.superposed.motion import SuperposedMotion
from dragdeck.study.superposed.oscillation import Oscillation
from dragdeck.study.superposed.spin import Spin, SpinStage
from dragdeck.study.workpiece import Carousel, Material, Station, Workpiece

Ranks = Annotated[
    Annotated[Literal["auto"], Tag("a-word")]
    | Annotated[Whole, Field(ge=1, le=1024), Tag("a-number")],
    Discriminator(lambda value: "a-word" if value == "auto" else "a-number"),
]


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
    default = CylinderBowl.model_fields["kind"].default
    if isinstance(value, Mapping):
        return value.get("kind", default)
    return getattr(value, "kind", default)


class Compound(Model):
    """A liquid at rest in the bowl: it carries a part of the particles' weight.

    Nothing else of it is modelled. `pairs` has the coefficients of wet contacts.
    """

    density_kg_m3: Positive = Field(description="density of the liquid, kg/m3")
    level_m: Positive | None = Field(
        default=None,
        description="height of the liquid above the floor, m; none: up to the rim of the bowl",
    )


class Superposed(Model):
    """The registry of superposed motions: the block of each kind, in the order of application.

    A motion carries the centres of those that follow it: what turns the workpiece comes last.
    """

    oscillation: Oscillation | None = None
    spin: Spin | None = None

    def superposed(self, speed_factor: float = 1.0) -> Mapping[str, SuperposedMotion]:
        """What is superposed on the path, by the name of its block, at this factor on speeds."""
        motions = {name: getattr(self, name) for name in Superposed.model_fields}
        return {
            name: motion.faster(speed_factor)
            for name, motion in motions.items()
            if motion is not None
        }


AnyPath = CirclePath | FigureEightPath | LinePath | RestPath | WaypointsPath
"""The registry of paths."""


_PLACES = 1001
"""Of a path, at which speeds are compared."""

BED_FRICTION_DEG = 26.0
"""Angle of friction of a bed of spheres, from the tilt of the surface in a turning bowl (friction
0.34 between particles)."""


_MOST_TURNED_DEG = 180
"""From one waypoint to the next: beyond, the shortest rotation is another one."""


class Motion(Superposed):
    """Immersion and path of the workpiece."""

    path: Annotated[AnyPath, Field(discriminator="kind")]
    speed_m_s: Positive | None = Field(
        default=None,
        description="speed of the workpiece's axis along the path, m/s; required except for `rest` "
        "and `waypoints`",
    )
    ramp_s: NonNegative = Field(
        default=0.0,
        exclude_if=lambda value: value == 0,
        description="duration of the start from rest along the path, s, with `speed_factor` 1; "
        "excluded from all statistics; not for `rest` and `waypoints`",
    )
    immersion_depth_m: Positive = Field(description="depth of the tip below the settled surface, m")
    orientation: Literal["follow_path", "fixed"] = Field(
        default="follow_path",
        description="follow_path: the workpiece turns with its path; fixed: it does not turn",
    )
    tilt_deg: Annotated[Number, Field(ge=-45, le=45)] | None = Field(
        default=None,
        description="inclination of the workpiece, degrees; positive: its upper end leans in the "
        "direction of motion, with orientation fixed in the first one; `spin` is then about the "
        "inclined axis",
    )
    bowl: AnyBowlMotion | None = Field(
        default=None, description="motion of the bowl during the whole process; none: it rests"
    )
    bed_friction_deg: Annotated[Number, Field(ge=0, lt=90)] = Field(
        default=BED_FRICTION_DEG,
        exclude_if=lambda value: value == BED_FRICTION_DEG,
        description="angle of friction of the bed, degrees, by which its surface in a rotating "
        "bowl is less inclined than that of a liquid",
    )
    plunge_at_m: tuple[Number, Number] | None = Field(
        default=None,
        description="x and y of the immersion, m; none: the bowl's axis for a circle, otherwise "
        "the start of the path",
    )
    plunge_speed_m_s: Positive = Field(
        default=0.05, description="vertical speed during the plunge, m/s"
    )
    approach_speed_m_s: Positive = Field(
        default=0.02, description="speed from the place of immersion to the start of the path, m/s"
    )
    transient_m: NonNegative = Field(
        description="initial path length excluded from all statistics, m"
    )
    counted_from_revolution: Annotated[Whole, Field(ge=1)] | None = Field(
        default=None,
        description="first revolution of a circle that the statistics include; none: all after "
        "`transient_m`",
    )

    @model_validator(mode="after")
    def _path(self) -> "Motion":
        if self.counted_from_revolution is not None and self.path.revolution_m is None:
            raise ValueError(
                "counted_from_revolution applies to circles only: this path has no revolutions"
            )
        if (self.path.turning or self.path.inclined) and self.spin is not None:
            raise ValueError("spin and waypoints that turn cannot be combined: remove one of them")
        if self.inclined and self.path.most_turned_deg >= _MOST_TURNED_DEG:
            raise ValueError(
                f"an inclined workpiece turns by {self.path.most_turned_deg:g} degrees from one "
                f"waypoint to the next, not by less than {_MOST_TURNED_DEG}: add waypoints"
            )
        if self.bowl is not None and self.path.bowl_rad_s(1.0):
            raise ValueError(
                f"motion.bowl cannot be used: the path `{self.path.kind}` rotates the bowl itself"
            )
        if self.ramp_s and self.path.own_speed_m_s is not None:
            raise ValueError("ramp_s cannot be used: the path itself gives the speed")
        if self.speed_m_s is None and self.path.own_speed_m_s is None:
            raise ValueError("speed_m_s is missing: give the speed along the path, m/s")
        if self.speed_m_s is not None and self.path.own_speed_m_s is not None:
            raise ValueError(
                f"speed_m_s {self.speed_m_s:g} and the path's own speed, "
                f"{self.path.own_speed_m_s:.3g} m/s, are both given: remove speed_m_s"
            )
        return self

    def superposed(self, speed_factor: float = 1.0) -> Mapping[str, SuperposedMotion]:
        """What is superposed on the path, the rotation that it gives included."""
        motions = super().superposed(speed_factor)
        if not self.path.turning or self.inclined:
            return motions
        stages = [SpinStage(until_s=end, rpm=rpm) for end, rpm in self.path.turning]
        return {**motions, "spin": Spin(schedule=stages, ramp_s=0.0).faster(speed_factor)}

    @property
    def inclined(self) -> bool:
        """Whether the workpiece's axis is ever inclined."""
        return bool(self.tilt_deg) or self.path.inclined

    @property
    def turns(self) -> bool:
        """Whether the workpiece turns in the frame of its path."""
        by_path = self.path.inclined or bool(self.path.turning)
        return by_path or any(motion.turns for motion in self.superposed().values())

    @property
    def turns_about_inclined_axis(self) -> bool:
        """Whether the workpiece spins about an axis that is not upright."""
        return bool(self.tilt_deg) and self.spin is not None

    @property
    def nominal_speed_m_s(self) -> float:
        """Speed of the workpiece's axis along its path, m/s.

        It is that relative to the bowl unless `bowl` moves it.
        """
        return self.path.own_speed_m_s or self.speed_m_s or math.nan

    @property
    def speed_in_bowl_m_s(self) -> float:
        """Speed of the workpiece's axis relative to the bowl, m/s: the highest, if that rotates."""
        rate = self.bowl.rad_s if self.bowl else 0.0
        if not rate:
            return self.nominal_speed_m_s
        share = np.linspace(0.0, 1.0, _PLACES)
        place, along = (as_rows(part(share)) for part in (self.path.place, self.path.tangent))
        speed = along * self.nominal_speed_m_s / self.path_length_m
        return float(np.linalg.norm(speed - about_vertical(rate, place), axis=1).max())

    @property
    def bowl_rad_s(self) -> float:
        """Angular speed of the bowl about +z, rad/s."""
        by_path = self.path.bowl_rad_s(self.nominal_speed_m_s)
        return self.bowl.rad_s if self.bowl else by_path

    @property
    def path_length_m(self) -> float:
        """Length of the drag, m."""
        return self.path.path_length_m

    @property
    def uncounted_m(self) -> float:
        """Length of the drag before the statistics begin, m: what is superposed has started."""
        whole = (self.path.revolution_m or 0.0) * ((self.counted_from_revolution or 1) - 1)
        starts = (self.passed_m(motion.ramp_s) for motion in self.superposed().values())
        return max(self.transient_m, whole, self.passed_m(self.ramp_s), *starts)

    def passed_m(self, time_s: float) -> float:
        """Length of the path after a time, at the end of its start or later, m."""
        return (max(time_s, self.ramp_s) - self.ramp_s / 2) * self.nominal_speed_m_s

    def turned(self, angle_deg: float, depth_m: float | None = None) -> "Motion":
        """The same motion turned about the bowl's axis, immersed where the drag begins.

        Parameters
        ----------
        angle_deg : float
        depth_m : float, optional
            Another immersion depth.
        """
        path, place = self.path.turned(angle_deg), self.plunge_at_m
        at = path.start_point if place is None else turned(place, angle_deg)
        depth = depth_m or self.immersion_depth_m
        return self.model_copy(update={"path": path, "plunge_at_m": at, "immersion_depth_m": depth})

    def at(self, pace: float, length_m: float) -> "Motion":
        """The drag at another pace and with another length, all of it counted.

        Parameters
        ----------
        pace : float
            On every speed of the drag.
        length_m : float
        """
        speed = None if self.speed_m_s is None else pace * self.speed_m_s
        return self.model_copy(
            update={
                "path": self.path.with_length(length_m).faster(pace),
                "speed_m_s": speed,
                "transient_m": 0.0,
                "ramp_s": 0.0,
                "counted_from_revolution": None,
                **self.superposed(pace),
            }
        )


class DropTest(Model):
    """The drop test: one mean particle on a plate of the workpiece's material."""

    height_m: Positive = Field(
        default=0.010, description="gap between particle and plate at the start, m"
    )
    impacts: Annotated[Whole, Field(ge=1, le=20)] = Field(
        default=3, description="number of impacts"
    )
    timestep_fraction: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.02, description="time step as a fraction of the Rayleigh time"
    )


class Filling(Model):
    """When a packing counts as settled."""

    energy_ratio: Annotated[Number, Field(gt=0, le=1e-3)] = Field(
        default=1e-5,
        description="settling criterion: largest mean kinetic energy per particle / (m g d)",
    )
    max_time_s: Positive = Field(
        default=10.0, description="simulated time after which an unsettled packing is rejected, s"
    )


class Outputs(Model):
    """Sampling rates of a process run; each is a lower bound, in process time."""

    workpiece_force_hz: Positive = Field(
        default=1000.0, description="minimum sampling rate of force and torque on the workpiece, Hz"
    )
    workpiece_contacts_hz: Positive = Field(
        default=200.0, description="minimum sampling rate of the contacts on the workpiece, Hz"
    )
    network_hz: Positive = Field(
        default=20.0, description="minimum sampling rate of all contacts and particles, Hz"
    )
    n_checkpoints: Annotated[Whole, Field(ge=0, le=1000)] = Field(
        default=50, description="number of checkpoints of a run, from which it can be resumed"
    )
    first_touch_fraction: Annotated[Number, Field(ge=0, le=1)] = Field(
        default=0,
        description="fraction of the drag, at its end, in which contacts on the workpiece are "
        "written at every step, for the velocity at first touch",
        exclude_if=lambda value: value == 0,
    )

    @model_validator(mode="after")
    def _order(self) -> "Outputs":
        if not self.workpiece_force_hz >= self.workpiece_contacts_hz >= self.network_hz:
            raise ValueError(
                "the rates must not increase from workpiece_force_hz to workpiece_contacts_hz to "
                "network_hz: each frame of a slower output is compared with one of a faster output"
            )
        return self


if TYPE_CHECKING:
    Quantity = str
else:
    Quantity = Literal[tuple(row["name"] for row in QUANTITIES if row["tolerance"])]
"""Quantities to which a tolerance can apply; docs/evidence/tradeoff.md defines each."""

RESTITUTION = "restitution"
"""The quantity of the drop test; all others are of the process."""


LARGEST_TIMESTEP_FRACTION = 2.0
"""Of the Rayleigh time: no larger step was ever stable (docs/development/liggghts.md)."""


class Windows(Model):
    """Short runs at physical stiffness along the path, until quantities are known well enough."""

    tolerance: Annotated[Number, Field(ge=1e-4, lt=1)] = Field(
        description="relative half-width of the 95 % confidence interval at which no further "
        "window is run"
    )
    quantities: Annotated[list[Quantity], Field(min_length=1)] = Field(
        default=["drag_mean"], description="quantities to which the tolerance applies"
    )
    most: Annotated[Whole, Field(ge=2, le=64)] = Field(
        default=16, description="largest number of windows"
    )
    timestep_fraction: Annotated[Number, Field(gt=0, le=LARGEST_TIMESTEP_FRACTION)] = Field(
        default=0.64, description="time step of the windows as a fraction of the Rayleigh time"
    )


class SoftStart(Model):
    """Settings of the process until shortly before its statistics, with smaller moduli.

    The moduli are raised to those of the run before the statistics begin. The filling has those of
    the run: the bed's surface, from which depth is measured, depends on them.
    """

    youngs_modulus_scale: Annotated[Number, Field(gt=0, lt=1)] = Field(
        description="multiplier of every Young's modulus"
    )
    timestep_fraction: Annotated[Number, Field(gt=0, le=LARGEST_TIMESTEP_FRACTION)] = Field(
        default=0.3, description="time step as a fraction of the Rayleigh time"
    )


class Fidelity(Model):
    """Settings for speed and accuracy."""

    youngs_modulus_scale: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=1.0, description="multiplier of every Young's modulus; 1: physical stiffness"
    )
    soft_start: SoftStart | None = Field(
        default=None,
        description="settings of plunge, approach and the start of the drag; none: those of the "
        "rest",
        exclude_if=lambda value: value is None,
    )
    timestep_fraction: Annotated[Number, Field(gt=0, le=LARGEST_TIMESTEP_FRACTION)] = Field(
        default=0.2, description="time step of the process as a fraction of the Rayleigh time"
    )
    filling_timestep_fraction: Annotated[Number, Field(gt=0, le=1)] = Field(
        default=0.25, description="time step of the filling as a fraction of the Rayleigh time"
    )
    filling_youngs_modulus_scale: Annotated[Number, Field(gt=0, le=1)] | None = Field(
        default=None,
        description="multiplier of every Young's modulus in the filling; none: that of the "
        "results, which is 1 with windows",
        exclude_if=lambda value: value is None,
    )
    speed_factor: Annotated[Number, Field(ge=1, le=100)] = Field(
        default=1.0, description="multiplier of the speed of the workpiece"
    )
    skin_m: Positive | None = Field(
        default=None,
        description="neighbour skin, m; none: 10 % of the mean particle radius, in a fast process "
        "up to 30 %",
    )
    ranks: Ranks = Field(
        default=2,
        description="number of MPI ranks; auto: from particles, cases and cores "
        "(docs/howto/running.md)",
    )

    windows: Windows | None = Field(
        default=None,
        description="windows of a run with reduced moduli; none: none are run",
        exclude_if=lambda value: value is None,
    )

    @model_validator(mode="after")
    def _parts_fit(self) -> Self:
        start, scale = self.soft_start, self.youngs_modulus_scale
        whole = scale < 1 and self.speed_factor == 1 and start is None
        if self.windows is not None and not whole:
            raise ValueError(
                "windows require a youngs_modulus_scale below 1, a speed_factor of 1 and no "
                "soft_start"
            )
        if start is not None and start.youngs_modulus_scale >= scale:
            raise ValueError(
                f"soft_start has a youngs_modulus_scale of {start.youngs_modulus_scale:g}, not "
                f"below {scale:g}"
            )
        first = (start or self).youngs_modulus_scale
        if self._filling_scale < first:
            raise ValueError(
                f"filling_youngs_modulus_scale is {self._filling_scale:g}: a process that starts "
                f"with {first:g} would throw so soft a bed up; use {first:g} or more"
            )
        return self

    @property
    def _filling_scale(self) -> float:
        of_results = 1.0 if self.windows else self.youngs_modulus_scale
        return self.filling_youngs_modulus_scale or of_results

    @property
    def of_filling(self) -> "Fidelity":
        """The settings of the filling, which has the modulus at which the results hold.

        A bed of softer particles is lower, and depth is measured from its surface.
        """
        if self._filling_scale == self.youngs_modulus_scale:
            return self
        return self.model_copy(update={"youngs_modulus_scale": self._filling_scale})

    @property
    def of_start(self) -> "Fidelity":
        """The settings of plunge, approach and the start of the drag."""
        if self.soft_start is None:
            return self
        filling = {"filling_youngs_modulus_scale": self._filling_scale}
        return self.model_copy(update={**dict(self.soft_start), "soft_start": None, **filling})


class Tolerance(Model):
    """A tolerance instead of settings: runs go on until the results are inside it."""

    tolerance: Annotated[Number, Field(ge=1e-4, lt=1)] = Field(
        description="relative half-width of the 95 % confidence interval at the physical Young's "
        "modulus"
    )
    quantity: Annotated[
        Annotated[Quantity, Tag("a-name")]
        | Annotated[list[Quantity], Field(min_length=1, max_length=8), Tag("a-list")],
        Discriminator(lambda value: "a-list" if isinstance(value, list) else "a-name"),
    ] = Field(
        default="drag_mean",
        description="quantity, or list of up to eight, to which the tolerance applies",
    )

    @property
    def quantities(self) -> Sequence[Quantity]:
        """All of them."""
        return self.quantity if isinstance(self.quantity, list) else [self.quantity]


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


class Scaling(Model):
    """A power law of the mean drag as a function of one sweep field."""

    field: str = Field(description="dotted name of the `sweep` field; its values must be above 0")
    expected_exponent: Number | None = Field(default=None, description="expected exponent")
    source: str | None = Field(default=None, description="source of the expected exponent")
    fit_range: tuple[Positive, Positive] | None = Field(
        default=None, description="lowest and highest value of the fit; none: all"
    )

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

    field: str = Field(description="dotted name of the field whose value is assumed")
    why: str = Field(description="what the source reports, and the reason for the value")
    std: Annotated[Number, Field(gt=0)] | None = Field(
        default=None,
        description="standard uncertainty of the value; of depth, speed, radius of the workpiece, "
        "or friction on it, the report says how uncertain it makes the mean drag",
    )


class Accepted(Model):
    """Limits that a study goes beyond on purpose."""

    unsafe_timestep: Line | None = Field(
        default=None,
        description="reason for a time step that is forecast to be unstable, and for accepting its "
        "run; shown in the report",
    )
    cases: Annotated[Whole, Field(ge=1)] = Field(
        default=200, description="largest number of cases of `sweep`"
    )


BUILT_IN_FIDELITIES: Mapping[str, Fidelity] = {
    "draft": Fidelity(youngs_modulus_scale=1e-3, timestep_fraction=0.6),
    "standard": Fidelity(youngs_modulus_scale=1e-2, timestep_fraction=0.5),
    "fine": Fidelity(youngs_modulus_scale=0.1, timestep_fraction=0.5),
    "full": Fidelity(youngs_modulus_scale=1.0, timestep_fraction=0.64),
    "reference": Fidelity(youngs_modulus_scale=1.0, timestep_fraction=0.2),
}


OF_NO_RUN = (
    *("accepted", "assumptions", "calibration", "licence", "reference", "removal"),
    *("roughness", "scaling", "search", "sweep", "title"),
)
"""Blocks that no input script depends on. A block that is missing here only makes runs anew."""


class Study(Model):
    """A whole study file."""

    title: Line = Field(description="title of the study in one line, used in headings")
    licence: Line | None = Field(
        default=None,
        description="licence of the results, as an SPDX name or an address; the RO-Crate states it",
    )
    gravity_m_s2: Positive = Field(
        default=9.81, description="gravitational acceleration along -z, m/s2"
    )
    materials: dict[MaterialName, Material] = Field(max_length=MOST_CLASSES)
    pairs: dict[str, Pair] = Field(
        description="'a-b': contact coefficients of the materials a and b"
    )
    media: Media
    bowl: Annotated[AnyBowl, Discriminator(_kind_of_bowl)]
    compound: Compound | None = Field(default=None, exclude_if=lambda value: value is None)
    workpiece: Workpiece
    workpieces: Carousel | None = None
    motion: Motion
    reduction: Reduction | None = Field(default=None, exclude_if=lambda value: value is None)
    contact: Contact = Contact()
    drop_test: DropTest = DropTest()
    calibration: Calibration | None = None
    filling: Filling = Filling()
    outputs: Outputs = Outputs()
    fidelity: AnyFidelity = Field(
        default="standard",
        description="settings for speed and accuracy: a name, a block, or a tolerance",
    )
    fidelities: dict[Name, Fidelity] = Field(default_factory=dict)
    seed: Annotated[Whole, Field(ge=0, lt=2**32)] = Field(
        default=1,
        description="random seed of the initial positions and velocities; one seed is one packing",
    )
    sweep: dict[str, list[Any]] = Field(
        default_factory=dict,
        description="dotted field name: list of values; every combination is a case",
    )
    scaling: Scaling | None = None
    accepted: Accepted = Accepted()
    assumptions: list[Assumption] = Field(default_factory=list)
    reference: Reference | None = None
    removal: Removal | None = Field(default=None, exclude_if=lambda value: value is None)
    roughness: Roughness | None = Field(default=None, exclude_if=lambda value: value is None)
    search: Search | None = Field(default=None, exclude_if=lambda value: value is None)

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
