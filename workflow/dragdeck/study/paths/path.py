"""What every kind of path knows of itself: fields, geometry, poses, and the engine's motion.

A new kind is a class with its fields, `place` and `tangent`; the rest follows from these unless it
says better.
"""

import math
from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.study.base import Json, Model
from dragdeck.study.drive import Drive, EngineMotion, Formula, Orientation, formula, rotating
from dragdeck.study.rotations import about_vertical, wrap_angle
from dragdeck.study.stages import StepCounts

Point = tuple[float, float]
Vector = tuple[float, float, float]

_PANELS, _NODES, _WEIGHTS = 1024, *np.polynomial.legendre.leggauss(8)
"""Of the quadrature of a path's length."""

_NEAR = 1e-6
"""Difference of the part of a path over which its turn is told."""


def turned(place: Point, angle_deg: float) -> Point:
    """A place turned about the bowl's axis, to 1e-12 m."""
    angle, (x, y) = math.radians(angle_deg), place
    c, s = math.cos(angle), math.sin(angle)
    return round(c * x - s * y, 12) + 0.0, round(s * x + c * y, 12) + 0.0


class WorkpiecePath(Model):
    """Block of a study: where the workpiece's axis goes in the drag.

    Speeds and lengths are relative to the bowl. Steps are counted from the start of the drag.

    Attributes
    ----------
    length_field : str
        The field below ``motion.path`` that its length grows with.
    one_direction : bool
        Whether it has one direction: the workpiece never turns with it.
    """

    length_field: ClassVar[str]
    one_direction: ClassVar[bool] = False

    if TYPE_CHECKING:
        kind: str

    # --- its line in the bowl ------------------------------------------------------------------

    @abstractmethod
    def place(self, share: Any) -> tuple[Any, Any, Any]:
        """X and y of the axis, m, and height of the tip above the immersion depth, m.

        Parameters
        ----------
        share : float, array or Formula
            The part of the path's time that has passed, from 0 to 1.
        """

    @abstractmethod
    def tangent(self, share: Any) -> tuple[Any, Any, Any]:
        """The derivatives of `place` with respect to `share`, m."""

    def words(self, number: Callable[[float], str]) -> str:
        """What a report calls it, with numbers as it writes them."""
        return self.kind.replace("_", " ")

    @property
    def path_length_m(self) -> float:
        """Length of the drag."""
        return _measured(self)[0]

    @property
    def revolution_m(self) -> float | None:
        """Length of a revolution; None if there is none."""
        return None

    @property
    def start_point(self) -> Point:
        """Where the drag begins, m."""
        x, y, _ = self.place(0.0)
        return float(x), float(y)

    @property
    def plunge_point(self) -> Point:
        """Where the workpiece goes in unless the study says other, m."""
        return self.start_point

    @property
    def direction_rad(self) -> float:
        """Direction of motion from +x when the drag begins."""
        x, y, _ = self.tangent(0.0)
        return math.atan2(y, x)

    @property
    def ahead_deg(self) -> float | None:
        """Angle of its start about the bowl's axis, in the sense of motion; None if no circle."""
        return None

    @property
    def own_speed_m_s(self) -> float | None:
        """Speed that the path itself gives; None if ``motion.speed_m_s`` does."""
        return None

    @property
    def peak_speed_ratio(self) -> float:
        """Highest speed of the drag divided by its mean."""
        return _measured(self)[1]

    @property
    def start_height_m(self) -> float:
        """Height of the tip above the immersion depth at the start."""
        return float(self.place(0.0)[2])

    @property
    def corners(self) -> Floats:
        """Places, (N, 3), beyond which the path never is."""
        return as_rows(self.place(np.linspace(0.0, 1.0, 8 * _PANELS + 1)))

    @property
    def turning(self) -> Sequence[tuple[float, float]]:
        """Rotation that the path itself gives: end of each stage, s, and its speed, 1/min."""
        return ()

    @property
    def inclined(self) -> bool:
        """Whether it inclines the workpiece."""
        return False

    @property
    def most_turned_deg(self) -> float:
        """Largest angle that it gives the workpiece to turn by on a straight stretch."""
        return 0.0

    @property
    def turning_rad_s(self) -> float:
        """Highest angular speed that it gives a workpiece that leans, at its own speed."""
        return 0.0

    @property
    def implied(self) -> Mapping[str, float]:
        """What follows from its fields and has to be plausible too, by dotted name."""
        return {}

    def one_side_inwards(self, orientation: Orientation) -> bool:
        """Whether the workpiece shows the bowl's axis the same side all the time."""
        return False

    def bowl_rad_s(self, speed_m_s: float) -> float:
        """Angular speed of the bowl about +z at a speed of the workpiece relative to it."""
        return 0.0

    def faster(self, factor: float) -> Self:
        """The same path with the speed that it gives, if any, multiplied."""
        return self

    @abstractmethod
    def turned(self, angle_deg: float) -> Self:
        """The same path turned about the bowl's axis."""

    def with_length(self, length_m: float) -> Self:
        """The same path with another length."""

        def off(value: float) -> float:
            return self.model_copy(update={self.length_field: value}).path_length_m - length_m

        longer = getattr(self, self.length_field) * length_m / self.path_length_m
        if abs(off(longer)) > 1e-9 * length_m:  # not proportional: its speed varies
            from scipy.optimize import newton

            longer = float(newton(off, longer, tol=1e-9 * longer))
        return self.model_copy(update={self.length_field: longer})

    # --- as a run drives it --------------------------------------------------------------------

    def turns(self, orientation: Orientation) -> bool:
        """Whether the workpiece turns with its path."""
        return orientation == "follow_path" and not self.one_direction

    def keeps_direction(self, orientation: Orientation) -> bool:
        """Whether the direction of motion is always the same in the workpiece's own frame."""
        return self.one_direction or self.turns(orientation)

    def fastest_m_s(self, drive: Drive) -> float:
        """Highest speed of the axis."""
        return math.hypot(*self.first_velocity(drive)) * self.peak_speed_ratio

    def first_velocity(self, drive: Drive) -> Vector:
        """Velocity at the beginning, at the mean speed, m/s."""
        heading, speed = self.direction_rad, drive.full_speed_m_s
        return speed * math.cos(heading), speed * math.sin(heading), 0.0

    def places(self, drive: Drive, since: StepCounts, begun: Floats) -> Floats:
        """Places of the reference point, (N, 3), after (N,) steps from where it begins, m."""
        moved = as_rows(self.place(drive.share(since))) - as_rows(self.place(np.zeros(1)))
        return np.asarray(begun + moved)

    def turn(self, drive: Drive, since: StepCounts) -> Floats:
        """By which angle the path has turned the workpiece after (N,) steps, rad."""
        if not self.turns(drive.orientation):
            return np.zeros(len(since))
        return np.asarray(self._heading(drive.share(since)) - self.direction_rad)

    def in_frame(self, drive: Drive, since: StepCounts) -> Floats | None:
        """Rotations in the workpiece's own frame, (N, 3, 3), by the path; None if there are none.

        They go before the turn about the vertical.
        """
        return None

    def directions(self, drive: Drive, since: StepCounts, ref_xy_m: Floats) -> Floats:
        """Direction of motion, (N,) in rad, after (N,) steps and at (N, 2) places of the axis."""
        return wrap_angle(self._heading(drive.share(since)))

    def velocity(self, drive: Drive, since: StepCounts, point_m: Floats, ref_m: Floats) -> Floats:
        """Velocity of points that are fixed to the workpiece.

        Parameters
        ----------
        drive : Drive
        since : (N,) ndarray of int
            Number of steps from the start of the drag.
        point_m, ref_m : (N, 3) ndarray
            The points, and the reference point, at these steps.

        Returns
        -------
        (N, 3) ndarray
            Velocities, m/s.
        """
        share = drive.share(since)
        rate = drive.begin.pace(since) / (drive.full_steps * drive.timestep_s)
        moved = rate[:, None] * as_rows(self.tangent(share))
        if not self.turns(drive.orientation):
            return moved
        after, before = (self._heading(share + sign * _NEAR) for sign in (1, -1))
        turning = wrap_angle(after - before) / (2 * _NEAR) * rate
        return moved + about_vertical(turning, point_m - ref_m)

    def straight_on(self, drive: Drive, since: StepCounts, direction_rad: Floats) -> Floats:
        """Velocity, (N, 3), at the mean speed in given directions."""
        ahead = np.cos(direction_rad), np.sin(direction_rad), np.zeros_like(direction_rad)
        speed = drive.speed_m_s * drive.begin.pace(since)
        return np.asarray(speed[:, None] * np.column_stack(ahead))

    def on_engine(self, drive: Drive) -> EngineMotion:
        """Its part of the input script: from place to place, and the turn between two."""
        variables, turns = dict[str, str](), self.turns(drive.orientation)
        for when, late in (("now", 0), ("before", 1)):
            variables[f"path_{when}"] = str(drive.share_formula(late))
            share = Formula(f"v_path_{when}")
            formulas = dict(zip("xyz", self.place(share), strict=True))
            along = dict(zip(("ahead_x", "ahead_y"), self.tangent(share), strict=False))
            for name, value in {**formulas, **(along if turns else {})}.items():
                variables[f"path_{name}_{when}"] = formula(value)
        for axis in "xyz":
            variables[f"path_v{axis}"] = f"(v_path_{axis}_now-v_path_{axis}_before)/dt"
        movers: dict[str, str] = {"": "linear/variable v_path_vx v_path_vy v_path_vz"}
        if turns:
            x, y, u, v = (
                f"v_path_ahead_{axis}_{when}" for when in ("before", "now") for axis in "xy"
            )
            variables["path_turn"] = f"atan2({x}*{v}-{y}*{u},{x}*{u}+{y}*{v})/dt"
            movers["_turn"] = rotating("path_turn")
        return EngineMotion(movers, variables, "along the path, from its place before the step")

    def heading_formula(self, drive: Drive) -> str | float:
        """Direction of the front at the engine's ``step``; a number if it does not turn."""
        if not self.turns(drive.orientation):
            return self.direction_rad
        x, y, _ = self.tangent(drive.share_formula())
        return f"atan2({y},{x})"

    def entry(self, drive: Drive) -> Json:
        """What ``case.json`` has of it, beside what it has of every path."""
        return {}

    def _heading(self, share: Floats) -> Floats:
        x, y, _ = self.tangent(share)
        return np.broadcast_to(np.arctan2(y, x), np.shape(share))


