"""Whether a workpiece fits with its motion into bowl, packing and time step."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from dragdeck.cases.bed import (
    bed_timestep,
    expected_surface,
    farthest_point,
    skin,
    smallest_radius,
    typical_reach,
    widest_skin,
)
from dragdeck.cases.case import Case
from dragdeck.errors import InputError, together
from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import limit_of, round_to, rounded
from dragdeck.scenes import motion as motions
from dragdeck.scenes.workpiece import (
    dip,
    outline_in_bed,
    workpiece_length,
    workpiece_radius,
    workpiece_reach,
)
from dragdeck.study.paths.path import as_rows
from dragdeck.study.workpiece import MeshShape

_FASTEST_PARTICLE, _STEPS_OF_LISTS = 1.9, 3
"""Speed of the fastest particle over that of the fastest motion, as measured from 1 to 3 m/s; steps
for which neighbour lists last at that speed."""


_PLACES_PER_LEG = 500
"""At which the distance of two workpieces is compared."""


_PLACES_AMONG_FACETS = 60
"""Of a leg, at which the gap to facets is measured, which takes longer."""


_SIDES, _HEIGHTS = 12, 9
"""Points around a workpiece, and heights, at which its gap to a sloping wall is measured."""


JAMMING_GAP = 2.0
"""Particle diameters between workpiece and bowl below which a warning is given: in a narrower gap,
an arch of two particles can block the workpiece (docs/development/liggghts.md)."""

ROOM_BESIDE, ROOM_BELOW = 6.0, 4.0
"""Particle diameters beside the workpiece and below it from which the drag no longer depends on
them within 13 and 5 % (docs/evidence/simplifications.md)."""

LEAST_GAP = 2.7
"""Smallest gap between workpiece and wall that larger particles may have, in their diameters."""


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
    across, along, up = motion.bowl.reach_m if motion.bowl else (0.0, 0.0, 0.0)
    tip = surface_m - motion.immersion_depth_m - up
    wall = wall_gap(case, surface_m) - math.hypot(across, along)
    return Clearances(wall, tip, tip + motion.vertical_range_m[0] - dip(case))


def in_diameters(case: Case, gap_m: float) -> float:
    """A gap in diameters of the sphere around a mean particle of the first class."""
    return gap_m / (2 * typical_reach(case.study))


def wall_gap(case: Case, surface_m: float | None = None) -> float:
    """Narrowest gap between the workpiece and a wall, m.

    Only a bowl whose width varies with height needs the surface of the bed; by default, the
    expected one.

    A tilted workpiece that shows the axis of a round bowl one side all the time is measured where
    it starts, all others as the cylinder of `workpiece_reach`.
    """
    motion, bowl = case.study.motion, case.study.bowl.container
    begin, plunge = motion.path.start_point, motion.plunge_point
    one_side = motion.tilt_deg and motion.path.one_side_inwards(motion.orientation)
    if one_side and bowl.round and not bowl.rim:
        angle, outline = motion.path.direction_rad, outline_in_bed(case).T
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        around = np.concatenate([outline @ turn + place for place in (begin, plunge)])
        return float(bowl.side_distance(around).min())
    count = _PLACES_AMONG_FACETS if bowl.own_facets.size else _PLACES_PER_LEG
    entry = np.linspace(plunge, begin, count)
    drag = np.atleast_2d(as_rows(motion.path.place(np.linspace(0.0, 1.0, count))))
    places = np.concatenate([entry, motion.path.corners[:, :2], drag[:, :2]])
    reach, surface = workpiece_reach(case), surface_m or expected_surface(case.study)
    if not bowl.rim:
        return float(bowl.side_distance(places).min()) - reach
    ring = np.linspace(0.0, math.tau, _SIDES, endpoint=False)
    outline = reach * np.column_stack([np.cos(ring), np.sin(ring)])
    points = (np.unique(places, axis=0)[:, None] + outline).reshape(-1, 2)
    return min(
        float(bowl.distance(np.insert(points, 2, height, axis=1)).min())
        for height in np.linspace(surface - motion.deepest_m, surface, _HEIGHTS).tolist()
    )


def may_jam(case: Case, surface_m: float) -> bool:
    """Whether particles can be squeezed between a workpiece and the bowl, and leave fast."""
    gaps = clearances(case, surface_m)
    return in_diameters(case, min(gaps.wall_m, gaps.floor_m)) < JAMMING_GAP


def check_fit(case: Case, surface_m: float, timestep_s: float) -> None:
    """Refuse a workpiece that leaves the bowl, goes through its floor or jumps over particles.

    Parameters
    ----------
    case : Case
    surface_m : float
        Lowest height of the bed's surface, m.
    timestep_s : float

    Raises
    ------
    InputError
        Names every field that has to change.
    """
    gaps = clearances(case, surface_m)
    problems = [
        *_beside(case, gaps.wall_m),
        *_below(case, gaps.tip_m),
        *_up_and_down(case, gaps.tip_m),
        *_per_step(case, timestep_s),
    ]
    if problems:
        raise together(problems)


def check_apart(each: Sequence[Case], bed: Bed) -> None:
    """Refuse workpieces that come so close to each other that a particle touches two.

    Raises
    ------
    InputError
        Names the two workpieces that come closest.
    """
    pair, diameter = closest(each, bed), _largest_particle(each[0])
    if pair is not None and pair[0] < diameter:
        gap, first, second = pair
        problem = "collide" if gap <= 0 else "come so close that a particle touches both"
        raise InputError(
            f"workpieces {first} and {second} {problem}", file=each[0].file, field="workpieces",
            value=f"a gap of {gap:.4g} m between them",
            limit=f"at least {diameter:.4g} m, the diameter of the largest particle",
            remedy="use fewer or smaller workpieces, other angles, or a larger radius of the path",
        )  # fmt: skip


def closest(each: Sequence[Case], bed: Bed) -> tuple[float, int, int] | None:
    """Least gap between two of several workpieces, m, and their numbers; None for a single one.

    Each counts as the upright cylinder around what of it is in the bed.
    """
    if len(each) < 2:
        return None
    reaches = [workpiece_reach(workpiece) for workpiece in each]
    ways = [_way(workpiece, bed) for workpiece in each]
    return min(
        (float(np.hypot(*(ways[a] - ways[b]).T).min()) - reaches[a] - reaches[b], a + 1, b + 1)
        for a, b in combinations(range(len(each)), 2)
    )


def _way(case: Case, bed: Bed) -> NDArray[np.float64]:
    """X and y, (N, 2), of the workpiece's axis along all its legs."""
    fractions = np.linspace(0.0, 1.0, _PLACES_PER_LEG + 1)
    way = motions.course(case.study, bed)
    return np.concatenate([way.poses(leg, fractions * leg.steps)[0][:, :2] for leg in way.legs])


