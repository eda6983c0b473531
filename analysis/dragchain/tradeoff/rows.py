"""Rows of the tables on the page of a trade, and the notes below them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from dragchain.report.notation import DASH, MINUS, number
from dragchain.tradeoff.compare import (
    CONFIDENCE,
    OTHER,
    TOLERANCES,
    Comparison,
    Run,
    Setting,
    Tradeoff,
    along,
)
from dragchain.tradeoff.findings import (
    MAIN,
    TRIALS,
    Gain,
    Reach,
    Softness,
    coverage,
    gains,
    modulus_levels,
    reaches,
    softness,
)
from dragchain.tradeoff.record import scene_numbers
from dragchain.tradeoff.words import (
    NOT_RESOLVED,
    PARAMETER_NAMES,
    SHORT,
    cell,
    joined,
    long_label,
    percent,
    plainly,
    span,
    times,
)


def reference_rows(tradeoff: Tradeoff) -> list[dict[str, str]]:
    """The main quantities at the reference, with what they are known to."""
    rows = []
    for name in MAIN:
        comparison = tradeoff.comparisons.get(name)
        if comparison is None:
            continue
        quantile = _quantile(comparison)
        rows.append(
            {
                "label": SHORT[name],
                "value": f"{number(comparison.reference)} {comparison.quantity.unit}".strip(),
                "halfwidth": f"± {percent(quantile * comparison.se, sign=False)} %",
            }
        )
    return rows


def _quantile(comparison: Comparison) -> float:
    from scipy import stats

    return float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, comparison.fit.degrees))


# --- softness


def softness_rows(tradeoff: Tradeoff) -> list[dict[str, Any]]:
    """A row a quantity, a cell a modulus."""
    levels = modulus_levels(tradeoff)
    return [
        {
            "label": long_label(comparison.quantity),
            "unit": " (in mean drags)" if comparison.quantity.signed else "",
            "cells": [_soft_cell(softness(tradeoff, comparison, level)) for level in levels],
        }
        for comparison in tradeoff.comparisons.values()
    ]


def _soft_cell(soft: Softness | None) -> dict[str, str]:
    shown = cell(soft.error if soft else None)
    return {**shown, "mixed": soft.mixed if soft else ""}


def verdicts(tradeoff: Tradeoff) -> list[dict[str, str]]:
    """For each modulus what it ruins, what it keeps, and what the runs cannot decide."""
    rows = []
    for level in modulus_levels(tradeoff):
        found: dict[str, list[str]] = {"ruined": [], "kept": [], "open": []}
        for comparison in tradeoff.comparisons.values():
            soft = softness(tradeoff, comparison, level)
            if soft is not None:
                found[soft.verdict].append(long_label(comparison.quantity))
        rows.append(
            {"level": f"E x {level:g}", **{k: joined(v) or "nothing" for k, v in found.items()}}
        )
    return rows


def mixed_note(tradeoff: Tradeoff) -> str:
    """Which cells of the table of softness hold another change too."""
    mixed = {
        soft.mixed
        for comparison in tradeoff.comparisons.values()
        for level in modulus_levels(tradeoff)
        if (soft := softness(tradeoff, comparison, level)) is not None and soft.mixed
    }
    if not mixed:
        return ""
    return (
        "Cells with an asterisk could not be told apart from another setting that changed with the "
        f"modulus: they compare {'; '.join(sorted(mixed))} with the reference "
        f"({tradeoff.reference})."
    )


# --- parameters


def gain_rows(tradeoff: Tradeoff) -> list[dict[str, Any]]:
    """A row a parameter turned alone: what it saves, and its errors."""
    return [
        {
            "parameter": PARAMETER_NAMES[gain.factors[0]],
            "base": str(gain.base),
            "change": _change(gain),
            "gain": times(gain.speed_up.ratio),
            "span": span(gain.speed_up),
            "cells": [cell(gain.errors.get(name)) for name in MAIN if name in tradeoff.comparisons],
        }
        for gain in gains(tradeoff)
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


def combination_rows(tradeoff: Tradeoff) -> list[dict[str, str]]:
    """A row a setting with several parameters turned: what it saves."""
    return [
        {
            "setting": str(gain.setting),
            "base": str(gain.base),
            "product": times(gain.product),
            "gain": times(gain.speed_up.ratio),
            "span": span(gain.speed_up),
            "fraction": DASH
            if math.isnan(gain.product)
            else number(gain.speed_up.ratio / gain.product, 2),
        }
        for gain in gains(tradeoff)
        if len(gain.factors) > 1
    ]


def speed_rows(tradeoff: Tradeoff) -> list[dict[str, str]]:
    """Speed factors with the inertial number of the scene at each."""
    at_one = scene_numbers(tradeoff).get("inertial_number")
    factors = sorted({one.speed_factor for one in tradeoff.settings()})
    if at_one is None or len(factors) < 2:
        return []
    return [{"factor": f"{one:g}", "inertial": number(float(at_one) * one, 2)} for one in factors]


# --- path


def path_rows(tradeoff: Tradeoff) -> list[dict[str, str]]:
    """A row a quantity: the path that it takes to know it."""
    tight, wide = TOLERANCES[1], TOLERANCES[2]
    rows = []
    for reach in reaches(tradeoff):
        seen = along(tradeoff, reach.quantity)
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


def reach_words(tradeoff: Tradeoff) -> list[str]:
    """How long to drag, in sentences."""
    found = {reach.quantity.name: reach for reach in reaches(tradeoff)}
    sentences = []
    for name in ("drag_mean", "drag_std", "contact_force_p90", "coordination_number"):
        if name in found:
            sentences.append(_reach_sentence(found[name], TOLERANCES[1]))
    return sentences


def _reach_sentence(reach: Reach, tolerance: float) -> str:
    path, compared = reach.path_m(tolerance), number(1e3 * reach.arc_m, 2)
    label = long_label(reach.quantity)
    start = f"{label[0].upper()}{label[1:]} within {plainly(tolerance)} %: "
    if path <= reach.block_m:
        return (
            f"{start}one run over a particle diameter ({number(1e3 * reach.block_m, 2)} "
            f"mm) will do."
        )
    seeds = reach.seeds(tolerance)
    more = f", or {seeds} runs of {compared} mm with a seed each" if seeds > 1 else ""
    return f"{start}one run over {number(1e3 * path, 2)} mm{more}."


# --- failures, statistics, points


TELLING_CHECKS = ("within its limits", "no engine error")
"""Acceptance checks that say more than others why a run failed, the most telling first."""


def _telling(failed: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """The one failed acceptance check that says most."""
    by_name = {check["name"]: check for check in failed}
    return next((by_name[name] for name in TELLING_CHECKS if name in by_name), failed[0])


def failure_rows(tradeoff: Tradeoff) -> list[dict[str, str]]:
    """A row a failed run."""
    failed = [run for run in tradeoff.runs if not run.complete]
    checks = [_telling(run.measures["failure"]) for run in failed]
    return [
        {
            "setting": str(run.setting),
            "seed": str(run.measures["inputs"]["seed"]),
            **{name: str(check[name]) for name in ("name", "seen", "limit")},
        }
        for run, check in zip(failed, checks, strict=True)
    ]


def statistic_rows(tradeoff: Tradeoff) -> list[dict[str, str]]:
    """A row a quantity: its scatter, and the model that its errors come from."""
    rows = []
    for comparison in tradeoff.comparisons.values():
        fraction = comparison.bed_fraction
        rows.append(
            {
                "label": long_label(comparison.quantity),
                "run_std": percent(comparison.run_std, sign=False),
                "bed_fraction": percent(fraction, sign=False),
                "pairing": number(1.0 / math.sqrt(1.0 - fraction), 2)
                if fraction > 0.0
                else "none seen",
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


def chance_note(tradeoff: Tradeoff) -> str:
    """How many differences chance alone would show, and what intervals held in simulations."""
    errors = [
        error
        for comparison in tradeoff.comparisons.values()
        for setting, error in comparison.errors.items()
        if setting != tradeoff.reference
    ]
    resolved = sum(error.significant for error in errors)
    note = (
        f"{len(errors)} differences are tested here and {resolved} are resolved; if none existed, "
        f"chance alone would show about {round((1.0 - CONFIDENCE) * len(errors))}."
    )
    held = coverage(tradeoff, MAIN[0])
    if held is None:
        return note
    return (
        f"{note} The bed's share is estimated, and additivity tested, from the same few runs, "
        f"which can make intervals too narrow: in {TRIALS} simulations of this plan without "
        f"any effect {percent(held, sign=False)} % of the intervals of the "
        f"{long_label(tradeoff.comparisons[MAIN[0]].quantity)} held the truth."
    )


def point_rows(tradeoff: Tradeoff) -> list[dict[str, Any]]:
    """A row a setting: its runs, its cost and its errors."""
    return [_point_row(tradeoff, setting, tradeoff.of(setting)) for setting in tradeoff.settings()]


def _point_row(tradeoff: Tradeoff, setting: Setting, runs: Sequence[Run]) -> dict[str, Any]:
    return {
        "setting": f"{setting} (reference)" if setting == tradeoff.reference else str(setting),
        "runs": f"{sum(run.complete for run in runs)} of {len(runs)}",
        "cost": number(tradeoff.cost(setting), 2),
        "cells": [
            {"text": "0", "detail": "", "kind": ""}
            if setting == tradeoff.reference
            else cell(tradeoff.comparisons[name].errors.get(setting))
            for name in MAIN
            if name in tradeoff.comparisons
        ],
    }
