"""Whether the workpiece and its motion fit into the bowl, the bed and the time step."""

from collections.abc import Iterator

from dragdeck.cases.bed import bed_radii, smallest_radius
from dragdeck.cases.case import Case
from dragdeck.errors import InputError, together
from dragdeck.scenes.motion import farthest_reach
from dragdeck.scenes.workpiece import workpiece_length, workpiece_radius


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


def _beside(case: Case) -> Iterator[InputError]:
    study = case.study
    radius, reach = workpiece_radius(case), farthest_reach(study.motion)
    gap, diameter = study.bowl.radius_m - reach - radius, 2 * study.media.radius_mean_m
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
