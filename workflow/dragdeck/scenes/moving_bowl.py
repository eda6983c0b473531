"""A bowl that moves: the surface of a bed that turns with it, and what it may not do."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.cases.bed import MESHED_PART, expected_surface
from dragdeck.cases.case import Case
from dragdeck.errors import Caution, InputError, together
from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import round_to
from dragdeck.physics.turning_bed import surface_rise, surface_tilt
from dragdeck.study.model import Study
from dragdeck.study.paths.path import as_rows

_PLACES = 200
"""Of a path, at which the surface below it is computed."""

_SLOW = 0.1
"""Speed relative to the bowl over that of the path, below which a warning is given."""


class _Rise(NamedTuple):
    """Height of a bed's surface in the drag above its mean: below the path, and extremes, m."""

    path_m: float
    lowest_m: float
    highest_m: float


def bed_in_motion(study: Study, bed: Bed) -> Bed:
    """A settled bed as it is in the drag.

    That in a rotating bowl is inclined: its surface is that below the path, in the mean, and its
    top the highest point at the wall.
    """
    rise = _rise(study, bed)
    if not any(rise):
        return bed
    return replace(bed, surface_m=bed.surface_m + rise.path_m, top_m=bed.top_m + rise.highest_m)


def path_tilt_deg(study: Study, factor: float = 1.0) -> float:
    """Inclination of the bed's surface below the path, with speeds multiplied, at most, degrees."""
    motion = study.motion
    centrifugal = motion.bowl_rad_s**2 * np.hypot(*_path_places(study).T)
    sideways = math.hypot(*_sideways(study))
    accelerations = factor**2 * np.append(centrifugal, sideways)
    return math.degrees(surface_tilt(1.0, *_resisting(study), accelerations).max())


def driven_gravity(study: Study, gravity_m_s2: float) -> tuple[float, tuple[float, float, float]]:
    """Size, m/s2, and direction of what acts on the particles in the process.

    Parameters
    ----------
    study : Study
    gravity_m_s2 : float
        Of the filling, down.
    """
    if not any(_sideways(study)):
        return gravity_m_s2, (0, 0, -1)
    x, y = (_factor(study) ** 2 * part for part in _sideways(study))
    size = math.hypot(x, y, gravity_m_s2)
    right, ahead, down = (round_to(part / size, 12) for part in (x, y, -gravity_m_s2))
    return round_to(size, 12), (right, ahead, down)


def _factor(study: Study) -> float:
    return study.chosen_fidelity().speed_factor


def _sideways(study: Study) -> tuple[float, float]:
    """Acceleration of the particles along x and y at the study's own speed, m/s2."""
    return study.motion.bowl.sideways_m_s2 if study.motion.bowl else (0.0, 0.0)


def _driven_tilt(study: Study) -> float:
    return path_tilt_deg(study, _factor(study))


def _resisting(study: Study) -> tuple[float, float]:
    """Gravity, m/s2, and angle of friction, rad."""
    return study.gravity_m_s2, math.radians(study.motion.bed_friction_deg)


def _path_places(study: Study) -> Floats:
    """X and y of the path, (N, 2), from the axis of the bowl, m."""
    places = as_rows(study.motion.path.place(np.linspace(0.0, 1.0, _PLACES)))
    return np.atleast_2d(places)[:, :2]


def _rise(study: Study, bed: Bed) -> _Rise:
    """Heights of the bed in the drag."""
    outlines, places = study.bowl.container.sections(bed.surface_m), _path_places(study)
    if any(_sideways(study)):
        push = np.array(_sideways(study)) / math.hypot(*_sideways(study))
        slope, along = math.tan(math.radians(_driven_tilt(study))), outlines[0] @ push
        return _Rise(*(slope * np.array([(places @ push).mean(), along.min(), along.max()])))
    outer, inner = [*(float(outline[:, 0].max()) for outline in outlines), 0.0][:2]
    rate = study.motion.bowl_rad_s * _factor(study)
    radius, rise = surface_rise(rate, *_resisting(study), inner, outer)
    below = float(np.interp(np.hypot(*places.T), radius, rise).mean())
    return _Rise(below, float(rise.min()), float(rise.max()))