def _beside(case: Case, gap: float) -> Iterator[InputError]:
    study = case.study
    diameter = 2 * typical_reach(study)
    if gap < diameter:
        shape = study.workpiece.shape
        remedy = "use another path or motion.plunge_at_m, a smaller workpiece, or a wider bowl"
        if isinstance(shape, MeshShape) and shape.offset_m:
            remedy = f"leave workpiece.shape.offset_m out: the part is centred then; or {remedy}"
        problem = "no particle fits between the workpiece and the bowl"
        if gap <= 0:
            problem = "the workpiece does not fit between its path and the bowl"
        yield InputError(
            problem, file=case.file, field="motion.path",
            value=f"{gap:.4g} m between workpiece and wall, at its axis "
            f"{study.motion.farthest_m:.4g} m from that of the bowl or nearer",
            limit=f"at least {diameter:.4g} m, a particle diameter", remedy=remedy,
        )  # fmt: skip


def _depth_field(case: Case) -> str:
    """The field that states how deep this workpiece is."""
    carousel, at = (case.whole or case).study.workpieces, max(case.number - 1, 0)
    stated = carousel and carousel.stations[at].immersion_depth_m
    return f"workpieces.each.{at}.immersion_depth_m" if stated else "motion.immersion_depth_m"


def _below(case: Case, tip_m: float) -> Iterator[InputError]:
    depth, length = case.study.motion.immersion_depth_m, workpiece_length(case)
    if length < depth:
        yield InputError(
            "the workpiece is shorter than its immersion depth: particles would cover it",
            file=case.file, field=_depth_field(case), value=depth,
            limit=f"at most the length of the workpiece, {limit_of(length)} m",
            remedy="reduce the immersion depth, or include the shaft of the workpiece in its mesh",
        )  # fmt: skip
    largest = _largest_particle(case)
    if tip_m < largest:
        problem = "the workpiece would crush particles between its tip and the floor"
        if tip_m < 0:
            problem = "the workpiece would reach below the floor"
        most = depth + tip_m - largest
        limit = f"at most {limit_of(most)} m" if most > 0 else "none"
        yield InputError(
            problem, file=case.file, field=_depth_field(case), value=depth,
            limit=f"{limit}: a packing at least {depth + tip_m:.4g} m high minus the diameter of "
            f"the largest particle, {largest:.4g} m",
            remedy="reduce the immersion depth, or use more particles",
        )  # fmt: skip


def _largest_particle(case: Case) -> float:
    """Diameter of the largest particle, m: with less between tip and floor, one is crushed."""
    return 2 * farthest_point(case.study)


def _up_and_down(case: Case, tip_m: float) -> Iterator[InputError]:
    """Refuse a path or superposed motions that take a workpiece to the floor or out of the bed."""
    motion = case.study.motion
    depth, (low, high) = motion.immersion_depth_m, motion.vertical_range_m
    low -= dip(case)
    deepest = min(depth + tip_m - _largest_particle(case), workpiece_length(case))
    moving = ["path"] if any(motion.path_heights_m) or motion.path.inclined else []
    moving += [
        name
        for name, superposed_motion in motion.superposed().items()
        if superposed_motion.vertical_reach_m
    ]
    problems = (
        (depth <= deepest < depth - low, "takes the workpiece too deep", deepest - depth),
        (high >= depth, "takes the workpiece out of the packing", depth),
    )
    for wrong, problem, limit in problems:
        if moving and wrong:
            yield InputError(
                problem, file=case.file, field=" and ".join(f"motion.{name}" for name in moving),
                value=f"{-low:.4g} m below and {high:.4g} m above an immersion of {depth:.4g} m",
                limit=f"below {limit:.4g} m: the tip stays at a depth between 0 and {deepest:.4g} "
                "m, one largest particle above the floor and no deeper than the workpiece is long",
                remedy="reduce the vertical motion, or change motion.immersion_depth_m",
            )  # fmt: skip


