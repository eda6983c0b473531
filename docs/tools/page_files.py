"""The pages of the documentation, and the records that they show."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from blocks import Records, renewed
from reference import TEXTS
from tables import table

ROOT = Path(__file__).resolve().parents[2]

PLACES = ("*.md", "docs/**/*.md", "studies/**/*.md", "config/*.md")


def pages() -> list[Path]:
    """Every page of the repository."""
    return sorted({page for place in PLACES for page in ROOT.glob(place)})


def records() -> Records:
    """The committed records."""
    return Records(table, TEXTS)


def changed_pages(names: Sequence[str] = ()) -> Iterator[tuple[Path, str]]:
    """Every page that is not up to date, with its text as it should be."""
    found = records()
    for page in pages():
        if names and not any(name in str(page) for name in names):
            continue
        text = page.read_text(encoding="utf-8")
        wanted = renewed(page.relative_to(ROOT), text, found)
        if wanted != text:
            yield page, wanted
