"""The dimensionless numbers by which scenes are compared, and the buoyancy of a workpiece."""

from dragdeck.cases import bed as beds
from dragdeck.cases.case import Case, of_each_workpiece
from dragdeck.mesh.surface import volume_below
from dragdeck.physics.contact_mechanics import inertial_number
from dragdeck.scenes.moving_bowl import path_tilt_deg
from dragdeck.scenes.workpiece import (
    fastest_surface,
    reference_height,
    workpiece_mesh,
    workpiece_radius,
)
from dragdeck.study.contact_law import compared_numbers


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
    particle, diameter = beds.particle_material(study), 2 * study.media.typical_radius_m
    motion = study.motion
    speed = fastest_surface(case)
    rate = speed / diameter
    added = speed / motion.nominal_speed_m_s - 1
    superposed = {"superposed_speed": added} if motion.superposed() or added > 1e-9 else {}
    acceleration = beds.weight_acceleration(study)
    optional = {
        "bowl_froude_number": motion.bowl_rad_s**2 * study.bowl.container.reach_m / acceleration,
        "surface_tilt_deg": path_tilt_deg(study),
        "tilt_deg": abs(motion.tilt_deg or 0.0),
        "submerged_weight_ratio": acceleration / study.gravity_m_s2 if study.compound else 0.0,
        "further_workpieces": float(len(of_each_workpiece(case.all_workpieces)) - 1),
    }
    names = study.media.main_material, study.workpiece.material
    return {
        "stiffness_number": beds.full_stiffness_number(study),
        "inertial_number": inertial_number(
            rate, diameter, particle.density_kg_m3, beds.tip_pressure(study)
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