def _per_step(case: Case, timestep_s: float) -> Iterator[InputError]:
    """Why a workpiece is too fast: LIGGGHTS looks where a mesh is only after it has used its lists.

    A contact that was farther away than the skin when the lists were built is then overlooked for
    one step, and no count of LIGGGHTS shows it (docs/development/liggghts.md).
    """
    motion, moved = case.study.motion, fastest_motion(case) * timestep_s
    radius, has, superposed = smallest_radius(case.study), process_skin(case), motion.superposed()
    field = "path" if motion.speed_m_s is None else "speed_m_s"
    what, most = "the workpiece moves by more than a particle radius", radius
    remedy = "use a lower speed or speed_factor, or a smaller timestep_fraction"
    if moved <= has and moved < radius:
        return
    if moved < radius:
        what, most = "the surface of the workpiece moves by more than the neighbour skin", has
        remedy += f", or a fidelity.skin_m of at least {rounded(moved, up=True):g}"
        if superposed:
            reach = workpiece_radius(case)
            field = max(superposed, key=lambda name: superposed[name].surface_speed_m_s(reach))
    yield InputError(
        f"{what} per step: contacts would be missed", file=case.file, field=f"motion.{field}",
        value=f"{moved:.3g} m in a step of {timestep_s:.3g} s", limit=f"at most {limit_of(most)} m",
        remedy=remedy,
    )  # fmt: skip


def fastest_motion(case: Case) -> float:
    """Speed of the fastest motion of workpiece and bowl, superposed motions included, m/s."""
    motion, factor = case.study.motion, case.study.chosen_fidelity().speed_factor
    entry = max(motion.plunge_speed_m_s, motion.approach_speed_m_s)
    return max(_fastest_in_drag(case), factor * entry)


def process_skin(case: Case) -> float:
    """Neighbour skin of a process, m: the fidelity's own, or as its speed requires.

    Lists last for some steps at the speed of the fastest particle: at 3 m/s, a wide skin makes a
    run 1.6 times cheaper.
    """
    study, usual = case.study, skin(case.study)
    if study.chosen_fidelity().skin_m is not None:
        return usual
    moved = _fastest_in_drag(case) * bed_timestep(study, "timestep_fraction")
    lasting = round_to(2 * _STEPS_OF_LISTS * _FASTEST_PARTICLE * moved, 3)
    return max(usual, min(lasting, widest_skin(study)))


def _fastest_in_drag(case: Case) -> float:
    """Speed of the fastest motion in the drag, m/s."""
    motion, factor = case.study.motion, case.study.chosen_fidelity().speed_factor
    rim = abs(motion.bowl_rad_s) * case.study.bowl.container.reach_m
    shaken = motion.bowl.displacement_speed_m_s if motion.bowl else 0.0
    return max(driven_surface(case), factor * max(rim, shaken))


def driven_surface(case: Case) -> float:
    """Highest speed of the workpiece's surface in the drag as it is driven, m/s."""
    radius = workpiece_radius(case) if case.study.motion.superposed() else 0.0
    return motions.driven_surface_speed(case.study, radius)


def check_headroom(case: Case, tip_m: float, top_m: float) -> None:
    """Refuse a workpiece that would stick out of the simulation box before it goes in.

    Raises
    ------
    InputError
        The workpiece is too long.
    """
    longest, length = top_m - tip_m - 0.001, workpiece_length(case)
    if length > longest:
        problem = "the workpiece is longer than the simulation box above the packing"
        limit, field = f"at most {limit_of(longest)} m", "workpiece.shape"
        remedy = "shorten the mesh at its upper end, or use a higher bowl (bowl.height_m)"
        value, file = f"length {length:.4g} m", case.file
        raise InputError(problem, file=file, field=field, value=value, limit=limit, remedy=remedy)


def check_lid(case: Case, bed: Bed) -> None:
    """Refuse a lid that the packing would touch.

    Raises
    ------
    InputError
        The lid is too low.
    """
    bowl, motion = case.study.bowl, case.study.motion.bowl
    lid, least = bowl.lid_m, bed.top_m + bed.margin_m + (motion.reach_m[2] if motion else 0.0)
    if lid is not None and lid < least:
        limit = f"at least {limit_of(least, up=True)} m, the highest point of a particle"
        problem, remedy = "the lid is not above the packing", "use a higher lid, or fewer particles"
        field, file = "bowl.lid_m", case.file
        raise InputError(problem, file=file, field=field, value=lid, limit=limit, remedy=remedy)
