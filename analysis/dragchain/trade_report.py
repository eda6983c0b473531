"""Tables, figures, ``trade.json`` and page of the trade of speed against accuracy."""

from __future__ import annotations

import json
import math
import os
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np

from dragchain.figures import STYLE, png
from dragchain.frames import write_parquet
from dragchain.measures import LONG_WAVE, SHORT_WAVE, Quantity
from dragchain.notation import DASH, MINUS, number
from dragchain.page import data_uri, render_page
from dragchain.parquet import write_json
from dragchain.trade import (
    ADDITIVE_LEVEL,
    CONFIDENCE,
    KNOBS,
    OTHER,
    TOLERANCES,
    Comparison,
    Error,
    Run,
    Setting,
    Trade,
    along,
    breaks,
    compare,
    error_table,
    read_runs,
    run_table,
)
from dragchain.trade_figures import FLOOR, draw
from dragchain.trade_findings import (
    MAIN,
    RUINED,
    TOGETHER,
    TRIALS,
    Choice,
    Costs,
    Drop,
    Gain,
    Reach,
    Softness,
    SpeedUp,
    choose,
    choose_drop,
    coverage,
    gains,
    hub,
    modulus_levels,
    reaches,
    read_costs,
    read_drops,
    softness,
    step_costs,
)

TRADE_SCHEMA = 1
NOT_RESOLVED = "not resolved"
FOLD = 2.0
"""Relative errors from this on are told as multiples."""


KNOB_NAMES = {
    "youngs_modulus_scale": "modulus",
    "timestep_fraction": "time step",
    "speed_factor": "speed of the tool",
    OTHER: "other",
}


@dataclass(frozen=True)
class Findings:
    """All that tables, figures and page are made of.

    Attributes
    ----------
    trade : Trade
    drops : list of Drop
    costs : Costs
    checks : list of dict
        What `dragchain.checks` wrote.
    provenance : dict
        Head of ``trade.json``.
    """

    trade: Trade
    drops: list[Drop]
    costs: Costs
    checks: list[dict[str, Any]]
    provenance: dict[str, Any]


def write_trade(
    out_dir: Path,
    measures: Sequence[Path],
    reference_run: Path,
    drops: Sequence[Path] = (),
    costs: Path | None = None,
    checks: Path | None = None,
    plan: str = "",
    commands: Sequence[str] = ("snakemake trade",),
    largest_step: float = math.inf,
) -> None:
    """Write tables, figures and page of a trade whose runs were measured.

    Parameters
    ----------
    out_dir : Path
        Gets ``runs.csv``, ``runs.parquet``, ``errors.csv``, ``errors.parquet``,
        ``trade.json``, ``figures/*.png`` and ``report.html``.
    measures : sequence of Path
        ``measures.json`` of every run, that of the reference among them.
    reference_run : Path
        Folder of a run at the reference.
    drops : sequence of Path
        Folders of drop tests, with their tables.
    costs : Path, optional
        Costs of what the decks leave out.
    checks : Path, optional
        ``checks.json`` of promises on other scenes.
    plan : str
        Name of the plan.
    largest_step : float
        Over the Rayleigh time: no setting with a larger one is recommended.
    commands : sequence of str
        What the user typed, for ``trade.json``.

    Raises
    ------
    TableError
        A file was written by another version, no run is complete, or a drop cannot be used.
    """
    priced = read_costs(costs)
    trade = compare(*read_runs(measures, reference_run), step_costs(priced), largest_step)
    found = Findings(
        trade, read_drops(drops), priced, _read_checks(checks), provenance(trade, plan, commands)
    )
    out_dir.mkdir(parents=True, exist_ok=True)
    for name, table in (("runs", run_table(trade)), ("errors", error_table(trade))):
        write_parquet(table, out_dir / f"{name}.parquet")
        table.to_csv(out_dir / f"{name}.csv", index=False, lineterminator="\n")
    with matplotlib.rc_context(STYLE):
        drawn = draw(trade, reaches(trade), found.drops)
        pictures = {name: png(figure) for name, figure in drawn.items()}
    folder = out_dir / "figures"
    folder.mkdir(exist_ok=True)
    for name, picture in pictures.items():
        (folder / f"{name}.png").write_bytes(picture)
    write_json(out_dir / "trade.json", summarise(found))
    (out_dir / "report.html").write_text(render(found, pictures), encoding="utf-8")


