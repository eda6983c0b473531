"""Derived tables of the trade-off, simplified scenes, and scaling laws."""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import pandas as pd
from tables import LABELS, ROOT, Store, derived

from dragchain.report.page import MINUS
from dragchain.scaling.document import ScalingFile
from dragchain.scaling.fit import said
from dragchain.statistics.estimate import NORMAL_QUANTILE, student_quantile
from dragchain.statistics.power_law import Runs, fit_power_law
from dragchain.tradeoff.report import in_percent
from dragdeck.project import Project

FOLD = 2
"""Relative errors from this on are shown as multiples."""

Row = Mapping[str, Any]


# --- cells -------------------------------------------------------------------------------


def percent(value: float, digits: int = 1) -> str:
    """A fraction in per cent with its sign."""
    text = f"{100 * value:+.{digits}f}"
    return text if float(text) else text[1:]


def error_cell(error: Row, shown: Callable[[float], str] = percent, fold: float = FOLD) -> str:
    """An error with its interval in per cent; its interval alone if that includes zero.

    A table that was typed in has no value where the interval includes zero.
    """
    ends = f"({shown(error['ci95_low'])} to {shown(error['ci95_high'])})"
    if math.isnan(error["value"]) or error["ci95_low"] < 0 < error["ci95_high"]:
        return f"n.s. {ends}"
    if error["value"] >= fold:
        return f"{1 + error['value']:.0f}-fold"
    return f"{shown(error['value'])} {ends}"


def fold(ratio: float) -> str:
    """A saving with three digits."""
    return f"{float(f'{ratio:.3g}'):g}-fold"


def settings_cell(setting: Row) -> str:
    """The three settings in words."""
    text = f"E x {setting['youngs_modulus_scale']:g}, {100 * setting['timestep_fraction']:.3g} %"
    speed = setting["speed_factor"]
    return text if speed == 1 else f"{text}, speed x {speed:g}"


def _modulus_name(scale: float) -> str:
    """Column of a factor on Young's modulus: ``m2`` for 0.01."""
    return f"m{round(-math.log10(scale))}"


def _settings(store: Store) -> list[Row]:
    found: list[Row] = store.record("tradeoff")["settings"]
    return found


# --- trade-off -----------------------------------------------------------------------------


@derived("tradeoff/all_settings")
def _all_settings(store: Store) -> pd.DataFrame:
    """One row per setting: cost, and error of the mean drag."""
    rows = []
    for setting in _settings(store):
        error = setting["errors"].get("drag_mean")
        text = f"rejected: {setting['failed']:g} of {setting['runs']:g} runs"
        if error:
            ends = f"({percent(error['ci95_low'])} to {percent(error['ci95_high'])})"
            text = f"{percent(error['value'])} {ends}" + (
                ", **unstable**" if setting["breaks"] else ""
            )
        rows.append(
            {
                **{key: value for key, value in setting.items() if key != "errors"},
                "setting": settings_cell(setting),
                "saving": 1 / setting["relative_cost"],
                "bound": error["bound"] if error else math.nan,
                "error": text,
                **{f"drag_{key}": value for key, value in (error or {}).items()},
            }
        )
    return pd.DataFrame(rows)


@derived("tradeoff/modulus")
def _modulus(store: Store) -> pd.DataFrame:
    """One row per quantity: its errors by modulus, at 50 % of the Rayleigh time and speed x 1."""
    plain = [
        setting
        for setting in _settings(store)
        if setting["timestep_fraction"] == 0.5 and setting["speed_factor"] == 1
    ]
    rows = []
    for quantity in store.record("tradeoff")["quantities"]:
        row = {"quantity": quantity, "label": LABELS[quantity]}
        for setting in plain:
            name, error = (
                _modulus_name(setting["youngs_modulus_scale"]),
                setting["errors"][quantity],
            )
            row |= {f"{name}_{key}": value for key, value in error.items()}
            row[name] = error_cell(error)
        rows.append(row)
    return pd.DataFrame(rows)


