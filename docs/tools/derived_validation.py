"""Tables of the pages of evidence on validation, stability of the time step, and motion."""

import math

import numpy as np
import pandas as pd
from tables import ROOT, Store, derived

from dragchain.statistics.estimate import Estimate, student_quantile
from dragdeck.cases.bed import full_stiffness_number
from dragdeck.physics.damping import damping_ratio
from dragdeck.project import Project
from evidence.validation.runs import over_packings

STATEMENTS = {
    "ahead_above_behind": "Forces ahead of the workpiece are far above those behind it",
    "network_ahead_above_behind": "The same in the contact network of the particles",
    "active_zone_reaches_far": "The active zone reaches far ahead",
    "forces_grow_with_depth": "Contact forces increase with depth",
    "most_intense_at_front": "Contacts are most intense at the front",
    "outer_surfaces_hit_hardest": "Surfaces facing the bowl wall are loaded most",
    "presence": "At a drag peak, the chain from workpiece to bowl is stronger than at other times.",
    "dominance": "It is stronger than the general rise of forces around the workpiece explains.",
    "order": "The chain is stronger before the peak than after it.",
    "breaking": "The chain of a peak ends sooner than chains at other times.",
    "coverage": "Most peaks coincide with a strong chain.",
    "reverse": "Most strong chains coincide with a peak.",
    "orientation": "Chains at peaks share one orientation in the xy plane more than others.",
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
    "orientation": "resultant length of the azimuths (one: all parallel)",
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
        numbers = [
            (f"{part}_{key}", value)
            for part, one in (("mean", mean), ("std", std))
            for key, value in vars(one).items()
        ]
        rows.append({"name": name, **dict(numbers)})
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


@derived("verification/shown")
def _verification(store: Store) -> pd.DataFrame:
    """The results, with the numbers of the tests, and with what a row is about in words."""
    table, rows = store.table("verification/results"), []
    for row in table.itertuples():
        numbers = (
            f"{row.test:g}" if row.test == row.last_test else f"{row.test:g}, {row.last_test:g}"
        )
        steps = (
            f", {row.steps_per_contact:g} steps per contact" if row.steps_per_contact > 0 else ""
        )
        order = f" ({row.order:g} for an expected 1)" if row.order > 0 else ""
        rows.append({"tests": numbers, "about": f"{row.quantity}{steps}{order}"})
    return table.join(pd.DataFrame(rows))


@derived("verification/excess")
def _excess(store: Store) -> pd.DataFrame:
    """Excess of the tangential impulse as a range."""
    table = store.table("verification/coulomb_excess")
    lowest, bounds = table["excess_low"].fillna(table["excess_high"]), table["bound"].fillna("")
    spans = [
        f"{bound} {_span(100 * low, 100 * high, '{:g} %')}".strip()
        for bound, low, high in zip(bounds, lowest, table["excess_high"], strict=True)
    ]
    remarks = [f"({remark})" if isinstance(remark, str) else "" for remark in table["remark"]]
    return table.assign(excess=spans, remark=remarks)


# --- calibration -------------------------------------------------------------------------------


@derived("calibration/rebounds")
def _rebounds(store: Store) -> pd.DataFrame:
    """Effective by entered restitution, one column per fidelity, purpose and contact option."""
    table = store.table("calibration/bias")
    limit = table["limit_force"].map({True: "limited", False: "unlimited"})
    columns = table["fidelity"] + "_" + table["purpose"] + "_" + limit
    wide = table.assign(column=columns).pivot(
        index="restitution_entered", columns="column", values="restitution_effective"
    )
    return wide.dropna().reset_index()


@derived("calibration/put_for")
def _put_for(store: Store) -> pd.DataFrame:
    """The value to enter by settings, with the contact option in words."""
    table = store.table("calibration/entered_values")
    full = table["purpose"] == "reference"
    return table.assign(
        limit=table["limit_force"].map({True: "on", False: "off"}),
        settings=table["fidelity"].map("`{}`".format).mask(full, "physical modulus, small step"),
    )


@derived("calibration/scatter")
def _scatter(store: Store) -> pd.DataFrame:
    """Largest deviation of a single production impact from the mean, per fidelity."""
    table = store.table("calibration/bias")
    limited = table[(table["purpose"] == "production") & table["limit_force"]]
    highest = limited["highest"] - limited["restitution_effective"]
    lowest = limited["restitution_effective"] - limited["lowest"]
    largest = pd.Series(np.maximum(highest, lowest)).groupby(limited["fidelity"]).max()
    elastic = limited[limited["restitution_entered"] == 1].set_index("fidelity")["highest"]
    return pd.DataFrame({"largest": largest, "elastic": elastic}).reset_index()


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
    numbers, errors = [], []
    for row in table.itertuples():
        span = _span(row.range_low, row.range_high, "{:.2f}")
        around = f" ({span})" if span else ""
        numbers.append(f"{row.number:.2f}{around}" if row.number > 0 else span)
        error = _span(100 * row.error_low, 100 * row.error_high, "{:+.0f} %")
        errors.append(row.lost if isinstance(row.lost, str) else error)
    return table.assign(numbers=numbers, errors=errors)


@derived("stability/observed")
def _observed(store: Store) -> pd.DataFrame:
    """Observables of runs with a correct drag and with a wrong one, as ranges."""
    table = store.table("stability/observables")
    texts = {"correct": [], "wrong": []}
    for row in table.to_dict("records"):
        for kind, cells in texts.items():
            low, high = row[f"{kind}_low"], row[f"{kind}_high"]
            cells.append(_range(low, high) + _fast(row.get(f"{kind}_fast", math.nan)))
    return table.assign(**texts)


def _range(low: float, high: float) -> str:
    if math.isnan(low):
        return f"up to {high:g}"
    return f"from {low:g}" if math.isnan(high) else f"{low:g} to {high:g}"


def _fast(value: float) -> str:
    return "" if math.isnan(value) else f"; {value:g} at ten times the speed"


@derived("stability/forecasts")
def _forecasts(store: Store) -> pd.DataFrame:
    """Forecast and measured stability numbers, with the relative error of the forecast."""
    table, law = store.table("stability/forecast"), store.record("stable_step")["stable_step"]
    study = Project(ROOT).cases("uhlmann2015")[0].study
    restitution = study.pair(study.media.material, study.media.material).restitution
    spread = study.media.radius_std_m / study.media.radius_mean_m
    u = (
        table["timestep_fraction"]
        / (full_stiffness_number(study) * table["youngs_modulus_scale"] ** (2 / 3)) ** 0.25
    )
    squared = law["stiffness"] * u**2 + law["damping"] * damping_ratio(restitution) * u
    table = table.assign(forecast=np.sqrt(squared) * math.exp(law["spread"] * spread))
    middle = (table["measured_low"] + table["measured_high"]) / 2
    spans = [_span(row.measured_low, row.measured_high, "{:.2f}") for row in table.itertuples()]
    return table.assign(measured=spans, error=table["forecast"] / middle - 1)


@derived("stability/forecast_error")
def _forecast_error(store: Store) -> pd.DataFrame:
    errors = store.table("stability/forecasts")["error"]
    return pd.DataFrame([{"lowest": errors.min(), "highest": errors.max()}])


@derived("stability/engine_minutes")
def _engine_minutes(store: Store) -> pd.DataFrame:
    return pd.DataFrame({"minutes": store.table("stability")["engine_wall_time_s"] / 60})


# --- motion ------------------------------------------------------------------------------------

SPIN_PACKINGS = 3
"""Of each level of the spin."""

ORDINALS = {"1": "first", "2": "second", "3": "third"}


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
    """One row per workpiece: how many there are, its number, its packing."""
    table = store.table("motion/carousel")
    cases, ratio = table["case"], "drag_wake_ratio"
    return table.assign(
        count=cases.str.extract(r"count-(\d)")[0].map({"1": "single", "3": "of three"}),
        workpiece=cases.str.extract(r"workpiece-(\d)")[0].fillna("1").map(ORDINALS),
        packing=cases.str.extract(r"seed-(\d)")[0].fillna("1").map(ORDINALS),
        wake=[
            "" if math.isnan(value) else f"{value:.2f} ({low:.2f} to {high:.2f})"
            for value, low, high in table[
                [ratio, f"{ratio}_ci95_low", f"{ratio}_ci95_high"]
            ].to_numpy()
        ],
    )


@derived("study/carousel_gaps")
def _gaps(store: Store) -> pd.DataFrame:
    """Clear distance between three workpieces at equal angles, in particle diameters."""
    rows = []
    for name in ("carousel", "carousel-wide"):
        study = Project(ROOT).cases(name)[0].study
        apart = math.sqrt(3.0) * study.motion.path.radius_m - 2 * study.workpiece.shape.radius_m
        rows.append({"study": name, "gap_diameters": apart / (2 * study.media.radius_mean_m)})
    return pd.DataFrame(rows)


@derived("motion/spins")
def _spins(store: Store) -> pd.DataFrame:
    """Drag, lateral force and torque against the spin ratio, with 95 % intervals."""
    table = store.table("motion/spin")
    times = student_quantile(SPIN_PACKINGS - 1)
    halves = {
        f"{name}_half": times * table[error]
        for name, error in (
            ("drag", "drag_se_n"),
            ("lateral", "lateral_se_n"),
            ("torque", "torque_se_mn_m"),
        )
    }
    return table.assign(**halves, change=table["drag_n"] / table["drag_n"].iloc[0] - 1)


@derived("validation/packings_total")
def _packings_total(store: Store) -> pd.DataFrame:
    """One row: the runs with the physical Young's modulus and their CPU time."""
    runs = store.table("validation/packings")
    return pd.DataFrame([{"runs": len(runs), "cpu_time_h": runs["cpu_time_s"].sum() / 3600}])