def as_rows(vector: tuple[Any, Any, Any]) -> Floats:
    """Three components, numbers or (N,) arrays, as an (N, 3) array."""
    return np.stack(np.broadcast_arrays(*vector), axis=-1).astype(np.float64)


def _measured(path: WorkpiecePath) -> tuple[float, float]:
    """Length of a path, m, and its highest speed over the mean one."""
    middle = (np.arange(_PANELS) + 0.5)[:, None]
    speed = np.linalg.norm(as_rows(path.tangent((middle + _NODES / 2) / _PANELS)), axis=-1)
    length = float((speed * _WEIGHTS).sum() / 2 / _PANELS)
    return length, float(speed.max()) / length


class FromPlace(WorkpiecePath):
    """Block of a study: a path from a place in a direction.

    Attributes
    ----------
    place_field : str
        The field of that place, m.
    """

    place_field: ClassVar[str]

    if TYPE_CHECKING:
        direction_deg: float

    def turned(self, angle_deg: float) -> Self:
        """From another place in another direction."""
        place = {self.place_field: turned(getattr(self, self.place_field), angle_deg)}
        return self.model_copy(update={**place, "direction_deg": self.direction_deg + angle_deg})


class AroundBowl(WorkpiecePath):
    """Block of a study: a path on a circle about the bowl's axis."""

    length_field: ClassVar[str] = "revolutions"

    if TYPE_CHECKING:
        start_deg: float
        radius_m: float
        revolutions: float

    @property
    def start_rad(self) -> float:
        """Angle of its start from +x."""
        return math.radians(self.start_deg)

    @property
    def path_length_m(self) -> float:
        """The circumference, as often as it is gone round."""
        return self.revolution_m * self.revolutions

    @property
    def revolution_m(self) -> float:
        """The circumference."""
        return 2 * math.pi * self.radius_m

    @property
    def peak_speed_ratio(self) -> float:
        """It has one speed."""
        return 1.0

    @property
    def start_point(self) -> Point:
        """At the radius and the angle."""
        return turned((self.radius_m, 0.0), self.start_deg)

    @property
    def corners(self) -> Floats:
        """The start: all of it is as far from the bowl's axis."""
        return np.array([[*self.start_point, 0.0]])

    @property
    def ahead_deg(self) -> float:
        """The angle, or its negative for a clockwise motion."""
        return math.copysign(1.0, math.sin(self.direction_rad - self.start_rad)) * self.start_deg

    def turned(self, angle_deg: float) -> Self:
        """Begun at another angle."""
        return self.model_copy(update={"start_deg": self.start_deg + angle_deg})

    def with_length(self, length_m: float) -> Self:
        """As many revolutions as give the length."""
        return self.model_copy(update={"revolutions": length_m / self.revolution_m})
