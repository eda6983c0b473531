"""The workpiece of a case: its mesh, whether it fits, and the numbers that describe its scene.

It has to fit with its motion into bowl, packing and time step. The dimensionless numbers are those
by which scenes are compared.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from dragdeck.cases.bed import (
    JUST_BEYOND,
    bed_timestep,
    box_half_widths,
    expected_surface,
    farthest_point,
    full_stiffness_number,
    impact_time,
    particle_material,
    skin,
    smallest_radius,
    tip_pressure,
    typical_reach,
    weight_acceleration,
    widest_skin,
)
from dragdeck.cases.case import Case, mesh_file, of_each_workpiece
from dragdeck.errors import Caution, InputError, together
from dragdeck.mesh.checks import MeshDefect, Surroundings, check
from dragdeck.mesh.contacts import gap_fraction
from dragdeck.mesh.files import read
from dragdeck.mesh.shapes import cylinder, cylinder_facets, cylinder_radius
from dragdeck.mesh.surface import (
    REMESHED,
    facing_out,
    place,
    points_below,
    surface,
    tilted,
    upright,
    volume_below,
)
from dragdeck.physics.contact_mechanics import inertial_number
from dragdeck.physics.packing import Bed
from dragdeck.physics.rounding import round_to, rounded
from dragdeck.scenes.motion import (
    course,
    deepest,
    driven_surface_speed,
    farthest_reach,
    path_heights,
    plunge_point,
    surface_speed,
    vertical_range,
)
from dragdeck.scenes.moving_bowl import path_tilt_deg
from dragdeck.study.contact_law import compared_numbers
from dragdeck.study.driven import DrivenMotion
from dragdeck.study.paths.path import as_rows
from dragdeck.study.rotations import by_vector
from dragdeck.study.workpiece import CylinderShape, MeshShape

if TYPE_CHECKING:
    from trimesh import Trimesh

PARTICLE_STEPS_PER_S = 7e6
"""Particles times steps per second of a process, one rank, with a few facets."""

FACET_STEP_S = 3e-7
"""Time of a step for each facet of a workpiece, s, one rank (docs/data/benchmarks/facets.csv)."""

_MOST_TIMES, _ALWAYS_FACETS = 5, 5000
"""Facets are too many if they take this many times as long as the particles, and never below that
number."""

_MOST_GAPS = 0.01
"""Part of a workpiece's surface on which LIGGGHTS may overlook contacts without a word."""

_LOOKS = 100
"""How often it is looked how a workpiece leans on its path."""

_FREEBOARD_DIAMETERS = 4
"""A generated workpiece stands this many particle diameters out of the bed."""


def workpiece_mesh(case: Case) -> "Trimesh":
    """The workpiece with its reference point in the origin, leaning towards +x if it is tilted.

    Raises
    ------
    InputError
        The mesh file is missing or cannot be used.
    """
    mesh, motion = _upright(case), case.study.motion
    if not motion.tilt_deg:
        return mesh
    return tilted(mesh, motion.tilt_deg, about_tip=motion.turns_about_inclined_axis)


def _upright(case: Case) -> "Trimesh":
    """The workpiece as it stands upright on its tip."""
    shape = case.study.workpiece.shape
    if isinstance(shape, CylinderShape):
        return _workpiece(shape, _generated_length(case))
    return _of_case(case, shape)[0]


def reference_height(case: Case) -> float:
    """Height of the reference point above the lowest point of the workpiece as it starts, m.

    A workpiece that spins about an inclined axis has it on the axis, and counts as low as it
    is at any angle of its spin.
    """
    motion = case.study.motion
    if not motion.turns_about_inclined_axis:
        return 0.0
    x, y, z = _upright(case).vertices.T
    tilt = math.radians(motion.tilt_deg or 0.0)
    lowest = z * math.cos(tilt) - np.hypot(x, y) * abs(math.sin(tilt))
    return round_to(float(-lowest.min()), 9)


def dip(case: Case) -> float:
    """How far a workpiece that leans on its path reaches below its lowest point at the start, m."""
    if not case.study.motion.path.inclined:
        return 0.0
    return max(0.0, *(float(-points[:, 2].min()) for points in _postures(case)))


