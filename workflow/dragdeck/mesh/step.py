"""STEP files: their text, and the units that they state."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from dragdeck.errors import InputError
from dragdeck.files import text_of
from dragdeck.mesh.step_mesher import NO_SOLID

_LARGEST_MB = 50
"""A part with all its fillets and threads has a few MB."""

_START = "ISO-10303-21"

_PREFIXES = {"$": 1.0, ".DECI.": 0.1, ".CENTI.": 0.01, ".MILLI.": 1e-3, ".MICRO.": 1e-6}
"""Of ISO 10303-41, in metres."""

_SOLID = re.compile(r"\b(MANIFOLD_SOLID_BREP|BREP_WITH_VOIDS|FACETED_BREP)\b")
_ENTITY = re.compile(r"#(\d+)\s*=(.*)", re.DOTALL)
_CONVERSION = re.compile(r"CONVERSION_BASED_UNIT\s*\(\s*'([^']*)'\s*,\s*#(\d+)")
_MEASURE = re.compile(r"MEASURE_WITH_UNIT\s*\(\s*LENGTH_MEASURE\s*\(([^()]*)\)\s*,\s*#(\d+)")
_PREFIX = re.compile(r"SI_UNIT\s*\(\s*(\$|\.\w+\.)\s*,\s*\.METRE\.")
_ASSIGNED = re.compile(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([^()]*)\)")
_SAME = 1e-6
"""Relative difference of two lengths that are one unit."""


def _refused(path: Path, problem: str, value: str, limit: str, remedy: str) -> InputError:
    return InputError(problem, file=path, value=value, limit=limit, remedy=remedy)


def step_text(path: Path, unit_m: float | None) -> str:
    """The text of a STEP file, without marks of its encoding.

    Parameters
    ----------
    path : Path
    unit_m : float, optional
        What one is in the file, m, with which the unit in the file must agree; none: any.

    Raises
    ------
    InputError
        It is no STEP file, is too large, or states another unit.
    """
    megabytes = path.stat().st_size / 1e6
    if megabytes > _LARGEST_MB:
        value, limit = f"{megabytes:.3g} MB", f"at most {_LARGEST_MB} MB"
        remedy = "export the workpiece alone, without threads and engravings"
        raise _refused(path, "the STEP file is too large", value, limit, remedy)
    text = text_of(path.read_bytes()).lstrip()
    if not text.startswith(_START):
        limit, remedy = f"{_START} at its start", "export the part as STEP"
        raise _refused(path, "the file is not a STEP file", repr(text[:20]), limit, remedy)
    if not _SOLID.search(text):
        value, limit = "no BREP of a solid", "one solid: the workpiece is one body"
        raise _refused(path, "the STEP file contains no solid", value, limit, NO_SOLID)
    stated = _units(text) or {"millimetre": 1e-3}
    if unit_m is None or any(abs(length - unit_m) <= _SAME * unit_m for length in stated.values()):
        return text.encode("latin-1", "replace").decode("latin-1")
    problem = "the STEP file states another unit than the study"
    remedy = "remove the line of the unit, or export the part in the unit that was meant"
    limit = " or ".join(f"{name.lower()} ({length:g} m)" for name, length in stated.items())
    error = _refused(path, problem, f"{unit_m:g} m", limit, remedy)
    error.field = "workpiece.shape.unit"
    raise error


def _units(text: str) -> dict[str, float]:
    """The units of length that a STEP file states, m, by their names."""
    told = (part.strip() for part in text.split(";") if "UNIT" in part or "MEASURE" in part)
    matches = map(_ENTITY.match, told)
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