@derived("tradeoff/speed")
def _speed(store: Store) -> pd.DataFrame:
    """One row per speed of the workpiece, at E x 0.01 and 50 % of the Rayleigh time."""
    inertial = store.record("tradeoff")["scene"]["inertial_number"]
    return pd.DataFrame(
        {
            "speed_factor": setting["speed_factor"],
            "inertial_number": inertial * setting["speed_factor"],
            **{name: error_cell(error) for name, error in setting["errors"].items()},
            **{f"{name}_value": error["value"] for name, error in setting["errors"].items()},
        }
        for setting in _settings(store)
        if (setting["youngs_modulus_scale"], setting["timestep_fraction"]) == (0.01, 0.5)
    )


@derived("tradeoff/scatter")
def _scatter(store: Store) -> pd.DataFrame:
    """One row per quantity: half-width of the 95 % CI of one run over the compared path."""
    return pd.DataFrame(
        {
            **one,
            "quantity": name,
            "label": LABELS[name],
            "half_width": NORMAL_QUANTILE * one["run_std"],
        }
        for name, one in store.record("tradeoff")["quantities"].items()
    )


@derived("tradeoff/unstable")
def _unstable(store: Store) -> pd.DataFrame:
    """One row: smallest and largest loss of drag at unstable time steps that no check rejected."""
    losses = [
        -setting["errors"]["drag_mean"]["value"]
        for setting in _settings(store)
        if setting["breaks"] and "drag_mean" in setting["errors"]
    ]
    return pd.DataFrame([{"smallest": min(losses), "largest": max(losses)}])


@derived("tradeoff/plain")
def _plain(store: Store) -> pd.DataFrame:
    """One row: cost of the plain input script at the physical modulus over the reference's."""
    found = store.record("tradeoff")
    plain = next(one["ratio"] for one in found["costs"] if one["name"] == "plain_full")
    base = next(
        one["relative_cost"]
        for one in found["settings"]
        if (one["youngs_modulus_scale"], one["timestep_fraction"], one["speed_factor"])
        == (0.01, 0.5, 1)
    )
    return pd.DataFrame([{"ratio": plain * base}])


@derived("tradeoff/further_shown")
def _further(store: Store) -> pd.DataFrame:
    """One row per simplification, with its CPU time per step."""
    costs = {one["name"]: one["per_step"] for one in store.record("tradeoff")["costs"]}
    return _cells(store.table("tradeoff/further")).assign(
        per_step=lambda rows: [costs.get(name, math.nan) for name in rows["cost"]]
    )


@derived("scenes/simplifications_shown")
def _simplifications(store: Store) -> pd.DataFrame:
    """One row per change of the scene."""
    return _cells(store.table("scenes/simplifications"))


@derived("scenes/simplifications_half_widths")
def _half_widths(store: Store) -> pd.DataFrame:
    """One row: half-widths of the CI of the mean drag, without coarse graining."""
    rows = store.table("scenes/simplifications")
    rows = rows[rows["relative_cpu_time"] > 0.5]
    half = (rows["drag_mean_ci95_high"] - rows["drag_mean_ci95_low"]) / 2
    return pd.DataFrame([{"low": half.min(), "high": half.max()}])


def _coarsely(value: float) -> str:
    return in_percent(value).replace(MINUS, "-")


def _cells(rows: pd.DataFrame) -> pd.DataFrame:
    """A column of text for each quantity that has an interval; empty if not measured."""
    shown = rows.copy()
    for name in [
        column.removesuffix("_ci95_low") for column in rows if column.endswith("_ci95_low")
    ]:
        shown[name] = [
            ""
            if math.isnan(row[f"{name}_ci95_low"])
            else error_cell(
                {key: row[f"{name}_{key}"] for key in ("value", "ci95_low", "ci95_high")},
                _coarsely,
                math.inf,
            )
            for row in rows.to_dict("records")
        ]
    return shown


