"""Load, sliding and friction on the workpiece over several packings."""

from collections.abc import Mapping, Sequence

import pandas as pd

from dragchain.loading.contact_events import Thresholds
from dragchain.loading.document import FILE, ContactType, Loading
from dragchain.statistics.estimate import Estimate
from dragchain.tables.by_step import read_table
from dragdeck.documents import Part
from evidence.validation.runs_by_bed import Point, over_packings

_PER_METRE = {
    "normal_impulse_n_s": "N s/m",
    "sliding_m": "m/m",
    "force_slide_n_m": "N m/m",
    "friction_work_j": "J/m",
}
"""Amounts per metre of path, each with its unit."""

_SHARES = ("events", "normal_impulse_n_s", "force_slide_n_m", "friction_work_j")


class LoadingRow(Part):
    """A number over the packings; the page has its name in words."""

    label: str
    unit: str
    value: float
    ci95_low: float
    ci95_high: float


class LoadingOverPackings(Part):
    """The loading over the packings.

    Attributes
    ----------
    rows : sequence of LoadingRow
    types : mapping
        Type of contact event to its percentages of all events and of amounts.
    closure : float
        Largest relative error of the sums over facets against the force on the workpiece.
    limits, sample_interval_s
        Of the first packing.
    """

    rows: tuple[LoadingRow, ...]
    types: Mapping[str, Mapping[str, Estimate]]
    closure: float
    limits: Thresholds
    sample_interval_s: float


def of_packings(packings: Sequence[Point]) -> LoadingOverPackings:
    """Average what `dragchain loading` found in every packing.

    Raises
    ------
    DocumentError
        If a packing has no ``loading.json``.
    """
    every = [Loading.read(point.folder / FILE) for point in packings]
    first, numbers = every[0], [_numbers(one) for one in every]
    return LoadingOverPackings(
        rows=tuple(
            LoadingRow(label=key[0], unit=key[1], **vars(over_packings([n[key] for n in numbers])))
            for key in numbers[0]
        ),
        types={kind: _shares([one.types[kind] for one in every]) for kind in first.types},
        closure=max(one.closure.facets_relative_error for one in every),
        limits=first.limits,
        sample_interval_s=first.sample_interval_s,
    )


def _numbers(loading: Loading) -> dict[tuple[str, str], float]:
    """The numbers that packings are compared by: name and unit to value."""
    front = loading.front_fraction
    fractions = {
        "friction_fraction_of_work": loading.friction_fraction_of_work,
        "front_fraction_normal_impulse": front["normal_impulse_n_s"],
        "front_fraction_force_slide": front["force_slide_n_m"],
        "load_while_sliding_fraction": loading.load_while_sliding_fraction,
    }
    return {
        ("mean_contacts", ""): loading.mean_contacts.value,
        **{(name, unit): loading.per_metre[name].value for name, unit in _PER_METRE.items()},
        **{(name, "%"): 100.0 * one.value for name, one in fractions.items()},
    }


def _shares(types: Sequence[ContactType]) -> dict[str, Estimate]:
    return {
        name: over_packings([100.0 * one.fraction_of[name].value for one in types])
        for name in _SHARES
    }


def facets(packings: Sequence[Point]) -> pd.DataFrame:
    """The facets of every packing, one row per facet and packing."""
    tables = [
        read_table(point.folder / "tables" / "facets.parquet").assign(packing=point.seed)
        for point in packings
    ]
    return pd.concat(tables, ignore_index=True)
