"""Load, sliding and friction on the workpiece over several fills."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import pandas as pd

from dragchain.loading.document import Loading
from dragchain.loading.write import read_loading
from dragchain.statistics.estimate import Estimate
from dragchain.tables.by_step import read_table
from dragchain.validation.runs_by_bed import Point, over_packings

Found = dict[str, Any]


def of_packings(packings: Sequence[Point]) -> Found:
    """What `dragchain.removal` says of every fill, and of all of them together.

    Parameters
    ----------
    fills : sequence of Point
        Each with the files of `dragchain.removal.write_loading` in its folder.

    Returns
    -------
    dict
        ``rows`` (``label``, ``unit``, ``value``, ``low``, ``high`` over fills), ``types``
        (type of stay to its shares in %), ``closure`` (largest relative error of the sums over
        facets against the force on the workpiece), ``first`` (``loading.json`` of the first fill).

    Raises
    ------
    TableError
        If a fill has no such files.
    """
    found = [read_loading(point.folder) for point in packings]
    rows = [
        {"label": label, "unit": unit, **over_packings([of(one) for one in found]).as_json()}
        for label, unit, of in _ROWS
    ]
    return {
        "rows": rows,
        "types": _types(found),
        "closure": max(one.closure.facets_relative_error for one in found),
        "first": found[0],
    }


def _per_metre(name: str) -> Callable[[Loading], float]:
    return lambda one: one.per_metre[name].value


def _percent(of: Callable[[Loading], Estimate]) -> Callable[[Loading], float]:
    return lambda one: 100.0 * of(one).value


_ROWS: list[tuple[str, str, Callable[[Loading], float]]] = [
    ("contacts that press on the workpiece at once", "", lambda one: one.mean_contacts.value),
    ("normal impulse", "N s a metre of way", _per_metre("normal_impulse_n_s")),
    ("sliding distance of all contacts", "m a metre", _per_metre("sliding_m")),
    ("normal force times sliding distance", "N m a metre", _per_metre("force_slide_n_m")),
    ("friction work", "J a metre", _per_metre("friction_work_j")),
    (
        "friction work, share of the work of the workpiece",
        "%",
        _percent(lambda one: one.friction_fraction_of_work),
    ),
    (
        "front half, share of the normal impulse",
        "%",
        _percent(lambda one: one.front_fraction["normal_impulse_n_s"]),
    ),
    (
        "front half, share of force times sliding",
        "%",
        _percent(lambda one: one.front_fraction["force_slide_n_m"]),
    ),
    (
        "normal impulse carried while sliding",
        "%",
        _percent(lambda one: one.load_while_sliding_fraction),
    ),
]


def _types(found: Sequence[Loading]) -> dict[str, Found]:
    """Shares of every type of stay in %, over fills."""
    quantities = ("events", "normal_impulse_n_s", "force_slide_n_m", "friction_work_j")
    return {
        kind: {
            name: over_packings(
                [100.0 * one.types[kind].fraction_of[name].value for one in found]
            ).as_json()
            for name in quantities
        }
        for kind in found[0].types
    }


def facets(packings: Sequence[Point]) -> pd.DataFrame:
    """The facets of every fill, a row a facet and fill."""
    tables = [
        read_table(point.folder / "tables" / "facets.parquet").assign(packing=point.seed)
        for point in packings
    ]
    return pd.concat(tables, ignore_index=True)
