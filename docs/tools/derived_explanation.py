"""Tables of the pages of explanation: numbers of the contact law, time steps, loads by stiffness."""

import math

import pandas as pd

from dragchain.contact_law.hertz import tangential_damping_ratio
from dragchain.statistics.estimate import student_quantile
from dragdeck.cases.bed import bed_rayleigh_time, bed_timestep, full_stiffness_number
from dragdeck.physics.contact_mechanics import effective_modulus, effective_shear, shear_modulus
from dragdeck.physics.damping import damping_ratio
from dragdeck.outlook.measured import measured_stiffness
from dragdeck.project import Project
from dragdeck.study.model import BUILT_IN_FIDELITIES, Study
from evidence.contact_law.impact import limited_restitution
from tables import ROOT, Store, derived

ENTERED = (0.05, 0.1, 0.3, 0.5, 0.68, 0.86, 0.95, 1.0)


def _study() -> Study:
    return Project(ROOT).cases("uhlmann2015")[0].study


@derived("contact_law/restitution")
def _restitution(store: Store) -> pd.DataFrame:
    """Effective restitution with limitForce on, by the closed form."""
    return pd.DataFrame({"entered": e, "effective": limited_restitution(e)} for e in ENTERED)


@derived("contact_law/pairs")
def _pairs(store: Store) -> pd.DataFrame:
    """Constants of the contacts of uhlmann2015 with the physical Young's modulus."""
    study, rows = _study(), []
    particle = study.materials[study.media.material]
    for other in study.type_names():
        partner, pair = study.materials[other], study.pair(study.media.material, other)
        modulus, shear = effective_modulus(particle, partner), effective_shear(particle, partner)
        mean_shear = (shear_modulus(particle) + shear_modulus(partner)) / 2
        mean_ratio = (particle.poissons_ratio + partner.poissons_ratio) / 2
        rows.append(
            {
                "pair": f"{study.media.material}-{other}",
                "modulus_gpa": modulus / 1e9,
                "shear_gpa": shear / 1e9,
                "beta": damping_ratio(pair.restitution),
                "tangential_stiffness_ratio": 8 * shear / (2 * modulus),
                "dashpot_ratio": math.sqrt(8 * shear / (2 * modulus)),
                "paper_stiffness_ratio": 4 * mean_shear / (2 - mean_ratio) / (8 * shear),
                "restitution": pair.restitution,
                "effective": limited_restitution(pair.restitution),
            }
        )
    assert math.isclose(rows[0]["dashpot_ratio"], tangential_damping_ratio(particle.poissons_ratio))
    return pd.DataFrame(rows)


@derived("timestep/presets")
def _presets(store: Store) -> pd.DataFrame:
    """Time steps of uhlmann2015 by preset, and the step at which its contacts become unstable."""
    study, law, rows = _study(), measured_stiffness().stable_step, []
    restitution = study.pair(study.media.material, study.media.material).restitution
    spread = study.media.radius_std_m / study.media.radius_mean_m
    for name, fidelity in BUILT_IN_FIDELITIES.items():
        scaled = study.model_copy(update={"fidelity": fidelity})
        scale = fidelity.youngs_modulus_scale
        kappa = full_stiffness_number(scaled) * scale ** (2 / 3)
        step = bed_timestep(scaled, "timestep_fraction")
        rows.append(
            {
                "preset": name,
                "scale": scale,
                "fraction": fidelity.timestep_fraction,
                "rayleigh_us": 1e6 * bed_rayleigh_time(scaled),
                "timestep_us": 1e6 * step,
                "million_steps": study.motion.path_length_m / study.motion.axis_speed_m_s / step / 1e6,
                "unstable_fraction": law.largest_fraction(kappa, restitution, spread),
            }
        )
    return pd.DataFrame(rows)


@derived("loading/stiffness")
def _stiffness(store: Store) -> pd.DataFrame:
    """Loads at E x 0.001 (two packings) beside those at E x 1 (over packings)."""
    soft, full = store.table("loading/reduced_stiffness"), store.table("validation/load")
    names = ["value", "ci95_low", "ci95_high"]
    rows = soft[soft["packing"] == 1][["label", "quantity", "unit"]].set_index("label")
    parts = [soft[soft["packing"] == packing].set_index("label")[names] for packing in (1, 2)]
    parts.append(full.set_index("label")[names])
    for prefix, part in zip(("first", "second", "full"), parts, strict=True):
        rows = rows.join(part.add_prefix(f"{prefix}_"))
    return rows.reset_index()


@derived("timestep/law")
def _law(store: Store) -> pd.DataFrame:
    """The law of the stability number, its largest deviation upwards as a fraction."""
    found = store.table("stiffness/stable_step")
    return found.assign(largest_fraction=found["largest"].map(math.expm1))


@derived("statistics/quantiles")
def _quantiles(store: Store) -> pd.DataFrame:
    """Half-width of a 95 % interval in standard errors, by the number of packings."""
    return pd.DataFrame(
        {"packings": count, "quantile": student_quantile(count - 1)} for count in (2, 3, 4, 8)
    )
