"""Numbers in the pages come from records."""

import re
from collections.abc import Iterator
from pathlib import Path
from random import Random
from typing import Any

import pandas as pd
import pytest
from blocks import Block, Records, blocks, renewed, selected
from doc_pages import PAGES, name_of, prose
from page_files import changed_pages
from paths import ROOT
from tables import STORE, Store

INPUTS = {
    "confidence", "drag_mean_step", "fidelity_timestep_fraction", "fidelity_youngs_modulus_scale",
    "level", "restitution_entered", "revolutions", "scale", "schema", "seed", "speed_factor",
    "timestep_fraction", "timestep_ratio", "tolerance", "workpiece_contacts_step", "x",
    "youngs_modulus_scale",
}  # fmt: skip
"""Columns of what was chosen, not measured: rows are told apart by them."""

COUNTS = {
    "confirmed", "inside", "moduli", "packings", "pairs", "rejected", "runs", "scenes",
}  # fmt: skip
"""Columns of numbers of rows: they follow the rows of a record, not its numbers."""

TEXTS = {
    "kind",
    "change", "engine", "facets", "label", "levels", "map", "measured", "number_high", "number_low",
    "output", "processes", "program", "scene", "setting", "started", "versions_engine", "what",
    "words",
}  # fmt: skip
"""Columns of words of a record: names, dates, versions, and what a check saw."""


def test_every_page_is_up_to_date() -> None:
    """`./run docs` renews them."""
    assert [name_of(page) for page, _ in changed_pages()] == []


def test_a_made_part_may_contain_code_and_code_may_show_a_block() -> None:
    code = "```text\n{}\n```"
    shown = "```markdown\n<!-- text help -->old<!-- end -->\n```\n"
    page = "<!-- text help -->\n{}\n<!-- end -->\n\n" + shown
    records = Records(STORE.table, STORE.table, {"help": lambda: code.format("new")})
    found = renewed(Path("page.md"), page.format(code.format("old")), records)
    assert found == page.format(code.format("new"))


def changed(value: Any, chance: Random, key: str = "") -> Any:
    """A record in which every measured number is 10 % larger or smaller, by chance."""
    if isinstance(value, pd.DataFrame):
        return value.apply(lambda column: _changed_column(column, chance))
    if isinstance(value, dict):
        return {name: changed(part, chance, name) for name, part in value.items()}
    if isinstance(value, list):
        return [changed(part, chance, key) for part in value]
    if isinstance(value, bool) or key in INPUTS or not isinstance(value, (int, float)):
        return value
    factor = chance.choice((0.9, 1.1))
    return more(value, factor) if isinstance(value, int) else value * factor


def more(count: int, factor: float) -> int:
    """A whole number changed by 10 %, and at least by 1."""
    return round(count * factor) if round(count * factor) != count else count + 1


def _changed_column(column: pd.Series, chance: Random) -> pd.Series:
    if column.name in INPUTS or column.dtype == bool or not pd.api.types.is_numeric_dtype(column):
        return column
    return pd.Series([changed(value, chance) for value in column.tolist()], index=column.index)


def records_of(store: Store) -> Records:
    return Records(store.table, STORE.table, {})


BEFORE = records_of(STORE)
AFTER = [
    records_of(Store(lambda name, record, seed=seed: changed(record, Random(f"{seed} {name}"))))
    for seed in range(3)
]
"""Two numbers that change alike keep their ratio: hence several."""


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_number_of_a_page_follows_its_record(page: Path) -> None:
    found = [block for block in blocks(page, page.read_text()) if block.kind != "text"]
    own = [block for block in found if not block.record.startswith("study/")]
    assert [text for block in own for text in staying(block)] == []


def staying(block: Block) -> Iterator[str]:
    """What a block shows of measured columns that do not change with the records."""
    query = block.what.splitlines()[0].removeprefix("table ").partition(" : ")[0]
    before = list(selected(query, BEFORE))
    after = [list(selected(query, records)) for records in AFTER]
    for name in set(re.findall(r"{(\w+)", block.what)) - INPUTS - COUNTS - TEXTS:
        values = [row[name] for row in before]
        if not any(is_number(value) for value in values):
            continue
        if all(values == [row[name] for row in rows] for rows in after):
            yield f"{query}: {name}"


def is_number(value: Any) -> bool:
    """Whether a value is a number, or a text that contains one, other than zero."""
    if isinstance(value, str):
        return bool(re.search(r"\d", value))
    return not isinstance(value, bool) and value == value and value != 0


def test_every_measured_number_of_a_record_changes_by_10_percent() -> None:
    record = {"a": [1.0, 2.0], "n": 3, "good": True, "seed": 3, "what": "x 5"}
    found = changed(record, Random(0))
    assert {round(found["a"][0], 9), round(found["a"][1] / 2, 9)} <= {0.9, 1.1}
    assert found["n"] != 3 and (found["good"], found["seed"], found["what"]) == (True, 3, "x 5")


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
