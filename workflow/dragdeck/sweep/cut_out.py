"""A straight trough around a part of the path, which stands for the machine.

Its sizes follow from laws that were measured with particles of 6.5 mm and a rod of 10 mm at a depth
of 30 mm and up to 3 m/s (docs/evidence/simplifications.md). Particle and workpiece diameters, and
height of the bed, were not varied alone there: of laws in two of these, the larger length holds.
Where the machine has less room, the cut-out has as much as the machine.
"""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.cases.bed import bed_classes
from dragdeck.cases.case import Case
from dragdeck.errors import InputError, together
from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import limit_of
from dragdeck.physics.turning_bed import surface_tilt
from dragdeck.physics.walls import Container
from dragdeck.scenes.bed_space import expected_bed
from dragdeck.scenes.fit import ROOM_BELOW
from dragdeck.scenes.moving_bowl import bed_in_motion
from dragdeck.scenes.workpiece import dip, workpiece_reach
from dragdeck.study.bowl_motions.acceleration import Acceleration
from dragdeck.study.bowl_motions.bowl_motion import BowlMotion
from dragdeck.study.bowls.trough import TroughBowl
from dragdeck.study.model import Assumption, Study
from dragdeck.study.motion import Motion
from dragdeck.study.paths.line import LinePath
from dragdeck.study.paths.path import AroundBowl

SIDE_DIAMETERS, SIDE_WORKPIECES = 6.7, 4.0
"""Gap to a side wall in particle and workpiece diameters. With 6 particle diameters, the drag was
still higher than in the machine by 8 % (docs/evidence/simplifications.md)."""

AHEAD_DIAMETERS, AHEAD_HEIGHTS = 14.0, 1.7
"""Distance of the workpiece's axis from the end wall, in particle diameters and heights of the
bed, above which it raises the drag by less than 10 %."""

TRANSIENT_DIAMETERS = 12.0
"""Path until the drag is steady at 1 m/s and more."""

LARGEST_FACTOR = 2.0
"""Gap and bed below hold for the diameters that are simulated. Scenes of several sizes have the
same space, for particles of up to this factor."""

COUNTED_DIAMETERS = 40.0
"""Longest counted path by default: one of 20 diameters gave the mean drag to about 10 %."""

_ALONG, _BESIDE, _HEIGHTS, _AROUND = 12, 121, 5, 12
"""Points at which the room in the machine is measured: along its path, sideways and down, in
height, and around the workpiece."""


class Room(NamedTuple):
    """Bed of the cut-out around the workpiece, m.

    Gaps to the walls on the left, on the right, and behind it at the start; distance between its
    axis and the wall ahead at the end; bed below its lowest point.
    """

    left_m: float
    right_m: float
    behind_m: float
    ahead_m: float
    below_m: float


class Passage(NamedTuple):
    """Motion of the workpiece relative to the bed: some places and directions, (N, 2)."""

    places_m: Floats
    ahead: Floats
    speed_m_s: float
    centrifugal_m_s2: float
    outwards: int
    """1 if the axis of the bowl is on the right, -1 if it is on the left, 0 for a line."""

    @property
    def left(self) -> Floats:
        """Horizontal directions across, (N, 2)."""
        return np.column_stack([-self.ahead[:, 1], self.ahead[:, 0]])


def with_cut_out(case: Case) -> Case:
    """The case of the cut-out of a machine; the case itself if its study asks for none.

    Raises
    ------
    InputError
        A line cannot stand for what the machine does; every reason is named.
    """
    study = case.study
    if study.reduction is None or not study.reduction.cut_out:
        return case
    problems = list(_refused(study))
    if problems:
        raise together(problems)
    low = dip(case) - study.motion.vertical_range_m[0]
    cut = cut_out(study, workpiece_reach(case), low)
    if cut.particle_count >= study.particle_count:
        raise InputError(
            "the cut-out is no smaller than the machine", field="reduction.cut_out",
            value=f"{cut.particle_count:,} particles",
            limit=f"below {study.particle_count:,}, those of the machine",
            remedy="simulate the machine: remove reduction; or use a shorter counted_m",
        )  # fmt: skip
    return replace(case, study=cut)


