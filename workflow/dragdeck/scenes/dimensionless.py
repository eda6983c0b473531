"""The dimensionless numbers of a process scene."""

from dragdeck.cases.bed import particle_material
from dragdeck.cases.case import Case
from dragdeck.physics.contact_mechanics import bed_pressure, inertial_number, stiffness_number
from dragdeck.scenes.workpiece import workpiece_radius
from dragdeck.study.contact_law import compared_numbers


def describe(case: Case) -> dict[str, float]:
    """The numbers of a case's scene at full modulus and at the study's own speed.

    Pressure is that of the bed at the depth of the workpiece's tip; the shear is that
    of the workpiece's speed over one particle diameter. Ratios are diameters, or the
    depth, over the mean diameter of a particle.
    """
    study = case.study
    particle, diameter = particle_material(study), 2 * study.media.radius_mean_m
    motion = study.motion
    pressure = bed_pressure(particle.density_kg_m3, study.gravity_m_s2, motion.immersion_depth_m)
    rate = motion.speed_m_s / diameter
    names = study.media.material, study.workpiece.material
    return {
        "stiffness_number": stiffness_number(particle, pressure),
        "inertial_number": inertial_number(rate, diameter, particle.density_kg_m3, pressure),
        "workpiece_to_particle": 2 * workpiece_radius(case) / diameter,
        "depth_to_particle": motion.immersion_depth_m / diameter,
        "bowl_to_particle": 2 * study.bowl.radius_m / diameter,
        **compared_numbers(
            study.pair(names[0], names[0]), study.pair(*names), study.pairs.values()
        ),
        "particles": study.media.count,
    }
