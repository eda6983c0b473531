"""Texts of the reference pages that are made from the code."""

import argparse
import csv
from collections.abc import Callable, Iterator
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path

from blocks import markdown_table
from pybtex.database import parse_file
from pybtex.plugin import find_plugin
from study_fields import fidelities, fields, plausible_ranges

from dragchain.cli import PROGRAM as DRAGCHAIN
from dragchain.tables.columns import _UNITS as UNITS
from dragchain.tables.columns import _rows, columns_of, descriptions, unit_end
from dragdeck.cli import PROGRAM as DRAGDECK

ROOT = Path(__file__).resolve().parents[2]


# --- command line --------------------------------------------------------------------


def commands(parser: argparse.ArgumentParser) -> str:
    """Every command of a program with its arguments."""
    return "\n\n".join(_commands(parser))


def _commands(parser: argparse.ArgumentParser) -> Iterator[str]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _commands(command)
            return
    program = parser.prog
    usage = " ".join(parser.format_usage().split()).removeprefix("usage: ")
    yield f"### `{program}`\n\n{_sentence(parser.description or '')}\n\n```text\n{usage}\n```"
    rows = [
        [
            f"`{_names(action)}`",
            (action.help or "").replace("%(default)s", str(action.default)).replace("|", "\\|"),
        ]
        for action in parser._actions
        if "--help" not in action.option_strings
    ]
    if rows:
        yield markdown_table(["argument", "meaning"], rows)


def _names(action: argparse.Action) -> str:
    if not action.option_strings:
        return str(action.metavar or action.dest)
    value = "" if action.nargs == 0 else f" {action.metavar or action.dest.upper()}"
    return ", ".join(action.option_strings) + value


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")


# --- results --------------------------------------------------------------------------


def columns(table: str) -> str:
    """The columns of a table: name, unit, type, meaning."""
    rows = []
    for name in columns_of(table):
        text = descriptions(name).get(table, "")
        rows.append([f"`{name}`", _unit(name), column_type(name, table), text])
    return markdown_table(["column", "unit", "type", "meaning"], rows)


def column_type(column: str, table: str) -> str:
    """The type of a column: number, integer, flag, text, list of integers, or any."""
    return next(
        row["type"]
        for row in _column_rows()
        if fnmatchcase(column, row["column"]) and table in row["tables"].split()
    )


@cache
def _column_rows() -> list[dict[str, str]]:
    with (ROOT / "analysis/dragchain/tables/columns.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _unit(name: str) -> str:
    return UNITS.get(unit_end(name.removesuffix("*")), "")


def all_columns() -> str:
    """A section for each table."""
    tables = dict.fromkeys(table for _, tables, _ in _rows() for table in tables)
    return "\n\n".join(f"### `{table}`\n\n{columns(table)}" for table in tables)


# --- bibliography ------------------------------------------------------------------------


def bibliography() -> str:
    """Every source, under an anchor of its key."""
    entries = parse_file(str(ROOT / "docs/references.bib"))
    style = find_plugin("pybtex.style.formatting", "plain")()
    backend = find_plugin("pybtex.backends", "markdown")()
    formatted = sorted(style.format_entries(entries.entries.values()), key=lambda one: one.key)
    return "\n\n".join(f"## {one.key}\n\n{one.text.render(backend)}" for one in formatted)


TEXTS: dict[str, Callable[[], str]] = {
    "study_fields": fields,
    "built_in_fidelities": fidelities,
    "plausible_ranges": plausible_ranges,
    "dragdeck_commands": lambda: commands(DRAGDECK.parser()),
    "dragchain_commands": lambda: commands(DRAGCHAIN.parser()),
    "columns": all_columns,
    "bibliography": bibliography,
}
"""What a block ``text`` can name."""
