"""How the process's input script moves each workpiece: its place, its legs, what is superposed."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from dragdeck.cases.case import Case
from dragdeck.decks.deck import Deck
from dragdeck.scenes.legs import Place, Stop, TimedLeg
from dragdeck.scenes.motion import Course, on_engine
from dragdeck.study.superposed.kind import EngineMotion


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
        Its reference point as it starts.
    turn_deg : float
        About +z, as it starts.
    legs : sequence of TimedLeg
        Those that the run moves it along.
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
    stops: Sequence[Stop]
    entry_step: int = 0

    @property
    def legs(self) -> Sequence[TimedLeg]:
        """Those of the first workpiece; the others' take as many steps."""
        return self.workpieces[0].legs


def moved_workpiece(case: Case, motion: Course, mesh: str, entry_step: int) -> MovedWorkpiece:
    """A workpiece of a case on its course.

    Parameters
    ----------
    case : Case
        Of the workpiece alone.
    motion : Course
    mesh : str
        File of its mesh.
    entry_step : int
        Step of the drag at which it starts; 0: it starts with the plunge.
    """
    ending, start = f"_{case.number}" if case.number > 1 else "", motion.drag.start
    staged = on_engine(motion.legs[-1].stages, start)
    moving = {name: one.on_engine(start) for name, one in motion.superposed.items()}
    place: Place = (*motion.start_m, motion.turn_rad)
    if entry_step:
        *_, (drag, begun) = motion.begun()
        place = motion.pose(drag, begun, entry_step - start)
    return MovedWorkpiece(
        ending=ending,
        mesh=mesh,
        start_m=place[:3],
        turn_deg=math.degrees(place[3]),
        legs=motion.legs[-1:] if entry_step else motion.legs,
        staged=staged and staged.ending(ending),
        superposed={name: one.ending(ending) for name, one in moving.items()},
    )
