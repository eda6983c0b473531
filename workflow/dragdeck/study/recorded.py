"""Waypoints in a CSV file: they take their place in the study, and errors name file and line."""

import csv
import os
from collections.abc import Mapping
from itertools import islice
from pathlib import Path
from typing import Any

from pydantic import JsonValue

from dragdeck.errors import InputError
from dragdeck.study.base import Json
from dragdeck.study.paths.waypoints import MOST_POINTS, Waypoint
from dragdeck.study.yaml import located, study_folders

_COLUMNS = Waypoint._fields
_POINTS = "motion.path.points"
_Place = tuple[Path | str, int | None, str | None]
Places = Mapping[str | None, _Place]
"""File, line and column of fields that do not stand in the study's own file."""


def with_recording(data: Json, study: Path) -> tuple[Json, Places]:
    """Plain data of a study with the waypoints instead of the name of their file, if it has one.

    Raises
    ------
    InputError
        There is no such file, or it is no table of waypoints.
    """
    motion = data.get("motion")
    path = motion.get("path") if isinstance(motion, dict) else None
    if not isinstance(motion, dict) or not isinstance(path, dict):
        return data, {}
    name, recorded = path.get("file"), path.get("kind") == "waypoints" and not path.get("points")
    if not recorded or not isinstance(name, str):
        return data, {}
    points, places = _read(_found(name, study))
    path = {**path, "file": None, "points": points}
    return {**data, "motion": {**motion, "path": path}}, places


def _found(name: str, study: Path) -> Path:
    """The file beside the study, or beside one that it extends."""
    folders = study_folders(study)
    inside = not Path(name).is_absolute() and ".." not in Path(name).parts
    for folder in folders if inside else ():
        if os.path.isfile(folder / name):  # a name that can be none is no error here
            return folder / name
    limit, remedy = f"a file in {', '.join(map(str, folders))}", "put it there, or correct the name"
    field = "motion.path.file"
    problem = "no such file" if inside else "the path leaves the folder of the study"
    raise located(
        InputError(problem, file=study, field=field, value=name, limit=limit, remedy=remedy)
    )


def _read(file: Path) -> tuple[list[JsonValue], Places]:
    """Waypoints as a study may have them, numbers or not, and where they stand.

    Of too long a file, no more is read than shows that it is.
    """
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.DictReader(stream, skipinitialspace=True)
            header = reader.fieldnames or []
            rows = [(reader.line_num, row) for row in islice(reader, MOST_POINTS + 1)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"not a CSV file: {error}", file=file) from None
    optional = tuple(Waypoint._field_defaults)
    needed = _COLUMNS[: -len(optional)]
    if not set(needed) <= set(header) <= set(_COLUMNS) or len(set(header)) < len(header):
        limit = f"{','.join(needed)}, optionally {', '.join(optional)}, separated by commas"
        problem = "the columns are not those of waypoints"
        value = ",".join(header)[:200] if set(needed) & set(header) else None  # quote only a table
        raise InputError(problem, file=file, field="line 1", value=value, limit=limit)
    surplus: Any = None  # the key of values beyond the header
    points: list[JsonValue] = [
        [*(row.get(key, "0") for key in _COLUMNS), *row.get(surplus, ())] for _, row in rows
    ]
    places: dict[str | None, _Place] = {_POINTS: (file, None, None)}
    for number, (line, _) in enumerate(rows):
        places[f"{_POINTS}.{number}"] = file, line, None
        for at, name in [*enumerate(_COLUMNS), ("speed_m_s", "speed_m_s")]:
            places[f"{_POINTS}.{number}.{at}"] = file, line, name
    return points, places