def _postures(case: Case) -> Iterator[NDArray[np.float64]]:
    """Corners of the workpiece, (N, 3), as it leans and spins, its front along +x, m."""
    mesh, motion = workpiece_mesh(case), case.study.motion
    way = DrivenMotion.of(motion, bed_timestep(case.study, "timestep_fraction"), 1.0)
    since = np.linspace(0.0, way.drive.steps, _LOOKS)
    rotations = motion.path.own(way.drive, since)
    if motion.turns_about_inclined_axis:
        rotations = by_vector(np.linspace(0.0, math.tau, 25)[:, None] * way.drive.own_axis)
    for rotation in np.eye(3)[None] if rotations is None else rotations:
        yield mesh.vertices @ rotation.T


def remeshing(case: Case) -> str | None:
    """How the surface of a workpiece that was meshed anew differs from that in its file."""
    shape = case.study.workpiece.shape
    if isinstance(shape, CylinderShape):
        return None
    deviation = _of_case(case, shape)[0].metadata.get(REMESHED)
    return deviation and f"{shape.file}, {deviation}"


def workpiece_warnings(case: Case) -> list[Caution]:
    """What is doubtful in the mesh of the user's, what was repaired, and what makes it slow."""
    shape, said = case.study.workpiece.shape, []
    if isinstance(shape, MeshShape):
        mesh, problems = _of_case(case, shape)
        said = [
            f"{shape.file}: {problem.problem}: {problem.value} ({problem.remedy})"
            for problem in problems
        ]
        said += _gaps(mesh, shape, case.study.media.typical_radius_m)
    return [*(Caution("mesh", text) for text in said), *_too_fine(case)]


def _gaps(mesh: "Trimesh", shape: MeshShape, radius_m: float) -> Iterator[str]:
    """A remark where many contacts are overlooked between nearly coplanar facets."""
    fraction = gap_fraction(mesh, radius_m)
    if fraction > _MOST_GAPS:
        where = "" if shape.facet_size_m is None else ": a larger workpiece.shape.facet_size_m"
        yield (
            f"{shape.file}: LIGGGHTS overlooks contacts on {100 * fraction:.2g} % of the surface, "
            "at convex edges between facets less than 0.26 degrees apart (mesh curved faces with "
            f"larger facets{where})"
        )


def _too_fine(case: Case) -> Iterator[Caution]:
    """A warning where a step is spent on facets."""
    shape, facets = case.study.workpiece.shape, workpiece_facets(case)
    particles_s = case.study.sphere_count / PARTICLE_STEPS_PER_S
    enough = max(_ALWAYS_FACETS, round(_MOST_TIMES * particles_s / FACET_STEP_S))
    if facets <= enough:
        return
    coarser = 1.1 * math.sqrt(facets / enough)  # not all facets scale alike
    of_file = isinstance(shape, MeshShape)
    size = shape.facet_size_m or float(np.median(workpiece_mesh(case).edges_unique_length))
    along = "" if of_file else " (facet_length_m in proportion)"
    remedy = f"workpiece.shape.facet_size_m: {rounded(size * coarser, up=True):g} would do{along}"
    yield Caution(
        "facets",
        f"{facets:,} facets make a step about {1 + facets * FACET_STEP_S / particles_s:.2g} times "
        f"as long as the particles alone; about {enough:,} are cheap: {remedy}",
    )


def _of_case(case: Case, shape: MeshShape) -> "tuple[Trimesh, list[MeshDefect]]":
    study = case.study
    sizes = study.bowl.container.clear_m, study.media.typical_radius_m, deepest(study.motion)
    surroundings = Surroundings(*sizes)
    return _from_file(mesh_file(case, shape), shape, surroundings)


def simulated_mesh(case: Case) -> "Trimesh":
    """The workpiece without what would leave the simulation box above the bed.

    LIGGGHTS ends a run if the centre of a facet leaves the box; of a wide part above the bed,
    such as a holder plate, no particle is there.

    Raises
    ------
    InputError
        A facet reaches from the bed out of the box.
    """
    mesh, motion = workpiece_mesh(case), case.study.motion
    if motion.path.inclined or motion.turns_about_inclined_axis:
        return mesh
    box = case.study.bowl.container.reach_m + 2 * case.study.media.typical_radius_m
    outside = np.hypot(*mesh.triangles_center[:, :2].T) + farthest_reach(motion) > box
    if (outside & (mesh.triangles[:, :, 2].min(axis=1) < deepest(motion))).any():
        raise InputError(
            "a facet of the workpiece reaches from the bed out of the simulation box",
            file=case.file,
            field="workpiece.shape",
            limit=f"a centre within {box:.4g} m from the axis of the bowl",
            remedy="mesh the part with smaller facets, or cut it off above the bed",
        )
    return surface(mesh.vertices, mesh.faces[~outside]) if outside.any() else mesh


