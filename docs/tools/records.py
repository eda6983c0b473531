"""The committed records as tables, and what pages show of them.

A record has the name of its file in ``docs/data`` without the ending (``motion/spin``), one of
`RECORDS`, or ``study/<name>`` for the fields of a study. For JSON, keys lead to a part of it
(``tradeoff/settings/errors``). What is shown is a recipe: a record, its rows and a format. Rows are
an expression of pandas or a single word, the name of a row; every field of the format is an
expression over the columns::

    validation/packings, seed == 1: "{drag_n_mean:.2f} N in {1e3 * arc_m:.0f} mm"
"""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from string import Formatter
from typing import Any

import pandas as pd
from pydantic import JsonValue
from ways import ways_table

from dragdeck.project import Project
from dragdeck.study.base import Json

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "docs/data"

RECORDS = {
    "quantities": ROOT / "workflow/dragdeck/study/quantities.csv",
    **{file.stem: file for file in ROOT.glob("workflow/dragdeck/data/*.json")},
    **{
        f"scaling/{file.stem}": file for file in ROOT.glob("analysis/dragchain/scaling/data/*.json")
    },
    **{
        str(file.relative_to(DATA).with_suffix("")): file
        for ending in ("csv", "json")
        for file in DATA.rglob(f"*.{ending}")
    },
}
"""File of each record."""

# --- tables ------------------------------------------------------------------------------


@cache
def record_table(name: str) -> pd.DataFrame:
    """A record, or a part of one, as a table; KeyError if there is none."""
    if name == "ways":
        return ways_table(Project(ROOT))
    if name.startswith("study/"):
        study = Project(ROOT).cases(name.removeprefix("study/"))[0].study
        return pd.DataFrame(_rows(study.model_dump(mode="json")))
    record = max((known for known in RECORDS if f"{name}/".startswith(f"{known}/")), key=len)
    if RECORDS[record].suffix == ".csv":
        return pd.read_csv(RECORDS[record])
    keys = name.removeprefix(record).strip("/")
    return pd.DataFrame(_rows(document(record), keys.split("/") if keys else ()))


@cache
def document(name: str) -> Any:
    """The objects of a JSON record."""
    return json.loads(RECORDS[name].read_text(encoding="utf-8"))


def _rows(part: Any, keys: Sequence[str] = ()) -> Iterator[dict[str, JsonValue]]:
    """One row per object of a list or mapping (column ``name``), with what stands above it."""
    if isinstance(part, list):
        for item in part:
            yield from _rows(item, keys)
    elif part and all(isinstance(entry, dict) for entry in part.values()):
        for name, item in part.items():
            yield from ({"name": name, **row} for row in _rows(item, keys))
    elif keys:
        other = {key: value for key, value in part.items() if key != keys[0]}
        above = {key: value for key, value in _flat(other).items() if not isinstance(value, list)}
        for row in _rows(part[keys[0]], keys[1:]):
            yield {**above, **row}
    elif part and all(isinstance(entry, list) for entry in part.values()):
        yield from pd.DataFrame(part).to_dict("records")
    else:
        yield _flat(part)


def _flat(part: Json) -> dict[str, JsonValue]:
    """The values of nested objects, their keys joined by ``_``."""
    return pd.json_normalize(dict(part), sep="_").to_dict("records")[0]


def chosen(
    records: str | Sequence[str], rows: str = "", join: Mapping[str, str | list[str]] | None = None
) -> pd.DataFrame:
    """Rows of a record, or of several below each other; ValueError if there is none.

    A join has another ``record``, and the column or columns ``by`` which its columns are added.
    """
    names = [records] if isinstance(records, str) else records
    table = pd.concat([record_table(name) for name in names], ignore_index=True)
    if join is not None:
        other = chosen(join["record"])
        table = table.merge(other, on=join["by"], suffixes=("", "_joined"))
    if re.fullmatch(r"[\w.-]+", rows) and rows not in table:
        names = table["name"] if "name" in table else table.iloc[:, 0]
        table = table[names.astype(str) == rows]
    elif rows:
        table = table.query(rows, engine="python")
    if table.empty:
        raise ValueError(f"no row {rows!r}")
    return table.reset_index(drop=True)


def pivoted(table: pd.DataFrame, index: list[str], by: list[str]) -> pd.DataFrame:
    """Values of the columns `by` side by side: ``value_0_01`` for ``value`` where it is 0.01."""
    wide = table.set_index([*index, *by]).unstack(by, sort=False)
    wide.columns = pd.Index(["_".join(map(str, names)).replace(".", "_") for names in wide])
    return wide.reset_index()


# --- texts -------------------------------------------------------------------------------


def texts(table: pd.DataFrame, form: str) -> list[str]:
    """What a format shows of each row; every field is an expression over the columns."""
    shown = [""] * len(table)
    for literal, field, spec, _ in Formatter().parse(form):
        values = [""] * len(table) if field is None else _field(table, field, spec or "")
        shown = [f"{text}{literal}{value}" for text, value in zip(shown, values, strict=True)]
    return shown


def _field(table: pd.DataFrame, field: str, spec: str) -> list[str]:
    if spec.startswith("change"):
        ends = [table[field.replace("value", end)] for end in ("ci95_low", "ci95_high")]
        form = spec.removeprefix("change")
        return [change(*numbers, form) for numbers in zip(table[field], *ends, strict=True)]
    values = table[field] if field in table else table.eval(field, engine="python")
    if not isinstance(values, pd.Series):
        values = pd.Series([values] * len(table))
    return [shown_value(value, spec) for value in values.tolist()]


def shown_value(value: Any, spec: str) -> str:
    """A value by a format of Python; ``on|off`` are words for a truth value.

    ``%`` has a space before it, a zero no minus, and a number that is missing shows nothing.
    """
    if isinstance(value, bool):
        yes, _, no = spec.partition("|")
        return yes if value else no
    if value is None or value != value:
        return ""
    if spec.endswith("%"):
        text = f"{100 * value:{spec[:-1]}f} %"
    elif spec.endswith("d"):
        text = f"{round(value):{spec}}"
    else:
        text = f"{value:g}" if spec == "" and isinstance(value, float) else f"{value:{spec}}"
    return re.sub(r"^-(?=0(\.0*)?( %)?$)", "", text)


LARGE = 2
"""Relative changes from this on are shown as multiples."""


def change(value: float, low: float, high: float, form: str = "") -> str:
    """A relative change and its interval in per cent; n.s. if that includes zero."""

    def percent(fraction: float) -> str:
        text = f"{100 * fraction:+{form or ('.0f' if abs(fraction) >= 0.0995 else '.1f')}}"
        return text if float(text) else text[1:]

    if pd.isna(low):
        return ""
    interval = f"({percent(low)} to {percent(high)})"
    if pd.isna(value) or low < 0 < high:
        return f"n.s. {interval}"
    return f"{1 + value:.0f}-fold" if value >= LARGE else f"{percent(value)} {interval}"
