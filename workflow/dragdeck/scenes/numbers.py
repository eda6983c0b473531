"""The dimensionless numbers of a process scene."""

from __future__ import annotations

from dragdeck.cases import Case
from dragdeck.derive import bed_pressure, inertial_number, stiffness_number
from dragdeck.scenes.common import ball_material
from dragdeck.scenes.tool import tool_radius


def describe(case: Case) -> dict[str, float]:
    """The numbers of a case's scene at full modulus and at the study's own speed.

    Pressure is that of the bed at the depth of the tool's tip; the shear is that
    of the tool's speed over one ball diameter. Ratios are diameters, or the
    depth, over the mean diameter of a ball.
    """
    study = case.study
    ball, diameter = ball_material(study), 2 * study.media.radius_mean_m
    motion = study.motion
    pressure = bed_pressure(ball.density_kg_m3, study.gravity_m_s2, motion.submersion_m)
    rate = motion.speed_m_s / diameter
    names = study.media.material, study.workpiece.material
    return {
        "stiffness_number": stiffness_number(ball, pressure),
        "inertial_number": inertial_number(rate, diameter, ball.density_kg_m3, pressure),
        "tool_to_ball": 2 * tool_radius(case) / diameter,
        "depth_to_ball": motion.submersion_m / diameter,
        "bowl_to_ball": 2 * study.bowl.radius_m / diameter,
        "ball_friction": study.pair(names[0], names[0]).friction,
        "tool_friction": study.pair(*names).friction,
        "lowest_restitution": min(pair.restitution for pair in study.pairs.values()),
        "balls": study.media.count,
    }
