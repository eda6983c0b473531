"""STEP files: their unit, and the mesh of the part in them."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from dragdeck.errors import InputError
from dragdeck.mesh import step_mesher

_LARGEST_MB = 50
"""A part with all its fillets and threads has a few MB."""

_START = "ISO-10303-21"

_OPENCASCADE_UNITS = {"m": "M", "cm": "CM", "mm": "MM", "um": "UM", "in": "INCH"}

_UNIT_NAMES = {"$": "m", ".CENTI.": "cm", ".MILLI.": "mm", ".MICRO.": "um", "INCH": "in"}
"""Of ISO 10303-41, in the units of a study."""

_NAMED = re.compile(r"CONVERSION_BASED_UNIT\s*\(\s*'([^']*)'")
_PREFIX = re.compile(r"SI_UNIT\s*\(\s*(\$|\.\w+\.)\s*,\s*\.METRE\.")


def mesh_step(path: Path, unit: str, size: float, edge_size: float) -> step_mesher.Meshed:
    """Mesh the surface of the part in a STEP file, in a process of its own.

    The same file gives the same mesh with the same version of gmsh.

    Parameters
    ----------
    path : Path
    unit : str
        What one is in the file, in which the part's own unit must agree.
    size, edge_size : float
        Target edge length of the facets, and of those at sharp edges, in that unit.

    Returns
    -------
    Meshed
        `points`, (N, 3), and `volume` of the part itself, in the unit; `triangles`, (M, 3).

    Raises
    ------
    InputError
        gmsh is missing, the file is damaged, too large or in another unit, it contains no solid or
        several, or the part cannot be meshed.
    """
    _check_text(path, unit)
    with TemporaryDirectory() as folder:
        answer = Path(folder, "answer.json")
        sizes = map(repr, (size, edge_size))
        arguments = [str(path.resolve()), str(answer), _OPENCASCADE_UNITS[unit], *sizes]
        command = [sys.executable, "-P", step_mesher.__file__, *arguments]
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, check=False)
        if done.returncode or not answer.is_file():
            raise _broken(path, done.returncode, done.stderr.decode("ascii", "replace"))
        content: Any = json.loads(answer.read_text(encoding="ascii"))
    if "refused" in content:
        raise _refused(path, *content["refused"])
    meshed: step_mesher.Meshed = content
    return meshed


def _refused(path: Path, problem: str, value: str, limit: str, remedy: str) -> InputError:
    return InputError(problem, file=path, value=value, limit=limit, remedy=remedy)


def _broken(path: Path, code: int, said: str) -> InputError:
    value = (said.splitlines() or [f"the mesher ended with code {code}"])[-1]
    if -code in (signal.SIGXCPU, signal.SIGKILL):
        limit = f"{step_mesher.CPU_LIMIT_S} s of CPU time"
        remedy = "use a larger facet_size_m and edge_facet_size_m"
        return _refused(path, "the part takes too long to mesh", value, limit, remedy)
    return _refused(path, "the STEP file is damaged", value, "a STEP part", step_mesher.EXPORT)


def _check_text(path: Path, unit: str) -> None:
    """Refuse a file that is no STEP file, is too large, or states another unit."""
    megabytes = path.stat().st_size / 1e6
    if megabytes > _LARGEST_MB:
        value, limit = f"{megabytes:.3g} MB", f"at most {_LARGEST_MB} MB"
        remedy = "export the workpiece alone, without threads and engravings"
        raise _refused(path, "the STEP file is too large", value, limit, remedy)
    text = path.read_text(encoding="latin-1")
    if not text.lstrip().startswith(_START):
        limit, remedy = f"{_START} at its start", "export the part as STEP"
        raise _refused(path, "the file is not a STEP file", repr(text[:20]), limit, remedy)
    stated = set(_units(text)) or {"mm"}
    if unit not in stated:
        problem = "the STEP file states another unit than the study"
        remedy = "state the unit of the file, or export the part in the unit that was meant"
        error = _refused(path, problem, unit, " or ".join(sorted(stated)), remedy)
        error.field = "workpiece.shape.unit"
        raise error


def _units(text: str) -> Iterator[str]:
    """The units of length that a STEP file states."""
    entities = [entity for entity in text.split(";") if "LENGTH_UNIT" in entity]
    named = [name.upper() for entity in entities for name in _NAMED.findall(entity)]
    for name in named or [name for entity in entities for name in _PREFIX.findall(entity)]:
        yield _UNIT_NAMES.get(name, name)
