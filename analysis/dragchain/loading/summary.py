"""What the particles do to the workpiece as a whole: load, sliding and friction work.

These are the quantities a law of wear starts from; no wear coefficient enters,
so none of them is a removed volume. See docs/explanation/loading.md.
"""

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from dragchain.drag import within_angle
from dragchain.loading.contact_events import AMOUNTS, LIMITS, TYPES, contact_time_s
from dragchain.loading.document import ContactType, LoadClosure, Loading, Profile, Quantiles, Totals
from dragchain.loading.samples import WORKPIECE, Sampled
from dragchain.statistics.correlated import estimates
from dragchain.statistics.estimate import CONFIDENCE, EstimateColumns
from dragdeck.records.case import CaseOfRun

LOAD_DEPTH_BINS = 20

_KNOWN = (*AMOUNTS, "normal_work_j", "workpiece_work_j")
"""Amounts of which totals are known."""

_BY_TYPE = ("samples", "normal_impulse_n_s", "sliding_m", "force_slide_n_m", "friction_work_j")
"""Amounts of which each type's fraction has an interval."""

_INTENSITIES = (
    *("duration_s", "peak_normal_force_n", "mean_normal_force_n", "normal_impulse_n_s"),
    *("sliding_m", "friction_work_j"),
)
"""Columns of the events whose distribution is told."""


def summarise_loading(
    sampled: Sampled,
    facets: pd.DataFrame,
    events: pd.DataFrame,
    event: Ints,
    case: CaseOfRun,
    off_facet_m: float,
) -> Loading:
    """The content of ``loading.json``.

    Parameters
    ----------
    sampled : Sampled
        All contacts, N rows.
    facets, events : DataFrame
        Of `facet_table` and `find_events`, the events with their ``type``.
    event : (N,) ndarray
        The event of each contact.
    case : CaseOfRun
    off_facet_m : float
        Largest distance of a contact point from its facet.
    """
    contact_s, interval_s = contact_time_s(case), sampled.interval_s
    return Loading(
        run=case.run,
        confidence=CONFIDENCE,
        samples=sampled.frames,
        sample_interval_s=interval_s,
        time_s=sampled.frames * interval_s,
        path_m=sampled.path_m,
        contact_time_s=contact_s,
        impact_seen_fraction=min(1.0, contact_s / interval_s),
        limits=LIMITS,
        **dict(_totals(sampled, events)),
        types=_types(sampled, events, event),
        by_depth=_profile(sampled),
        closure=_closure(sampled, facets, off_facet_m),
    )


def _totals(sampled: Sampled, events: pd.DataFrame) -> Totals:
    rows, count = sampled.rows, len(_KNOWN)
    ahead = within_angle(rows["azimuth_rad"].to_numpy(np.float64), np.pi / 2)
    sums = np.column_stack(
        [
            *(sampled.per_frame(rows[name] * ahead) for name in _KNOWN),
            *(sampled.per_frame(rows[name] * (1.0 - ahead)) for name in _KNOWN),
            sampled.per_frame(rows["normal_impulse_n_s"] * rows["mobilised"]),
            sampled.per_frame(rows["normal_impulse_n_s"] * (1.0 - rows["mobilised"])),
        ]
    )
    friction, whole = map(_KNOWN.index, ("friction_work_j", "workpiece_work_j"))

    def statistic(means: Floats) -> Floats:
        front, back = means[..., :count], means[..., count : 2 * count]
        sliding, sticking = np.moveaxis(means[..., 2 * count :], -1, 0)
        total = front + back
        others = [total[..., friction] / total[..., whole], sliding / (sliding + sticking)]
        return np.concatenate([front / total, np.stack(others, -1)], axis=-1)

    ratios = estimates(sums, statistic)
    friction_part, sliding_part = ratios[count:]
    return Totals(
        totals={name: float(rows[name].sum()) for name in _KNOWN} | {"events": len(events)},
        front_fraction=dict(zip(_KNOWN, ratios, strict=False)),
        friction_fraction_of_work=friction_part,
        load_while_sliding_fraction=sliding_part,
    )


def _types(sampled: Sampled, events: pd.DataFrame, event: Ints) -> dict[str, ContactType]:
    """Number, fractions and intensity of the contacts of each type."""
    rows = sampled.rows.rename(columns={"contacts": "samples"})
    kind, frames = events["type"].to_numpy(), sampled.frames
    of_rows = kind[event]
    amounts = [sampled.per_frame(rows[name] * (of_rows == t)) for t in TYPES for name in _BY_TYPE]
    begun = [np.bincount(events["frame"][kind == t], minlength=frames) for t in TYPES]
    width = len(_BY_TYPE)

    def statistic(means: Floats) -> Floats:
        loads = means[..., : width * len(TYPES)].reshape(*means.shape[:-1], len(TYPES), width)
        begins = means[..., width * len(TYPES) :, None]
        both = np.concatenate([loads, begins], axis=-1)
        fractions = both / both.sum(axis=-2, keepdims=True)
        return np.asarray(fractions.reshape(*means.shape[:-1], -1))

    types_in_order = iter(estimates(np.column_stack([*amounts, *begun]), statistic))
    return {
        name: ContactType(
            events=int((kind == name).sum()),
            fraction_of={key: next(types_in_order) for key in (*_BY_TYPE, "events")},
            intensity={key: event_quantiles(events[key][kind == name]) for key in _INTENSITIES},
        )
        for name in TYPES
    }


def event_quantiles(values: pd.Series) -> Quantiles:
    """Quartiles and 95th percentile of values."""
    return Quantiles.model_validate(
        {f"p{percent}": float(values.quantile(percent / 100)) for percent in (25, 50, 75, 95)}
    )


def _profile(sampled: Sampled) -> Profile:
    """Sliding load by depth, per metre of path."""
    rows = sampled.rows
    depth = rows["depth_m"].to_numpy()
    levels = np.linspace(depth.min(), depth.max(), LOAD_DEPTH_BINS + 1)
    level = np.clip(np.searchsorted(levels, depth, side="right") - 1, 0, LOAD_DEPTH_BINS - 1)
    sums = np.zeros((sampled.frames, LOAD_DEPTH_BINS))
    np.add.at(sums, (rows["frame"].to_numpy(), level), rows["force_slide_n_m"].to_numpy())
    scale = sampled.path_m / sampled.frames * (levels[1] - levels[0])
    profile = estimates(sums, lambda means: means / scale)
    return Profile(edges_m=tuple(levels.tolist()), force_slide=EstimateColumns.of(profile))


# --- closure ---------------------------------------------------------------------------------


def _closure(sampled: Sampled, facets: pd.DataFrame, off_facet_m: float) -> LoadClosure:
    placed = facets[list(WORKPIECE)].to_numpy().sum(axis=0)
    missing = sampled.workpiece_impulse_n_s - placed
    return LoadClosure(
        workpiece_relative_error=float(
            np.linalg.norm(missing) / np.linalg.norm(sampled.workpiece_impulse_n_s)
        ),
        point_off_facet_max_m=off_facet_m,
    )
