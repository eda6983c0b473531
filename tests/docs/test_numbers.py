"""Numbers in the pages come from records."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from blocks import Block, Records, blocks, selected
from doc_pages import PAGES, name_of, prose
from page_files import changed_pages
from paths import ROOT
from tables import STORE, Store

INPUTS = {
    "youngs_modulus_scale", "timestep_fraction", "speed_factor", "tolerance", "level", "scale",
    "schema", "seed", "confidence", "x", "revolutions", "restitution_entered",
}  # fmt: skip
"""Keys of what was chosen, not measured: rows are told apart by them."""


def test_every_page_is_up_to_date() -> None:
    """`./run docs` renews them."""
    assert [name_of(page) for page, _ in changed_pages()] == []


def changed(value: Any, key: str = "", factor: float = 1.1) -> Any:
    """A record in which every measured number differs by 10 %, up and down in turn."""
    if isinstance(value, pd.DataFrame):
        return value.apply(lambda column: _changed_column(column, str(column.name)))
    if isinstance(value, dict):
        return {name: changed(part, name) for name, part in value.items()}
    if isinstance(value, list):
        return [changed(part, key, (1.1, 0.9)[place % 2]) for place, part in enumerate(value)]
    if isinstance(value, bool) or key in INPUTS or not isinstance(value, (int, float)):
        return value
    return more(value, factor) if isinstance(value, int) else value * factor


def more(count: int, factor: float) -> int:
    """A whole number changed by 10 %, and at least by 1."""
    return round(count * factor) if round(count * factor) != count else count + 1


def _changed_column(column: pd.Series, name: str) -> pd.Series:
    if name in INPUTS or not pd.api.types.is_numeric_dtype(column) or column.dtype == bool:
        return column
    factors = np.where(np.arange(len(column)) % 2, 0.9, 1.1)
    if column.dtype.kind == "i":
        return pd.Series(map(more, column.tolist(), factors), index=column.index)
    return column * factors


CHANGED = Store(lambda name, record: changed(record))
BEFORE, AFTER = (Records(store.table, STORE.table, {}) for store in (STORE, CHANGED))


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_number_of_a_page_follows_its_record(page: Path) -> None:
    found = [block for block in blocks(page, page.read_text()) if block.kind != "text"]
    own = [block for block in found if not block.record.startswith("study/")]
    assert [text for block in own for text in staying(block)] == []


def staying(block: Block) -> Iterator[str]:
    """What a block shows of measured columns that do not change with the records."""
    query = block.what.splitlines()[0].removeprefix("table ").partition(" : ")[0]
    before, after = (list(selected(query, records)) for records in (BEFORE, AFTER))
    for name in re.findall(r"{(\w+)", block.what):
        values = [row[name] for row in before]
        if name in INPUTS or not any(is_number(value) for value in values):
            continue
        if values == [row[name] for row in after]:
            yield f"{query}: {name}"


def is_number(value: Any) -> bool:
    """Whether a value is a number, or a text that contains one, other than zero."""
    if isinstance(value, str):
        return bool(re.search(r"\d", value))
    return not isinstance(value, bool) and value == value and value != 0


def test_the_test_of_following_notices_a_typed_number() -> None:
    record = pd.DataFrame({"spin_ratio": [0.0, 1.0], "drag_n": [-2.5, -2.4]})
    other = changed(record)
    assert other["drag_n"].tolist() == pytest.approx([-2.75, -2.16])
    assert changed({"a": [1.0, 2.0], "n": True, "seed": 3}) == {
        "a": pytest.approx([1.1, 1.8]),
        "n": True,
        "seed": 3,
    }


# --- numbers that are typed ---------------------------------------------------------------

UNITS = (
    "N|mN|kN|Pa|kPa|MPa|GPa|mm|cm|m|km|um|µm|nm|s|ms|us|µs|ns|min|h|hours?|minutes?|seconds?|days?|"
    "microseconds?|milliseconds?|nanoseconds?|"
    r"kB|MB|GB|KiB|MiB|GiB|B|bytes?|Hz|kHz|1/min|rpm|J|mJ|N m|N s|rad|degrees?|°|%|"
    "m/s|mm/s|m/s2|kg|g|kg/m3|frames/s|steps/s|fold|times|core-hours?|CPU hours?"
)
NUMBER = re.compile(rf"(?<![\w.])[-+]?\d[\d,.]*(?:e[-+]?\d+)?(?:\s|-|\u00a0)?(?:{UNITS})(?![\w/])")

ALLOWED = ROOT / "docs/allowed_numbers.txt"
"""Lines `number unit | reason`; a line `page: number unit | reason` is about one page."""


def allowed() -> dict[str, str]:
    lines = [line for line in ALLOWED.read_text().splitlines() if line and line[0] != "#"]
    return {text.strip(): reason.strip() for text, reason in (line.split("|") for line in lines)}


def typed() -> Iterator[tuple[str, str]]:
    for page in PAGES:
        for found in NUMBER.findall(prose(page)):
            yield name_of(page), " ".join(found.split())


def test_no_number_with_a_unit_is_typed_without_a_reason() -> None:
    known = allowed()
    strange = {
        f"{page}: {number}"
        for page, number in typed()
        if number not in known and f"{page}: {number}" not in known
    }
    assert sorted(strange) == []


def test_every_allowed_number_is_typed_somewhere_and_has_a_reason() -> None:
    found = {text for page, number in typed() for text in (number, f"{page}: {number}")}
    assert [text for text, reason in allowed().items() if text not in found or not reason] == []


@pytest.mark.parametrize("text", ["a drag of -2.64 N", "25 % less", "took 3.5 hours", "310-fold"])
def test_a_typed_number_is_found(text: str) -> None:
    assert NUMBER.search(text)


@pytest.mark.parametrize("text", ["`-2.64 N`", "version 3.8.0", "E x 0.01", "section 5"])
def test_other_numbers_are_not(text: str) -> None:
    assert not NUMBER.search(re.sub(r"`[^`]*`", " ", text))