def cut_out(study: Study, reach_m: float, low_m: float = 0.0) -> Study:
    """The study of the cut-out of a machine.

    Parameters
    ----------
    study : Study
        Of the machine.
    reach_m : float
        Radius of the upright cylinder around what of the workpiece is in the bed.
    low_m : float
        How far the workpiece comes below its immersion depth.

    Raises
    ------
    InputError
        The circle is too narrow for a line to stand for it.
    """
    passage, bed = _passage(study.motion), bed_in_motion(study, expected_bed(study))
    room = room_in_machine(study, passage, bed, reach_m, low_m)
    inner = math.hypot(*passage.places_m[0]) - reach_m
    least = (room.left_m, room.right_m)[passage.outwards > 0]
    if passage.outwards and inner < least * (1 - 1e-9):
        raise InputError(
            "the circle is too narrow for a straight cut-out: beside the workpiece is the other "
            "side of its path", field="reduction.cut_out",
            value=f"{inner:.4g} m between the workpiece and the axis of the bowl",
            limit=f"at least {least:.4g} m", remedy="simulate the machine: remove reduction",
        )  # fmt: skip
    return _trough(study, passage, bed, room, reach_m, low_m)


def room_in_machine(study: Study, passage: Passage, bed: Bed, reach_m: float, low_m: float) -> Room:
    """The room that the laws ask for, or that of the machine where it has less."""
    diameter, bowl = _diameter(study), study.bowl.container
    larger = study.reduction is not None and study.reduction.coarser is not None
    simulated = LARGEST_FACTOR * diameter if larger else diameter
    aside = max(SIDE_DIAMETERS * simulated, SIDE_WORKPIECES * 2 * reach_m)
    tip = bed.surface_m - study.motion.immersion_depth_m - low_m
    heights = np.linspace(tip, bed.surface_m, _HEIGHTS)
    left, right = (
        _free(bowl, passage.places_m, sign * passage.left, heights, reach_m, aside)
        for sign in (1, -1)
    )
    under = ROOM_BELOW * simulated
    below = _free_below(bowl, passage.places_m, tip, reach_m, under)
    height = study.motion.immersion_depth_m + low_m + below
    ahead = max(AHEAD_DIAMETERS * diameter, AHEAD_HEIGHTS * height)
    behind = aside
    if not passage.outwards:
        ends = passage.places_m[[0, -1]], passage.ahead[[0, -1]]
        behind = _free(bowl, ends[0][:1], -ends[1][:1], heights, reach_m, aside)
        ahead = _free(bowl, ends[0][1:], ends[1][1:], heights, 0.0, ahead)
    return Room(left, right, behind, ahead, below)


def _free(
    bowl: Container,
    places_m: Floats,
    along: Floats,
    heights_m: Floats,
    begin_m: float,
    most_m: float,
) -> float:
    """Shortest distance to a wall along horizontal directions, at most `most_m`, m.

    Parameters
    ----------
    bowl : Container
    places_m, along : (N, 2) ndarray
    heights_m : (H,) ndarray
    begin_m : float
        Distance from the places at which it begins.
    most_m : float
    """
    steps = np.linspace(0.0, most_m, _BESIDE)
    way = places_m[:, None] + (begin_m + steps)[:, None] * along[:, None]
    points = np.concatenate([np.insert(way, 2, height, axis=2) for height in heights_m.tolist()])
    inside = bowl.distance(points.reshape(-1, 3)).reshape(len(points), -1).min(axis=0)
    return _until_outside(steps, inside)


def _free_below(
    bowl: Container, places_m: Floats, tip_m: float, reach_m: float, most_m: float
) -> float:
    """Shortest distance between a workpiece's lowest point and a floor, at most `most_m`, m."""
    most = min(most_m, tip_m)
    if not bowl.rim:
        return most
    steps, ring = np.linspace(0.0, most, _BESIDE), np.linspace(0.0, math.tau, _AROUND)
    outline = reach_m * np.column_stack([np.cos(ring), np.sin(ring)])
    around = np.concatenate([places_m, (places_m[:, None] + outline).reshape(-1, 2)])
    points = np.array([np.insert(around, 2, tip_m - step, axis=1) for step in steps.tolist()])
    inside = bowl.distance(points.reshape(-1, 3)).reshape(len(steps), -1).min(axis=1)
    return _until_outside(steps, inside)