def workpiece_length(case: Case) -> float:
    """Height of the workpiece, m: its length if it is not tilted."""
    study = case.study
    if isinstance(study.workpiece.shape, MeshShape) or study.motion.tilt_deg:
        low, high = workpiece_mesh(case).bounds[:, 2]
        return float(high - low)
    return _generated_length(case)


def _generated_length(case: Case) -> float:
    """Length of a generated workpiece along its axis, m."""
    study = case.study
    freeboard = _FREEBOARD_DIAMETERS * 2 * study.media.typical_radius_m
    depth = deepest(study.motion)
    return round_to((depth + freeboard) / math.cos(math.radians(study.motion.tilt_deg or 0)), 6)


def workpiece_radius(case: Case) -> float:
    """Radius of the cylinder around the workpiece's own axis and what is in the bed, m.

    A workpiece that leans counts as a whole.
    """
    shape, motion = case.study.workpiece.shape, case.study.motion
    if isinstance(shape, CylinderShape):
        return cylinder_radius(shape.radius_m, _generated_length(case), shape.facet_size_m)
    mesh, _ = _of_case(case, shape)
    below = points_below(mesh, mesh.bounds[1, 2] if motion.inclined else deepest(motion))
    return float(np.hypot(*below[:, :2].T).max())


def workpiece_reach(case: Case) -> float:
    """Radius of the upright cylinder about the tip around what is in the bed, m."""
    if not case.study.motion.inclined:
        return workpiece_radius(case)
    return float(np.hypot(*_in_bed(case)).max())


def _in_bed(case: Case) -> NDArray[np.float64]:
    """X and y, (2, N), of the corners of what is in the bed, its front along +x, m."""
    mesh, height = workpiece_mesh(case), deepest(case.study.motion) - reference_height(case)
    outlines = [
        points_below(surface(points, mesh.faces), height)[:, :2] for points in _postures(case)
    ]
    return np.concatenate(outlines).T


def fastest_surface(case: Case) -> float:
    """Highest speed of the workpiece's surface in the drag, at the study's own speed, m/s."""
    motion = case.study.motion
    turns = motion.superposed() or motion.path.inclined
    return surface_speed(motion, workpiece_radius(case) if turns else 0.0)


def workpiece_facets(case: Case) -> int:
    """Number of facets of the workpiece; that of a generated one without making its mesh."""
    shape = case.study.workpiece.shape
    if isinstance(shape, CylinderShape):
        sizes = shape.facet_size_m, shape.facet_length_m
        return cylinder_facets(shape.radius_m, _generated_length(case), *sizes)
    return len(workpiece_mesh(case).faces)


@lru_cache(maxsize=8)
def _workpiece(shape: CylinderShape, length_m: float) -> "Trimesh":
    return cylinder(shape.radius_m, length_m, shape.facet_size_m, shape.facet_length_m)


@lru_cache(maxsize=8)
def _from_file(
    file: Path, shape: MeshShape, surroundings: Surroundings
) -> "tuple[Trimesh, list[MeshDefect]]":
    mesh = _read(file, shape, 2 * surroundings.bowl_radius_m)
    problems = check(mesh, file=file, field="workpiece.shape", surroundings=surroundings)
    turned = facing_out(mesh)
    assert turned is not None, "the check refuses a surface with one side"
    placed = place(turned, shape.offset_m)
    placed.metadata.update(mesh.metadata)
    return placed, problems


@lru_cache(maxsize=8)
def _read(file: Path, shape: MeshShape, widest_m: float) -> "Trimesh":
    sizes = shape.facet_size_m, shape.edge_facet_size_m
    return upright(read(file, shape.unit, *sizes, widest_m), shape.axis)


# --- whether it fits -----------------------------------------------------------------------------


_FEWEST_STEPS_PER_CONTACT = 5
"""Below this many steps in a contact at the workpiece's speed a warning is given."""

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
    wall = _wall_gap(case, surface_m) - math.hypot(across, along)
    return Clearances(wall, tip, tip + vertical_range(motion)[0] - dip(case))


