"""Texts of the reference pages that are made from the code."""

import argparse
import ast
import inspect
import math
import re
import types
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from itertools import pairwise, takewhile
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
from dragdeck.cli import PROGRAM as DRAGDECK
from dragdeck.command_line import Program
from dragdeck.script.findings import rules
from dragdeck.study.fidelity import BUILT_IN_FIDELITIES, Fidelity
from dragdeck.study.model import Study
from dragdeck.study.plausible import plausible_range

NUMBERS = re.compile(r"[-+\u00d7 ]*\d[\d., %]*(e[-+]\d+)?( \(.*\))?|")


def markdown_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown; columns of numbers are aligned to the right."""
    columns = list(zip(*rows, strict=True))
    right = [all(map(NUMBERS.fullmatch, cells)) and any(cells) for cells in columns]
    rules = ["---:" if numbers else "---" for numbers in right] or ["---"] * len(heads)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (heads, rules, *rows))


# --- command line --------------------------------------------------------------------

OPTIONAL = re.compile(r"\[-(?:[^][]|\[[^]]*\])*\]")
"""An optional argument in a usage, such as ``[--var NAME [VALUE ...]]``."""


def command_sections(program: Program) -> str:
    """The commands of a program in a sentence each, and their options, each described once.

    Steps, which only rules call, are left out.
    """
    rows: list[list[str]] = []
    arguments: dict[tuple[str, str], list[str]] = {}
    *_, parsers = program.parser()._actions
    for name in (command.name for command in program.commands):
        command = parsers.choices[name]
        usage = _cell(" ".join(OPTIONAL.sub("", command.format_usage()).split()[2:]))
        about = re.split(r"\. (?=[A-Z])", command.description or "")[0]
        rows.append([f"`{usage}`", about[:1].upper() + about[1:].removesuffix(".") + "."])
        for action in command._actions:
            if action.option_strings and "--help" not in action.option_strings:
                arguments.setdefault((_names(action), _help(action)), []).append(name)
    described = [
        [f"`{name}`", ", ".join(f"`{use}`" for use in uses), meaning]
        for (name, meaning), uses in sorted(arguments.items(), key=lambda item: -len(item[1]))
    ]
    table = markdown_table(["command", "effect"], rows)
    return f"{table}\n\n{markdown_table(['option', 'commands', 'meaning'], described)}"


def _help(action: argparse.Action) -> str:
    text = (action.help or "").replace("%(default)s", str(action.default))
    return _cell(text.replace("%%", "%"))


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def _names(action: argparse.Action) -> str:
    words = action.metavar or action.dest.upper()
    value = words if isinstance(words, str) else " ".join(words)
    return ", ".join(action.option_strings) + ("" if action.nargs == 0 else f" {value}")


# --- tables of results -----------------------------------------------------------------


ENDS = re.compile(r"_(ci95_(?:low|high)|se)(?=_|\*|$)")
ONLY_IN_CSV = {"chains", "clusters", "impacts", "network", "summary", "thermo", "touch_events"}
"""Tables whose columns stand only in the file of all columns."""
PARTS = re.compile(r"^[wxyz] (?=component|coordinate)|(?:drag|lateral|vertical) (?=force)")


def columns() -> str:
    """A section for each table, or for tables that share three columns; the rest come first."""
    rows = pd.read_csv(ROOT / "analysis/dragchain/tables/columns.csv", dtype=str)
    ends = rows["column"].str.extract(ENDS)[0]
    marks = dict.fromkeys(rows["tables"] + " " + rows["column"], "")
    for tables, name, end in zip(rows["tables"], rows["column"], ends, strict=True):
        if isinstance(end, str):
            stems = {ENDS.sub(part, name).replace("**", "*") for part in ("", "_mean")}
            base = next(mark for mark in marks if tables in mark and mark.split()[-1] in stems)
            where = "" if base.startswith(f"{tables} {base.split()[-1]}") else f" in `{tables}`"
            marks[base] = f", with {'SE' if end == 'se' else 'CI'}{where}"
    rows["key"] = rows["description"].str.replace(PARTS, "", regex=True)
    rows["key"] += (rows["tables"] + " " + rows["column"]).map(marks)
    merged = rows[ends.isna()].groupby(["tables", "key"], sort=False)["column"].agg(list)
    counts = merged.groupby("tables").transform("size")
    heads = ["column", "meaning", "tables"]
    parts: dict[str, list[list[str]]] = {"In several tables": []}
    for (tables, meaning), names in merged.items():
        cells = [f"`{_braced(names)}`", meaning]
        listed = (
            ", ".join(f"`{name}`" for name in tables.split()) if tables.count(" ") < 7 else "most"
        )
        if " " in tables and counts[tables].max() < 3:
            parts["In several tables"].append([*cells, listed])
        else:
            parts.setdefault(listed, []).append(cells)
    return "\n\n".join(
        f"### {name}\n\n{markdown_table(heads[: len(cells[0])], cells)}"
        for name, cells in parts.items()
        if name.strip("`") not in ONLY_IN_CSV
    )


def _braced(names: Sequence[str]) -> str:
    """Names that differ in one part, as one: ``force_{x,y,z}_n``."""
    if len(names) == 1:
        return names[0]
    start, end = _common(names), _common([name[::-1] for name in names])
    parts = ",".join(name[start : len(name) - end] for name in names)
    return f"{names[0][:start]}{{{parts}}}{names[0][len(names[0]) - end :]}"


def _common(names: Sequence[str]) -> int:
    """Number of characters with which all names start."""
    return len(list(takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False))))


# --- study file --------------------------------------------------------------------------


@cache
def fields() -> dict[str, str]:
    """Fields of each top-level block as a table with their names in it; of none: ``study``."""
    merged: dict[tuple[str, ...], list[str]] = {}
    for name, *cells in _fields(Study, "", {}):
        head = re.match(r"(\w+)[.\[]", name)
        leaf = name.rpartition(".")[2]
        block = head[1] if head else "study"
        shown = name.removeprefix(block).removeprefix(".") if head else name
        merged.setdefault((block, leaf, *cells), []).append(shown)
    groups: dict[str, list[list[str]]] = {}
    for (head, _, *cells), names in merged.items():
        groups.setdefault(head, []).append([_named(names), *cells])
    heads = ["field", "limits, or (usual)", "default", "meaning"]
    return {name: markdown_table(heads, rows) for name, rows in groups.items()}


def _named(names: Sequence[str]) -> str:
    """Fields that share a row: one name for all kinds of a part."""
    kinds: dict[str, list[str]] = {}
    for name in names:
        stem, kind, leaf = re.fullmatch(r"(.*?)(?:\[(.*)\](.*))?", name).groups("")
        kinds.setdefault(stem + (f"[%s]{leaf}" if kind else ""), []).append(kind)
    lists = {
        stem: ",".join(suffixes) if len(suffixes) < 4 else "any" for stem, suffixes in kinds.items()
    }
    return ", ".join(f"`{stem.replace('%s', kind)}`" for stem, kind in lists.items())


def _fields(
    model: type[BaseModel], prefix: str, seen: dict[type[BaseModel], str]
) -> Iterator[tuple[str, str, str, str]]:
    """Name, limits with usual values, default and meaning of every field, depth first."""
    for name, field in model.model_fields.items():
        if name == "kind":  # stands in the brackets of the other fields
            continue
        path = f"{prefix}{name}"
        inner = list(_models(field.annotation))
        if not inner or any(get_args(part)[:1] == (str,) for part in _parts(field.annotation)):
            numbers = path if not _is_row(field.annotation) else f"{path}.0"
            usual = "" if isinstance(field.default, str) else numbers
            yield path, _usual(usual, _limits(field)), _default(field), _meanings(model)[name]
        known = [seen[part] for part, _ in inner if part in seen]
        if known:
            place = f"{path}.*" if inner[0][1] else path
            same = known[0] if len(inner) == 1 else known[0].partition("[")[0]
            yield place, "", "", f"as `{same}`"
            continue
        for part, many in inner:
            kind = f"[{_kind(part)}]" if len(inner) > 1 else ""
            seen[part] = f"{path}{kind}"
            yield from _fields(part, f"{path}{kind}.{'*.' if many else ''}", seen)


@cache
def _meanings(model: type[BaseModel]) -> dict[str, str]:
    """The docstring below each field of a model, or of a model that it extends."""
    meanings: dict[str, str] = {}
    for part in reversed(model.__mro__[: model.__mro__.index(BaseModel)]):
        (definition,) = ast.parse(inspect.getsource(part)).body
        for field, text in pairwise(definition.body):
            if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr):
                meanings[field.target.id] = " ".join(text.value.value.split())
    return meanings


def _is_row(annotation: Any) -> bool:
    """Whether it is several numbers, such as x and y."""
    return get_origin(annotation) is tuple and get_origin(get_args(annotation)[0]) is not tuple


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
        return ", ".join(f"`{value}`" for value in get_args(field.annotation))
    parts = [part for part in _parts(field.annotation) if part is not types.NoneType]
    if parts and all(get_origin(part) is Annotated for part in parts):
        plain = [part for part in parts if not list(_models(get_args(part)[0]))]
        return " or ".join(
            filter(None, (_limits(FieldInfo.from_annotation(part)) for part in plain))
        )
    limits = [
        f"{words} {getattr(item, name):.10g}"
        for item in field.metadata
        for words, name in [_SIGNS.get(type(item), ("", ""))]
        if name
    ]
    low = [item.min_length for item in field.metadata if isinstance(item, MinLen)]
    high = [item.max_length for item in field.metadata if isinstance(item, MaxLen)]
    if low or high:
        least = f"{low[0]} to {high[0]}" if low and high else f"up to {high[0]}" if high else ""
        limits.append(f"{least or f'{low[0]} or more'} entries")
    return ", ".join(limits)


_BOUND = re.compile(r"(above|at least|below|at most) ([^ ,]+),? ?")


def _usual(path: str, limits: str) -> str:
    """Limits within which a value is accepted; or, in brackets, those without a warning."""
    name, rest = re.sub(r"\[\w+\]", "", path), _BOUND.sub("", limits)
    bounds = {word: float(value) for word, value in _BOUND.findall(limits)}
    places = ((name, f"{name}.0"), [f"{name}.0.{index}" for index in range(7)])
    single, listed = ([*dict.fromkeys(filter(None, map(plausible_range, of)))] for of in places)
    first = single[:1] or listed
    if not first or ("`" in rest and not bounds):
        return limits
    accepted, usual = [], []
    for limit in first:
        low = max(
            limit.refused_below, bounds.get("above", -math.inf), bounds.get("at least", -math.inf)
        )
        high = min(
            limit.refused_above, bounds.get("below", math.inf), bounds.get("at most", math.inf)
        )
        above = "above " if low == bounds.get("above") else ""
        below = "below " if high == bounds.get("below") else ""
        accepted.append(f"{above}{low:.7g} to {below}{high:.7g}")
        usual.append(f"{max(low, limit.warned_below):.7g} to {min(high, limit.warned_above):.7g}")
    if usual != [re.sub("above |below ", "", text) for text in accepted]:
        return f"{rest.strip().removesuffix(' or')} ({'; '.join(usual)})".strip()
    return "; ".join([*filter(None, [rest.strip()]), *accepted]).replace("or; ", "or ")


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    if field.default is PydanticUndefined or field.default is None:
        return "none"
    return f"`{field.default}`" if isinstance(field.default, str) else f"{field.default!r}"


def fidelities() -> str:
    """The built-in fidelities and the settings in which they differ."""
    fields = {name: fidelity.model_dump() for name, fidelity in BUILT_IN_FIDELITIES.items()}
    names = [name for name in Fidelity.model_fields
             if len({str(values.get(name)) for values in fields.values()}) > 1]  # fmt: skip
    rows = [
        [f"`{name}`", *(f"{values[field]:g}" for field in names)] for name, values in fields.items()
    ]
    return markdown_table(["name", *names], rows)


# --- bibliography ------------------------------------------------------------------------

MANY = re.compile(r"^([^,\n]*)(?:, [^,\n]*){3,}")
"""The names of more than three authors, of which the first is shown."""


def bibliography() -> str:
    """Every source, under an anchor of its key."""
    entries = parse_file(str(ROOT / "docs/references.bib"))
    style = find_plugin("pybtex.style.formatting", "plain")()
    backend = find_plugin("pybtex.backends", "markdown")()
    formatted = sorted(style.format_entries(entries.entries.values()), key=lambda entry: entry.key)
    texts = (
        (entry.key, MANY.sub(r"\1 et al\\.", entry.text.render(backend))) for entry in formatted
    )
    return "\n\n".join(f"## {key}\n\n{text}" for key, text in texts)


def audit_rules() -> str:
    """The rules of ``dragdeck audit``."""
    rows = [(rule.id, rule.severity, rule.title) for rule in rules().values()]
    return markdown_table(("id", "severity", "title"), rows)


TEXTS: dict[str, Callable[[], str]] = {
    **{f"fields_{name}": partial(fields().__getitem__, name) for name in fields()},
    "fidelities": fidelities,
    "dragdeck": lambda: command_sections(DRAGDECK),
    "dragchain": lambda: command_sections(DRAGCHAIN),
    "columns": columns,
    "bibliography": bibliography,
    "rules": audit_rules,
    **{f"study_{name}": partial(study_text, name) for name in EXAMPLES},
}
"""What a page can enclose by two comments."""
