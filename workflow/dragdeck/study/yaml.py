"""Study files as YAML: reading them, with what they take from others, and the lines of fields."""

import math
import re
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, cast

import yaml
from pydantic import JsonValue

from dragdeck.errors import InputError, choices
from dragdeck.shipped import SHIPPED
from dragdeck.study.base import DECIMAL, NAME, STUDY_FILE, Json
from dragdeck.study.media import INSTEAD_OF


class _Loader(yaml.SafeLoader):
    """YAML that refuses a key given twice, and whose numbers are decimal.

    ``1:30``, ``0300``, ``0x1F``, dates, and ``yes`` or ``on`` are text, as in YAML 1.2. There are
    no aliases: a few lines of them hold more values than any memory.
    """

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """A node of the file, if it stands there itself."""
        if self.check_event(yaml.AliasEvent):
            problem, events = "aliases are not supported; repeat the value", cast(Any, self)
            raise yaml.composer.ComposerError(None, None, problem, events.peek_event().start_mark)
        return super().compose_node(parent, index)


def _mapping(loader: _Loader, node: yaml.MappingNode) -> dict[Any, Any]:
    seen: set[Any] = set()
    for number, (key_node, value_node) in enumerate(node.value):
        plain = isinstance(key_node, yaml.ScalarNode)
        if number and plain and key_node.value.isdecimal() and not value_node.value:
            _refuse_decimal_comma(node.value[number - 1][1], key_node)
        key = None if key_node.tag.endswith(":merge") else loader.construct_object(key_node)
        problem = f"key {key!r} is given twice" if isinstance(key, str) and key in seen else None
        if not isinstance(key, str):
            problem = "a key is text, in quotes if YAML reads another thing; << is not supported"
        if problem:
            raise yaml.constructor.ConstructorError(None, None, problem, key_node.start_mark)
        seen.add(key)
    return loader.construct_mapping(node, deep=True)


def _refuse_decimal_comma(before: yaml.Node, key: yaml.ScalarNode) -> None:
    """Refuse ``{radius_m: 0,025}``, whose second part is a key without a value."""
    if isinstance(before, yaml.ScalarNode) and before.value.lstrip("+-").isdecimal():
        problem = f"a decimal comma in {before.value},{key.value}: write {before.value}.{key.value}"
        raise yaml.constructor.ConstructorError(None, None, problem, before.start_mark)


def _refused(_: _Loader, node: yaml.Node) -> None:
    kind = node.tag.rpartition(":")[2]
    raise yaml.constructor.ConstructorError(
        None, None, f"a {kind} is not a plain value; put text in quotes", node.start_mark
    )


_Loader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _mapping)
for _kind in ("binary", "set", "omap", "pairs"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_kind}", _refused)


_NULL = "tag:yaml.org,2002:null"
_LONGEST_NUMBER, _LONGEST_SHOWN = 40, 200
_PLAIN = re.compile(rf"{DECIMAL.pattern}|[-+]?\.(inf|nan)|true|false", re.ASCII | re.IGNORECASE)


def _scalar(loader: _Loader, node: yaml.ScalarNode) -> Any:
    """A decimal number or a truth value; whatever else YAML 1.1 has a type for is text."""
    read = yaml.SafeLoader.yaml_constructors[node.tag]
    plain = len(node.value) <= _LONGEST_NUMBER and _PLAIN.fullmatch(node.value)
    return read(loader, node) if plain else node.value


for _tag in ("bool", "float", "int", "timestamp"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_tag}", _scalar)