def in_diameters(case: Case, gap_m: float) -> float:
    """A gap in diameters of the sphere around a mean particle of the first class."""
    return gap_m / (2 * typical_reach(case.study))


def _wall_gap(case: Case, surface_m: float | None = None) -> float:
    """Narrowest gap between the workpiece and a wall, m.

    Only a bowl whose width varies with height needs the surface of the bed; by default, the
    expected one.

    A tilted workpiece that shows the axis of a round bowl one side all the time is measured where
    it starts, all others as the cylinder of `workpiece_reach`.
    """
    motion, bowl = case.study.motion, case.study.bowl.container
    begin, plunge = motion.path.start_point, plunge_point(motion)
    one_side = motion.tilt_deg and motion.path.one_side_inwards(motion.orientation)
    if one_side and bowl.round and not bowl.rim:
        angle, outline = motion.path.direction_rad, _in_bed(case).T
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
        for height in np.linspace(surface - deepest(motion), surface, _HEIGHTS).tolist()
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
    reaches = [workpiece_reach(workpiece) for workpiece in each]
    ways = [_way(workpiece, bed) for workpiece in each]
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
    of_file = isinstance(study.workpiece.shape, MeshShape)
    left_out = workpiece_facets(case) - len(simulated_mesh(case).faces) if of_file else 0
    if left_out:
        yield Caution(
            "mesh",
            f"{left_out:,} facets above the bed would leave the simulation box, "
            f"{box_half_widths(study)[0]:.3g} m from the axis of the bowl: the run leaves them out",
        )
    gap = in_diameters(case, _wall_gap(case))
    if gap < JAMMING_GAP:
        yield Caution(
            "gap",
            f"the gap between workpiece and bowl is {gap:.2g} particle diameters, less than "
            f"{JAMMING_GAP:g}: particles may jam there and cause very large forces",
        )
    fidelity = study.chosen_fidelity()
    surface = max(_driven_surface(case), fidelity.speed_factor * _against_bowl(case))
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


def _beside(case: Case, gap: float) -> Iterator[InputError]:
    study = case.study
    diameter = 2 * typical_reach(study)
    if gap < diameter:
        shape = study.workpiece.shape
        remedy = "use another path or motion.plunge_at_m, a smaller workpiece, or a wider bowl"
        if isinstance(shape, MeshShape) and shape.offset_m:
            remedy = f"leave workpiece.shape.offset_m out: the part is centred then; or {remedy}"
        yield InputError(
            "the workpiece does not fit between its path and the bowl"
            if gap <= 0
            else "no particle fits between the workpiece and the bowl",
            file=case.file,
            field="motion.path",
            value=f"{gap:.4g} m between workpiece and wall, at its axis "
            f"{farthest_reach(study.motion):.4g} m from that of the bowl or nearer",
            limit=f"at least {diameter:.4g} m, a particle diameter",
            remedy=remedy,
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
            limit=f"at most {depth + tip_m - largest:.4g} m: a packing at least "
            f"{depth + tip_m:.4g} m high minus the diameter of the largest particle",
            remedy="reduce the immersion depth, or use more particles",
        )


def _largest_particle(case: Case) -> float:
    """Diameter of the largest particle, m: with less between tip and floor, one is crushed."""
    return 2 * farthest_point(case.study)


def _up_and_down(case: Case, tip_m: float) -> Iterator[InputError]:
    """Refuse a path or superposed motions that take a workpiece to the floor or out of the bed."""
    motion = case.study.motion
    depth, (low, high) = motion.immersion_depth_m, vertical_range(motion)
    low -= dip(case)
    deepest = min(depth + tip_m - _largest_particle(case), workpiece_length(case))
    moving = ["path"] if any(path_heights(motion)) or motion.path.inclined else []
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
                problem,
                file=case.file,
                field=" and ".join(f"motion.{name}" for name in moving),
                value=f"{-low:.4g} m below and {high:.4g} m above an immersion of {depth:.4g} m",
                limit=f"below {limit:.4g} m: the tip stays at a depth between 0 and {deepest:.4g} "
                "m, one largest particle above the floor and no deeper than the workpiece is long",
                remedy="reduce the vertical motion, or change motion.immersion_depth_m",
            )


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
        f"{what} per step: contacts would be missed",
        file=case.file,
        field=f"motion.{field}",
        value=f"{moved:.3g} m in a step of {timestep_s:.3g} s",
        limit=f"at most {most:.3g} m",
        remedy=remedy,
    )


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
    return max(_driven_surface(case), factor * max(rim, shaken))


