"""Where the workpiece goes: plunge, approach, drag.

A position is that of the workpiece's reference point, the centre of its tip. What is superposed on
the path (`dragdeck.study.superposed`) moves the workpiece during the drag only.

A `Course` is the motion in whole steps, as LIGGGHTS makes it. Input script, ``case.json``, checks
and preview are made from it.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.cases.bed import bed_timestep
from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import round_to
from dragdeck.study.drive import Drive, EngineMotion
from dragdeck.study.driven import DrivenMotion
from dragdeck.study.model import Study
from dragdeck.study.motion import Motion
from dragdeck.study.paths.path import Vector
from dragdeck.study.rotations import Orientations
from dragdeck.study.workpiece import MeshShape


@dataclass(frozen=True)
class Leg:
    """A stretch of the motion in whole steps; it ends where it should after them.

    Attributes
    ----------
    name : str
        ``plunge``, ``approach`` or ``drag``.
    start_step, end_step : int
    duration_s : float
    velocity_m_s : tuple of 3 floats
        At its beginning.
    motion : EngineMotion
        How the engine makes it.
    """

    name: str
    start_step: int
    end_step: int
    duration_s: float
    velocity_m_s: Vector
    motion: EngineMotion

    @property
    def steps(self) -> int:
        """How many it takes."""
        return self.end_step - self.start_step

    @property
    def speed_m_s(self) -> float:
        """Speed of the workpiece's axis at its beginning, m/s."""
        return math.hypot(*self.velocity_m_s)

    def straight_on(self, begun: Floats, steps: Floats) -> Floats:
        """Places, (N, 3), after (N,) steps from where it begins, at that velocity."""
        time = steps * self.duration_s / self.steps
        return np.asarray(begun + time[:, None] * np.array(self.velocity_m_s))


@dataclass(frozen=True)
class Periods:
    """Steps between frames of each output, each a multiple of the one before."""

    force: int
    contacts: int
    network: int


def output_periods(study: Study, timestep_s: float) -> Periods:
    """Steps between frames: at least the asked rates, each a multiple of the faster one."""
    rates, factor = study.outputs, study.chosen_fidelity().speed_factor
    per_second = factor * timestep_s
    force = max(1, math.floor(1 / (rates.workpiece_force_hz * per_second)))
    contacts = force * max(1, math.floor(1 / (rates.workpiece_contacts_hz * per_second * force)))
    network = contacts * max(1, math.floor(1 / (rates.network_hz * per_second * contacts)))
    return Periods(force, contacts, network)


@dataclass(frozen=True)
class Course:
    """The whole motion of a workpiece.

    Attributes
    ----------
    start_m : tuple of 3 floats
        Its reference point before the plunge.
    turn_rad : float
        Turn about +z, as it starts.
    legs : sequence of Leg
        The last one is the drag.
    driven : DrivenMotion
        The motion in the drag.
    """

    start_m: Vector
    turn_rad: float
    legs: Sequence[Leg]
    driven: DrivenMotion

    @property
    def drag(self) -> Drive:
        """The drag in steps."""
        return self.driven.drive

    def poses(self, leg: Leg, steps: Floats) -> tuple[Floats, Orientations]:
        """Places, (N, 3), and orientations after (N,) steps from the beginning of a leg."""
        begun, single = np.array(self.start_m), np.ones(1)
        for before in self.legs[: self.legs.index(leg)]:
            begun = before.straight_on(begun, before.steps * single)[0]
        if leg.name == "drag":
            places = self.driven.places(steps, begun)
            return places, self.driven.rotation(steps, self.turn_rad)
        return leg.straight_on(begun, steps), Orientations(np.full(len(steps), self.turn_rad))


def driven(study: Study, start: int = 0) -> DrivenMotion:
    """The motion of a study in whole steps, for a drag that begins at a step."""
    timestep = bed_timestep(study, "timestep_fraction")
    return DrivenMotion.of(study.motion, timestep, study.chosen_fidelity().speed_factor, start)


def driven_surface_speed(study: Study, radius_m: float) -> float:
    """The highest speed of the workpiece's surface as it is driven, m/s; see `surface_speed`."""
    way = driven(study)
    return way.fastest_m_s + study.motion.added_speed_m_s(radius_m, way.factor)


def course(
    study: Study, bed: Bed, reference_m: float = 0.0, deepest_m: float | None = None
) -> Course:
    """The motion of a workpiece in a bed.

    Parameters
    ----------
    study : Study
    bed : Bed
    reference_m : float
        Height of the workpiece's reference point above its lowest point.
    deepest_m : float, optional
        Immersion depth of the deepest workpiece of the carousel: the others start higher, so that
        all plunge as far.
    """
    motion, timestep = study.motion, bed_timestep(study, "timestep_fraction")
    higher = (deepest_m or motion.immersion_depth_m) - motion.immersion_depth_m
    clear = round_to(bed.top_m + study.media.typical_radius_m + higher, 6)
    dive = clear - (bed.surface_m - motion.immersion_depth_m + motion.path.start_height_m)
    legs, begun, period = list[Leg](), 0, output_periods(study, timestep).network
    for name, duration, velocity in _entry(motion, dive, study.chosen_fidelity().speed_factor):
        legs.append(_in_periods(name, begun, duration, velocity, timestep, period))
        begun = legs[-1].end_step
    way = driven(study, begun)
    drive, path = way.drive, motion.path
    legs.append(
        Leg(
            name="drag",
            start_step=drive.start,
            end_step=drive.end,
            duration_s=drive.duration_s,
            velocity_m_s=path.first_velocity(drive),
            motion=path.on_engine(drive),
        )
    )
    start = (*motion.plunge_point, clear + reference_m)
    has_front = isinstance(study.workpiece.shape, MeshShape) or motion.inclined
    turn = path.direction_rad if has_front else 0.0  # a mesh looks along +x in its own file
    return Course(start_m=start, turn_rad=turn, legs=legs, driven=way)


def _entry(
    motion: Motion, dive_m: float, speed_factor: float
) -> Iterator[tuple[str, float, Vector]]:
    """Duration and velocity of plunge and approach; the tip goes down by `dive_m`."""
    speed = motion.plunge_speed_m_s * speed_factor
    yield "plunge", dive_m / speed, (0.0, 0.0, -speed)
    begin, end = motion.plunge_point, motion.path.start_point
    dx, dy = end[0] - begin[0], end[1] - begin[1]
    distance = math.hypot(dx, dy)
    if distance:
        speed = motion.approach_speed_m_s * speed_factor
        velocity = (speed * dx / distance, speed * dy / distance, 0.0)
        yield "approach", distance / speed, velocity


def _in_periods(
    name: str, begun: int, duration_s: float, velocity: Vector, timestep_s: float, period: int
) -> Leg:
    """A leg that is a little slower, and so ends with a whole period of the network."""
    steps = period * max(1, math.ceil(duration_s / timestep_s / period - 1e-9))
    slower = duration_s / (steps * timestep_s)
    x, y, z = (round_to(slower * v, 12) for v in velocity)
    return Leg(
        name=name,
        start_step=begun,
        end_step=begun + steps,
        duration_s=round_to(steps * timestep_s, 12),
        velocity_m_s=(x, y, z),
        motion=EngineMotion({"": f"linear {x!r} {y!r} {z!r}"}),
    )