def check_bowl_motion(case: Case, settled: Bed, top_m: float) -> None:
    """Refuse a bowl that throws its bed out, leaves the box, or cannot go on where it was.

    Parameters
    ----------
    case : Case
    settled : Bed
        Before the bowl moves.
    top_m : float
        Of the simulation box.

    Raises
    ------
    InputError
        Names every field that has to change.
    """
    problems = [*_spilled(case, settled), *_out_of_box(case, top_m), *_in_parts(case)]
    if problems:
        raise together(problems)


def _spilled(case: Case, settled: Bed) -> Iterator[InputError]:
    study = case.study
    rise = _rise(study, settled)
    if not any(rise):
        return
    rim, top = study.bowl.height_m, settled.top_m + settled.margin_m + rise.highest_m
    floor = settled.surface_m - settled.margin_m + rise.lowest_m
    tilt = f"{_driven(study)}, and its surface is inclined by {_driven_tilt(study):.3g}"
    field = "motion.path" if study.motion.bowl is None else "motion.bowl"
    remedy = "move the bowl more slowly, or use fewer particles or a higher bowl"
    for wrong, what, limit in (
        (top > rim, f"it stands up to {top:.4g} m high at the wall", f"the rim, {rim:g} m"),
        (floor <= 0, "no particles are left on the floor near the axis", "a covered floor"),
    ):
        if wrong:
            problem = f"{tilt} degrees below the workpiece: {what}"
            yield InputError(problem, file=case.file, field=field, limit=limit, remedy=remedy)


def _driven(study: Study) -> str:
    """What inclines the bed."""
    return f"the bed {'is accelerated' if any(_sideways(study)) else 'turns with the bowl'}"


def _out_of_box(case: Case, top_m: float) -> Iterator[InputError]:
    """A bowl that moves by so much that its facets leave the box ends the run."""
    study, bowl = case.study, case.study.motion.bowl
    room = study.media.typical_radius_m
    if study.bowl.container.rim:  # its mesh ends near the top of the box
        room = min(room, (1 - MESHED_PART) * top_m)
    if bowl is not None and max(bowl.reach_m) >= room:
        yield InputError(
            "the bowl would leave the simulation box", file=case.file, field="motion.bowl",
            value=f"a displacement of {max(bowl.reach_m):.4g} m",
            limit=f"below {room:.4g} m, the room around it", remedy="use smaller amplitudes",
        )  # fmt: skip


def _in_parts(case: Case) -> Iterator[InputError]:
    """A displaced bowl is where its step says; runs with other steps disagree on it."""
    bowl, fidelity = case.study.motion.bowl, case.study.chosen_fidelity()
    if bowl is None or not any(bowl.reach_m):
        return
    for name in ("windows", "soft_start"):
        if getattr(fidelity, name) is not None:
            problem = "runs with other time steps do not go on with a bowl that is displaced"
            field, remedy = f"fidelity.{name}", f"leave {name} out, or motion.bowl"
            if case.requested:
                field, remedy = "fidelity.tolerance", "name a fidelity in place of the tolerance"
            yield InputError(problem, file=case.file, field=field, remedy=remedy)


def bowl_cautions(case: Case) -> Iterator[Caution]:
    """What a user should know of a bowl that moves."""
    study, motion = case.study, case.study.motion
    tilt, above = _driven_tilt(study), study.bowl.height_m - expected_surface(study)
    upwards = motion.bowl.displacement_speed_m_s if motion.bowl and motion.bowl.reach_m[2] else 0.0
    thrown = (_factor(study) * upwards) ** 2 / (2 * study.gravity_m_s2)
    if study.bowl.lid_m is None and thrown > above:
        yield Caution(
            "thrown",
            f"the floor throws particles up to {thrown:.3g} m high, and the rim is {above:.3g} m "
            "above the bed: use a smaller amplitude or frequency, or a lid (bowl.lid_m)",
        )
    if motion.bowl and motion.speed_in_bowl_m_s < _SLOW * motion.nominal_speed_m_s:
        yield Caution(
            "with_bowl",
            f"the workpiece moves at only {motion.speed_in_bowl_m_s:.2g} m/s relative to the bowl, "
            "which turns with it: it hardly moves through the bed",
        )
    if tilt:
        yield Caution(
            "tilt", f"{_driven(study)}, and its surface is expected to be inclined by "
            f"{tilt:.3g} degrees below the workpiece (that of a liquid minus "
            f"{case.study.motion.bed_friction_deg:g} degrees of friction, motion.bed_friction_deg):"
            " the immersion depth is measured from this surface, which forms during the transient",
        )  # fmt: skip
