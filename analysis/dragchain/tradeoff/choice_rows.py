"""What to choose: the cheapest setting for each quantity and tolerance, in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from dragchain.report.notation import number
from dragchain.tradeoff.compare import TOLERANCES, Tradeoff
from dragchain.tradeoff.findings import TOGETHER, Choice, Drop, choose, choose_drop, hub
from dragchain.tradeoff.record import Findings
from dragchain.tradeoff.words import cheaper, joined, long_label, percent, plainly, times

CHOSEN = (
    *((name,) for name in ("drag_mean", "drag_std", "workpiece_contacts")),
    *((name,) for name in TOGETHER),
    TOGETHER,
    *((name,) for name in ("coordination_number", "chain_count", "chain_length")),
)


def choice_rows(found: Findings) -> list[dict[str, Any]]:
    """A row a quantity, a cell a tolerance: the cheapest certified setting."""
    rows = [
        {
            "label": _chosen_label(found.tradeoff, names),
            "cells": [
                _choice_cell(found, choose(found.tradeoff, names, one)) for one in TOLERANCES
            ],
        }
        for names in _compared(found.tradeoff)
    ]
    if len(found.drops) > 1:
        cells = [_drop_cell(found.drops, choose_drop(found.drops, one)) for one in TOLERANCES]
        rows.append({"label": "restitution (drop test)", "cells": cells})
    return rows


def _compared(tradeoff: Tradeoff) -> list[tuple[str, ...]]:
    return [names for names in CHOSEN if all(name in tradeoff.comparisons for name in names)]


def _chosen_label(tradeoff: Tradeoff, names: Sequence[str]) -> str:
    if names == TOGETHER:
        return "distribution of contact forces: its mean and 90th percentile together"
    return long_label(tradeoff.comparisons[names[0]].quantity)


def _choice_cell(found: Findings, choice: Choice) -> dict[str, str]:
    if choice.setting is not None:
        ratio = 1.0 / found.tradeoff.cost(choice.setting)
        plain = found.costs.plain(found.tradeoff, choice.setting)
        more = f" ({times(plain)} than the plain deck)" if math.isfinite(plain) else ""
        return {
            "text": str(choice.setting),
            "detail": f"{cheaper(ratio)}{more}; bound {percent(choice.bound, sign=False)} %",
            "kind": "good",
        }
    if choice.nearest is None:
        return {"text": "none", "detail": "no setting has two complete runs", "kind": "none"}
    inside = all(abs(error.value) <= choice.tolerance for error in choice.errors)
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
        _advice(_chosen_label(found.tradeoff, names), choices_of(found, names))
        for names in _compared(found.tradeoff)
    ]
    if len(found.drops) > 1:
        parts = [(one, _drop_words(choose_drop(found.drops, one))) for one in TOLERANCES]
        sentences.append(_advice("restitution (drop test)", parts))
    return sentences


def best(found: Findings) -> dict[str, Any] | None:
    """What to choose for the first quantity, with what the head of the page says of it."""
    names = next(iter(_compared(found.tradeoff)), None)
    if names is None:
        return None
    return {"label": _chosen_label(found.tradeoff, names), "choices": choices_of(found, names)}


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
        setting = choose(found.tradeoff, names, tolerance).setting
        words = None
        if setting is not None:
            gain = f"{cheaper(1.0 / found.tradeoff.cost(setting))} than the reference"
            plain = found.costs.plain(found.tradeoff, setting)
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


def plain_note(found: Findings) -> str:
    """What the plain deck costs, in a sentence; empty where that was not timed."""
    entry = found.costs.plain_entry
    if entry is None:
        return ""
    standard, what = found.costs.standard or hub(found.tradeoff), entry.what
    taken = "" if found.costs.standard else ", taken to be the one the file of costs means"
    return (
        f"{what[:1].upper()}{what[1:]}: it takes {number(entry.ratio)} times "
        f"({number(entry.ci95_low)} to {number(entry.ci95_high)}) the time of the "
        f"standard deck ({standard}{taken}); what it costs against other settings is that times "
        "the measured ratio of their costs."
    )