def read_yaml(file: Path) -> dict[str, JsonValue]:
    """Read a study file, or another one of its kind, as plain data.

    Raises
    ------
    InputError
        The file is missing, is not YAML, or is not a mapping.
    """
    try:
        data = _Loader("").construct_document(_composed(file.read_bytes()))
    except FileNotFoundError:
        raise InputError("no such study file", file=file, remedy=_studies_nearby(file)) from None
    except UnicodeDecodeError as error:
        raise InputError(
            "not UTF-8 text", file=file,
            value=f"byte {error.object[error.start]:#04x} at byte {error.start}",
            remedy="save it in the encoding UTF-8",
        ) from None  # fmt: skip
    except RecursionError:
        raise InputError("nested too deeply", file=file, remedy="remove a level") from None
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else "?"
        syntax = isinstance(error, yaml.scanner.ScannerError | yaml.parser.ParserError)
        remedy = "check indentation (blanks, no tabs), colons and quotes there" if syntax else None
        problem = f"not YAML: {error.problem}"
        raise InputError(problem, file=file, field=f"line {line}", remedy=remedy) from None
    except (yaml.YAMLError, ValueError, TypeError) as error:
        raise InputError(f"not YAML of plain values: {error}", file=file) from None
    if not isinstance(data, dict):
        limit = "fields and their values, such as title: A study"
        raise InputError("the file has no fields", file=file, value=shown(data), limit=limit)
    return data


@lru_cache(maxsize=8)
def _composed(content: bytes) -> yaml.Node:
    """The nodes of a YAML file, whose parsing takes most of the time of a long one."""
    return yaml.compose(content.decode(), Loader=_Loader) or yaml.ScalarNode(_NULL, "")


def _studies_nearby(file: Path) -> str:
    names = sorted(
        study_file.parent.name for study_file in file.parent.parent.glob(f"*/{STUDY_FILE}")
    )
    return f"choose one of: {', '.join(names)}" if names else "check the path"


def read_study(file: Path) -> dict[str, JsonValue]:
    """Read a study as plain data, with all that it takes from the studies it extends.

    A block whose lines are all comments is not there.

    Raises
    ------
    InputError
        As of `read_yaml` and `lineage`.
    """
    data: dict[str, JsonValue] = {}
    for _, content in reversed(lineage(file)):
        data = _merged(data, content)
    data.pop("extends", None)
    return {key: value for key, value in data.items() if value is not None}


def lineage(file: Path) -> list[tuple[Path, Json]]:
    """The file of a study and its content, then those of each study it extends, nearest first.

    Raises
    ------
    InputError
        A file cannot be read, a study extends one that there is not, or itself.
    """
    family: list[tuple[Path, Json]] = [(file, read_yaml(file))]
    while (name := family[-1][1].get("extends")) is not None:
        studies, place = file.parent.parent, family[-1][0]
        base = studies_called(studies, name) if isinstance(name, str) else []
        problem = None
        if not base:
            problem = "extends an unknown study"
        elif any(base[0] == other for other, _ in family):
            problem = "extends itself"
        if problem:
            used = {other.parent.name for other, _ in family}
            known = dict.fromkeys(other.parent.name for other in studies_called(studies))
            names = [word for word in known if NAME.fullmatch(word) and word not in used]
            raise InputError(
                problem, file=place, field="extends", value=shown(name),
                limit=choices(str(name), names), remedy="name another study, or remove the line",
            )  # fmt: skip
        family.append((base[0], read_yaml(base[0])))
    return family


def studies_called(studies: Path, name: str | None = None) -> list[Path]:
    """The files of the studies of this name, or of all: a project's before those of dragdeck."""
    if name is not None and not NAME.fullmatch(name):
        return []
    folders = (studies, SHIPPED / "studies")
    return [file for of in folders for file in sorted(of.glob(f"{name or '*'}/{STUDY_FILE}"))]


def study_folders(file: Path) -> tuple[Path, ...]:
    """The folder of a study, then those of the studies it extends, nearest first."""
    return _folders(file, file.stat().st_mtime_ns if file.is_file() else 0)


@lru_cache(maxsize=64)
def _folders(file: Path, _changed: int) -> tuple[Path, ...]:
    return tuple(place.parent for place, _ in lineage(file))