def _driven_surface(case: Case) -> float:
    """Highest speed of the workpiece's surface in the drag as it is driven, m/s."""
    radius = workpiece_radius(case) if case.study.motion.superposed() else 0.0
    return driven_surface_speed(case.study, radius)


def _against_bowl(case: Case) -> float:
    """Highest speed of the workpiece's surface relative to a bowl that moves by itself, m/s."""
    return fastest_surface(case) if case.study.motion.bowl else 0.0


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


def check_lid(case: Case, bed: Bed) -> None:
    """Refuse a lid that the packing would touch.

    Raises
    ------
    InputError
        The lid is too low.
    """
    lid, least = case.study.bowl.lid_m, bed.top_m + bed.margin_m
    if lid is not None and lid < least:
        raise InputError(
            "the lid is not above the packing",
            file=case.file,
            field="bowl.lid_m",
            value=lid,
            limit=f"at least {least:.4g} m, the highest point of a particle",
            remedy="use a higher lid, or fewer particles",
        )


def workpiece_buoyancy(case: Case, surface_m: float) -> float:
    """Buoyancy of a case's workpiece as its drag starts, which LIGGGHTS does not have, N.

    Parameters
    ----------
    case : Case
    surface_m : float
        Height of the settled bed.
    """
    study, motion, compound = case.study, case.study.motion, case.study.compound
    if compound is None:
        return 0.0
    lowest = surface_m - motion.immersion_depth_m + motion.path.start_height_m
    level = study.liquid_level_m - lowest - reference_height(case)
    volume = volume_below(workpiece_mesh(case), level)
    return compound.density_kg_m3 * study.gravity_m_s2 * volume


# --- dimensionless numbers -----------------------------------------------------------------------


def describe(case: Case) -> dict[str, float]:
    """The numbers of a case's scene at full modulus and at the study's own speed.

    Pressure is that of the bed at the depth of the workpiece's tip; the shear is that
    of the workpiece's highest surface speed over one particle diameter. ``superposed_speed``, the
    difference of this speed and the mean speed along the path divided by the latter, is absent
    without superposed motions on a path of one speed; ``bowl_froude_number``, the centripetal
    acceleration at the bowl's wall over gravity, is absent if the bowl stands still, and so are
    ``submerged_weight_ratio`` without compound, ``surface_tilt_deg`` of a bed that is level,
    ``tilt_deg`` without a tilt and ``further_workpieces`` of a single one. Other ratios are
    diameters, or the depth, over the mean diameter of a particle.
    """
    study = case.study
    particle, diameter = particle_material(study), 2 * study.media.typical_radius_m
    motion = study.motion
    speed = fastest_surface(case)
    rate = speed / diameter
    added = speed / motion.nominal_speed_m_s - 1
    superposed = {"superposed_speed": added} if motion.superposed() or added > 1e-9 else {}
    acceleration = weight_acceleration(study)
    optional = {
        "bowl_froude_number": motion.bowl_rad_s**2 * study.bowl.container.reach_m / acceleration,
        "surface_tilt_deg": path_tilt_deg(study),
        "tilt_deg": abs(motion.tilt_deg or 0.0),
        "submerged_weight_ratio": acceleration / study.gravity_m_s2 if study.compound else 0.0,
        "further_workpieces": float(len(of_each_workpiece(case.all_workpieces)) - 1),
    }
    names = study.media.main_material, study.workpiece.material
    return {
        "stiffness_number": full_stiffness_number(study),
        "inertial_number": inertial_number(
            rate, diameter, particle.density_kg_m3, tip_pressure(study)
        ),
        "workpiece_to_particle": 2 * workpiece_radius(case) / diameter,
        "depth_to_particle": motion.immersion_depth_m / diameter,
        "bowl_to_particle": 2 * study.bowl.container.clear_m / diameter,
        **compared_numbers(
            study.pair(names[0], names[0]), study.pair(*names), study.pairs.values()
        ),
        **superposed,
        **{name: value for name, value in optional.items() if value},
        "particles": study.particle_count,
    }
