"""Tables in CSV files: their rows take their place in the study; errors name file and line."""

import csv
import os
from collections.abc import Mapping
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import JsonValue

from dragdeck.errors import InputError
from dragdeck.mesh.clump import convex_corners
from dragdeck.study.base import Json
from dragdeck.study.media import MOST_SIEVES, Sieve
from dragdeck.study.paths.waypoints import MOST_POINTS, Waypoint
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
    """Rows as a study may have them, numbers or not; where they stand is added to `places`.

    Of too long a file, no more is read than shows that it is.
    """
    columns, optional = row._fields, tuple(row._field_defaults)
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.DictReader(stream, skipinitialspace=True)
            header = reader.fieldnames or []
            rows = [(reader.line_num, row) for row in islice(reader, most + 1)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"not a CSV file: {error}", file=file) from None
    needed = columns[: len(columns) - len(optional)]
    if not set(needed) <= set(header) <= set(columns) or len(set(header)) < len(header):
        limit = ",".join(needed) + (f", optionally {', '.join(optional)}" if optional else "")
        limit += ", separated by commas"
        problem = f"the columns are not those of {row.__name__.lower()}s"
        value = ",".join(header)[:200] if set(needed) & set(header) else None  # quote only a table
        raise InputError(problem, file=file, field="line 1", value=value, limit=limit)
    surplus: Any = None  # the key of values beyond the header
    points: list[JsonValue] = [
        [*(cells.get(key, "0") for key in columns), *cells.get(surplus, ())] for _, cells in rows
    ]
    places[field] = file, None, None
    for number, (line, _) in enumerate(rows):
        places[f"{field}.{number}"] = file, line, None
        for at, name in [*enumerate(columns), ("speed_m_s", "speed_m_s")]:
            places[f"{field}.{number}.{at}"] = file, line, name
    return points
