"""What the inputs of the paper's study mean: its contacts, and its time steps by preset."""

import math
from pathlib import Path

import pandas as pd

from dragdeck.cases.bed import bed_rayleigh_time, bed_timestep, full_stiffness_number
from dragdeck.physics.contact_mechanics import (
    damping_ratio,
    effective_modulus,
    effective_shear,
    shear_modulus,
)
from dragdeck.project import Project
from dragdeck.records.stability import stable_step_law
from dragdeck.study.model import BUILT_IN_FIDELITIES

STUDY = Project(Path(__file__).resolve().parents[2]).cases("uhlmann2015")[0].study


def paper_contacts() -> pd.DataFrame:
    """Constants of the contacts with the physical Young's modulus."""
    rows = []
    media = STUDY.media.material
    particle = STUDY.materials[media]
    for other in STUDY.type_names():
        partner, restitution = STUDY.materials[other], STUDY.pair(media, other).restitution
        modulus, shear = effective_modulus(particle, partner), effective_shear(particle, partner)
        mean_shear = (shear_modulus(particle) + shear_modulus(partner)) / 2
        mean_ratio = (particle.poissons_ratio + partner.poissons_ratio) / 2
        rows.append(
            {
                "pair": f"{media}-{other}",
                "modulus_gpa": modulus / 1e9,
                "shear_gpa": shear / 1e9,
                "beta": damping_ratio(restitution),
                "tangential_stiffness_ratio": 8 * shear / (2 * modulus),
                "dashpot_ratio": math.sqrt(8 * shear / (2 * modulus)),
                "paper_stiffness_ratio": 4 * mean_shear / (2 - mean_ratio) / (8 * shear),
                "restitution": restitution,
            }
        )
    return pd.DataFrame(rows)


def paper_presets() -> pd.DataFrame:
    """Time steps, and the fraction at which the contacts are forecast to become unstable."""
    law = stable_step_law()
    media, motion, rows = STUDY.media, STUDY.motion, []
    restitution = STUDY.pair(media.material, media.material).restitution
    for name, fidelity in BUILT_IN_FIDELITIES.items():
        scaled = STUDY.model_copy(update={"fidelity": fidelity})
        stiffness = full_stiffness_number(scaled) * fidelity.youngs_modulus_scale ** (2 / 3)
        step = bed_timestep(scaled, "timestep_fraction")
        spread = media.radius_std_m / media.radius_mean_m
        rows.append(
            {
                "preset": name,
                "scale": fidelity.youngs_modulus_scale,
                "fraction": fidelity.timestep_fraction,
                "rayleigh_us": 1e6 * bed_rayleigh_time(scaled),
                "timestep_us": 1e6 * step,
                "million_steps": motion.path_length_m / motion.axis_speed_m_s / step / 1e6,
                "unstable_fraction": law.largest_fraction(stiffness, restitution, spread),
            }
        )
    return pd.DataFrame(rows)
