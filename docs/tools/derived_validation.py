"""Tables of the pages of evidence on validation, stability of the time step, and motion."""

import math

import numpy as np
import pandas as pd

from dragchain.statistics.estimate import Estimate, student_quantile
from dragdeck.cases.bed import full_stiffness_number
from dragdeck.outlook.measured import measured_stiffness
from dragdeck.physics.damping import damping_ratio
from dragdeck.project import Project
from evidence.validation.runs_by_bed import over_packings
from tables import ROOT, Store, derived

STATEMENTS = {
    "ahead_above_behind": "Forces ahead of the workpiece are far above those behind it",
    "network_ahead_above_behind": "The same in the contact network of the particles",
    "active_zone_reaches_far": "The active zone reaches far ahead",
    "forces_grow_with_depth": "Contact forces increase with depth",
    "most_intense_at_front": "Contacts are most intense at the front",
    "outer_surfaces_hit_hardest": "Surfaces facing the bowl wall are loaded most",
    "presence": "At a peak of the drag, the chain from workpiece to bowl is stronger than at other times.",
    "dominance": "It is stronger than the general increase of the forces around the workpiece explains.",
    "order": "The chain is stronger before the peak than after it.",
    "breaking": "The chain of a peak ends sooner than chains at other times.",
    "coverage": "Most peaks coincide with a strong chain.",
    "reverse": "Most strong chains coincide with a peak.",
    "orientation": "Chains at peaks share one orientation in the xy plane more than chains at other times.",
}
QUANTITIES = {
    "ahead_behind": "normal force on the workpiece, ratio ahead / behind",
    "network_ratio": "mean contact force in the corridor, ratio ahead / behind",
    "network_at_wall": "mean contact force, ratio at the bowl wall ahead / far from the workpiece",
    "depth_slope_n_per_m": "slope of the normal force per contact with depth",
    "deep_over_shallow": "mean contact force, ratio deepest / shallowest third",
    "front_over_flank": "normal force, ratio front quarter / the two eighths beside it",
    "outer_over_inner": "normal force, ratio outer / inner half",
    "strength": "chain strength",
    "strength_over_surroundings": "chain strength / RMS force around the workpiece",
    "strength_over_drag": "chain strength / drag (biased against the statement)",
    "before_minus_after": "chain strength before minus after the peak",
    "remaining_lifetime": "remaining lifetime of the chain",
    "coverage": "fraction of the peaks with a strong chain nearby",
    "reverse": "fraction of the strong chains with a peak nearby",
    "orientation": "resultant length of the azimuths (1: all parallel)",
}


def _worded(table: pd.DataFrame, column: str, words: dict[str, str]) -> pd.DataFrame:
    """The table with the name in a column in words, in the column ``words``."""
    return table.assign(words=[words[name] for name in table[column]])


# --- validation --------------------------------------------------------------------------------


@derived("validation/force")
def _force(store: Store) -> pd.DataFrame:
    """Mean and standard deviation of each force over the packings, one row per component."""
    packings, rows = store.table("validation/packings"), []
    for name in ("drag_n", "lateral_n", "vertical_n"):
        mean = over_packings(packings[f"{name}_mean"].to_list())
        std = over_packings(packings[f"{name}_std"].to_list(), ratio=True)
        parts = {"mean": mean, "std": std}
        rows.append(
            {"name": name}
            | {f"{part}_{key}": value for part, one in parts.items() for key, value in vars(one).items()}
        )
    return pd.DataFrame(rows).assign(path_mm=1000 * packings["arc_m"].mean())


@derived("validation/settings")
def _settings(store: Store) -> pd.DataFrame:
    """Other settings: effect on the mean drag, and on its standard deviation (``std_``)."""
    effects = store.table("validation/effects")
    others = effects[effects["field"].isna()]
    means, stds = (others[others["quantity"] == name] for name in ("drag_mean", "drag_std"))
    return means.reset_index(drop=True).join(
        stds[["change", "ci95_low", "ci95_high"]].reset_index(drop=True).add_prefix("std_")
    )


@derived("validation/inputs")
def _inputs(store: Store) -> pd.DataFrame:
    """Unreported inputs and their effect on the mean drag."""
    effects = store.table("validation/effects")
    return effects[effects["field"].notna() & (effects["quantity"] == "drag_mean")]


@derived("validation/claims")
def _claims(store: Store) -> pd.DataFrame:
    table = store.table("validation/statements")
    statements = _worded(table, "statement", STATEMENTS)["words"]
    return _worded(table, "number", QUANTITIES).assign(said=statements)


@derived("validation/peak_verdicts")
def _peak_verdicts(store: Store) -> pd.DataFrame:
    return _worded(store.table("validation/peak_statements"), "statement", STATEMENTS)


@derived("validation/peak_differences")
def _peak_differences(store: Store) -> pd.DataFrame:
    """The tests with an effect in standard deviations."""
    table = _worded(store.table("validation/peak_tests"), "test", QUANTITIES)
    return table[table["effect"].notna()]


@derived("validation/peak_fractions")
def _peak_fractions(store: Store) -> pd.DataFrame:
    """The tests of fractions and of the orientation."""
    table = _worded(store.table("validation/peak_tests"), "test", QUANTITIES)
    return table[table["effect"].isna()]


# --- stability ---------------------------------------------------------------------------------

REGIMES = {
    "impact": "single impacts",
    "settle": "settling",
    "column": "packing at rest under a load",
    "drag": "slow drag",
}


