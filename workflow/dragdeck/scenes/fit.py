"""Whether the workpiece and its motion fit into the bowl, the bed and the time step."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from dragdeck.cases.bed import (
    JUST_BEYOND,
    bed_radii,
    bed_timestep,
    impact_time,
    outrun,
    skin,
    smallest_radius,
)
from dragdeck.cases.case import Case
from dragdeck.errors import Caution, InputError, together
from dragdeck.physics.contact_mechanics import fall_speed
from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import rounded
from dragdeck.physics.run_limits import SPEED_FACTOR
from dragdeck.scenes.legs import farthest_reach, path_heights, vertical_range
from dragdeck.scenes.motion import (
    course,
    driven_surface_speed,
)
from dragdeck.scenes.workpiece import (
    dip,
    farthest_surface,
    workpiece_length,
    workpiece_radius,
    workpiece_reach,
    workpiece_warnings,
)

_FEWEST_STEPS_PER_CONTACT = 5
"""Below this many steps in a contact at the workpiece's speed a warning is given."""

_PLACES_PER_LEG = 500
"""At which the distance of two workpieces is compared."""

_JAMMING_GAP = 2.0
"""Particle diameters between workpiece and bowl below which a warning is given: in a narrower gap,
an arch of two particles can block the workpiece (docs/development/liggghts.md)."""


@dataclass(frozen=True)
class Clearances:
    """Least distances between workpiece and bowl over the whole motion, m; negative: it is outside.

    Attributes
    ----------
    wall_m : float
        Between workpiece and wall, superposed motions included.
    tip_m : float
        Between tip and floor at the immersion depth.
    floor_m : float
        Between tip and floor at the lowest point, superposed motions included.
    """

    wall_m: float
    tip_m: float
    floor_m: float


def clearances(case: Case, surface_m: float) -> Clearances:
    """Clearances of a case's workpiece in a bed with its surface at this height, m."""
    motion = case.study.motion
    tip = surface_m - motion.immersion_depth_m
    return Clearances(_wall_gap(case), tip, tip + vertical_range(motion)[0] - dip(case))


def _wall_gap(case: Case) -> float:
    """Narrowest gap between the workpiece and the wall, m; no bed is needed for it."""
    return case.study.bowl.radius_m - farthest_surface(case)


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
    gaps = clearances(case, surface_m)
    problems = (
        _beside(case, gaps.wall_m),
        _below(case, gaps.tip_m),
        _up_and_down(case, gaps.tip_m),
        _per_step(case, timestep_s),
    )
    found = [error for group in problems for error in group]
    if found:
        raise together(found)


def check_apart(each: Sequence[Case], bed: Bed) -> None:
    """Refuse workpieces that come so close to each other that a particle touches two.

    Raises
    ------
    InputError
        Names the two workpieces that come closest.
    """
    found, diameter = closest(each, bed), _largest_particle(each[0])
    if found is not None and found[0] < diameter:
        gap, first, second = found
        problem = "collide" if gap <= 0 else "come so close that a particle touches both"
        raise InputError(
            f"workpieces {first} and {second} {problem}",
            file=each[0].file,
            field="workpieces",
            value=f"a gap of {gap:.4g} m between them",
            limit=f"at least {diameter:.4g} m, the diameter of the largest particle",
            remedy="use fewer or smaller workpieces, other angles, or a larger radius of the path",
        )


def closest(each: Sequence[Case], bed: Bed) -> tuple[float, int, int] | None:
    """Least gap between two of several workpieces, m, and their numbers; None for a single one.

    Each counts as the upright cylinder around what of it is in the bed.
    """
    if len(each) < 2:
        return None
    reaches = [workpiece_reach(one) for one in each]
    ways = [_way(one, bed) for one in each]
    return min(
        (float(np.hypot(*(ways[a] - ways[b]).T).min()) - reaches[a] - reaches[b], a + 1, b + 1)
        for a, b in combinations(range(len(each)), 2)
    )


def _way(case: Case, bed: Bed) -> NDArray[np.float64]:
    """X and y, (N, 2), of the workpiece's axis along all its legs."""
    fractions = np.linspace(0.0, 1.0, _PLACES_PER_LEG + 1)
    way = course(case.study, bed)
    return np.concatenate([way.poses(leg, fractions * leg.steps)[0][:, :2] for leg in way.legs])


def process_cautions(case: Case) -> Iterator[Caution]:
    """What a user should know of the workpiece and its motion before a process runs."""
    study = case.study
    yield from workpiece_warnings(case)
    gap = _wall_gap(case) / (2 * study.media.radius_mean_m)
    if gap < _JAMMING_GAP:
        yield Caution(
            "gap",
            f"the gap between workpiece and bowl is {gap:.2g} particle diameters, less than "
            f"{_JAMMING_GAP:g}: particles may jam there and cause very large forces",
        )
    fidelity = study.chosen_fidelity()
    surface = _driven_surface(case)
    contact = impact_time(study, fidelity.youngs_modulus_scale, surface)
    steps = contact / bed_timestep(study, "timestep_fraction")
    if steps * JUST_BEYOND < _FEWEST_STEPS_PER_CONTACT:
        shorter = fidelity.timestep_fraction * steps / _FEWEST_STEPS_PER_CONTACT
        yield Caution(
            "steps_per_contact",
            f"a contact at the workpiece's speed takes {steps:.1f} steps, fewer than "
            f"{_FEWEST_STEPS_PER_CONTACT}: single impacts are not resolved; use a smaller "
            "fidelity.timestep_fraction",
            {"timestep_fraction": rounded(shorter, up=False)},
        )
    # seen: 2 to 3 times the workpiece's speed, once 6 times; or the fall into a slow one's wake
    fall = fall_speed(study.motion.immersion_depth_m, study.gravity_m_s2)
    speed = math.hypot(SPEED_FACTOR * fastest_motion(case), fall)
    yield from outrun(study, "timestep_fraction", "particles may move", speed)


