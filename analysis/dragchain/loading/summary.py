"""What the particles do to the workpiece, facet by facet: load, sliding and friction work.

These are the quantities a law of wear starts from; no wear coefficient enters,
so none of them is a removed volume. See docs/removal.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from dragchain.drag.azimuth import circumference, parts, within
from dragchain.loading.contact_events import (
    AMOUNTS,
    TYPES,
    Thresholds,
    event_types,
    find_events,
    surfaces,
)
from dragchain.loading.samples import WORKPIECE, Sampled
from dragchain.run.case import Case
from dragchain.statistics.bootstrap import estimates
from dragchain.statistics.estimate import CONFIDENCE, Estimate, finite

SCHEMA = 2


THINNING = (2, 5, 10)
"""Every n-th sample is taken to see what a lower rate of samples would give."""

GAPS = (1, 2, 5)
"""Samples without force that may lie within a stay, to see what they do to its number."""

MOBILISED = (0.9, 0.95, 0.99, 0.999)
"""Limits of a sliding contact, to see what they do to the sums."""

DEPTH_BINS, AZIMUTH_BINS = 20, 24


# --- findings --------------------------------------------------------------------------------


def findings(
    sampled: Sampled,
    facets: pd.DataFrame,
    events: pd.DataFrame,
    event: Ints,
    case: Case,
    limits: Thresholds,
) -> dict[str, Any]:
    """The content of ``loading.json``; `event` is the event of each row of `sampled`."""
    known = surfaces(case)
    found = {
        "schema": SCHEMA,
        "run": case.run,
        "confidence": CONFIDENCE,
        "samples": sampled.frames,
        "sample_interval_s": sampled.interval_s,
        "time_s": sampled.frames * sampled.interval_s,
        "path_m": sampled.path_m,
        "friction_coefficient": known.friction,
        "contact_time_s": known.contact_time_s,
        "impact_seen_fraction": min(1.0, known.contact_time_s / sampled.interval_s),
        "limits": limits.as_json(),
        **_totals(sampled, events),
        "types": _types(sampled, events, event),
        "sensitivity": _sensitivity(sampled, events, case, limits),
        "mobilised": _mobilised(sampled),
        "gaps": [{"samples": gap, "events": _events(sampled.rows, 1 + gap)} for gap in (0, *GAPS)],
        "profiles": _profiles(sampled),
        "sampling": _sampling(sampled, case, limits),
        "closure": _closure(sampled, facets, events),
    }
    return {**found, "words": words(found)}


def words(found: Mapping[str, Any]) -> list[str]:
    """Say in sentences what the findings are, each number with its 95 % interval."""
    metre, front = found["per_metre"], found["front_fraction"]
    types = found["types"]
    by_type = "; ".join(
        f"{name} {types[name]['events']} stays with "
        f"{_percent(fraction['normal_impulse_n_s'])} of the"
        f" normal impulse and {_percent(fraction['friction_work_j'])} of the friction work"
        for name in TYPES
        for fraction in (types[name]["fraction_of"],)
    )
    return [
        f"{_span(found['mean_contacts'])} contacts press on the workpiece at once, in the mean.",
        f"A metre of way brings a normal impulse of {_span(metre['normal_impulse_n_s'])} N s,"
        f" {_percent(front['normal_impulse_n_s'])} of it on the front half.",
        f"The contacts together slide {_span(metre['sliding_m'])} m a metre of way. Normal force"
        f" times sliding distance is {_span(metre['force_slide_n_m'])} N m a metre,"
        f" {_percent(front['force_slide_n_m'])} of it on the front half.",
        f"Friction on the workpiece takes {_span(metre['friction_work_j'])} J a metre, which is"
        f" {_percent(found['friction_fraction_of_work'])} of the work that the workpiece "
        f"does on the bed.",
        f"{_percent(found['load_while_sliding_fraction'])} of the normal impulse is carried while a"
        " contact slides, the rest while it sticks.",
        f"By type of stay: {by_type}.",
        f"A lone impact at the workpiece's speed lasts {1e3 * found['contact_time_s']:.2g} ms and a"
        f" sample comes every {1e3 * found['sample_interval_s']:.2g} ms, so the chance to see one"
        f" is {100 * found['impact_seen_fraction']:.2g} %. The sums are fair all the "
        f"same; the number"
        " of stays depends on the rate of samples.",
    ]


def _span(estimate: Mapping[str, float | None]) -> str:
    value, low, high = (_digits(estimate[key]) for key in ("value", "ci95_low", "ci95_high"))
    return f"{value} ({low} to {high})"


def _percent(estimate: Mapping[str, float | None]) -> str:
    value, low, high = (
        _digits(None if estimate[key] is None else 100.0 * (estimate[key] or 0.0))
        for key in ("value", "ci95_low", "ci95_high")
    )
    return f"{value} % ({low} to {high})"


def _digits(value: float | None) -> str:
    """A number with three digits and without an exponent, "unknown" for none."""
    if value is None:
        return "unknown"
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def _totals(sampled: Sampled, events: pd.DataFrame) -> dict[str, Any]:
    """Return totals, what they are a metre of path, the front's share, and shares of work."""
    rows, known = sampled.rows, [*AMOUNTS, "normal_work_j", "workpiece_work_j"]
    ahead = within(rows["azimuth_rad"].to_numpy(np.float64), np.pi / 2)
    frame, frames = rows["frame"].to_numpy(), sampled.frames
    loads = rows["normal_impulse_n_s"] * rows["mobilised"]
    sums = np.column_stack(
        [
            *(np.bincount(frame, rows[name], frames) for name in known),
            *(np.bincount(frame, rows[name] * ahead, frames) for name in known),
            np.bincount(frame, minlength=frames),
            np.bincount(frame, loads, frames),
            np.bincount(events["frame"], minlength=frames),
        ]
    )
    count = len(known)
    at = {name: number for number, name in enumerate(known)}
    metre = sampled.path_m / sampled.frames

    def statistic(means: Floats) -> Floats:
        total, front = means[..., :count], means[..., count : 2 * count]
        work = total[..., [at["friction_work_j"], at["normal_work_j"]]]
        contacts, sliding, begins = np.moveaxis(means[..., 2 * count :], -1, 0)
        fractions = [
            *np.moveaxis(work / total[..., [at["workpiece_work_j"]]], -1, 0),
            sliding / total[..., at["normal_impulse_n_s"]],
            contacts,
            begins / metre,
        ]
        return np.concatenate([total / metre, front / total, np.stack(fractions, -1)], axis=-1)

    found = [estimate.as_json() for estimate in estimates(sums, statistic)]
    names = ("friction_fraction_of_work", "normal_fraction_of_work", "load_while_sliding_fraction")
    return {
        "totals": {name: float(rows[name].sum()) for name in known} | {"events": len(events)},
        "per_metre": dict(zip(known, found, strict=False)) | {"events": found[-1]},
        "front_fraction": dict(zip(known, found[count:], strict=False)),
        **dict(zip((*names, "mean_contacts"), found[2 * count : -1], strict=True)),
    }