@derived("stability/limits")
def _limits(store: Store) -> pd.DataFrame:
    return _worded(store.table("stability/regimes"), "name", REGIMES)


def _span(low: float, high: float, form: str) -> str:
    """A range, or one value if both ends are the same; nothing without a value."""
    if math.isnan(low):
        return ""
    ends = [form.format(edge).replace("-0 %", "0 %").replace("+0 %", "0 %") for edge in (low, high)]
    return ends[0] if ends[0] == ends[1] else f"{ends[0]} to {ends[1]}"


@derived("stability/detected")
def _detected(store: Store) -> pd.DataFrame:
    """Runs and how the check judged them, with number and error as ranges."""
    table = store.table("stability/detection")
    numbers = [
        f"{row.number:.2f}" + (f" ({row.range_low:.2f} to {row.range_high:.2f})" if row.range_low > 0 else "")
        if row.number > 0
        else _span(row.range_low, row.range_high, "{:.2f}")
        for row in table.itertuples()
    ]
    errors = [
        row.lost if isinstance(row.lost, str) else _span(100 * row.error_low, 100 * row.error_high, "{:+.0f} %")
        for row in table.itertuples()
    ]
    return table.assign(numbers=numbers, errors=errors)


@derived("stability/forecasts")
def _forecasts(store: Store) -> pd.DataFrame:
    """Forecast and measured stability numbers, with the relative error of the forecast."""
    table, law = store.table("stability/forecast"), measured_stiffness().stable_step
    study = Project(ROOT).cases("uhlmann2015")[0].study
    restitution = study.pair(study.media.material, study.media.material).restitution
    spread = study.media.radius_std_m / study.media.radius_mean_m
    u = table["timestep_fraction"] / (
        full_stiffness_number(study) * table["youngs_modulus_scale"] ** (2 / 3)
    ) ** 0.25
    squared = law.stiffness * u**2 + law.damping * damping_ratio(restitution) * u
    table = table.assign(forecast=np.sqrt(squared) * math.exp(law.spread * spread))
    middle = (table["measured_low"] + table["measured_high"]) / 2
    spans = [_span(row.measured_low, row.measured_high, "{:.2f}") for row in table.itertuples()]
    return table.assign(measured=spans, error=table["forecast"] / middle - 1)


@derived("stability/forecast_error")
def _forecast_error(store: Store) -> pd.DataFrame:
    errors = store.table("stability/forecasts")["error"]
    return pd.DataFrame([{"lowest": errors.min(), "highest": errors.max()}])


@derived("stability/law")
def _law(store: Store) -> pd.DataFrame:
    """The law of the stability number: constants, scatter, largest deviation upwards."""
    law = dict(store.record("stiffness")["stable_step"])
    kappa, restitution = law.pop("stiffness_numbers"), law.pop("restitutions")
    numbers = {"kappa_low": kappa[0], "kappa_high": kappa[1]}
    numbers |= {"restitution_low": restitution[0], "restitution_high": restitution[1]}
    return pd.DataFrame([law | numbers | {"upwards": math.expm1(law["largest"])}])


# --- motion ------------------------------------------------------------------------------------

SPIN_PACKINGS = 3
"""Of each level of the spin."""


def _drags(store: Store, study: str, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean drag of every workpiece, and the half-width of its interval."""
    table = store.table("motion/carousel")
    chosen = table[(table["study"] == study) & table["case"].str.contains(f"count-{count}")]
    half = (chosen["drag_ci95_high_n"] - chosen["drag_ci95_low_n"]) / 2
    return chosen["drag_mean_n"].to_numpy(), half.to_numpy()


@derived("motion/neighbours")
def _neighbours(store: Store) -> pd.DataFrame:
    """Three workpieces beside a single one: difference and ratio of the mean drag, per study."""
    rows = []
    for study in ("carousel", "carousel-wide"):
        (three, half_three), (one, half_one) = _drags(store, study, 3), _drags(store, study, 1)
        errors = [np.sqrt((half**2).sum()) / half.size for half in (half_three, half_one)]
        change = Estimate.around(float(three.mean() - one.mean()), math.hypot(*errors))
        ratio = three.mean() / one.mean()
        half_ratio = abs(ratio) * math.hypot(errors[0] / three.mean(), errors[1] / one.mean())
        rows.append(
            {"study": study, "change": ratio - 1, "change_low": ratio - 1 - half_ratio}
            | {"change_high": ratio - 1 + half_ratio, **vars(change)}
        )
    return pd.DataFrame(rows)


@derived("motion/workpieces")
def _workpieces(store: Store) -> pd.DataFrame:
    """One row per workpiece, with its arrangement in words."""
    table = store.table("motion/carousel")
    cases = table["case"]
    count = cases.str.extract(r"count-(\d)")[0].map({"1": "one", "3": "three"})
    return table.assign(
        count=count,
        workpiece=cases.str.extract(r"workpiece-(\d)")[0].fillna(""),
        packing=cases.str.extract(r"seed-(\d)")[0].fillna("1"),
    )


@derived("motion/spins")
def _spins(store: Store) -> pd.DataFrame:
    """Drag, lateral force and torque against the spin ratio, with 95 % intervals over the packings."""
    table = store.table("motion/spin")
    times = student_quantile(SPIN_PACKINGS - 1)
    halves = {
        f"{name}_half": times * table[error]
        for name, error in (
            ("drag", "drag_se_n"), ("lateral", "lateral_se_n"), ("torque", "torque_se_mn_m"),
        )
    }
    return table.assign(**halves, change=table["drag_n"] / table["drag_n"].iloc[0] - 1)
