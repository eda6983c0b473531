"""Tables in CSV files: their rows take their place in the study; errors name file and line."""

import os
from collections.abc import Callable, Iterator, Mapping
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
from dragdeck.study.table import read_table
from dragdeck.study.workpiece import MeshShape
from dragdeck.study.yaml import located, mesh_beside, study_folders

_Place = tuple[Path | str, int | None, str | None]
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
    motion, media = data.get("motion"), data.get("media")
    places: dict[str | None, _Place] = {}
    unread: dict[str, InputError] = {}

    def filled(value: Any, field: str, content: Callable[..., Any]) -> Any:
        try:
            return content(value, field, study, places)
        except InputError as error:
            unread[field] = error
            return value

    def grains(value: Any, field: str) -> Any:
        if not isinstance(value, dict):
            return value
        contents = {"sieve": _sieved, "shape": _shaped}
        known = {key: content for key, content in contents.items() if key in value}
        return value | {
            k: filled(value[k], f"{field}.{k}", recorded) for k, recorded in known.items()
        }

    bowl = data.get("bowl")
    if isinstance(bowl, dict) and bowl.get("kind") == "mesh":
        data = {**data, "bowl": filled(bowl, "bowl", _meshed_bowl)}
    roughness = data.get("roughness")
    if isinstance(roughness, dict) and "profile" in roughness:
        profile = filled(roughness["profile"], "roughness.profile", _profiled)
        data = {**data, "roughness": {**roughness, "profile": profile}}
    if isinstance(motion, dict) and "path" in motion:
        path = filled(motion["path"], "motion.path", _waypoints)
        data = {**data, "motion": {**motion, "path": path}}
    if isinstance(media, dict):
        classes = media.get("classes")
        if isinstance(classes, dict):
            recorded_classes = {
                name: grains(class_, f"media.classes.{name}") for name, class_ in classes.items()
            }
            media = {**media, "classes": recorded_classes}
        data = {**data, "media": grains(media, "media")}
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
    if bowl.get("facets_m") or not isinstance(bowl.get("file"), str):
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


def _sieved(sieve: Any, field: str, study: Path, places: dict[str | None, _Place]) -> Any:
    """A sieve analysis, if it is the name of a file of one."""
    if not isinstance(sieve, str):
        return sieve
    return _read(recorded_file(sieve, study, field), Sieve, MOST_SIEVES, field, places)


def _profiled(profile: Any, field: str, study: Path, places: dict[str | None, _Place]) -> Any:
    """A roughness profile, if it is the name of a file of one."""
    if not isinstance(profile, str):
        return profile
    return _read(recorded_file(profile, study, field), Height, MOST_HEIGHTS, field, places)


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
    columns, optional, table = row._fields, tuple(row._field_defaults), read_table(file, most)
    header, needed = table.names, columns[: len(columns) - len(optional)]
    if not set(needed) <= set(header) <= set(columns) or len(set(header)) < len(header):
        limit = ",".join(needed) + (f", optionally {', '.join(optional)}" if optional else "")
        problem = f"the columns are not those of {row.__name__.lower()}s"
        value = ",".join(header)[:200] if set(needed) & set(header) else None  # quote only a table
        line = table.header_line
        raise InputError(problem, file=file, line=line, value=value, limit=limit)
    lines, numbers = table.numbers(header)
    values, zero = dict(zip(header, numbers, strict=True)), np.zeros(len(lines))
    points = np.transpose([values.get(name, zero) for name in columns]).tolist()
    places[field] = file, None, None
    for number, line in enumerate(lines.tolist()):
        places[f"{field}.{number}"] = file, line, None
        for at, name in [*enumerate(columns), ("speed_m_s", "speed_m_s")]:
            places[f"{field}.{number}.{at}"] = file, line, name
    rows: list[JsonValue] = points
    return rows
