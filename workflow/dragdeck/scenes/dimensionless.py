"""The dimensionless numbers of a process scene."""

from dragdeck.cases.bed import full_stiffness_number, particle_material, tip_pressure
from dragdeck.cases.case import Case, of_each_workpiece
from dragdeck.physics.contact_mechanics import inertial_number
from dragdeck.scenes.workpiece import fastest_surface, workpiece_radius
from dragdeck.study.contact_law import compared_numbers


def describe(case: Case) -> dict[str, float]:
    """The numbers of a case's scene at full modulus and at the study's own speed.

    Pressure is that of the bed at the depth of the workpiece's tip; the shear is that
    of the workpiece's highest surface speed over one particle diameter. ``superposed_speed``, the
    difference of this speed and the mean speed along the path divided by the latter, is absent
    without superposed motions on a path of one speed; ``bowl_froude_number``, the centripetal
    acceleration at the bowl's wall over gravity, is absent if the bowl stands still, and so are
    ``tilt_deg`` without a tilt and ``further_workpieces`` of a single one. Other ratios
    are diameters, or the depth, over the mean diameter of a particle.
    """
    study = case.study
    particle, diameter = particle_material(study), 2 * study.media.radius_mean_m
    motion = study.motion
    speed = fastest_surface(case)
    rate = speed / diameter
    added = speed / motion.axis_speed_m_s - 1
    superposed = {"superposed_speed": added} if motion.superposed() or added > 1e-9 else {}
    froude = motion.bowl_rad_s**2 * study.bowl.radius_m / study.gravity_m_s2
    rotation = {"bowl_froude_number": froude} if froude else {}
    tilt = {"tilt_deg": abs(motion.tilt_deg)} if motion.tilt_deg else {}
    others = len(of_each_workpiece(case.all_workpieces)) - 1
    further = {"further_workpieces": float(others)} if others else {}
    names = study.media.material, study.workpiece.material
    return {
        "stiffness_number": full_stiffness_number(study),
        "inertial_number": inertial_number(
            rate, diameter, particle.density_kg_m3, tip_pressure(study)
        ),
        "workpiece_to_particle": 2 * workpiece_radius(case) / diameter,
        "depth_to_particle": motion.immersion_depth_m / diameter,
        "bowl_to_particle": 2 * study.bowl.radius_m / diameter,
        **compared_numbers(
            study.pair(names[0], names[0]), study.pair(*names), study.pairs.values()
        ),
        **superposed,
        **rotation,
        **tilt,
        **further,
        "particles": study.media.count,
    }
