"""What the template of a process sees: workpieces, their legs, and the stops of the drag."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.cases.case import Case
from dragdeck.decks.deck import Deck, Properties
from dragdeck.physics.walls import Container
from dragdeck.scenes.motion import Course, Leg
from dragdeck.study.drive import EngineMotion
from dragdeck.study.driven import DrivenMotion
from dragdeck.study.rotations import rotation_vector


@dataclass(frozen=True)
class Stop:
    """A step of the drag up to which the engine runs, and what is done before and after.

    Attributes
    ----------
    step : int
    properties : Properties or None
        Of the materials from here on; None if they stay.
    first : bool
        Whether the run of a lead begins here.
    writes : bool
        Whether the outputs of the drag begin here.
    mark : str
        File into which the state is written then; empty for none.
    """

    step: int
    properties: Properties | None = None
    first: bool = False
    writes: bool = False
    mark: str = ""


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
    own_turn : sequence of float
        Before that, in its own frame: axis, and angle in degrees; empty for none.
    legs : sequence of Leg
        Those that the run moves it along.
    driven : DrivenMotion
        The motion in the drag.
    superposed : mapping
        What is superposed on the drag, by name.
    """

    ending: str
    mesh: str
    start_m: tuple[float, float, float]
    turn_deg: float
    own_turn: Sequence[float]
    legs: Sequence[Leg]
    driven: DrivenMotion
    superposed: Mapping[str, EngineMotion]

    @property
    def name(self) -> str:
        """Name of its mesh."""
        return f"workpiece{self.ending}"

    @property
    def about_reference(self) -> bool:
        """Whether a motion turns it about its live reference point, or might."""
        return bool(self.superposed) or self.legs[-1].motion.about_reference


@dataclass(frozen=True, kw_only=True)
class ProcessDeck(Deck):
    """What the process template sees."""

    bowl_type: int
    bowl: Container
    bowl_facets: bool
    bowl_rad_s: float
    bowl_motion: EngineMotion
    workpiece_type: int
    workpieces: Sequence[MovedWorkpiece]
    stops: Sequence[Stop] = ()
    entry_step: int = 0

    @property
    def legs(self) -> Sequence[Leg]:
        """Those of the first workpiece; the others' take as many steps."""
        return self.workpieces[0].legs


def _axis_and_angle(matrix: Floats) -> Sequence[float]:
    vector = rotation_vector(matrix)
    angle = float(np.linalg.norm(vector))
    return [*(vector / angle).tolist(), math.degrees(angle)] if angle else ()


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
    ending = f"_{case.number}" if case.number > 1 else ""
    place, turn, tilt = motion.start_m, motion.turn_rad, None
    legs = motion.legs[-1:] if entry_step else motion.legs
    if entry_step:
        places, rotation = motion.poses(legs[-1], np.array([entry_step - motion.drag.start]))
        x, y, z = places[0].tolist()
        place, turn = (x, y, z), float(rotation.turn_rad[0])
        tilt = rotation.in_frame
    moving = motion.driven.superposed_on_engine()
    return MovedWorkpiece(
        ending=ending,
        mesh=mesh,
        start_m=place,
        turn_deg=math.degrees(turn),
        own_turn=() if tilt is None else _axis_and_angle(tilt[0]),
        legs=[replace(leg, motion=leg.motion.ending(ending)) for leg in legs],
        driven=motion.driven,
        superposed={
            name: superposed_motion.ending(ending) for name, superposed_motion in moving.items()
        },
    )
