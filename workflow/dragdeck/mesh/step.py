"""STEP files: their unit, and the mesh of the part in them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from dragdeck.files import text_of
from dragdeck.mesh import step_mesher
from dragdeck.mesh.mesher import answer_of, refused

_LARGEST_MB = 50
"""A part with all its fillets and threads has a few MB."""

_START = "ISO-10303-21"

_PREFIXES = {"$": 1.0, ".DECI.": 0.1, ".CENTI.": 0.01, ".MILLI.": 1e-3, ".MICRO.": 1e-6}
"""Of ISO 10303-41, in metres."""

_ENTITY = re.compile(r"#(\d+)\s*=(.*)", re.DOTALL)
_CONVERSION = re.compile(r"CONVERSION_BASED_UNIT\s*\(\s*'([^']*)'\s*,\s*#(\d+)")
_MEASURE = re.compile(r"MEASURE_WITH_UNIT\s*\(\s*LENGTH_MEASURE\s*\(([^()]*)\)\s*,\s*#(\d+)")
_PREFIX = re.compile(r"SI_UNIT\s*\(\s*(\$|\.\w+\.)\s*,\s*\.METRE\.")
_ASSIGNED = re.compile(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([^()]*)\)")
_SAME = 1e-6
"""Relative difference of two lengths that are one unit."""


def mesh_step(
    path: Path, unit_m: float | None, size_m: float, edge_size_m: float, widest_m: float = math.inf
) -> step_mesher.Meshed:
    """Mesh the surface of the part in a STEP file, in a process of its own.

    The same file gives the same mesh with the same version of gmsh.

    Parameters
    ----------
    path : Path
    unit_m : float, optional
        What one is in the file, m, with which the unit in the file must agree; none: that unit.
    size_m, edge_size_m : float
        Target edge length of the facets, and of those at sharp edges, m.
    widest_m : float
        Width of the bowl, m, in which a part of too many facets does not fit.

    Returns
    -------
    Meshed
        `points`, (N, 3) in m, and `volume` of the part itself, m3; `triangles`, (M, 3).

    Raises
    ------
    InputError
        gmsh is missing, the file is damaged, too large or in another unit, it contains no solid or
        several, or the part cannot be meshed.
    """
    text = _checked_text(path, unit_m)
    with TemporaryDirectory() as folder:
        plain = Path(folder, "part.step")
        plain.write_text(text, encoding="latin-1")
        lengths_mm = [repr(1e3 * length_m) for length_m in (size_m, edge_size_m, widest_m)]
        content = answer_of(step_mesher.__file__, path, [str(plain)], lengths_mm)
    return {
        "points": (1e-3 * np.array(content["points"])).tolist(),
        "triangles": content["triangles"],
        "volume": 1e-9 * content["volume"],
    }


def _checked_text(path: Path, unit_m: float | None) -> str:
    """The text of a STEP file; refuses what is none, is too large, or states another unit."""
    megabytes = path.stat().st_size / 1e6
    if megabytes > _LARGEST_MB:
        value, limit = f"{megabytes:.3g} MB", f"at most {_LARGEST_MB} MB"
        remedy = "export the workpiece alone, without threads and engravings"
        raise refused(path, "the STEP file is too large", value, limit, remedy)
    text = text_of(path.read_bytes()).lstrip()
    if not text.startswith(_START):
        limit, remedy = f"{_START} at its start", "export the part as STEP"
        raise refused(path, "the file is not a STEP file", repr(text[:20]), limit, remedy)
    stated = _units(text) or {"millimetre": 1e-3}
    if unit_m is None or any(abs(length - unit_m) <= _SAME * unit_m for length in stated.values()):
        return text.encode("latin-1", "replace").decode("latin-1")
    problem = "the STEP file states another unit than the study"
    remedy = "remove the line of the unit, or export the part in the unit that was meant"
    limit = " or ".join(f"{name.lower()} ({length:g} m)" for name, length in stated.items())
    error = refused(path, problem, f"{unit_m:g} m", limit, remedy)
    error.field = "workpiece.shape.unit"
    raise error


def _units(text: str) -> dict[str, float]:
    """The units of length that a STEP file states, m, by their names."""
    matches = map(_ENTITY.match, (part.strip() for part in text.split(";")))
    entities = {match[1]: match[2] for match in matches if match}
    lengths = {key: entity for key, entity in entities.items() if "LENGTH_UNIT" in entity}
    assigned = [key for entity in entities.values() for listed in _ASSIGNED.findall(entity)
                for key in re.findall(r"#(\d+)", listed) if key in lengths]  # fmt: skip
    return dict(filter(None, (_unit(key, entities) for key in assigned or lengths)))


def _unit(key: str, entities: Mapping[str, str], factor: float = 1.0) -> tuple[str, float] | None:
    """Name and length in m of a unit; None where the file does not say it."""
    entity = entities.get(key, "")
    if prefix := _PREFIX.search(entity):
        length = _PREFIXES.get(prefix[1])
        name = {"$": "metre"}.get(prefix[1], f"{prefix[1].strip('.')}metre")
        return (name, factor * length) if length else None
    conversion = _CONVERSION.search(entity)
    measure = conversion and _MEASURE.search(entities.get(conversion[2], ""))
    if not conversion or not measure or measure[2] == key:
        return None
    base = _unit(measure[2], {**entities, key: ""}, factor * float(measure[1]))
    return base and (conversion[1], base[1])
