"""Tables of the pages of explanation: contact law, time steps, loads by stiffness."""

import math

import pandas as pd
from tables import ROOT, Store, derived

from dragchain.statistics.estimate import student_quantile
from dragdeck.cases.bed import bed_rayleigh_time, bed_timestep, full_stiffness_number
from dragdeck.physics.contact_mechanics import effective_modulus, effective_shear, shear_modulus
from dragdeck.physics.damping import damping_ratio, tangential_damping_ratio
from dragdeck.project import Project
from dragdeck.records.stability import StableStepLaw
from dragdeck.study.model import BUILT_IN_FIDELITIES, Study
from evidence.contact_law.impact import limited_restitution

ENTERED = (0.05, 0.1, 0.3, 0.5, 0.68, 0.86, 0.95, 1.0)


def _study() -> Study:
    return Project(ROOT).cases("uhlmann2015")[0].study


@derived("study/effective_restitution")
def _restitution(store: Store) -> pd.DataFrame:
    """Effective restitution with limitForce on, by the closed form."""
    return pd.DataFrame({"entered": e, "effective": limited_restitution(e)} for e in ENTERED)


@derived("study/uhlmann2015/contacts")
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


@derived("study/uhlmann2015/timesteps")
def _presets(store: Store) -> pd.DataFrame:
    """Time steps of uhlmann2015 by preset, and the step at which its contacts become unstable."""
    study, rows = _study(), []
    law = StableStepLaw.model_validate(store.record("stable_step")["stable_step"])
    restitution = study.pair(study.media.material, study.media.material).restitution
    spread = study.media.radius_std_m / study.media.radius_mean_m
    duration_s = study.motion.path_length_m / study.motion.axis_speed_m_s
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
                "million_steps": duration_s / step / 1e6,
                "unstable_fraction": law.largest_fraction(kappa, restitution, spread),
            }
        )
    return pd.DataFrame(rows)


@derived("loading/stiffness")
def _stiffness(store: Store) -> pd.DataFrame:
    """Loads at E x 0.001 (two packings) beside those at E x 1 (over packings)."""
    soft, full = store.table("loading/reduced_stiffness"), store.table("validation/load")
    names = ["value", "ci95_low", "ci95_high"]
    rows = soft[soft["packing"] == "first"][["label", "quantity", "unit"]].set_index("label")
    parts = {name: part for name, part in soft.groupby("packing")} | {"full": full}
    for name, part in parts.items():
        rows = rows.join(part.set_index("label")[names].add_prefix(f"{name}_"))
    return rows.reset_index()


@derived("loading/sampling_rates")
def _sampling(store: Store) -> pd.DataFrame:
    """Contact events per mm of path by sampling rate: the runs are not equally long."""
    rows = store.table("loading/sampling").copy()
    for name in ("reduced", "physical"):
        rows[f"{name}_per_mm"] = rows[f"events_{name}"] / rows[f"path_{name}_mm"]
    return rows


@derived("benchmarks/coverage_shown")
def _coverage(store: Store) -> pd.DataFrame:
    """One row per kind of interval and length, numbers with their intervals as text."""
    rows = store.table("benchmarks/coverage")
    shown = {
        "shown_length": "{length:d} {unit}",
        "shown_coverage": "{coverage:.1%} ({ci95_low:.1%} to {ci95_high:.1%})",
        "shown_reliable": "{reliable_coverage:.1%}",
    }
    texts = {
        name: [form.format(**row).replace("nan%", "none") for row in rows.to_dict("records")]
        for name, form in shown.items()
    }
    return rows.assign(**{name: [one.replace("%", " %") for one in t] for name, t in texts.items()})


@derived("timestep/law")
def _law(store: Store) -> pd.DataFrame:
    """The law of the stability number, its largest deviation upwards as a fraction."""
    found = store.table("stable_step/stable_step")
    return found.assign(largest_fraction=found["largest"].map(math.expm1))


@derived("study/student_quantiles")
def _quantiles(store: Store) -> pd.DataFrame:
    """Half-width of a 95 % interval in standard errors, by the number of packings."""
    return pd.DataFrame(
        {"packings": count, "quantile": student_quantile(count - 1)} for count in (2, 3, 4, 8)
    )