_SHARED = ("samples", "normal_impulse_n_s", "sliding_m", "force_slide_n_m", "friction_work_j")


def _types(sampled: Sampled, events: pd.DataFrame, event: Ints) -> dict[str, Any]:
    """Return number, shares and intensity of the contacts of each type."""
    rows = sampled.rows.assign(samples=1.0)
    kind = events["type"].to_numpy()
    of_rows = kind[event]
    frame = rows["frame"].to_numpy()
    parts = [
        np.bincount(frame, rows[name] * (of_rows == t), sampled.frames)
        for t in TYPES
        for name in _SHARED
    ]
    begun = [np.bincount(events["frame"][kind == t], minlength=sampled.frames) for t in TYPES]
    sums = np.column_stack([*parts, *begun])
    width = len(_SHARED)

    def statistic(means: Floats) -> Floats:
        loads = means[..., : width * len(TYPES)].reshape(*means.shape[:-1], len(TYPES), width)
        begins = means[..., width * len(TYPES) :, None]
        both = np.concatenate([loads, begins], axis=-1)
        fractions = both / both.sum(axis=-2, keepdims=True)
        return np.asarray(fractions.reshape(*means.shape[:-1], -1))

    found = iter(estimates(sums, statistic))
    return {
        name: {
            "events": int((kind == name).sum()),
            "fraction_of": {key: next(found).as_json() for key in (*_SHARED, "events")},
            "intensity": _intensity(events[kind == name]),
        }
        for name in TYPES
    }