def _until_outside(steps_m: Floats, inside_m: Floats) -> float:
    """Where distances from the walls become negative; the last of the steps if they do not."""
    outside = np.flatnonzero(inside_m < 0)
    if not outside.size:
        return float(steps_m[-1])
    at = max(int(outside[0]), 1)
    return float(np.interp(0.0, -inside_m[at - 1 : at + 1], steps_m[at - 1 : at + 1]))


def _passage(motion: Motion) -> Passage:
    path = motion.path
    if not isinstance(path, AroundBowl):
        places = np.linspace(path.corners[0, :2], path.corners[-1, :2], _ALONG)
        heading = [math.cos(path.direction_rad), math.sin(path.direction_rad)]
        return Passage(places, np.tile(heading, (_ALONG, 1)), motion.nominal_speed_m_s, 0.0, 0)
    of_bowl = motion.bowl_rad_s
    rate = math.sin(path.direction_rad - path.start_rad) * motion.nominal_speed_m_s / path.radius_m
    if motion.bowl is not None:
        rate -= motion.bowl.rad_s
    angle = path.start_rad + np.linspace(0.0, math.tau, _ALONG, endpoint=False)
    outwards = np.column_stack([np.cos(angle), np.sin(angle)])
    ahead = math.copysign(1.0, rate) * np.column_stack([-outwards[:, 1], outwards[:, 0]])
    speed, centrifugal = abs(rate) * path.radius_m, of_bowl**2 * path.radius_m
    return Passage(path.radius_m * outwards, ahead, speed, centrifugal, -1 if rate > 0 else 1)


def _diameter(study: Study) -> float:
    """Of the sphere around a mean particle of the largest class, m."""
    return max(2 * float(part.radii_m.mean()) * part.clump.reach for part in bed_classes(study))


def _trough(
    study: Study, passage: Passage, bed: Bed, room: Room, reach_m: float, low_m: float
) -> Study:
    """The study in a trough with that room, the path along +x."""
    motion, diameter = _straight(study, passage), _diameter(study)
    width = room.left_m + room.right_m + 2 * reach_m
    length = room.behind_m + reach_m + motion.path_length_m + room.ahead_m
    start = room.behind_m + reach_m - length / 2, (room.right_m - room.left_m) / 2
    path = motion.path.model_copy(update={"start_m": tuple(round(at, 6) for at in start)})
    slope = _slope(study, passage)
    rise = passage.outwards * start[1] * slope
    fill = motion.immersion_depth_m + low_m + room.below_m - rise
    lifted = fill + rise - bed.surface_m
    height = 1.3 * fill + width / 2 * slope + 4 * diameter
    bowl = TroughBowl(
        kind="trough",
        material=study.bowl.material,
        length_m=round(length, 6),
        width_m=round(width, 6),
        height_m=round(max(study.bowl.height_m, height), 6),
        lid_m=None if study.bowl.lid_m is None else round(study.bowl.lid_m + lifted, 6),
    )
    totals = {"count": None, "mass_kg": None, "fill_height_m": round(fill, 6)}
    changed: dict[str, Any] = {
        "media": study.media.model_copy(update=totals),
        "bowl": bowl,
        "motion": motion.model_copy(update={"path": path}),
        "compound": _lifted(study, lifted),
    }
    cut = study.model_copy(update=changed)
    why = _words(study, cut, room)
    said = Assumption(field="reduction.cut_out", why=why)
    return cut.model_copy(update={"assumptions": [*study.assumptions, said]})


def _straight(study: Study, passage: Passage) -> Motion:
    """The motion on a line, from the origin along +x."""
    old, diameter = study.motion, _diameter(study)
    bowl: BowlMotion | None = old.bowl if old.bowl and not old.bowl.rad_s else None
    if passage.centrifugal_m_s2:
        bowl = Acceleration(
            kind="acceleration",
            acceleration_m_s2=passage.centrifugal_m_s2,
            direction_deg=90.0 * passage.outwards,
        )
    changed: dict[str, Any] = {
        "path": LinePath(kind="line", start_m=(0.0, 0.0), length_m=old.path_length_m),
        "speed_m_s": passage.speed_m_s,
        "transient_m": round(max(old.transient_m, TRANSIENT_DIAMETERS * diameter), 6),
        "counted_from_revolution": None,
        "plunge_at_m": None,
        "bowl": bowl,
    }
    motion = old.model_copy(update=changed)
    asked = study.reduction.counted_m if study.reduction else None
    counted = asked or min(old.path_length_m - old.uncounted_m, COUNTED_DIAMETERS * diameter)
    least = passage.speed_m_s / study.outputs.network_hz
    if counted < least:
        problem, field = "no frame of the contact network is written on it", "reduction.counted_m"
        limit = f"at least {limit_of(least, up=True)} m, or a higher outputs.network_hz"
        raise InputError(problem, field=field, value=counted, limit=limit)
    path = motion.path.with_length(round(motion.uncounted_m + counted, 6))
    return motion.model_copy(update={"path": path})