def _read_checks(file: Path | None) -> list[dict[str, Any]]:
    if file is None:
        return []
    found: list[dict[str, Any]] = json.loads(file.read_text(encoding="utf-8"))["checks"]
    return found


def _check_row(check: Mapping[str, Any]) -> dict[str, Any]:
    scene = ", ".join(f"{name} {value}" for name, value in check["scene"].items())
    modulus, step, speed = (float(check[name]) for name in KNOBS)
    return {**check, "scene": scene or "other beds", "setting": Setting(modulus, step, speed)}


# --- trade.json ----------------------------------------------------------------------------------


def provenance(trade: Trade, plan: str, commands: Sequence[str]) -> dict[str, Any]:
    """When, with what and on what a trade was measured."""
    measures = [run.measures for run in trade.runs]
    return {
        "schema": TRADE_SCHEMA,
        "measured": max(one["started"] for one in measures)[:10],
        "commands": list(commands),
        "plan": plan,
        "study": ", ".join(sorted({one["study"] for one in measures})),
        "versions": {
            **{
                name: ", ".join(sorted({str(one["versions"][name]) for one in measures}))
                for name in ("dragdeck", "engine")
            },
            "python": platform.python_version(),
            "numpy": np.__version__,
        },
        "machine": {"cores": os.cpu_count(), "processor": _processor()},
        "runs": len(measures),
        "engine_hours": sum(one["cost"]["cpu_time_s"] for one in measures) / 3600.0,
    }


def _processor() -> str:
    file = Path("/proc/cpuinfo")
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def summarise(found: Findings) -> dict[str, Any]:
    """The content of ``trade.json``, which the advisor reads; a null is a number there is none of.

    An ``arc_m`` of a setting is the compared path of all its complete runs together;
    a ``restitution_error`` is that of the worst impact.
    """
    trade = found.trade
    content = {
        **found.provenance,
        "scene": _scene(trade),
        "reference": {name: getattr(trade.reference, name) for name in KNOBS},
        "quantities": {
            name: _quantity_entry(own, trade.arc_m) for name, own in trade.comparisons.items()
        },
        "settings": [_setting_entry(trade, one) for one in trade.settings() if not one.other],
        "drop": [
            {
                "timestep_fraction": drop.timestep_fraction,
                "restitution_error": drop.bound,
                "relative_cost": drop.relative_cost,
            }
            for drop in found.drops
            if not drop.other
        ],
        "costs": found.costs.entries,
        "checks": [
            {**check, "scene": check["numbers"], "met": check["met"]} for check in found.checks
        ],
    }
    return {name: _finite(value) for name, value in content.items()}


def _scene(trade: Trade) -> Mapping[str, Any]:
    numbers = [run.measures.get("numbers") for run in trade.of(trade.reference)]
    return next((own for own in numbers if own), {})


def _quantity_entry(comparison: Comparison, arc_m: float) -> dict[str, Any]:
    return {
        "label": long_label(comparison.quantity),
        "unit": comparison.quantity.unit,
        "signed": comparison.quantity.signed,
        "reference": comparison.reference,
        "standard_error": comparison.standard_error,
        "run_sd": comparison.run_sd,
        "arc_m": arc_m,
    }


