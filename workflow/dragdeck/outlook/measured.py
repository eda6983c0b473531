"""The measured trade-off of speed against accuracy."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import lru_cache
from importlib import resources
from typing import Any

from dragdeck.errors import InputError

TRADEOFF_FILE = "tradeoff.json"
TRADEOFF_SCHEMA = 2

Tradeoff = Mapping[str, Any]


@lru_cache(maxsize=1)
def measured_tradeoff() -> dict[str, Any]:
    """The measured trade: ``data/tradeoff.json`` of this package.

    Raises
    ------
    InputError
        It has not been measured, or another version of dragdeck wrote it.
    """
    file = resources.files("dragdeck").joinpath("data").joinpath(TRADEOFF_FILE)
    remedy = (
        "name a fidelity instead of a tolerance; or measure the trade, `snakemake tradeoff --config "
        "study=uhlmann2015 plan=long`, and copy its tradeoff.json to workflow/dragdeck/data/"
    )
    if not file.is_file():
        raise InputError(
            "no trade of speed against accuracy was measured, so no tolerance can be resolved",
            file=f"dragdeck/data/{TRADEOFF_FILE}",
            remedy=remedy,
        )
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    if found.get("schema") != TRADEOFF_SCHEMA:
        raise InputError(
            "a trade of another schema",
            file=f"dragdeck/data/{TRADEOFF_FILE}",
            field="schema",
            value=found.get("schema"),
            limit=str(TRADEOFF_SCHEMA),
            remedy=remedy,
        )
    return found


def tradeoff_if_measured() -> Tradeoff:
    """`measured_tradeoff`, or nothing where it cannot be read.

    For what is only told, not chosen.
    """
    try:
        return measured_tradeoff()
    except InputError:
        return {}