def _slope(study: Study, passage: Passage) -> float:
    """Of the bed's surface below the path, across, upwards from the axis of the bowl."""
    factor, friction = study.chosen_fidelity().speed_factor, study.motion.bed_friction_deg
    acceleration = np.array([factor**2 * passage.centrifugal_m_s2])
    tilt = surface_tilt(1.0, study.gravity_m_s2, math.radians(friction), acceleration)
    return math.tan(float(tilt[0]))


def _lifted(study: Study, lifted_m: float) -> Any:
    """The compound with its surface as high above that of the bed as in the machine."""
    level = study.liquid_level_m + lifted_m
    if study.compound is None or level <= 0:
        return None
    return study.compound.model_copy(update={"level_m": round(level, 6)})


# --- what it cannot stand for --------------------------------------------------------------------


def _refused(study: Study) -> Iterator[InputError]:
    motion, path, kinds = study.motion, study.motion.path, "circle, rest and line"
    remedy = "simulate the machine: remove reduction.cut_out"

    def error(problem: str, field: str, limit: str) -> InputError:
        text = f"a straight cut-out cannot stand for {problem}"
        return InputError(text, field=field, limit=limit, remedy=remedy)

    around = isinstance(path, AroundBowl)
    if not around and not isinstance(path, LinePath):
        yield error(f"a path of kind {path.kind}", "motion.path.kind", kinds)
    if study.of_each_workpiece()[0] is not study:
        yield error("several workpieces", "workpieces", "one workpiece")
    if path.kind == "circle" and motion.orientation == "fixed":
        problem = "a circle on which the workpiece shows its direction of motion all its sides"
        yield error(problem, "motion.orientation", "follow_path")
    bowl = motion.bowl
    if bowl is None:
        turning = bool(motion.bowl_rad_s)
    else:
        turning = bool(bowl.rad_s)
        if any(bowl.reach_m[:2]) or any(bowl.sideways_m_s2):
            problem = "a bowl that moves to and fro, in all directions to a path around it"
            yield error(problem, "motion.bowl", "vibration along z, or rotation")
        if turning and not around:
            yield error("a line in a rotating bowl", "motion.path.kind", "circle")
        elif turning and around and _passage(motion).speed_m_s < 1e-6:
            yield error("a workpiece that turns with its bowl", "motion.bowl", "a relative speed")
    if turning and study.compound is not None:
        yield error("a liquid in a rotating bowl", "compound", "a bowl at rest, or no compound")


def _words(study: Study, cut: Study, room: Room) -> str:
    """What was replaced by what, and what that cannot give."""

    def mm(length_m: float) -> str:
        return f"{1e3 * length_m:.3g} mm"

    bowl, old, new = cut.bowl, study.motion, cut.motion
    pushed = f"; {new.bowl.words()}" if isinstance(new.bowl, Acceleration) else ""
    gaps = (f"{mm(gap)} {where}" for gap, where in zip(room, _WHERE, strict=True))
    return (
        f"{bowl.words(mm)}, with {cut.particle_count:,} particles stands for "
        f"{study.bowl.words(mm)}, with {study.particle_count:,}; a line of "
        f"{mm(new.path_length_m)} at {new.nominal_speed_m_s:.3g} m/s, {mm(new.uncounted_m)} of it "
        f"transient, for {mm(old.path_length_m)} of: "
        f"{old.path.words(lambda number: f'{number:.3g}')}{pushed}; bed: {', '.join(gaps)}. "
        "That is the first passage through a level or evenly inclined bed. Not given: radial "
        "force, difference between the inner and the outer side, distribution along the path, "
        "later passages through the wake, chains to walls farther away"
    )


_WHERE = (
    "beside the workpiece on the left",
    "on the right",
    "behind it",
    "from its axis to the wall ahead",
    "below the tip",
)