def _setting_entry(trade: Trade, setting: Setting) -> dict[str, Any]:
    runs = trade.of(setting)
    complete = [run for run in runs if run.complete]
    return {
        **{name: getattr(setting, name) for name in KNOBS},
        "seeds": len({run.measures["inputs"]["seed"] for run in runs}),
        "runs": len(runs),
        "failed": len(runs) - len(complete),
        "arc_m": trade.arc_m * len(complete),
        "breaks": breaks(trade, setting),
        "relative_cost": trade.cost(setting),
        "errors": {
            name: {
                **vars(own.errors[setting]),
                "alone": own.alone(setting, trade.reference),
            }
            for name, own in trade.comparisons.items()
            if setting in own.errors
        },
    }


def _finite(value: Any) -> Any:
    """The same with None for every number that is not finite."""
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _finite(own) for key, own in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(own) for own in value]
    return value


# --- numbers in words ----------------------------------------------------------------------------


def percent(value: float, sign: bool = True) -> str:
    """A share in per cent with as many digits as matter."""
    size = abs(100.0 * value)
    digits = 0 if size >= 9.95 else 1 if size >= 0.095 else 2 if size >= 0.0095 else 3
    text = f"{100.0 * value:{'+' if sign else ''}.{digits}f}"
    text = text if float(text) else "0"
    return text.replace("-", MINUS)


def plainly(share: float) -> str:
    """A round share, such as a tolerance, in per cent."""
    return f"{100.0 * share:g}"


def interval(error: Error) -> str:
    """The interval of an error, in per cent; that of a large one in multiples."""
    if error.error >= FOLD:
        return f"{number(1.0 + error.low, 2)} to {number(1.0 + error.high, 2)}"
    return f"{percent(error.low)} to {percent(error.high)} %"


def times(ratio: float) -> str:
    """A ratio of costs with two digits."""
    return DASH if not math.isfinite(ratio) else number(float(f"{ratio:.2g}"), 2)


def cheaper(ratio: float) -> str:
    """A ratio of costs in words."""
    if ratio >= 1.0:
        return f"{times(ratio)} times cheaper"
    return f"{times(1.0 / ratio)} times dearer"


def span(gain: SpeedUp) -> str:
    """The interval of a ratio of costs; "one run" where there is none."""
    if math.isnan(gain.low):
        return "one run"
    return f"{times(gain.low)} to {times(gain.high)}"


def cell(error: Error | None) -> dict[str, str]:
    """An error as a cell of a table: text, interval and class."""
    if error is None:
        return {"text": DASH, "detail": "", "kind": ""}
    if not error.resolved:
        return {"text": NOT_RESOLVED, "detail": interval(error), "kind": "open"}
    size = abs(error.error)
    kind = "bad" if size > RUINED else "middling" if size > RUINED / 2.0 else "good"
    large = error.error >= FOLD
    text = f"{number(1.0 + error.error, 2)}-fold" if large else f"{percent(error.error)} %"
    return {"text": text, "detail": interval(error), "kind": kind}


def joined(names: Sequence[str]) -> str:
    """A list in words."""
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"


def long_label(quantity: Quantity) -> str:
    """A label that can stand alone; some in `QUANTITIES` lean on the one before."""
    return {
        "drag_sd_long": "drag variations over two ball diameters",
        "drag_sd_middle": "drag variations in between",
        "drag_sd_short": "drag variations under a quarter of a diameter",
        "contact_force_p50": "median force of a contact on the tool",
        "contact_force_p90": "90th percentile of the contact forces on the tool",
        "contact_force_p99": "99th percentile of the contact forces on the tool",
    }.get(quantity.name, quantity.label)


SHORT = {
    "drag_mean": "mean drag",
    "drag_sd": "sd of drag",
    "rod_contacts": "contacts on tool",
    "contact_force_mean": "mean contact force",
    "contact_force_p90": "90th per\N{SOFT HYPHEN}centile of it",
    "coordination_number": "coordi\N{SOFT HYPHEN}nation number",
    "chain_count": "Peters chains",
    "chain_length": "balls in a chain",
}
"""Heads of columns, for the main quantities."""


# --- page ----------------------------------------------------------------------------------------