def _beside(case: Case, gap: float) -> Iterator[InputError]:
    study = case.study
    reach = farthest_reach(study.motion)
    radius = study.bowl.radius_m - gap - reach
    diameter = 2 * study.media.radius_mean_m
    if gap < diameter:
        yield InputError(
            "the workpiece does not fit between its path and the bowl"
            if gap <= 0
            else "no particle fits between the workpiece and the bowl",
            file=case.file,
            field="motion.path",
            value=f"axis up to {reach:.4g} m from the bowl's axis, workpiece radius {radius:.4g} m",
            limit=f"sum at most {study.bowl.radius_m - diameter:.4g} m: the bowl's radius "
            "minus a particle diameter",
            remedy="use a smaller path or workpiece, or a wider bowl",
        )


def _below(case: Case, tip_m: float) -> Iterator[InputError]:
    depth, length = case.study.motion.immersion_depth_m, workpiece_length(case)
    if length < depth:
        yield InputError(
            "the workpiece is shorter than its immersion depth: particles would cover it",
            file=case.file,
            field="motion.immersion_depth_m",
            value=depth,
            limit=f"at most the length of the workpiece, {length:.4g} m",
            remedy="reduce the immersion depth, or include the shaft of the workpiece in its mesh",
        )
    largest = _largest_particle(case)
    if tip_m < largest:
        yield InputError(
            "the workpiece would reach below the floor"
            if tip_m < 0
            else "the workpiece would crush particles between its tip and the floor",
            file=case.file,
            field="motion.immersion_depth_m",
            value=depth,
            limit=f"at most {depth + tip_m - largest:.4g} m: a packing {depth + tip_m:.4g} m "
            "high minus the diameter of the largest particle",
            remedy="reduce the immersion depth, or use more particles",
        )


def _largest_particle(case: Case) -> float:
    """Diameter of the largest particle, m: with less between tip and floor, one is crushed."""
    return 2 * float(bed_radii(case.study).max())


def _up_and_down(case: Case, tip_m: float) -> Iterator[InputError]:
    """Refuse a path or superposed motions that take a workpiece to the floor or out of the bed."""
    motion = case.study.motion
    depth, (low, high) = motion.immersion_depth_m, vertical_range(motion)
    low -= dip(case)
    deepest = min(depth + tip_m - _largest_particle(case), workpiece_length(case))
    moving = ["path"] if any(path_heights(motion)) or motion.path.leans else []
    moving += [name for name, one in motion.superposed().items() if one.vertical_reach_m]
    problems = (
        (depth <= deepest < depth - low, "takes the workpiece too deep", deepest - depth),
        (high >= depth, "takes the workpiece out of the packing", depth),
    )
    for wrong, problem, limit in problems:
        if moving and wrong:
            yield InputError(
                problem,
                file=case.file,
                field=" and ".join(f"motion.{name}" for name in moving),
                value=f"{-low:.4g} m below and {high:.4g} m above an immersion of {depth:.4g} m",
                limit=f"below {limit:.4g} m: the tip stays at a depth between 0 and {deepest:.4g} "
                "m, one largest particle above the floor and no deeper than the workpiece is long",
                remedy="reduce the vertical motion, or change motion.immersion_depth_m",
            )


def _per_step(case: Case, timestep_s: float) -> Iterator[InputError]:
    moved, radius = fastest_motion(case) * timestep_s, smallest_radius(case.study)
    if moved >= radius:
        yield InputError(
            "the workpiece moves by more than a particle radius per step: contacts would be missed",
            file=case.file,
            field="motion.path" if case.study.motion.speed_m_s is None else "motion.speed_m_s",
            value=f"{moved:.3g} m in a step of {timestep_s:.3g} s",
            limit=f"below {radius:.3g} m",
            remedy="use a lower speed or speed_factor, or a smaller timestep_fraction",
        )
        return
    superposed, has = case.study.motion.superposed(), skin(case.study)
    if superposed and moved > has:
        radius = workpiece_radius(case)
        name = max(superposed, key=lambda name: superposed[name].surface_speed_m_s(radius))
        yield InputError(
            "the surface of the workpiece moves by more than the neighbour skin per step",
            file=case.file,
            field=f"motion.{name}",
            value=f"{moved:.3g} m in a step of {timestep_s:.3g} s",
            limit=f"at most {has:.3g} m",
            remedy="use a lower speed or speed_factor, a smaller timestep_fraction, or a larger "
            "fidelity.skin_m",
        )


def fastest_motion(case: Case) -> float:
    """Speed of the fastest motion of workpiece and bowl, superposed motions included, m/s."""
    motion, factor = case.study.motion, case.study.chosen_fidelity().speed_factor
    rim = abs(motion.bowl_rad_s) * case.study.bowl.radius_m
    entry = max(motion.plunge_speed_m_s, motion.approach_speed_m_s)
    return max(_driven_surface(case), factor * max(rim, entry))


def _driven_surface(case: Case) -> float:
    """Highest speed of the workpiece's surface in the drag as it is driven, m/s."""
    radius = workpiece_radius(case) if case.study.motion.superposed() else 0.0
    return driven_surface_speed(case.study, radius)


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
            "the workpiece is longer than the simulation box above the packing",
            file=case.file,
            field="workpiece.shape",
            value=f"length {workpiece_length(case):.4g} m",
            limit=f"at most {longest:.4g} m",
            remedy="shorten the mesh at its upper end, or use a higher bowl (bowl.height_m)",
        )
