"""How the process's input script moves each workpiece: its place, its legs, what is superposed."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from dragdeck.cases.case import Case
from dragdeck.decks.deck import Deck
from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import round_to
from dragdeck.scenes.motion import course, in_steps, on_engine
from dragdeck.study.model import Study
from dragdeck.study.paths.kind import Leg
from dragdeck.study.superposed.kind import DragSteps, EngineMotion, SuperposedMotion
from dragdeck.study.workpiece import MeshShape


@dataclass(frozen=True)
class TimedLeg:
    """A leg of the motion with its steps, as the template writes it."""

    leg: Leg
    start_step: int
    end_step: int
    direction_rad: float

    name = property(lambda self: self.leg.name)
    kind = property(lambda self: self.leg.kind)
    duration_s = property(lambda self: self.leg.duration_s)
    velocity_m_s = property(lambda self: self.leg.velocity_m_s)
    angular_speed_rad_s = property(lambda self: self.leg.angular_speed_rad_s)

    @property
    def speed_m_s(self) -> float:
        """Speed of the workpiece's axis, m/s."""
        return math.hypot(*self.leg.velocity_m_s)

    @property
    def period_s(self) -> float:
        """Time of a revolution, s."""
        return 2 * math.pi / abs(self.leg.angular_speed_rad_s)

    @property
    def sense(self) -> float:
        """1 counter-clockwise from above, -1 not."""
        return math.copysign(1.0, self.leg.angular_speed_rad_s)


@dataclass(frozen=True)
class MovedWorkpiece:
    """A workpiece as the template moves it.

    Attributes
    ----------
    ending : str
        Of the names in the input script that are its own: empty for the first, ``_2`` and so on.
    mesh : str
        File of its mesh.
    start_m : tuple of 3 floats
        Its reference point before the plunge.
    turn_deg : float
        About +z, as it starts.
    legs : sequence of TimedLeg
    staged : EngineMotion or None
        Of a drag in stages.
    superposed : mapping
        What is superposed on the drag, by name.
    """

    ending: str
    mesh: str
    start_m: tuple[float, float, float]
    turn_deg: float
    legs: Sequence[TimedLeg]
    staged: EngineMotion | None
    superposed: Mapping[str, EngineMotion]

    name = property(lambda self: f"workpiece{self.ending}")


@dataclass(frozen=True, kw_only=True)
class ProcessDeck(Deck):
    """What the process template sees."""

    bowl_type: int
    bowl_radius_m: float
    bowl_facets: bool
    bowl_rad_s: float
    workpiece_type: int
    workpieces: Sequence[MovedWorkpiece]

    @property
    def legs(self) -> Sequence[TimedLeg]:
        """Those of the first workpiece; the others' take as many steps."""
        return self.workpieces[0].legs


def moved_workpiece(
    case: Case, bed: Bed, timestep_s: float, period: int, mesh: str
) -> MovedWorkpiece:
    """A workpiece of a case in a settled bed.

    Parameters
    ----------
    case : Case
        Of the workpiece alone.
    bed : Bed
    timestep_s : float
    period : int
        Steps of which each leg takes a multiple.
    mesh : str
        File of its mesh.
    """
    study, ending = case.study, f"_{case.number}" if case.number > 1 else ""
    start, plan = course(study, bed, study.chosen_fidelity().speed_factor)
    timed = _timed_legs(plan, study, timestep_s, period)
    drag = drag_steps(timed, timestep_s)
    staged = on_engine(in_steps(timed[-1].leg, drag), drag.start)
    moving = {name: one.on_engine(drag) for name, one in superposed(study).items()}
    return MovedWorkpiece(
        ending=ending,
        mesh=mesh,
        start_m=start,
        turn_deg=workpiece_turn(study),
        legs=timed,
        staged=staged and staged.ending(ending),
        superposed={name: one.ending(ending) for name, one in moving.items()},
    )


def drag_steps(timed: Sequence[TimedLeg], timestep_s: float) -> DragSteps:
    """The steps of the last leg."""
    return DragSteps(timed[-1].start_step, timed[-1].end_step, timestep_s)


def _timed_legs(
    plan: Sequence[Leg], study: Study, timestep_s: float, period: int
) -> list[TimedLeg]:
    """Give every leg its steps; each ends with a whole network period.

    A plunge or an approach goes a little slower to end where it should; the
    drag keeps its speed and goes a little farther.
    """
    found: list[TimedLeg] = []
    start = 0
    for leg in plan:
        steps = period * max(1, math.ceil(leg.duration_s / timestep_s / period - 1e-9))
        duration = steps * timestep_s
        if leg.name != "drag":
            slower = leg.duration_s / duration
            x, y, z = (round_to(slower * v, 12) for v in leg.velocity_m_s)
            leg = replace(leg, velocity_m_s=(x, y, z))
        timed = replace(leg, duration_s=round_to(duration, 12))
        found.append(TimedLeg(timed, start, start + steps, study.motion.path.direction_rad))
        start += steps
    return found


def workpiece_turn(study: Study) -> float:
    """A mesh looks along +x in its own file: turn it into the direction of motion, degrees."""
    if not isinstance(study.workpiece.shape, MeshShape) and not study.motion.tilt_deg:
        return 0.0
    return math.degrees(study.motion.path.direction_rad)


def superposed(study: Study) -> Mapping[str, SuperposedMotion]:
    """What is superposed on the path, by name, at the speed that is driven."""
    return study.motion.superposed(study.chosen_fidelity().speed_factor)