CAPTIONS = {
    "pareto": "Every mark is a setting: the size of its error against what a metre of path costs. "
    "The upright line is the 95 % interval of the size. A hollow mark is an error that is not "
    "resolved: its interval holds zero. The short bar is the bound that the true error stays "
    "below with 95 % confidence, and the front joins the settings that no cheaper one undercuts "
    "in it. Dashed lines: the tolerances.",
    "contact_forces": "Share of the contacts on the tool whose normal force is above a value: the "
    "thick line all runs together, the thin ones a run each. Left in newtons, right over the mean. "
    "What the thin lines spread by is chance.",
    "path": "How well one run knows a quantity, seed and time together. Where a line crosses a "
    "tolerance, one run is long enough for it.",
    "drop": "Error of the coefficient of restitution against the finest step.",
}


def render(found: Findings, pictures: Mapping[str, bytes]) -> str:
    """The page: HTML that needs no other file and no network."""
    trade = found.trade
    return render_page(
        "trade.html.j2",
        {"in_percent": percent, "plainly": plainly},
        found=found,
        trade=trade,
        what=what_was_run(found),
        references=_reference_rows(trade),
        tolerances=TOLERANCES,
        choices=choice_rows(found),
        best=_best(found),
        advice=advice(found),
        plain=_plain_note(found),
        soft=softness_rows(trade),
        levels=modulus_levels(trade),
        verdicts=verdicts(trade),
        mixed=_mixed_note(trade),
        gains=_gain_rows(trade),
        combinations=_combination_rows(trade),
        speeds=_speed_rows(trade),
        main=[SHORT[name] for name in MAIN if name in trade.comparisons],
        paths=_path_rows(trade),
        reach_words=reach_words(trade),
        failures=_failure_rows(trade),
        drops=found.drops,
        costs=found.costs.entries,
        checks=[_check_row(check) for check in found.checks],
        statistics=_statistic_rows(trade),
        points=_point_rows(trade),
        chance=_chance_note(trade),
        pictures={
            name: {"uri": data_uri(data), "caption": CAPTIONS[name]}
            for name, data in pictures.items()
        },
        confidence=CONFIDENCE,
        additive_level=ADDITIVE_LEVEL,
        ruined=RUINED,
        floor=FLOOR,
        not_resolved=NOT_RESOLVED,
        waves=(SHORT_WAVE, LONG_WAVE),
        dash=DASH,
    )


def what_was_run(found: Findings) -> list[tuple[str, str]]:
    """The facts at the head of the page."""
    trade = found.trade
    beds = {run.bed for run in trade.runs}
    own = trade.of(trade.reference)
    failed = sum(not run.complete for run in trade.runs)
    cpu = float(np.median([run.cpu_per_m for run in own]))
    provenance = found.provenance
    machine, versions = provenance["machine"], provenance["versions"]
    return [
        (
            "Study",
            provenance["study"] + (f", plan {provenance['plan']}" if provenance["plan"] else ""),
        ),
        ("Reference", f"{trade.reference}; {_count(len(own), 'run')}"),
        (
            "Runs",
            f"{_count(len(trade.runs), 'run')} at {_count(len(trade.settings()), 'setting')}, "
            f"on {_count(len(beds), 'bed')}; {failed or 'none'} failed",
        ),
        (
            "Path",
            f"the first {number(1e3 * trade.arc_m)} mm after the run-in, which every complete run "
            "has; longer runs are cut there",
        ),
        (
            "Cost",
            f"processor time for a metre of path; the reference takes {number(cpu / 3600.0, 2)} h "
            f"for it. {number(provenance['engine_hours'], 2)} h of engine time in all",
        ),
        (
            "Measured",
            f"{provenance['measured']} with LIGGGHTS {versions['engine']} and dragdeck "
            f"{versions['dragdeck']} on {machine['cores']} cores"
            + (f" ({machine['processor']})" if machine["processor"] else ""),
        ),
    ]