def _intensity(events: pd.DataFrame) -> dict[str, dict[str, float | None]]:
    """Return quartiles and 95th percentile over the events of a type."""
    names = ("duration_s", "peak_normal_force_n", "mean_normal_force_n", "normal_impulse_n_s")
    fractions = {"p25": 0.25, "p50": 0.5, "p75": 0.75, "p95": 0.95}
    return {
        name: {
            key: finite(float(events[name].quantile(fraction))) if len(events) else None
            for key, fraction in fractions.items()
        }
        for name in (*names, "sliding_m", "friction_work_j")
    }


def _sensitivity(
    sampled: Sampled, events: pd.DataFrame, case: Case, limits: Thresholds
) -> list[dict[str, Any]]:
    """The shares by type with each limit halved and doubled."""
    interval_s = sampled.interval_s
    cases = {"as stated": limits, **limits.varied()}
    return [
        {
            "limits": name,
            "fraction_of": _fractions(events, event_types(events, case, interval_s, moved)),
        }
        for name, moved in cases.items()
    ]


def _fractions(events: pd.DataFrame, kind: Any) -> dict[str, dict[str, float | None]]:
    """Each type's share of the stays and of what they bring."""
    names = ("normal_impulse_n_s", "force_slide_n_m", "friction_work_j")
    fractions = {
        name: {t: _fraction(events[name].to_numpy(), kind == t) for t in TYPES} for name in names
    }
    return {"events": {t: float((kind == t).mean()) for t in TYPES}, **fractions}


def _fraction(values: Floats, chosen: Any) -> float | None:
    total = float(values.sum())
    return finite(float(values[chosen].sum()) / total) if total else None


def _mobilised(sampled: Sampled) -> list[dict[str, float]]:
    """What counts as sliding with other limits of `Thresholds.mobilised`."""
    rows = sampled.rows
    table = []
    for limit in MOBILISED:
        slides = rows["mobilisation"] >= limit
        path = rows["relative_path_m"][slides]
        load = rows["normal_impulse_n_s"][slides].sum() / rows["normal_impulse_n_s"].sum()
        force = float((rows["normal_force_n"][slides] * path).sum())
        table.append(
            {
                "limit": limit,
                "load_while_sliding_fraction": float(load),
                "sliding_m": float(path.sum()),
                "force_slide_n_m": force,
            }
        )
    return table


def _profiles(sampled: Sampled) -> dict[str, Any]:
    """Return force times sliding distance by depth and by azimuth, a metre of path."""
    rows, metre = sampled.rows, sampled.path_m / sampled.frames
    frame, weight = rows["frame"].to_numpy(), rows["force_slide_n_m"].to_numpy()
    depth = rows["depth_m"].to_numpy()
    levels = np.linspace(depth.min(), depth.max(), DEPTH_BINS + 1)
    level = np.clip(np.searchsorted(levels, depth, side="right") - 1, 0, DEPTH_BINS - 1)
    bins = {
        "depth": (levels, (level, level)),
        "azimuth": (
            circumference(AZIMUTH_BINS),
            parts(rows["azimuth_rad"].to_numpy(np.float64), AZIMUTH_BINS),
        ),
    }
    profiles = {}
    for name, (edges, halves) in bins.items():
        sums = np.zeros((sampled.frames, len(edges) - 1))
        for half in halves:
            np.add.at(sums, (frame, half), 0.5 * weight)
        found = estimates(sums, _per(metre * (edges[1] - edges[0])))
        profiles[name] = {"edges": edges.tolist(), "force_slide": _columns(found)}
    return profiles


