"""Tables in CSV files: their rows take their place in the study; errors name file and line."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import JsonValue, ValidationError

from dragdeck.errors import InputError
from dragdeck.mesh.bowl_file import bowl_facets
from dragdeck.mesh.checks import check
from dragdeck.mesh.clump import convex_corners
from dragdeck.mesh.files import STEP, read
from dragdeck.mesh.surface import upright
from dragdeck.study.base import Json
from dragdeck.study.media import MOST_SIEVES, Sieve
from dragdeck.study.paths.waypoints import MOST_POINTS, Waypoint
from dragdeck.study.roughness import MOST_HEIGHTS, Height
from dragdeck.study.table import ROW, user_table
from dragdeck.study.workpiece import MeshShape
from dragdeck.study.yaml import located, mesh_beside, study_folders

_Place = tuple[Path | str, int | None, str | None]
_Content = Callable[[Any, str, Path, dict[str | None, _Place]], Any]
Places = Mapping[str | None, _Place]
"""File, line and column of fields that do not stand in the study's own file."""


def with_recording(data: Json, study: Path) -> tuple[Json, Places, Mapping[str, InputError]]:
    """Plain data of a study with the content of tables and particle meshes for their names.

    Returns
    -------
    data : mapping
    places : mapping
        Where the rows of tables stand.
    unread : mapping
        Fields that still name a file, because that cannot be used, and why.
    """
    places: dict[str | None, _Place] = {}
    unread: dict[str, InputError] = {}

    def filled(value: Any, names: Sequence[str], content: _Content, field: str = "") -> Any:
        """The value of a block, with the content at these names below it, if it has them."""
        if not names:
            try:
                return content(value, field, study, places)
            except InputError as error:
                unread[field] = error
                return value
        name, *below = names
        keys = value if name == "*" and isinstance(value, dict) else [name]
        if not isinstance(value, dict) or name not in (*value, "*"):
            return value
        return value | {
            key: filled(value[key], below, content, f"{field}.{key}".lstrip(".")) for key in keys
        }

    for field, content in _CONTENTS.items():
        data = filled(data, field.split("."), content)
    return data, places, unread


def _waypoints(path: Any, field: str, study: Path, places: dict[str | None, _Place]) -> Any:
    """A path with its waypoints, if it names a file of them."""
    if not isinstance(path, dict) or path.get("kind") != "waypoints" or path.get("points"):
        return path
    name = path.get("file")
    if not isinstance(name, str):
        return path
    file = recorded_file(name, study, f"{field}.file")
    points = _read(file, Waypoint, MOST_POINTS, f"{field}.points", places)
    return {**path, "file": None, "points": points}


def _meshed_bowl(bowl: Any, field: str, study: Path, _: dict[str | None, _Place]) -> Any:
    """A bowl with its facets, if it names a mesh."""
    if not isinstance(bowl, dict) or bowl.get("kind") != "mesh" or bowl.get("facets_m"):
        return bowl
    if not isinstance(bowl.get("file"), str):
        return bowl
    file = recorded_file(bowl["file"], study, f"{field}.file")
    corners = bowl_facets(file, bowl.get("unit")).reshape(-1, 9)
    return {**bowl, "file": None, "unit": None, "facets_m": corners.tolist()}


def _shaped(shape: Any, field: str, study: Path, _: dict[str | None, _Place]) -> Any:
    """A shape with its corners, if it names a mesh."""
    if not isinstance(shape, dict) or not isinstance(shape.get("points"), str):
        return shape
    file = recorded_file(shape["points"], study, f"{field}.points")
    return {**shape, "points": convex_corners(file).tolist()}


def _rows_of(row: type[NamedTuple], most: int) -> _Content:
    """What gives the rows of a table for the name of its file."""

    def rows(value: Any, field: str, study: Path, places: dict[str | None, _Place]) -> Any:
        if not isinstance(value, str):
            return value
        return _read(recorded_file(value, study, field), row, most, field, places)

    return rows