def _count(amount: int, noun: str) -> str:
    return f"{amount} {noun}" + ("" if amount == 1 else "s")


def _reference_rows(trade: Trade) -> list[dict[str, str]]:
    """The main quantities at the reference, with what they are known to."""
    rows = []
    for name in MAIN:
        comparison = trade.comparisons.get(name)
        if comparison is None:
            continue
        quantile = _quantile(comparison)
        rows.append(
            {
                "label": SHORT[name],
                "value": f"{number(comparison.reference)} {comparison.quantity.unit}".strip(),
                "halfwidth": f"± {percent(quantile * comparison.standard_error, sign=False)} %",
            }
        )
    return rows


def _quantile(comparison: Comparison) -> float:
    from scipy import stats

    return float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, comparison.fit.degrees))


# --- what to choose


CHOSEN = (
    *((name,) for name in ("drag_mean", "drag_sd", "rod_contacts")),
    *((name,) for name in TOGETHER),
    TOGETHER,
    *((name,) for name in ("coordination_number", "chain_count", "chain_length")),
)


def choice_rows(found: Findings) -> list[dict[str, Any]]:
    """A row a quantity, a cell a tolerance: the cheapest certified setting."""
    rows = [
        {
            "label": _chosen_label(found.trade, names),
            "cells": [_choice_cell(found, choose(found.trade, names, one)) for one in TOLERANCES],
        }
        for names in _compared(found.trade)
    ]
    if len(found.drops) > 1:
        cells = [_drop_cell(found.drops, choose_drop(found.drops, one)) for one in TOLERANCES]
        rows.append({"label": "restitution (drop test)", "cells": cells})
    return rows


def _compared(trade: Trade) -> list[tuple[str, ...]]:
    return [names for names in CHOSEN if all(name in trade.comparisons for name in names)]


def _chosen_label(trade: Trade, names: Sequence[str]) -> str:
    if names == TOGETHER:
        return "distribution of contact forces: its mean and 90th percentile together"
    return long_label(trade.comparisons[names[0]].quantity)


def _choice_cell(found: Findings, choice: Choice) -> dict[str, str]:
    if choice.setting is not None:
        ratio = 1.0 / found.trade.cost(choice.setting)
        plain = found.costs.plain(found.trade, choice.setting)
        more = f" ({times(plain)} than the plain deck)" if math.isfinite(plain) else ""
        return {
            "text": str(choice.setting),
            "detail": f"{cheaper(ratio)}{more}; bound {percent(choice.bound, sign=False)} %",
            "kind": "good",
        }
    if choice.nearest is None:
        return {"text": "none", "detail": "no setting has two complete runs", "kind": "none"}
    inside = all(abs(error.error) <= choice.tolerance for error in choice.errors)
    more = "; its error is smaller: more runs may certify it" if inside else ""
    return {
        "text": "none",
        "detail": f"nearest: {choice.nearest}, bound {percent(choice.bound, sign=False)} %{more}",
        "kind": "none",
    }


def _drop_cell(drops: Sequence[Drop], drop: Drop | None) -> dict[str, str]:
    if drop is None:
        nearest = min((one for one in drops[1:] if not one.other), key=lambda one: one.bound)
        return {
            "text": "none",
            "detail": f"nearest: step {plainly(nearest.timestep_fraction)} % of "
            f"Rayleigh, worst impact {percent(nearest.bound, sign=False)} %",
            "kind": "none",
        }
    return {
        "text": f"step {plainly(drop.timestep_fraction)} % of Rayleigh",
        "detail": f"{cheaper(1.0 / drop.relative_cost)} than the finest; worst impact "
        f"{percent(drop.bound, sign=False)} %",
        "kind": "good",
    }


def advice(found: Findings) -> list[str]:
    """The same in sentences, one a quantity."""
    sentences = [
        _advice(_chosen_label(found.trade, names), choices_of(found, names))
        for names in _compared(found.trade)
    ]
    if len(found.drops) > 1:
        parts = [(one, _drop_words(choose_drop(found.drops, one))) for one in TOLERANCES]
        sentences.append(_advice("restitution (drop test)", parts))
    return sentences


