"""Tables that pages show: the committed records, by name.

A name is the path of a file in ``docs/data`` without its ending (``motion/spin``), or one of
`RECORDS`, and for JSON the keys that lead to a part of it (``tradeoff/settings``). A list of
objects has one row per object, a mapping of objects one row per key (column ``name``), an object
one row. Columns of nested objects are joined by ``_``. `DERIVED` has the tables that need more, and
``study/<name>`` has the fields of a study, with ``_`` for a dot.
"""

import json
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pandas as pd

from dragchain.tradeoff.measures import QUANTITIES
from dragdeck.project import Project

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "docs/data"

LABELS = {quantity.name: quantity.label for quantity in QUANTITIES}
"""Quantities of the trade-off in words; those of an older record may differ."""

RECORDS = {
    "tradeoff": ROOT / "workflow/dragdeck/data/tradeoff.json",
    "stability": ROOT / "workflow/dragdeck/data/stability.json",
    "stable_step": ROOT / "workflow/dragdeck/data/stable_step.json",
    **{
        f"scaling/{file.stem}": file
        for file in (ROOT / "analysis/dragchain/scaling/data").glob("*.json")
    },
    **{
        str(file.relative_to(DATA).with_suffix("")): file
        for ending in ("csv", "json")
        for file in DATA.rglob(f"*.{ending}")
    },
}
"""File of each record."""

DERIVED: dict[str, Callable[["Store"], pd.DataFrame]] = {}
"""Tables that are computed from records; `derived` enters one."""


def derived(name: str) -> Callable[[Callable[["Store"], pd.DataFrame]], None]:
    """Enter a function that makes a table from the records under a name."""

    def enter(make: Callable[["Store"], pd.DataFrame]) -> None:
        DERIVED[name] = make

    return enter


class Store:
    """The records, each read once."""

    def __init__(self) -> None:
        self.record = cache(self._record)
        self.table = cache(self._table)

    def _record(self, name: str) -> Any:
        """What a file contains: a table, or the objects of JSON."""
        file = RECORDS[name]
        return pd.read_csv(file) if file.suffix == ".csv" else json.loads(file.read_text())

    def _table(self, name: str) -> pd.DataFrame:
        """A table of a name; KeyError if there is none."""
        if name in DERIVED:
            return DERIVED[name](self)
        if name.startswith("study/"):
            return study_fields(name.removeprefix("study/"))
        record, keys = self._split(name)
        part = self.record(record)
        for key in keys:
            part = part[int(key) if isinstance(part, list) else key]
        return part if isinstance(part, pd.DataFrame) else tabled(part)

    @staticmethod
    def _split(name: str) -> tuple[str, list[str]]:
        words = name.split("/")
        for count in range(len(words), 0, -1):
            record = "/".join(words[:count])
            if record in RECORDS:
                return record, words[count:]
        raise KeyError(f"no record {name!r}")


def tabled(part: Any) -> pd.DataFrame:
    """A part of a JSON document as a table."""
    if isinstance(part, dict) and part and all(isinstance(value, dict) for value in part.values()):
        part = [{"name": name, **value} for name, value in part.items()]
    if isinstance(part, dict) and part and all(isinstance(value, list) for value in part.values()):
        return pd.DataFrame(part)
    return pd.json_normalize(part, sep="_")


def study_fields(name: str) -> pd.DataFrame:
    """The fields of a study as one row."""
    study = Project(ROOT).cases(name)[0].study
    return pd.json_normalize(study.model_dump(mode="json"), sep="_")


@derived("tradeoff/errors")
def _tradeoff_errors(store: Store) -> pd.DataFrame:
    """One row per setting and quantity."""
    found = store.record("tradeoff")
    return pd.DataFrame(
        {
            **{key: value for key, value in setting.items() if key != "errors"},
            "quantity": quantity,
            "label": LABELS[quantity],
            "signed": found["quantities"][quantity]["signed"],
            **error,
        }
        for setting in found["settings"]
        for quantity, error in setting["errors"].items()
    )


STORE = Store()


def table(name: str) -> pd.DataFrame:
    """A table of the committed records."""
    return STORE.table(name)


import derived_cost  # noqa: E402, F401
import derived_explanation  # noqa: E402, F401
import derived_settings  # noqa: E402, F401
import derived_tradeoff  # noqa: E402, F401
import derived_validation  # noqa: E402, F401
