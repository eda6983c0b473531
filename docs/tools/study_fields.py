"""The fields of a study file as tables, made from the model itself."""

import re
import types
from collections.abc import Iterator
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from blocks import markdown_table
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from dragdeck.study.model import BUILT_IN_FIDELITIES, Fidelity, Study
from dragdeck.study.plausible import _RANGES as RANGES


def fields() -> str:
    """One row per field, in one table per top-level key that has fields of its own."""
    groups: dict[str, list[tuple[str, str, str, str]]] = {}
    for row in _rows(Study, ""):
        head, dot, _ = row[0].partition(".")
        groups.setdefault(re.sub(r"\[.*", "", head) if dot or "[" in head else "", []).append(row)
    alone = groups.pop("", [])
    parts = [_table(alone)]
    parts += [f"### `{name}`\n\n{_table(rows)}" for name, rows in groups.items()]
    return "\n\n".join(parts)


def _table(rows: list[tuple[str, str, str, str]]) -> str:
    return markdown_table(
        ["field", "limits", "default", "meaning"], [[f"`{row[0]}`", *row[1:]] for row in rows]
    )


def _rows(model: type[BaseModel], prefix: str) -> Iterator[tuple[str, str, str, str]]:
    """Name, limits, default and meaning of every field, depth first."""
    for name, field in model.model_fields.items():
        path = f"{prefix}{name}"
        inner = list(_models(field.annotation))
        if not inner or _also_plain(field.annotation):
            yield path, _limits(field), _default(field), field.description or ""
        for part, many in inner:
            kind = f"[{_kind(part)}]" if len(inner) > 1 else ""
            yield from _rows(part, f"{path}{kind}.{'*.' if many else ''}")


def _also_plain(annotation: Any) -> bool:
    """Whether a plain value may stand where a model may."""
    parts = get_args(annotation) if _is_union(annotation) else ()
    return any(get_args(part)[:1] == (str,) for part in parts)


def _kind(model: type[BaseModel]) -> str:
    """Return the word by which a model is told from its alternatives."""
    if model is Fidelity:
        return "settings"
    kind = model.model_fields.get("kind")
    return str(get_args(kind.annotation)[0]) if kind else model.__name__.lower()


def _models(annotation: Any, many: bool = False) -> Iterator[tuple[type[BaseModel], bool]]:
    """The models within a type, and whether there can be several of each."""
    origin = get_origin(annotation)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation, many
    elif origin in (Union, types.UnionType):
        for part in get_args(annotation):
            yield from _models(part, many)
    elif origin is Annotated:
        yield from _models(get_args(annotation)[0], many)
    elif origin in (list, dict):
        yield from _models(get_args(annotation)[-1], True)


_SIGNS = {Gt: ("above", "gt"), Ge: ("at least", "ge"), Lt: ("below", "lt"), Le: ("at most", "le")}


def _limits(field: FieldInfo) -> str:
    if get_origin(field.annotation) is Literal:
        return " or ".join(f"`{value}`" for value in get_args(field.annotation))
    parts = get_args(field.annotation) if _is_union(field.annotation) else ()
    parts = tuple(part for part in parts if part is not types.NoneType)
    if parts and all(get_origin(part) is Annotated for part in parts):
        return " or ".join(filter(None, map(_limits_of_part, parts)))
    bounds = [(_SIGNS[type(item)], item) for item in field.metadata if type(item) in _SIGNS]
    found = [f"{words} {getattr(item, name):.10g}" for (words, name), item in bounds]
    lengths = [item.min_length for item in field.metadata if isinstance(item, MinLen)]
    lengths += [item.max_length for item in field.metadata if isinstance(item, MaxLen)]
    if lengths:
        found.append(f"{' to '.join(map(str, lengths))} entries")
    return ", ".join(found)


def _is_union(annotation: Any) -> bool:
    return get_origin(annotation) in (Union, types.UnionType)


def _limits_of_part(part: Any) -> str:
    """Limits of one of several plain forms of a value; of a model they stand with its fields."""
    annotation, *metadata = get_args(part)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return ""
    return _limits(FieldInfo.from_annotation(Annotated[annotation, *metadata]))  # type: ignore[arg-type]


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
        values = [getattr(fidelity, field) for field in names]
        rows.append([f"`{name}`", *("none" if one is None else f"{one:g}" for one in values)])
    return markdown_table(["name", *names], rows)


def plausible_ranges() -> str:
    """The values that give a warning, those that are refused, and the units that are tried."""
    heads = ["field", "warning outside", "refused outside", "other units tried"]
    rows = []
    for name, one in RANGES.items():
        usual, known = f"{one.low:g} to {one.high:g}", f"{one.least:g} to {one.most:g}"
        rows.append([f"`{name}`", usual, known, ", ".join(one.slips)])
    return markdown_table(heads, rows)