def mesh_errors(data: Json, study: Path) -> Iterator[InputError]:
    """What is wrong with the meshes of workpieces, of a study that has other errors, too."""
    several, single = data.get("workpieces"), data.get("workpiece")
    each = several.get("each") if isinstance(several, dict) else None
    for owner in (single, *(each if isinstance(each, list) else ())):
        try:
            shape = MeshShape.model_validate(owner.get("shape") if isinstance(owner, dict) else 0)
            sizes = shape.facet_size_m, shape.edge_facet_size_m
            file = mesh_beside(study, shape.file)
            if file.suffix.lower() not in STEP or shape.facet_size_m:
                mesh = upright(read(file, shape.unit, *sizes), shape.axis)
                check(mesh, file=file, field="workpiece.shape")
        except ValidationError:
            continue
        except InputError as error:
            yield located(error)


def recorded_file(name: str, study: Path, field: str) -> Path:
    """The file beside the study, or beside one that it extends.

    Raises
    ------
    InputError
        There is none, or the path leaves the folder.
    """
    folders = study_folders(study)
    inside = not Path(name).is_absolute() and ".." not in Path(name).parts
    for folder in folders if inside else ():
        if os.path.isfile(folder / name):  # a name that can be none is no error here
            return folder / name
    limit, remedy = f"a file in {', '.join(map(str, folders))}", "put it there, or correct the name"
    problem = "no such file" if inside else "the path leaves the folder of the study"
    raise located(
        InputError(problem, file=study, field=field, value=name, limit=limit, remedy=remedy)
    )


def _read(
    file: Path, row: type[NamedTuple], most: int, field: str, places: dict[str | None, _Place]
) -> list[JsonValue]:
    """Rows of numbers as a study may have them; where they stand is added to `places`.

    Of too long a file, no more is read than shows that it is.
    """
    columns, optional, table = row._fields, tuple(row._field_defaults), user_table(file, most)
    names = [name for name in table.names if name != ROW]
    header, scales = zip(*map(_in_si, names), strict=True)
    needed = columns[: len(columns) - len(optional)]
    if not set(needed) <= set(header) <= set(columns) or len(set(header)) < len(header):
        limit = ",".join(needed) + (f", optionally {', '.join(optional)}" if optional else "")
        problem = f"the columns are not those of {row.__name__.lower()}s"
        is_table = set(needed) & set(header)  # nothing else is quoted
        value = ",".join(table.names)[:200] if is_table else None
        line = table.header_line
        raise InputError(problem, file=file, line=line, value=value, limit=limit)
    lines, numbers = table.numbers(names)
    scaled = map(np.multiply, scales, numbers)
    values, zero = dict(zip(header, scaled, strict=True)), np.zeros(len(lines))
    points = np.transpose([values.get(name, zero) for name in columns]).tolist()
    places[field] = file, None, None
    for number, line in enumerate(lines.tolist()):
        places[f"{field}.{number}"] = file, line, None
        for at, name in [*enumerate(columns), ("speed_m_s", "speed_m_s")]:
            places[f"{field}.{number}.{at}"] = file, line, name
    rows: list[JsonValue] = points
    return rows


_SMALLER = {
    "cm": ("m", 1e-2), "mm": ("m", 1e-3), "um": ("m", 1e-6), "ms": ("s", 1e-3), "us": ("s", 1e-6),
}  # fmt: skip
"""Units of columns, with that in which a study has them and its multiple."""


def _in_si(column: str) -> tuple[str, float]:
    """Name of a column in the unit of the study, and what its numbers are multiplied by."""
    name, _, unit = column.rpartition("_")
    meant, scale = _SMALLER.get(unit, (unit, 1.0))
    return f"{name}_{meant}" if name else column, scale


_CONTENTS: Mapping[str, _Content] = {
    "bowl": _meshed_bowl,
    "roughness.profile": _rows_of(Height, MOST_HEIGHTS),
    "motion.path": _waypoints,
    "media.sieve": (_sieves := _rows_of(Sieve, MOST_SIEVES)),
    "media.shape": _shaped,
    "media.classes.*.sieve": _sieves,
    "media.classes.*.shape": _shaped,
}
"""What takes the place of the name of a file, by its field."""