# --- scaling laws -----------------------------------------------------------------------------


SWEEPS = {
    "drag-depth": ("depth of the tip", 1e3, "mm", 1),
    "drag-diameter": ("diameter of the workpiece", 1e3, "mm", 2),
    "drag-speed": ("speed", 1e3, "mm/s", 1),
    "drag-friction": ("friction of particle on workpiece", 1, "", 1),
}
"""Label, factor, unit, and what a level is multiplied by in the summary (a radius by two)."""


def _level(value: float, factor: float, unit: str) -> str:
    return f"{factor * value:.3g} {unit}".strip()


def _between(low: Row, high: Row, factor: float, unit: str) -> str:
    return f"{factor * low['x']:.3g} to {_level(high['x'], factor, unit)}"


def _with_interval(one: Row, form: Callable[[float], str]) -> str:
    return f"{form(one['value'])} ({form(one['ci95_low'])} to {form(one['ci95_high'])})"


def _two(value: float) -> str:
    return f"{value:.2f}".replace("-0.00", "0.00")


@derived("scaling/summary")
def _scaling(store: Store) -> pd.DataFrame:
    """One row per sweep: exponent, verdict, lack of fit, other forms, what changes beside it."""
    rows = []
    for study, (label, factor, unit, times) in SWEEPS.items():
        found = store.record(f"scaling/{study}")
        fit, levels = found["fit"], found["levels"]
        rejected = fit["lack_of_fit"] < 0.05
        confirmed = found["verdict"] == "confirmed"
        verdict = "confirmed, power law rejected" if confirmed and rejected else found["verdict"]
        row = {
            "study": study,
            "label": label,
            "levels": _between(levels[0], levels[-1], factor * times, unit),
            "runs": len(found["runs"]),
            "packings": len({run["seed"] for run in found["runs"]}),
            "expected": found["expected"]["exponent"],
            "exponent": _with_interval(fit["exponent"], _two),
            "verdict": verdict,
            "lack_of_fit": fit["lack_of_fit"],
            "eta": _with_interval(found["eta"], lambda value: f"{value:.1f}"),
            "per_decade": _with_interval(fit["change_per_decade"], lambda value: percent(value, 0)),
            "said": _said(found),
            "cpu_minutes": found["cpu_time_s"] / 60,
            "started": found["started"][:10],
            "engine": found["engine"],
        }
        for end, level in (("first", levels[0]), ("last", levels[-1])):
            row |= {
                f"{end}_{key}": value for key, value in level.items() if not isinstance(value, dict)
            }
        if found["shifted"]:
            offset, terms = found["shifted"]["offset"], found["two_terms"]
            diameter = 2e3 * _base().media.radius_mean_m
            row |= {
                "offset": _with_interval(
                    {key: 1e3 * times * value for key, value in offset.items()},
                    lambda value: f"{value:.1f}",
                ),
                "offset_particles": _with_interval(
                    {key: 1e3 * times * value / diameter for key, value in offset.items()},
                    lambda value: f"{value:.1f}",
                ),
                "offset_p": found["shifted"]["lack_of_fit"],
                "lower_power": _with_interval(
                    {key: 100 * value for key, value in terms["lower_fraction"].items()},
                    lambda value: f"{value:.0f}",
                ),
                "terms_p": terms["lack_of_fit"],
            }
        rows.append(row)
    return pd.DataFrame(rows)


def _said(found: Row) -> str:
    """The first statement that the command prints on a scaling."""
    text = said(ScalingFile.model_validate(found)).splitlines()[0].replace(MINUS, "-")
    return text.removeprefix(f"{found['field']}: ")


@derived("scaling/local")
def _local(store: Store) -> pd.DataFrame:
    """One row per pair of neighbouring levels of each sweep."""
    return pd.DataFrame(_local_rows(store))


