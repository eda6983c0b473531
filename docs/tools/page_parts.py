"""Parts of pages that are made from records and code.

A page is plain Markdown that reads without any tool. A comment after a value names it, a comment
above a table names that, and two comments enclose text that is made from the code::

    The mean drag is -2.64 N<!--drag-->.

    <!--spin-->
    | spin ratio | mean drag (N) |
    ...

    <!--begin columns-->
    ...
    <!--end-->

Names are those of ``docs/values.csv``, of ``docs/tables.yaml`` and of `reference.TEXTS`.
"""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pandas as pd
import yaml
from records import ROOT, chosen, pivoted, texts
from reference import TEXTS, markdown_table

from dragdeck.study.base import Json

VALUES, TABLES = ROOT / "docs/values.csv", ROOT / "docs/tables.yaml"
PLACES = ("*.md", "docs/**/*.md", "studies/**/*.md", "config/*.md")

CODE = r"(?P<code>^(?P<indent> *)(?P<ticks>```+).*?^(?P=indent)(?P=ticks) *$|`[^`\n]*`)"
PART = re.compile(
    r"^<!--begin (?P<text>\w+)-->\n.*?^<!--end-->$|"
    rf"{CODE}|"
    r"^<!--(?P<table>\w+)-->\n(?:\|[^\n]*\n)*|"
    r"<!--(?P<value>\w+)-->",
    re.M | re.S,
)
"""What is made, or code, in which nothing is."""


class PageError(Exception):
    """A part of a page that cannot be made."""


def pages() -> list[Path]:
    """Every page of the repository."""
    return sorted({page for place in PLACES for page in ROOT.glob(place)})


@dataclass(frozen=True)
class Parts:
    """What pages contain: values by name as they stand there, and functions for the rest.

    Attributes
    ----------
    old : mapping of str to str
        Values as the pages have them.
    new : mapping of str to str
        Values as the records have them.
    table : callable
        Markdown of a table.
    text : callable
        Markdown from the code.
    """

    old: Mapping[str, str]
    new: Mapping[str, str]
    table: Callable[[str], str]
    text: Callable[[str], str]

    def renewed(self, page: str) -> str:
        """A page with all its parts made anew; PageError if the value before a name is unknown."""
        made, place = "", 0
        for part in PART.finditer(page):
            made += page[place : part.start()]
            place = part.end()
            if name := part["text"]:
                made += f"<!--begin {name}-->\n{self.text(name).strip()}\n<!--end-->"
            elif name := part["table"]:
                made += f"<!--{name}-->\n{self.table(name)}\n"
            elif name := part["value"]:
                made = f"{self._valued(made, name)}<!--{name}-->"
            else:
                made += part[0]
        return made + page[place:]

    def _valued(self, before: str, name: str) -> str:
        """The text before the name of a value, which ends with the value or with a space."""
        if name not in self.new:
            raise PageError(f"no value {name!r}")
        for value in (self.new[name], self.old.get(name, "")):
            words = r"\s+".join(map(re.escape, value.split()))
            if match := value and re.search(rf"(?<![\w.+-]){words}$", before[-400:]):
                shown = match[0] if value == self.new[name] else self.new[name]
                return before.removesuffix(match[0]) + shown
        if before[-1:] not in (" ", "\n", "("):
            wanted = f"{self.new[name]!r} or nothing"
            raise PageError(f"put {wanted} before <!--{name}-->: ...{before[-60:]!r}")
        return before + self.new[name]


# --- from the files ----------------------------------------------------------------------


@cache
def values() -> pd.DataFrame:
    """The values as committed: name, value, record, rows, format."""
    return pd.read_csv(VALUES, dtype=str, keep_default_na=False)


def _value(row: Mapping[str, str]) -> str:
    try:
        shown = set(texts(chosen(row["record"], row["rows"]), row["format"]))
    except Exception as error:
        raise PageError(f"value {row['name']!r}: {type(error).__name__}: {error}") from error
    if len(shown) != 1 or "" in shown:
        raise PageError(f"value {row['name']!r}: not one value, but {sorted(shown)}")
    return shown.pop()


def table_recipes() -> dict[str, Json]:
    """The recipe of each table: the parameters of `made_table`."""
    return yaml.safe_load(TABLES.read_text(encoding="utf-8"))


def made_table(
    columns: Mapping[str, str],
    record: str | Sequence[str],
    rows: str = "",
    join: Mapping[str, str | list[str]] | None = None,
    pivot: Mapping[str, list[str]] | None = None,
) -> str:
    """A table in Markdown.

    Parameters
    ----------
    columns : mapping of str to str
        The format of each column by its heading.
    record, rows, join
        As of `records.chosen`.
    pivot : mapping, optional
        ``index``: columns that name a row, and ``by``: those whose values go side by side.
    """
    table = chosen(record, rows, join)
    if pivot:
        table = pivoted(table, **pivot)
    cells = [texts(table, form) for form in columns.values()]
    return markdown_table(list(columns), list(zip(*cells, strict=True)))


def stale_files() -> Iterator[tuple[Path, str]]:
    """Every file that is not up to date, the values first, with its text as it should be."""
    old, recipes = values(), table_recipes()
    new = old.assign(value=[_value(row) for row in old.to_dict("records")])
    yield from _if_changed(VALUES, new.to_csv(index=False))
    parts = Parts(
        dict(old[["name", "value"]].to_numpy()),
        dict(new[["name", "value"]].to_numpy()),
        table=lambda name: made_table(**recipes[name]),
        text=lambda name: TEXTS[name](),
    )
    for page in pages():
        try:
            text = parts.renewed(page.read_text(encoding="utf-8"))
        except Exception as error:
            message = f"{page.relative_to(ROOT)}: {type(error).__name__}: {error}"
            raise PageError(message) from error
        yield from _if_changed(page, text)


def _if_changed(file: Path, text: str) -> Iterator[tuple[Path, str]]:
    if text != file.read_text(encoding="utf-8"):
        yield file, text
