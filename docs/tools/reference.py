"""Texts of the reference pages that are made from the code."""

import argparse
import re
import types
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import pandas as pd
from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pybtex.database import parse_file
from pybtex.plugin import find_plugin
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined
from records import ROOT
from worked_examples import EXAMPLES, study_text

from dragchain.cli import PROGRAM as DRAGCHAIN
from dragchain.tables.columns import _UNITS as UNITS
from dragchain.tables.columns import unit_end
from dragdeck.cli import PROGRAM as DRAGDECK
from dragdeck.study.model import BUILT_IN_FIDELITIES, Fidelity, Study
from dragdeck.study.plausible import _RANGES as RANGES

NUMBERS = re.compile(r"[-+x ]*\d[\d., %]*(e[-+]\d+)?( \(.*\))?|")


def markdown_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown; columns of numbers are aligned to the right."""
    columns = list(zip(*rows, strict=True))
    right = [all(map(NUMBERS.fullmatch, cells)) and any(cells) for cells in columns]
    rules = ["---:" if numbers else "---" for numbers in right] or ["---"] * len(heads)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (heads, rules, *rows))


# --- command line --------------------------------------------------------------------


def command_sections(parser: argparse.ArgumentParser) -> str:
    """Every command of a program with its arguments."""
    return "\n\n".join(_commands(parser))


def _commands(parser: argparse.ArgumentParser) -> Iterator[str]:
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _commands(command)
            return
    about, usage = parser.description or "", " ".join(parser.format_usage().split()[1:])
    sentence = about[:1].upper() + about[1:].removesuffix(".") + "."
    yield f"### `{parser.prog}`\n\n{sentence}\n\n```text\n{usage}\n```"
    rows = [
        [f"`{_names(action)}`", _help(action)]
        for action in parser._actions
        if "--help" not in action.option_strings
    ]
    if rows:
        yield markdown_table(["argument", "meaning"], rows)


def _help(action: argparse.Action) -> str:
    return (action.help or "").replace("%(default)s", str(action.default)).replace("|", "\\|")


def _names(action: argparse.Action) -> str:
    value = str(action.metavar or action.dest.upper())
    if not action.option_strings:
        return str(action.metavar or action.dest)
    return ", ".join(action.option_strings) + ("" if action.nargs == 0 else f" {value}")


# --- tables of results -----------------------------------------------------------------


def columns() -> str:
    """A section for each table: the columns with unit, type and meaning."""
    rows = pd.read_csv(ROOT / "analysis/dragchain/tables/columns.csv", dtype=str)
    rows = rows.assign(table=rows["tables"].str.split()).explode("table")
    sections = []
    for table, own in rows.groupby("table", sort=False):
        cells = [
            [f"`{row.column}`", UNITS.get(unit_end(row.column.removesuffix("*")), ""),
             row.type, row.description]
            for row in own.itertuples()
        ]  # fmt: skip
        table_of = markdown_table(["column", "unit", "type", "meaning"], cells)
        sections.append(f"### `{table}`\n\n{table_of}")
    return "\n\n".join(sections)


# --- study file --------------------------------------------------------------------------


def fields() -> str:
    """One row per field, in one table per top-level key that has fields of its own."""
    groups: dict[str, list[list[str]]] = {}
    for name, *cells in _fields(Study, ""):
        head = re.match(r"(\w+)[.\[]", name)
        groups.setdefault(head[1] if head else "", []).append([f"`{name}`", *cells])
    heads = ["field", "limits", "default", "meaning"]
    parts = [markdown_table(heads, groups.pop("", []))]
    parts += [f"### `{name}`\n\n{markdown_table(heads, rows)}" for name, rows in groups.items()]
    return "\n\n".join(parts)


def _fields(model: type[BaseModel], prefix: str) -> Iterator[tuple[str, str, str, str]]:
    """Name, limits, default and meaning of every field, depth first."""
    for name, field in model.model_fields.items():
        path = f"{prefix}{name}"
        inner = list(_models(field.annotation))
        if not inner or any(get_args(part)[:1] == (str,) for part in _parts(field.annotation)):
            yield path, _limits(field), _default(field), field.description or ""
        for part, many in inner:
            kind = f"[{_kind(part)}]" if len(inner) > 1 else ""
            yield from _fields(part, f"{path}{kind}.{'*.' if many else ''}")


def _parts(annotation: Any) -> tuple[Any, ...]:
    """The alternatives of a union, nothing of any other type."""
    return get_args(annotation) if get_origin(annotation) in (Union, types.UnionType) else ()


def _kind(model: type[BaseModel]) -> str:
    """The word by which a model is told from its alternatives."""
    if model is Fidelity:
        return "settings"
    kind = model.model_fields.get("kind")
    return str(get_args(kind.annotation)[0]) if kind else model.__name__.lower()


def _models(annotation: Any, many: bool = False) -> Iterator[tuple[type[BaseModel], bool]]:
    """The models within a type, and whether there can be several of each."""
    origin = get_origin(annotation)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation, many
    elif origin is Annotated:
        yield from _models(get_args(annotation)[0], many)
    elif origin in (list, dict):
        yield from _models(get_args(annotation)[-1], True)
    for part in _parts(annotation):
        yield from _models(part, many)


_SIGNS = {Gt: ("above", "gt"), Ge: ("at least", "ge"), Lt: ("below", "lt"), Le: ("at most", "le")}


def _limits(field: FieldInfo) -> str:
    """Limits of a field in words; those of a model stand with its own fields."""
    if get_origin(field.annotation) is Literal:
        return " or ".join(f"`{value}`" for value in get_args(field.annotation))
    parts = [part for part in _parts(field.annotation) if part is not types.NoneType]
    if parts and all(get_origin(part) is Annotated for part in parts):
        plain = [part for part in parts if not list(_models(get_args(part)[0]))]
        return " or ".join(filter(None, (_limits(FieldInfo.from_annotation(one)) for one in plain)))
    found = [
        f"{words} {getattr(item, name):.10g}"
        for item in field.metadata
        for words, name in [_SIGNS.get(type(item), ("", ""))]
        if name
    ]
    lengths = [item.min_length for item in field.metadata if isinstance(item, MinLen)]
    lengths += [item.max_length for item in field.metadata if isinstance(item, MaxLen)]
    return ", ".join([*found, *([f"{' to '.join(map(str, lengths))} entries"] if lengths else [])])


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    if field.default is PydanticUndefined or field.default is None:
        return "none"
    return f"`{field.default}`" if isinstance(field.default, str) else f"{field.default!r}"


def fidelities() -> str:
    """The built-in fidelities and their settings."""
    names = list(Fidelity.model_fields)
    rows = []
    for name, fidelity in BUILT_IN_FIDELITIES.items():
        settings = [getattr(fidelity, field) for field in names]
        rows.append([f"`{name}`", *("none" if one is None else f"{one:g}" for one in settings)])
    return markdown_table(["name", *names], rows)


def plausible_ranges() -> str:
    """The values that give a warning, those that are refused, and the units that are tried."""
    heads = ["field", "warning outside", "refused outside", "other units tried"]
    rows = [
        [f"`{name}`", f"{one.low:g} to {one.high:g}", f"{one.least:g} to {one.most:g}",
         ", ".join(one.slips)]
        for name, one in RANGES.items()
    ]  # fmt: skip
    return markdown_table(heads, rows)


# --- bibliography ------------------------------------------------------------------------


def bibliography() -> str:
    """Every source, under an anchor of its key."""
    entries = parse_file(str(ROOT / "docs/references.bib"))
    style = find_plugin("pybtex.style.formatting", "plain")()
    backend = find_plugin("pybtex.backends", "markdown")()
    formatted = sorted(style.format_entries(entries.entries.values()), key=lambda one: one.key)
    return "\n\n".join(f"## {one.key}\n\n{one.text.render(backend)}" for one in formatted)


TEXTS: dict[str, Callable[[], str]] = {
    "fields": fields,
    "fidelities": fidelities,
    "ranges": plausible_ranges,
    "dragdeck": lambda: command_sections(DRAGDECK.parser()),
    "dragchain": lambda: command_sections(DRAGCHAIN.parser()),
    "columns": columns,
    "bibliography": bibliography,
    **{f"study_{name}": partial(study_text, name) for name in EXAMPLES},
}
"""What a page can enclose by two comments."""
