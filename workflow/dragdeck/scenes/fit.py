"""Whether the workpiece and its motion fit into the bowl, the bed and the time step."""

import math
from collections.abc import Iterator

from dragdeck.cases.bed import (
    JUST_BEYOND,
    bed_radii,
    bed_timestep,
    impact_time,
    outrun,
    smallest_radius,
)
from dragdeck.cases.case import Case
from dragdeck.errors import Caution, InputError, together
from dragdeck.physics.contact_mechanics import fall_speed
from dragdeck.physics.rounding import rounded
from dragdeck.physics.run_limits import SPEED_FACTOR
from dragdeck.scenes.motion import farthest_reach
from dragdeck.scenes.workpiece import workpiece_length, workpiece_radius, workpiece_warnings

_FEWEST_STEPS_PER_CONTACT = 5
"""Below this many steps in a contact at the workpiece's speed a warning is given."""

_JAMMING_GAP = 2.0
"""Particle diameters between workpiece and bowl below which a warning is given: an arch of two
particles at 1.7 diameters held a workpiece until the force was 190 N, and then left the bowl."""


def check_fit(case: Case, surface_m: float, timestep_s: float) -> None:
    """Refuse a workpiece that leaves the bowl, goes through its floor or jumps over particles.

    Parameters
    ----------
    case : Case
    surface_m : float
        Height of the bed's surface, m.
    timestep_s : float

    Raises
    ------
    InputError
        Names every field that has to change.
    """
    problems = (_beside(case), _below(case, surface_m), _per_step(case, timestep_s))
    found = [error for group in problems for error in group]
    if found:
        raise together(found)


def process_cautions(case: Case) -> Iterator[Caution]:
    """What a user should know of the workpiece and its motion before a process runs."""
    study = case.study
    yield from workpiece_warnings(case)
    gap = _gap(case) / (2 * study.media.radius_mean_m)
    if gap < _JAMMING_GAP:
        yield Caution(
            "gap",
            f"the gap between workpiece and bowl is {gap:.2g} particle diameters, less than "
            f"{_JAMMING_GAP:g}: particles can jam in it, with forces far beyond those of the bed",
        )
    fidelity = study.chosen_fidelity()
    contact = impact_time(study, fidelity.youngs_modulus_scale, case.axis_speed_m_s)
    steps = contact / bed_timestep(study, "timestep_fraction")
    if steps * JUST_BEYOND < _FEWEST_STEPS_PER_CONTACT:
        shorter = fidelity.timestep_fraction * steps / _FEWEST_STEPS_PER_CONTACT
        yield Caution(
            "steps_per_contact",
            f"a contact at the workpiece's speed takes {steps:.1f} steps, fewer than "
            f"{_FEWEST_STEPS_PER_CONTACT}: single impacts are not resolved",
            {"timestep_fraction": rounded(shorter, up=False)},
        )
    # seen: 2 to 3 times the workpiece's speed, once 6 times; or the fall into a slow one's wake
    fall = fall_speed(study.motion.immersion_depth_m, study.gravity_m_s2)
    speed = math.hypot(SPEED_FACTOR * fastest_motion(case), fall)
    yield from outrun(study, "timestep_fraction", "particles may move", speed)


def _gap(case: Case) -> float:
    """Narrowest gap between the workpiece and the bowl, m."""
    return case.study.bowl.radius_m - farthest_reach(case.study.motion) - workpiece_radius(case)


def _beside(case: Case) -> Iterator[InputError]:
    study = case.study
    radius, reach = workpiece_radius(case), farthest_reach(study.motion)
    gap, diameter = _gap(case), 2 * study.media.radius_mean_m
    if gap < diameter:
        yield InputError(
            "the workpiece does not fit between its path and the bowl"
            if gap <= 0
            else "no particle fits between the workpiece and the bowl",
            file=case.file,
            field="motion.path",
            value=f"axis up to {reach:.4g} m from the bowl's axis, workpiece radius {radius:.4g} m",
            limit=f"together at most {study.bowl.radius_m - diameter:.4g} m: the bowl's radius "
            "minus one particle",
            remedy="use a smaller path or workpiece, or a wider bowl",
        )


def _below(case: Case, surface_m: float) -> Iterator[InputError]:
    depth, length = case.study.motion.immersion_depth_m, workpiece_length(case)
    if length < depth:
        yield InputError(
            "the workpiece is shorter than its immersion: particles would close above it",
            file=case.file,
            field="motion.immersion_depth_m",
            value=depth,
            limit=f"at most the length of the workpiece, {length:.4g} m",
            remedy="submerge the workpiece less, or model it with the shaft that holds it",
        )
    deepest = surface_m - 2 * float(bed_radii(case.study).max())
    if depth > deepest:
        yield InputError(
            "the workpiece would reach below the floor"
            if depth > surface_m
            else "the workpiece would crush particles between its tip and the floor",
            file=case.file,
            field="motion.immersion_depth_m",
            value=depth,
            limit=f"at most {deepest:.4g} m: a bed {surface_m:.4g} m high minus one largest "
            "particle",
            remedy="submerge the workpiece less, or fill in more particles",
        )


def _per_step(case: Case, timestep_s: float) -> Iterator[InputError]:
    moved, radius = fastest_motion(case) * timestep_s, smallest_radius(case.study)
    if moved >= radius:
        yield InputError(
            "the workpiece crosses a particle's radius in one step: contacts would be missed",
            file=case.file,
            field="motion.speed_m_s",
            value=f"{moved:.3g} m in a step of {timestep_s:.3g} s",
            limit=f"below {radius:.3g} m",
            remedy="use a lower speed or speed_factor, or a smaller timestep_fraction",
        )


def fastest_motion(case: Case) -> float:
    """Speed of the fastest motion of the workpiece, m/s."""
    motion, factor = case.study.motion, case.study.chosen_fidelity().speed_factor
    return factor * max(motion.speed_m_s, motion.plunge_speed_m_s, motion.approach_speed_m_s)


def check_headroom(case: Case, tip_m: float, top_m: float) -> None:
    """Refuse a workpiece that would stick out of the simulation box before it goes in.

    Raises
    ------
    InputError
        The workpiece is too long.
    """
    longest = top_m - tip_m - 0.001
    if workpiece_length(case) > longest:
        raise InputError(
            "the workpiece is longer than the simulation box above the bed",
            file=case.file,
            field="workpiece.shape",
            value=f"length {workpiece_length(case):.4g} m",
            limit=f"at most {longest:.4g} m",
            remedy="cut the mesh off higher up, or state a higher bowl (bowl.height_m)",
        )
