"""Parts of pages that are made from records.

A page is plain Markdown. A part of it between two comments is made from the record that the
first comment names, and is kept in the page, so that it reads without any tool::

    The mean is <!-- motion/spin spin_ratio=0 : {drag_n:.2f} N -->-2.56 N<!-- end -->.

    <!-- table motion/spin
    spin ratio :> {spin_ratio:g}
    mean drag (N) :> {drag_n:.2f}
    -->
    ...
    <!-- end -->

    <!-- text commands -->
    ...
    <!-- end -->

``record key=value ...`` selects rows of a table; a value in single quotes may contain spaces. What
follows the colon is a format string of Python over the columns of the row. ``:>`` aligns a column
to the right.
"""

import re
import shlex
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

CODE = r"(?P<code>^(?P<indent> *)(?P<ticks>```+).*?^(?P=indent)(?P=ticks) *$)"
BLOCK = re.compile(
    rf"{CODE}|"
    r"(?P<head><!-- (?P<what>[a-z](?:[^-]|-(?!->))*?)\s*-->).*?(?P<tail><!-- end -->)",
    re.M | re.S,
)
"""A block, or code in which nothing is made; what is made may contain code."""


class BlockError(Exception):
    """A block that cannot be made: page, block, problem."""


class Shown(float):
    """A number as pages show it: a space before the per cent sign, nothing where there is none."""

    def __format__(self, spec: str) -> str:
        """Format it; ``1f?`` omits nothing, ``%`` multiplies by 100 and adds a space."""
        if self != self:
            return ""
        if spec.endswith("%"):
            return f"{100 * float(self):{spec[:-1]}f} %".replace("-0 %", "0 %")
        if spec == "":
            return f"{float(self):g}"
        if spec.endswith("d"):
            return f"{round(float(self)):{spec}}"
        return format(float(self), spec)


@dataclass(frozen=True)
class Block:
    """A part of a page that is made, by what it says of itself."""

    page: Path
    what: str

    @property
    def kind(self) -> str:
        """``table``, ``text`` or ``row``."""
        first = self.what.split(maxsplit=1)[0]
        return first if first in ("table", "text") else "row"

    @property
    def record(self) -> str:
        """Name of the table or text that it is made from."""
        words = self.what.split()
        return words[0] if self.kind == "row" else words[1]


@dataclass(frozen=True)
class Records:
    """What blocks are made from.

    Attributes
    ----------
    table : callable
        Table of a name.
    text : mapping of str to callable
        Markdown of a name.
    """

    table: Callable[[str], pd.DataFrame]
    text: Mapping[str, Callable[[], str]]


def without_blocks(text: str) -> str:
    """A page without what is made, for checks of what is typed."""
    return BLOCK.sub(lambda found: found["code"] or " ", text)


ROW = r"(?=<!-- (?!table |text |end)[a-z][^>]*? : )"
LINE_START = re.compile(rf"{CODE}|(?<=[^\n])\n(?:> )?[ \t]*{ROW}", re.M | re.S)
PARAGRAPH_START = re.compile(
    rf"{CODE}|^[ \t]*(?:[-*] +|\d+\. +|> +)?{ROW}(?P<row>[^\n]*)", re.M | re.S
)
"""Where Markdown takes a comment for the start of HTML code."""


def renewed(page: Path, text: str, records: Records) -> str:
    """A page with every block made anew; a row that starts a line moves to the line before.

    Raises
    ------
    BlockError
        If a block cannot be made, or if a row starts a paragraph.
    """
    text = LINE_START.sub(lambda found: found["code"] or " ", text)
    for found in PARAGRAPH_START.finditer(text):
        if row := found["row"]:
            raise BlockError(f"{page}: a paragraph must not start with a row: {row[:80]}")

    def made(found: re.Match[str]) -> str:
        if found["code"]:
            return found["code"]
        block = Block(page, found["what"])
        return f"{found['head']}{content(block, records)}{found['tail']}"

    return BLOCK.sub(made, text)


def content(block: Block, records: Records) -> str:
    """What stands between the two comments of a block."""
    try:
        if block.kind == "text":
            return f"\n{records.text[block.record]().strip()}\n"
        if block.kind == "row":
            return _row(block.what, records)
        return f"\n{_table(block.what, records)}\n"
    except Exception as error:
        raise BlockError(
            f"{block.page}: {block.what!r}: {type(error).__name__}: {error}"
        ) from error


def _row(what: str, records: Records) -> str:
    query, _, template = what.partition(" : ")
    rows = list(selected(query, records))
    if len(rows) != 1:
        raise ValueError(f"{len(rows)} rows instead of one")
    return template.strip().format(**rows[0])


def _table(what: str, records: Records) -> str:
    first, *columns = what.splitlines()
    heads, rules, templates = [], [], []
    for line in columns:
        head, right, template = re.fullmatch(r"\s*(.*?) :(>?) ?(.*)", line).groups()  # type: ignore[union-attr]
        heads.append(head)
        rules.append("---:" if right else "---")
        templates.append(template)
    rows = selected(first.removeprefix("table "), records)
    return markdown_table(heads, ([one.format(**row) for one in templates] for row in rows), rules)


def markdown_table(
    heads: Sequence[str], rows: Iterable[Sequence[str]], rules: Sequence[str] = ()
) -> str:
    """A table in Markdown; `rules` are the marks of alignment, one per column."""
    lines = [heads, rules or ["---"] * len(heads), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)


def selected(query: str, records: Records) -> Iterator[dict[str, Any]]:
    """The rows of a table that have the values of a query."""
    name, *conditions = shlex.split(query)
    table = records.table(name)
    chosen = pd.Series(True, index=table.index)
    for condition in conditions:
        column, _, value = condition.partition("=")
        if column.endswith("!"):
            chosen &= ~_is(table[column[:-1]], value)
        else:
            chosen &= _is(table[column], value)
    for row in table[chosen.to_numpy()].to_dict("records"):
        yield {str(name): _shown(value) for name, value in row.items()}


def _is(column: pd.Series, value: str) -> pd.Series:
    if value == "":
        return column.isna() | (column.astype(str) == "")
    if pd.api.types.is_numeric_dtype(column) and not pd.api.types.is_bool_dtype(column):
        return column == float(value)
    return column.astype(str) == value


def _shown(value: Any) -> Any:
    if isinstance(value, bool):
        return value
    if isinstance(value, (int, float)):
        return Shown(value)
    return "" if value is None or value is pd.NA else value