def _local_rows(store: Store) -> Iterator[Row]:
    for study, (_, factor, unit, times) in SWEEPS.items():
        found = store.record(f"scaling/{study}")
        ends = zip(found["levels"], found["levels"][1:], found["local_exponents"], strict=False)
        for low, high, local in ends:
            yield {
                "study": study,
                "label": SWEEPS[study][0],
                "levels": _between(low, high, factor * times, unit),
                "exponent": _with_interval(local, _two),
            }


@derived("scaling/levels")
def _levels(store: Store) -> pd.DataFrame:
    """One row per level of each sweep."""
    rows = []
    for study, (_, factor, unit, times) in SWEEPS.items():
        for level in store.record(f"scaling/{study}")["levels"]:
            rows.append(
                {"study": study, "level": _level(level["x"], factor * times, unit), **level}
            )
    return pd.json_normalize(rows, sep="_")


@derived("scaling/common_scene")
def _common(store: Store) -> pd.DataFrame:
    """One row: the scene that is a level of every sweep, over all its packings."""
    base = _base()
    values = {
        "drag-depth": base.motion.immersion_depth_m,
        "drag-diameter": base.workpiece.shape.radius_m,
        "drag-speed": base.motion.speed_m_s,
        "drag-friction": base.pairs["ceramic-steel"].friction,
    }
    runs = [
        run
        for study, level in values.items()
        for run in store.record(f"scaling/{study}")["runs"]
        if math.isclose(run["level"], level)
    ]
    drag = np.array([run["drag_n"] for run in runs])
    eta = np.array([run["eta"] for run in runs])
    reach = student_quantile(len(runs) - 1) / math.sqrt(len(runs))
    return pd.DataFrame(
        [
            {
                "packings": len(runs),
                "drag_n": drag.mean(),
                "drag_half_width_n": reach * drag.std(ddof=1),
                "drag_std_n": drag.std(ddof=1),
                "standard_error_n": np.mean([run["standard_error_n"] for run in runs]),
                "eta": eta.mean(),
                "eta_half_width": reach * eta.std(ddof=1),
                "cpu_minutes": store.table("scaling/summary")["cpu_minutes"].sum(),
            }
        ]
    )


@derived("scaling/friction_first")
def _friction_first(store: Store) -> pd.DataFrame:
    """One row: exponent of the friction of the workpiece from its first four levels."""
    runs = [run for run in store.record("scaling/drag-friction")["runs"] if run["level"] < 1]
    drag = np.array([run["drag_n"] for run in runs])
    sample = Runs(
        np.array([run["level"] for run in runs]),
        drag,
        np.array([run["standard_error_n"] for run in runs]) / drag,
        [run["bed"] for run in runs],
    )
    return pd.DataFrame([vars(fit_power_law(sample).exponent)])


def _base() -> Any:
    return Project(ROOT).cases("uhlmann2015")[0].study


SOLID_FRACTION, STRESS_RATIO = 0.6, 0.6
"""Assumed in the estimates: solid fraction of the bed, horizontal over vertical stress."""


@derived("study/drag_estimates")
def _estimates(store: Store) -> pd.DataFrame:
    """One row, from inputs: friction on the tip, and Janssen's screening of the depth."""
    base = _base()
    depth, radius = base.motion.immersion_depth_m, base.workpiece.shape.radius_m
    friction = base.pairs["ceramic-steel"].friction
    weight = base.materials["ceramic"].density_kg_m3 * 9.81 * SOLID_FRACTION
    length = base.bowl.radius_m / (2 * friction * STRESS_RATIO)
    levels = np.unique(
        [case.study.motion.immersion_depth_m for case in Project(ROOT).cases("drag-depth")]
    )
    screened = levels - length * (1 - np.exp(-levels / length))
    return pd.DataFrame(
        [
            {
                "tip_n": friction * weight * depth * math.pi * radius**2,
                "length_mm": 1e3 * length,
                "exponent_change": np.polyfit(np.log(levels), np.log(screened), 1)[0] - 2,
            }
        ]
    )