def _best(found: Findings) -> dict[str, Any] | None:
    """What to choose for the first quantity, with what the head of the page says of it."""
    names = next(iter(_compared(found.trade)), None)
    if names is None:
        return None
    return {"label": _chosen_label(found.trade, names), "choices": choices_of(found, names)}


def _drop_words(drop: Drop | None) -> str | None:
    if drop is None:
        return None
    step = plainly(drop.timestep_fraction)
    gain = cheaper(1.0 / drop.relative_cost)
    return f"a step of {step} % of the Rayleigh time ({gain} than the finest)"


def choices_of(found: Findings, names: Sequence[str]) -> list[tuple[float, str | None]]:
    """For each tolerance the certified setting in words, None where there is none."""
    parts: list[tuple[float, str | None]] = []
    for tolerance in TOLERANCES:
        setting = choose(found.trade, names, tolerance).setting
        words = None
        if setting is not None:
            gain = f"{cheaper(1.0 / found.trade.cost(setting))} than the reference"
            plain = found.costs.plain(found.trade, setting)
            if math.isfinite(plain):
                gain += f", {cheaper(plain)} than the plain deck"
            words = f"{setting} ({gain})"
        parts.append((tolerance, words))
    return parts


def _advice(label: str, parts: Sequence[tuple[float, str | None]]) -> str:
    """One sentence; tolerances with the same answer share it."""
    groups: list[tuple[list[float], str | None]] = []
    for tolerance, words in parts:
        if groups and groups[-1][1] == words:
            groups[-1][0].append(tolerance)
        else:
            groups.append(([tolerance], words))
    said = []
    for tolerances, words in groups:
        within = f"within {joined([plainly(one) for one in tolerances])} %"
        said.append(f"{within}: {words or 'none of the cheaper settings is certain'}")
    return f"{label[0].upper()}{label[1:]}, {'; '.join(said)}."


def _plain_note(found: Findings) -> str:
    entry = found.costs.plain_entry
    if entry is None:
        return ""
    standard, what = found.costs.standard or hub(found.trade), entry["what"]
    taken = "" if found.costs.standard else ", taken to be the one the file of costs means"
    return (
        f"{what[:1].upper()}{what[1:]}: it takes {number(float(entry['ratio']))} times "
        f"({number(float(entry['low']))} to {number(float(entry['high']))}) the time of the "
        f"standard deck ({standard}{taken}); what it costs against other settings is that times "
        "the measured ratio of their costs."
    )


# --- softness


def softness_rows(trade: Trade) -> list[dict[str, Any]]:
    """A row a quantity, a cell a modulus."""
    levels = modulus_levels(trade)
    return [
        {
            "label": long_label(comparison.quantity),
            "unit": " (in mean drags)" if comparison.quantity.signed else "",
            "cells": [_soft_cell(softness(trade, comparison, level)) for level in levels],
        }
        for comparison in trade.comparisons.values()
    ]


def _soft_cell(soft: Softness | None) -> dict[str, str]:
    shown = cell(soft.error if soft else None)
    return {**shown, "mixed": soft.mixed if soft else ""}


def verdicts(trade: Trade) -> list[dict[str, str]]:
    """For each modulus what it ruins, what it keeps, and what the runs cannot decide."""
    rows = []
    for level in modulus_levels(trade):
        found: dict[str, list[str]] = {"ruined": [], "kept": [], "open": []}
        for comparison in trade.comparisons.values():
            soft = softness(trade, comparison, level)
            if soft is not None:
                found[soft.verdict].append(long_label(comparison.quantity))
        rows.append(
            {"level": f"E x {level:g}", **{k: joined(v) or "nothing" for k, v in found.items()}}
        )
    return rows


