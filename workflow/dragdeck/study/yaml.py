"""Study files as YAML: reading, and errors that name file, line, field, value and limit."""

import math
import re
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, cast

import yaml
from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from dragdeck.errors import Caution, InputError, near, together
from dragdeck.study.base import DECIMAL, Model
from dragdeck.study.consistency import contradictions
from dragdeck.study.model import STUDY_FILE, Study
from dragdeck.study.plausible import implausible


class _Loader(yaml.SafeLoader):
    """YAML that refuses a key given twice, and whose numbers are decimal.

    ``1:30``, ``0300``, ``0x1F``, dates, and ``yes`` or ``on`` are text, as in YAML 1.2. There are
    no aliases: a few lines of them hold more values than any memory.
    """

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """A node of the file, if it stands there itself."""
        if self.check_event(yaml.AliasEvent):
            problem, events = "aliases are not read; write the value again", cast(Any, self)
            raise yaml.composer.ComposerError(None, None, problem, events.peek_event().start_mark)
        return super().compose_node(parent, index)


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
for _kind in ("binary", "set", "omap", "pairs"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_kind}", _refused)


_LONGEST_NUMBER, _LONGEST_SHOWN = 40, 200
_PLAIN = re.compile(rf"{DECIMAL.pattern}|[-+]?\.(inf|nan)|true|false", re.ASCII | re.IGNORECASE)


def _scalar(loader: _Loader, node: yaml.ScalarNode) -> Any:
    """A decimal number or a truth value; whatever else YAML 1.1 has a type for is text."""
    read = yaml.SafeLoader.yaml_constructors[node.tag]
    plain = len(node.value) <= _LONGEST_NUMBER and _PLAIN.fullmatch(node.value)
    return read(loader, node) if plain else node.value


for _tag in ("bool", "float", "int", "timestamp"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_tag}", _scalar)


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


def located(error: InputError) -> InputError:
    """The error with the line of its field in the file, where both are known."""
    file = error.file
    if error.line is None and error.field and isinstance(file, Path) and file.is_file():
        lines, field = _line_table(file.read_bytes()), error.field
        while field and not {f"sweep.{field}", field} & set(lines):
            field = field.rpartition(".")[0]
        error.line = lines.get(f"sweep.{field}", lines.get(field))
    for other in error.more:
        located(other)
    return error


@lru_cache(maxsize=4)
def _line_table(content: bytes) -> Mapping[str, int]:
    """The lines of a study's fields; none of a file that is no study."""
    try:
        return dict(_lines(yaml.compose(content.decode(), Loader=_Loader), ""))
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError):
        return {}


def _lines(node: yaml.Node | None, prefix: str) -> Iterator[tuple[str, int]]:
    """The line of every dotted field, counted from 1."""
    items: list[tuple[str, yaml.Node, yaml.Node]] = []
    if isinstance(node, yaml.MappingNode):
        items = [(str(key.value), key, value) for key, value in node.value]
    elif isinstance(node, yaml.SequenceNode):
        items = [(str(index), item, item) for index, item in enumerate(node.value)]
    for name, place, value in items:
        yield f"{prefix}{name}", place.start_mark.line + 1
        yield from _lines(value, f"{prefix}{name}.")


def validate(data: Mapping[str, Any], file: Path | str, *, whole: bool = False) -> Study:
    """Check plain data against the study model, and its values against each other.

    Parameters
    ----------
    data : mapping
    file : Path or str
        For error messages.
    whole : bool
        Whether it is a study with its sweep, and not a case of it.

    Raises
    ------
    InputError
        Names every problem with its line, field, value, limit and a remedy.
    """
    found, study = [], None
    try:
        study = Study.model_validate(data)
    except ValidationError as error:
        found = _problems(error)
    wrong = {error.field for error in found}
    doubts = [row for row in implausible(data) if row[0].field not in wrong]
    found += [error for error, _ in doubts]
    doubtful = {error.field for error in found}
    others = contradictions(study, whole) if study else iter(())
    more = [error for error in others if error.field not in doubtful]
    if study is None or more or any(refused for _, refused in doubts):
        raise _of_file([*found, *more], file)
    return study


def warnings(study: Study) -> list[Caution]:
    """Values of a valid study that are hardly meant, one line each."""
    return [
        Caution(
            "implausible", f"{one.field} {one.value:g} {one.problem}; {one.remedy}; {one.limit}"
        )
        for one, _ in implausible(study.plain())
    ]


_FORMS = (
    "cylinder",
    "circle",
    "line",
    "a-name",
    "a-number",
    "a-word",
    "settings",
    "a-tolerance",
    "[key]",
)
"""Names of alternatives, which are no part of a field's dotted name."""

_LIMITS = {
    "greater_than": "greater than {gt}",
    "greater_than_equal": "at least {ge}",
    "less_than": "less than {lt}",
    "less_than_equal": "at most {le}",
    "finite_number": "a finite number",
}


def explained(error: ValidationError, file: Path | str) -> InputError:
    """What a model found in a file, as one error for the user."""
    return _of_file(_problems(error), file)


def _of_file(found: list[InputError], file: Path | str) -> InputError:
    for error in found:
        error.file = file
    return located(together(found))


def _problems(error: ValidationError) -> list[InputError]:
    return [_problem(issue) for issue in error.errors()]


def _problem(issue: ErrorDetails) -> InputError:
    """One problem that a model found."""
    kind = issue["type"]
    field = ".".join(str(part) for part in issue["loc"] if part not in _FORMS)
    limit = _LIMITS[kind].format(**issue.get("ctx", {})) if kind in _LIMITS else None
    problem, remedy = issue["msg"].removeprefix("Value error, "), None
    value: object = issue["input"]
    if kind == "extra_forbidden":
        hint = near(str(issue["loc"][-1]), _every_key())
        problem, remedy = "unknown key", f"{hint}remove it, or see docs/study.md for its spelling"
    elif kind == "missing":
        problem, remedy, value = "a required key is missing", "add it", None
    if isinstance(value, Mapping | BaseModel):
        value = None
    return InputError(problem, field=field or None, value=_shown(value), limit=limit, remedy=remedy)


def _every_key(model: type[Model] = Model) -> set[str]:
    """Every key that some part of a study may have."""
    inner = (_every_key(part) for part in model.__subclasses__())
    return set(model.model_fields).union(*inner)


def _shown(value: object) -> str | None:
    if value is None:
        return None
    if isinstance(value, float) and math.isnan(value):
        return "NaN"
    return repr(value)[:_LONGEST_SHOWN]
