"""What to expect of a process before it is run: its bed, its workpiece, its modulus."""

import math

from dragdeck.cases.bed import particle_material, skin
from dragdeck.cases.case import Case, of_each_workpiece
from dragdeck.cases.ranks import cores_here
from dragdeck.physics.contact_mechanics import (
    AT_SPEED,
    FAST,
    SOFT_AT_SPEED,
    effective_modulus,
    impact_overlap,
)
from dragdeck.scenes.bed_space import expected_bed, rank_split
from dragdeck.scenes.filling_cautions import MOST_OVERLAP, floor_overlap
from dragdeck.scenes.fit import clearances, closest, in_diameters
from dragdeck.scenes.moving_bowl import bed_in_motion
from dragdeck.scenes.numbers import describe
from dragdeck.scenes.workpiece import fastest_surface
from dragdeck.study.contact_law import compared_labels

_RATIOS = {
    "workpiece_to_particle": "diameter of the workpiece / mean particle diameter",
    "depth_to_particle": "immersion depth / mean particle diameter",
    "bowl_to_particle": "width between the walls of the bowl / mean particle diameter",
    "superposed_speed": "(highest surface speed - speed along the path) / speed along the path",
    "bowl_froude_number": "Froude number of the bowl's rotation",
    "submerged_weight_ratio": "weight of the particles minus buoyancy / weight",
    "surface_tilt_deg": "inclination of the bed's surface below the path (degrees)",
    "tilt_deg": "tilt of the workpiece (degrees)",
}


def workpiece_notes(case: Case) -> list[tuple[str, str]]:
    """What ``check`` says of a process: a heading and a text each."""
    bed = bed_in_motion(case.study, expected_bed(case.study))
    gaps = clearances(case, bed.surface_m)
    named = {"wall": gaps.wall_m, "floor": gaps.floor_m}
    if case.study.bowl.container.rim:
        named = {"wall or floor": gaps.wall_m}
    return [
        *((f"gap between workpiece and {what}", _gap(case, gap)) for what, gap in named.items()),
        *_between(case),
        ("highest surface speed of the workpiece", _speed(case)),
        ("overlap of impacts", _impact(case)),
        ("bed height", f"{1e3 * bed.surface_m:.3g} mm, +- {1e3 * bed.margin_m:.2g} mm (estimate)"),
        *_rotation(case),
    ]


def dimensionless(case: Case) -> list[tuple[str, str]]:
    """The dimensionless numbers of a process, their values and what two of them mean."""
    words, numbers = {**compared_labels(), **_RATIOS}, describe(case)
    scale = case.study.chosen_fidelity().youngs_modulus_scale
    soft = numbers["stiffness_number"] * scale ** (2 / 3)
    means = {
        "stiffness_number": f"; {soft:.4g} in the run: overlaps are inversely proportional to it",
        "inertial_number": ": fast; contacts differ from those of slow drags"
        if numbers["inertial_number"] > FAST
        else ": slow; the drag hardly depends on the speed",
    }
    return [
        (words.get(name, name.replace("_", " ")), f"{value:.4g}{means.get(name, '')}")
        for name, value in numbers.items()
        if name != "particles"
    ]


def _gap(case: Case, gap_m: float) -> str:
    return f"{in_diameters(case, gap_m):.3g} particle diameters, {1e3 * gap_m:.3g} mm"


def _between(case: Case) -> list[tuple[str, str]]:
    """The least gap between two of several workpieces."""
    nearest = closest(of_each_workpiece(case), expected_bed(case.study))
    return [("gap between workpieces", _gap(case, nearest[0]))] if nearest else []


def _rotation(case: Case) -> list[tuple[str, str]]:
    """How the bowl rotates, if it does."""
    motion = case.study.motion
    if motion.bowl is not None:
        return [("motion of the bowl", motion.bowl.words())]
    rpm = motion.bowl_rad_s * 60 / math.tau
    sense = "counter-clockwise" if rpm > 0 else "clockwise"
    text = f"{abs(rpm):.4g} 1/min, {sense} seen from above; the workpiece stands still"
    return [("rotation of the bowl", text)] if rpm else []


def _speed(case: Case) -> str:
    speed, factor = fastest_surface(case), case.study.chosen_fidelity().speed_factor
    faster = "" if factor == 1 else f", {factor * speed:.3g} m/s in the run (speed_factor)"
    return f"{speed:.3g} m/s{faster}"


_SOFT_IMPACT = 0.025
"""Overlap of an impact over the diameter from which numbers and forces of single contacts are said
to depend on the reduced modulus; an assumption."""


def _impact(case: Case) -> str:
    """Overlap of two particles that meet at the speed of the workpiece."""
    scale = case.study.chosen_fidelity().youngs_modulus_scale
    particle = particle_material(case.study)
    modulus = effective_modulus(particle, particle, scale)
    overlap = impact_overlap(particle.density_kg_m3, modulus, case.axis_speed_m_s)
    text = f"{100 * overlap:.2g} % of a diameter, if two particles meet at the speed of the path"
    if overlap < _SOFT_IMPACT or scale == 1:
        return text
    return (
        f"{text}: numbers and forces of single contacts differ from those at the physical modulus "
        "more than the drag does"
    )


def bed_notes(case: Case) -> list[tuple[str, str]]:
    """What ``check`` says of a fill and a process: a heading and a text each."""
    return [("overlap", _overlap(case)), ("ranks", _ranks(case))]


def _overlap(case: Case) -> str:
    overlap = floor_overlap(case.study)
    verdict = "within" if overlap <= MOST_OVERLAP else "ABOVE"
    return (
        f"{100 * overlap:.2g} % of a diameter between particles at the floor, by the weight above: "
        f"{verdict} {100 * MOST_OVERLAP:g} % (an assumption)"
    )


def _ranks(case: Case) -> str:
    parts = rank_split(case, skin(case.study))
    if case.study.chosen_fidelity().ranks != "auto":
        return f"{case.ranks}, {parts}"
    cases = f"{case.beside} case{'s' if case.beside > 1 else ''}"
    return f"{case.ranks} (auto: {cases} on {cores_here()} cores), {parts}"


def not_corrected(case: Case) -> str:
    """What results with a reduced modulus lack; empty if nothing, or for a part of another case."""
    chosen = case.study.chosen_fidelity()
    if chosen.youngs_modulus_scale == 1 or chosen.windows is not None or case.part:
        return ""
    at_speed = f" ({SOFT_AT_SPEED})" if describe(case)["inertial_number"] > AT_SPEED else ""
    return (
        f"E x {chosen.youngs_modulus_scale:g} gives more and smaller contact forces than the "
        f"physical modulus, by amounts that differ from scene to scene{at_speed}, and the report "
        "does not correct them: fidelity: {tolerance: 0.1} measures them in this scene"
    )


def reduced(case: Case, clauses: int | None = None) -> str:
    """What stands for the machine of the study, and what that cannot give; empty if nothing does.

    Parameters
    ----------
    case : Case
    clauses : int, optional
        So many of the first; all by default.
    """
    said = [entry for entry in case.study.assumptions if entry.field.startswith("reduction.")]
    return "; ".join("; ".join(entry.why.split("; ")[:clauses]) for entry in said)