def _mixed_note(trade: Trade) -> str:
    mixed = {
        soft.mixed
        for comparison in trade.comparisons.values()
        for level in modulus_levels(trade)
        if (soft := softness(trade, comparison, level)) is not None and soft.mixed
    }
    if not mixed:
        return ""
    return (
        "Cells with an asterisk could not be told apart from another setting that changed with the "
        f"modulus: they compare {'; '.join(sorted(mixed))} with the reference ({trade.reference})."
    )


# --- knobs


def _gain_rows(trade: Trade) -> list[dict[str, Any]]:
    return [
        {
            "knob": KNOB_NAMES[gain.factors[0]],
            "base": str(gain.base),
            "change": _change(gain),
            "gain": times(gain.speed_up.ratio),
            "span": span(gain.speed_up),
            "cells": [cell(gain.errors.get(name)) for name in MAIN if name in trade.comparisons],
        }
        for gain in gains(trade)
        if len(gain.factors) == 1
    ]


def _change(gain: Gain) -> str:
    (name,) = gain.factors
    own, base = getattr(gain.setting, name), getattr(gain.base, name)
    if name == OTHER:
        return str(own or f"without {base}")
    if name == "timestep_fraction":
        return f"{plainly(base)} → {plainly(own)} % of Rayleigh"
    return f"x {base:g} → x {own:g}"


def _combination_rows(trade: Trade) -> list[dict[str, str]]:
    return [
        {
            "setting": str(gain.setting),
            "base": str(gain.base),
            "product": times(gain.product),
            "gain": times(gain.speed_up.ratio),
            "span": span(gain.speed_up),
            "share": DASH
            if math.isnan(gain.product)
            else number(gain.speed_up.ratio / gain.product, 2),
        }
        for gain in gains(trade)
        if len(gain.factors) > 1
    ]


def _speed_rows(trade: Trade) -> list[dict[str, str]]:
    """Speed factors with the inertial number of the scene at each."""
    at_one = _scene(trade).get("inertial_number")
    factors = sorted({one.speed_factor for one in trade.settings()})
    if at_one is None or len(factors) < 2:
        return []
    return [{"factor": f"{one:g}", "inertial": number(float(at_one) * one, 2)} for one in factors]


# --- path


def _path_rows(trade: Trade) -> list[dict[str, str]]:
    tight, wide = TOLERANCES[1], TOLERANCES[2]
    rows = []
    for reach in reaches(trade):
        seen = along(trade, reach.quantity)
        drift = DASH
        if seen is not None and not math.isnan(seen.drift_halfwidth):
            low, high = seen.drift - seen.drift_halfwidth, seen.drift + seen.drift_halfwidth
            size = f"{percent(low)} to {percent(high)} %"
            resolved = low > 0.0 or high < 0.0
            drift = f"{percent(seen.drift)} % ({size})" if resolved else f"{NOT_RESOLVED} ({size})"
        rows.append(
            {
                "label": long_label(reach.quantity),
                "halfwidth": percent(reach.halfwidth, sign=False),
                "tight": _path_text(reach, tight),
                "wide": _path_text(reach, wide),
                "seeds": str(reach.seeds(tight)),
                "correlation": ", ".join(
                    f"{one:.2f}".replace("-", MINUS) for one in seen.correlation
                )
                if seen
                else DASH,
                "drift": drift,
            }
        )
    return rows


def _path_text(reach: Reach, tolerance: float) -> str:
    path = reach.path_m(tolerance)
    return "one block" if path <= reach.block_m else number(1e3 * path, 2)


def reach_words(trade: Trade) -> list[str]:
    """How long to drag, in sentences."""
    found = {reach.quantity.name: reach for reach in reaches(trade)}
    sentences = []
    for name in ("drag_mean", "drag_sd", "contact_force_p90", "coordination_number"):
        if name in found:
            sentences.append(_reach_sentence(found[name], TOLERANCES[1]))
    return sentences


