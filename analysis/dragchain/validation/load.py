"""Load, sliding and friction on the tool over several fills."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import pandas as pd

from dragchain.frames import read_table
from dragchain.removal import read_removal
from dragchain.validation.fills import Point, over_fills

Found = dict[str, Any]


def of_fills(fills: Sequence[Point]) -> Found:
    """What `dragchain.removal` says of every fill, and of all of them together.

    Parameters
    ----------
    fills : sequence of Point
        Each with the files of `dragchain.removal.write_removal` in its folder.

    Returns
    -------
    dict
        ``rows`` (``label``, ``unit``, ``value``, ``low``, ``high`` over fills), ``types``
        (type of stay to its shares in %), ``closure`` (largest relative error of the sums over
        facets against the force on the tool), ``first`` (``removal.json`` of the first fill).

    Raises
    ------
    TableError
        If a fill has no such files.
    """
    found = [read_removal(point.folder) for point in fills]
    rows = [
        {"label": label, "unit": unit, **over_fills([of(one) for one in found]).as_json()}
        for label, unit, of in _ROWS
    ]
    return {
        "rows": rows,
        "types": _types(found),
        "closure": max(one["closure"]["facets_relative_error"] for one in found),
        "first": found[0],
    }


def _per_metre(name: str) -> Callable[[Mapping[str, Any]], float]:
    return lambda one: float(one["per_metre"][name]["value"])


def _percent(*names: str) -> Callable[[Mapping[str, Any]], float]:
    def of(one: Mapping[str, Any]) -> float:
        for name in names:
            one = one[name]
        return 100.0 * float(one["value"])

    return of


_ROWS: list[tuple[str, str, Callable[[Mapping[str, Any]], float]]] = [
    ("contacts that press on the rod at once", "", lambda one: one["mean_contacts"]["value"]),
    ("normal impulse", "N s a metre of way", _per_metre("normal_impulse_ns")),
    ("sliding distance of all contacts", "m a metre", _per_metre("sliding_m")),
    ("normal force times sliding distance", "N m a metre", _per_metre("force_slide_nm")),
    ("friction work", "J a metre", _per_metre("friction_work_j")),
    ("friction work, share of the work of the rod", "%", _percent("friction_share_of_work")),
    ("front half, share of the normal impulse", "%", _percent("front_share", "normal_impulse_ns")),
    ("front half, share of force times sliding", "%", _percent("front_share", "force_slide_nm")),
    ("normal impulse carried while sliding", "%", _percent("load_while_sliding_share")),
]


def _types(found: Sequence[Mapping[str, Any]]) -> dict[str, Found]:
    """Shares of every type of stay in %, over fills."""
    quantities = ("events", "normal_impulse_ns", "force_slide_nm", "friction_work_j")
    return {
        kind: {
            name: over_fills(
                [100.0 * one["types"][kind]["share_of"][name]["value"] for one in found]
            ).as_json()
            for name in quantities
        }
        for kind in found[0]["types"]
    }


def facets(fills: Sequence[Point]) -> pd.DataFrame:
    """The facets of every fill, a row a facet and fill."""
    tables = [
        read_table(point.folder / "tables" / "facets.parquet").assign(fill=point.seed)
        for point in fills
    ]
    return pd.concat(tables, ignore_index=True)
