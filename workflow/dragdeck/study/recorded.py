"""Tables in CSV files: their rows take their place in the study; errors name file and line."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pydantic import JsonValue

from dragdeck.errors import InputError
from dragdeck.mesh.clump import convex_corners
from dragdeck.study.base import Json
from dragdeck.study.media import MOST_SIEVES, Sieve
from dragdeck.study.paths.waypoints import MOST_POINTS, Waypoint
from dragdeck.study.table import read_table
from dragdeck.study.yaml import located, study_folders

_Place = tuple[Path | str, int | None, str | None]
Places = Mapping[str | None, _Place]
"""File, line and column of fields that do not stand in the study's own file."""


def with_recording(data: Json, study: Path) -> tuple[Json, Places]:
    """Plain data of a study with waypoints and sieve analyses instead of the names of their files.

    Raises
    ------
    InputError
        There is no such file, or it is no such table.
    """
    motion, media = data.get("motion"), data.get("media")
    places: dict[str | None, _Place] = {}
    if isinstance(motion, dict) and "path" in motion:
        data = {**data, "motion": {**motion, "path": _waypoints(motion.get("path"), study, places)}}
    if isinstance(media, dict):
        media, classes = _with_files(media, "media", study, places), media.get("classes")
        if isinstance(classes, dict):
            fields = {name: f"media.classes.{name}" for name in classes}
            parts = {k: _with_files(v, fields[k], study, places) for k, v in classes.items()}
            media = {**media, "classes": parts}
        data = {**data, "media": media}
    return data, places


def _waypoints(path: Any, study: Path, places: dict[str | None, _Place]) -> Any:
    """A path with its waypoints, if it names a file of them."""
    if not isinstance(path, dict) or path.get("kind") != "waypoints" or path.get("points"):
        return path
    name = path.get("file")
    if not isinstance(name, str):
        return path
    file = recorded_file(name, study, "motion.path.file")
    points = _read(file, Waypoint, MOST_POINTS, "motion.path.points", places)
    return {**path, "file": None, "points": points}


def _with_files(grains: Any, field: str, study: Path, places: dict[str | None, _Place]) -> Any:
    """A class of the media with its sieve analysis and its body, if it names files of them."""
    grains = _sieved(grains, field, study, places)
    shape = grains.get("shape") if isinstance(grains, dict) else None
    if not isinstance(shape, dict) or not isinstance(shape.get("points"), str):
        return grains
    file = recorded_file(shape["points"], study, f"{field}.shape.points")
    return {**grains, "shape": {**shape, "points": convex_corners(file).tolist()}}


def _sieved(grains: Any, field: str, study: Path, places: dict[str | None, _Place]) -> Any:
    """A class of the media with its sieve analysis, if it names a file of one."""
    name = grains.get("sieve") if isinstance(grains, dict) else None
    if not isinstance(name, str):
        return grains
    file = recorded_file(name, study, f"{field}.sieve")
    return {**grains, "sieve": _read(file, Sieve, MOST_SIEVES, f"{field}.sieve", places)}


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
    values = dict(zip(header, table.numbers(header), strict=True))
    zero = np.zeros(len(table.lines))
    points = np.transpose([values.get(name, zero) for name in columns]).tolist()
    places[field] = file, None, None
    for number, line in enumerate(table.lines):
        places[f"{field}.{number}"] = file, line, None
        for at, name in [*enumerate(columns), ("speed_m_s", "speed_m_s")]:
            places[f"{field}.{number}.{at}"] = file, line, name
    found: list[JsonValue] = points
    return found