def _per(scale: float) -> Any:
    return lambda means: means / scale


def _columns(found: list[Estimate]) -> dict[str, list[float | None]]:
    keys = ("value", "ci95_low", "ci95_high")
    return {key: [finite(getattr(estimate, key)) for estimate in found] for key in keys}


def _sampling(sampled: Sampled, case: Case, limits: Thresholds) -> list[dict[str, Any]]:
    """What every n-th sample alone would give.

    The sums' errors are the worst of its n beginnings, the number of stays is their mean; the
    shares by type are those of the first.
    """
    return [
        {
            "every": every,
            "samples_hz": 1.0 / (every * sampled.interval_s),
            "largest_relative_error": {
                name: _thinned_error(sampled.rows, name, every) for name in AMOUNTS
            },
            "events": float(np.mean([_thinned_events(sampled, every, i) for i in range(every)])),
            "fraction_of": _thinned_types(sampled, every, case, limits),
        }
        for every in THINNING
    ]


def _thinned(sampled: Sampled, every: int) -> pd.DataFrame:
    """The contacts of every n-th frame, each standing for n; frames are numbered anew."""
    rows = sampled.rows[sampled.rows["frame"] % every == 0]
    amounts = {name: every * rows[name] for name in AMOUNTS}
    return rows.assign(frame=rows["frame"] // every, **amounts).reset_index(drop=True)


def _thinned_events(sampled: Sampled, every: int, start: int) -> int:
    """The number of stays that every n-th frame shows."""
    rows = sampled.rows.loc[sampled.rows["frame"] % every == start, ["particle_id", "frame"]]
    return _events(rows.assign(frame=rows["frame"] // every))


def _thinned_error(rows: pd.DataFrame, name: str, every: int) -> float | None:
    """The largest relative error of a sum over every n-th frame."""
    parts = np.bincount(rows["frame"] % every, rows[name], every)
    return finite(float(np.abs(every * parts / parts.sum() - 1.0).max())) if parts.sum() else None


def _thinned_types(
    sampled: Sampled, every: int, case: Case, limits: Thresholds
) -> dict[str, dict[str, float | None]]:
    interval_s = every * sampled.interval_s
    rows = _thinned(sampled, every)
    events, _ = find_events(rows, -(-sampled.frames // every), interval_s)
    return _fractions(events, event_types(events, case, interval_s, limits))


def _events(rows: pd.DataFrame, step: int = 1) -> int:
    """The number of stays on the workpiece; samples of one are at most `step` apart."""
    touches = rows[["particle_id", "frame"]].drop_duplicates().sort_values(["particle_id", "frame"])
    particle, frame = touches["particle_id"].to_numpy(), touches["frame"].to_numpy()
    return int(len(touches) > 0) + int(((np.diff(particle) != 0) | (np.diff(frame) > step)).sum())


def _closure(sampled: Sampled, facets: pd.DataFrame, events: pd.DataFrame) -> dict[str, Any]:
    """How the sums over facets and events agree with those of the workpiece."""
    whole = {name: float(sampled.rows[name].sum()) for name in AMOUNTS}
    placed = facets[list(WORKPIECE)].to_numpy().sum(axis=0)
    missing = sampled.workpiece_impulse_n_s - placed
    names = ("drag", "lateral", "vertical")
    return {
        "workpiece_impulse_n_s": dict(
            zip(names, sampled.workpiece_impulse_n_s.tolist(), strict=True)
        ),
        "facets_impulse_n_s": dict(zip(names, placed.tolist(), strict=True)),
        "unplaced_impulse_n_s": dict(zip(names, missing.tolist(), strict=True)),
        "workpiece_relative_error": float(
            np.linalg.norm(missing) / np.linalg.norm(sampled.workpiece_impulse_n_s)
        ),
        "facets_relative_error": _largest_error(facets, whole),
        "events_relative_error": _largest_error(events, whole),
    }


def _largest_error(table: pd.DataFrame, whole: Mapping[str, float]) -> float:
    return max(
        abs(float(table[name].sum()) - total) / abs(total) if total else 0.0
        for name, total in whole.items()
    )
