"""Study files as YAML: reading, and errors that name field, value and limit."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import (
    BaseModel,
    ValidationError,
)

from dragdeck.errors import InputError
from dragdeck.study.model import STUDY_FILE, Study


class _Loader(yaml.SafeLoader):
    """YAML of plain values that refuses a key given twice."""


def _mapping(loader: _Loader, node: yaml.MappingNode) -> dict[Any, Any]:
    seen: set[Any] = set()
    for key_node, _ in node.value:
        key = loader.construct_object(key_node)
        if key in seen:
            raise yaml.constructor.ConstructorError(
                None, None, f"key {key!r} is given twice", key_node.start_mark
            )
        seen.add(key)
    return loader.construct_mapping(node, deep=True)


def _refused(_: _Loader, node: yaml.Node) -> None:
    kind = node.tag.rpartition(":")[2]
    raise yaml.constructor.ConstructorError(
        None, None, f"a {kind} is no plain value; put text in quotes", node.start_mark
    )


_Loader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _mapping)
for _kind in ("timestamp", "binary", "set", "omap", "pairs"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_kind}", _refused)


def read_yaml(file: Path) -> dict[str, Any]:
    """Read a study file as plain data.

    Raises
    ------
    InputError
        The file is missing, is not YAML, or is not a mapping.
    """
    try:
        data = yaml.load(file.read_text(encoding="utf-8"), Loader=_Loader)
    except FileNotFoundError:
        raise InputError("no such study file", file=file, remedy=_studies_nearby(file)) from None
    except UnicodeDecodeError as error:
        raise InputError(
            "not UTF-8 text",
            file=file,
            value=f"byte {error.object[error.start]:#04x} at byte {error.start}",
            remedy="save it in the encoding UTF-8",
        ) from None
    except RecursionError:
        raise InputError("nested too deeply", file=file, remedy="remove a level") from None
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else "?"
        raise InputError(f"not YAML: {error.problem}", file=file, field=f"line {line}") from None
    except (yaml.YAMLError, ValueError, TypeError) as error:
        raise InputError(f"not YAML of plain values: {error}", file=file) from None
    if not isinstance(data, dict):
        raise InputError("a study is a mapping of fields", file=file, value=type(data).__name__)
    return data


def _studies_nearby(file: Path) -> str:
    names = sorted(found.parent.name for found in file.parent.parent.glob(f"*/{STUDY_FILE}"))
    return f"choose one of: {', '.join(names)}" if names else "check the path"


def validate(data: Mapping[str, Any], file: Path | str) -> Study:
    """Check plain data against the study model.

    Raises
    ------
    InputError
        Names the first field that is wrong, its value, its limit and a remedy.
    """
    try:
        return Study.model_validate(data)
    except ValidationError as error:
        raise explained(error, file) from None


_FORMS = ("cylinder", "circle", "line", "a-name", "a-number", "a-word", "settings", "a-tolerance")
"""Names of alternatives, which are no part of a field's dotted name."""

_LIMITS = {
    "greater_than": "greater than {gt}",
    "greater_than_equal": "at least {ge}",
    "less_than": "less than {lt}",
    "less_than_equal": "at most {le}",
    "finite_number": "a finite number",
}


def explained(error: ValidationError, file: Path | str) -> InputError:
    """The first problem that a model found in a file, as an error for the user."""
    issues = error.errors()
    first = issues[0]
    kind = first["type"]
    field = ".".join(str(part) for part in first["loc"] if part not in _FORMS)
    limit = _LIMITS[kind].format(**first.get("ctx", {})) if kind in _LIMITS else None
    problem, remedy = first["msg"].removeprefix("Value error, "), None
    value: object = first["input"]
    if kind == "extra_forbidden":
        problem, remedy = "unknown key", "remove it, or check its spelling against docs/study.md"
    elif kind == "missing":
        problem, remedy, value = "a required key is missing", "add it", None
    elif isinstance(value, Mapping | BaseModel):
        value = None
    if len(issues) > 1:
        more = f"{len(issues) - 1} more problem(s) stand in this file"
        remedy = f"{remedy}; {more}" if remedy else more
    return InputError(
        problem, file=file, field=field or None, value=_shown(value), limit=limit, remedy=remedy
    )


def _shown(value: object) -> str | None:
    if value is None:
        return None
    if isinstance(value, float) and math.isnan(value):
        return "NaN"
    return repr(value)