def _reach_sentence(reach: Reach, tolerance: float) -> str:
    path, compared = reach.path_m(tolerance), number(1e3 * reach.arc_m, 2)
    label = long_label(reach.quantity)
    start = f"{label[0].upper()}{label[1:]} within {plainly(tolerance)} %: "
    if path <= reach.block_m:
        return f"{start}one run over a ball diameter ({number(1e3 * reach.block_m, 2)} mm) will do."
    seeds = reach.seeds(tolerance)
    more = f", or {seeds} runs of {compared} mm with a seed each" if seeds > 1 else ""
    return f"{start}one run over {number(1e3 * path, 2)} mm{more}."


# --- failures, statistics, points


TELLING_GATES = ("within its limits", "no engine error")
"""Gates that say more than others why a run failed, the most telling first."""


def _telling(failed: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The one failed gate that says most."""
    by_name = {gate["name"]: gate for gate in failed}
    return next((by_name[name] for name in TELLING_GATES if name in by_name), failed[0])


def _failure_rows(trade: Trade) -> list[dict[str, str]]:
    """A row a failed run."""
    failed = [run for run in trade.runs if not run.complete]
    gates = [_telling(run.measures["failure"]) for run in failed]
    return [
        {
            "setting": str(run.setting),
            "seed": str(run.measures["inputs"]["seed"]),
            **{name: str(gate[name]) for name in ("name", "seen", "limit")},
        }
        for run, gate in zip(failed, gates, strict=True)
    ]


def _statistic_rows(trade: Trade) -> list[dict[str, str]]:
    rows = []
    for comparison in trade.comparisons.values():
        share = comparison.bed_share
        rows.append(
            {
                "label": long_label(comparison.quantity),
                "run_sd": percent(comparison.run_sd, sign=False),
                "bed_share": percent(share, sign=False),
                "pairing": number(1.0 / math.sqrt(1.0 - share), 2) if share > 0.0 else "none seen",
                "additivity": DASH
                if math.isnan(comparison.additivity)
                else number(comparison.additivity, 2),
                "model": _model(comparison),
                "degrees": str(comparison.fit.degrees),
            }
        )
    return rows


def _model(comparison: Comparison) -> str:
    if not comparison.additive:
        return "separate"
    if not comparison.apart:
        return "added up"
    return f"added up, without {'; '.join(map(str, comparison.apart))}"


def _chance_note(trade: Trade) -> str:
    errors = [
        error
        for comparison in trade.comparisons.values()
        for setting, error in comparison.errors.items()
        if setting != trade.reference
    ]
    resolved = sum(error.resolved for error in errors)
    note = (
        f"{len(errors)} differences are tested here and {resolved} are resolved; if none existed, "
        f"chance alone would show about {round((1.0 - CONFIDENCE) * len(errors))}."
    )
    held = coverage(trade, MAIN[0])
    if held is None:
        return note
    return (
        f"{note} The bed's share is estimated, and additivity tested, from the same few runs, "
        f"which can make intervals too narrow: in {TRIALS} simulations of this plan without "
        f"any effect {percent(held, sign=False)} % of the intervals of the "
        f"{long_label(trade.comparisons[MAIN[0]].quantity)} held the truth."
    )


def _point_rows(trade: Trade) -> list[dict[str, Any]]:
    return [_point_row(trade, setting, trade.of(setting)) for setting in trade.settings()]


def _point_row(trade: Trade, setting: Setting, runs: Sequence[Run]) -> dict[str, Any]:
    return {
        "setting": f"{setting} (reference)" if setting == trade.reference else str(setting),
        "runs": f"{sum(run.complete for run in runs)} of {len(runs)}",
        "cost": number(trade.cost(setting), 2),
        "cells": [
            {"text": "0", "detail": "", "kind": ""}
            if setting == trade.reference
            else cell(trade.comparisons[name].errors.get(setting))
            for name in MAIN
            if name in trade.comparisons
        ],
    }
