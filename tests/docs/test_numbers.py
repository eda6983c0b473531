"""Numbers in the pages come from records."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from blocks import Records, renewed
from doc_pages import PAGES, name_of, prose
from page_files import changed_pages
from paths import ROOT
from tables import table


def test_every_page_is_up_to_date() -> None:
    """`./run docs` renews them."""
    assert [name_of(page) for page, _ in changed_pages()] == []


def test_a_made_part_may_contain_code_and_code_may_show_a_block() -> None:
    code = "```text\n{}\n```"
    shown = "```markdown\n<!-- text help -->old<!-- end -->\n```\n"
    page = "<!-- text help -->\n{}\n<!-- end -->\n\n" + shown
    records = Records(table, {"help": lambda: code.format("new")})
    found = renewed(Path("page.md"), page.format(code.format("old")), records)
    assert found == page.format(code.format("new"))


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