def mesh_beside(study: Path, name: str) -> Path:
    """The file of a mesh: beside the study, in its meshes/, in the project's or dragdeck's meshes/.

    A study that extends another finds its meshes, too.

    Raises
    ------
    InputError
        No such file in any of these places.
    """
    places = [place for folder in study_folders(study) for place in (folder, folder / "meshes")]
    places += dict.fromkeys([study.parent.parent.parent / "meshes", SHIPPED / "meshes"])
    for place in places:
        if (place / name).is_file():
            return place / name
    raise InputError(
        "no such mesh file", file=study, field="workpiece.shape.file", value=name,
        limit="a file in " + ", ".join(str(place) for place in places),
        remedy="put the mesh there, or correct the name",
    )  # fmt: skip


_WHOLE = ("fidelity", "sweep")
"""Blocks that a study takes or replaces as a whole."""


def _merged(base: Json, changes: Json, top: bool = True) -> dict[str, JsonValue]:
    """A study's content with another's changes.

    A part of another `kind` is replaced, and ``null`` leaves out a part of the base. A ``null``
    with nothing to leave out stays: only fields that may be empty accept it. Alternatives of the
    media give way to each other.
    """
    replaced = {name for key in changes for name in INSTEAD_OF.get(key, ())}
    merged = {key: value for key, value in base.items() if key not in replaced}
    for key, value in changes.items():
        there = merged.get(key)
        if value is None and key in base:
            merged.pop(key, None)
        elif isinstance(value, dict) and not (top and key in _WHOLE):
            if not isinstance(there, dict) or value.get("kind") not in (None, there.get("kind")):
                there = {}
            merged[key] = _merged(there, value, top=False)
        else:
            merged[key] = value
    return merged


def located(error: InputError) -> InputError:
    """The error with the line of its field and the file that has it, where both are known."""
    if error.line is None and error.field and isinstance(error.file, Path):
        field, tables = error.field, list(_line_tables(error.file))
        while field and not any({f"sweep.{field}", field} & set(lines) for _, lines in tables):
            field = field.rpartition(".")[0]
        for file, lines in tables:
            line = lines.get(f"sweep.{field}", lines.get(field))
            if line is not None:
                error.file, error.line = file, line
                break
    for other in error.more:
        located(other)
    return error


def _line_tables(file: Path) -> Iterator[tuple[Path, Mapping[str, int]]]:
    """The lines of a study's fields in its own file and in those of the studies it extends."""
    try:
        files = [place for place, _ in lineage(file)]
    except InputError:
        files = [file] if file.is_file() else []
    for place in files:
        yield place, _line_table(place.read_bytes())


def comma_lists(file: Path) -> Mapping[str, str]:
    """Fields of a study whose list may be a number with a decimal comma, ``[1,5]``, as written."""
    if not file.is_file():
        return {}
    content = file.read_bytes()
    text, lists = content.decode(), dict[str, str]()
    for name, _, node in _fields(_composed(content), ""):
        written = text[node.start_mark.index : node.end_mark.index]
        if re.fullmatch(r"\[[+-]?\d+,\d+\]", written):
            lists[name] = written
    return lists


@lru_cache(maxsize=4)
def _line_table(content: bytes) -> Mapping[str, int]:
    """The lines of a study's fields; none of a file that is no study."""
    try:
        fields = _fields(_composed(content), "")
        return {name: place.start_mark.line + 1 for name, place, _ in fields}
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError):
        return {}


def _fields(node: yaml.Node | None, prefix: str) -> Iterator[tuple[str, yaml.Node, yaml.Node]]:
    """Every dotted field, with the nodes of its key and its value."""
    items: list[tuple[str, yaml.Node, yaml.Node]] = []
    if isinstance(node, yaml.MappingNode):
        items = [(str(key.value), key, value) for key, value in node.value]
    elif isinstance(node, yaml.SequenceNode):
        items = [(str(index), item, item) for index, item in enumerate(node.value)]
    for name, place, value in items:
        yield f"{prefix}{name}", place, value
        yield from _fields(value, f"{prefix}{name}.")


def shown(value: object) -> str | None:
    """A value as error messages show it."""
    if value is None:
        return None
    if isinstance(value, float) and math.isnan(value):
        return "NaN"
    return repr(value)[:_LONGEST_SHOWN]
