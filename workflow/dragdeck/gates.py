"""The gates that a finished run must pass before it counts as a result."""

from __future__ import annotations

import math
import re
import struct
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from dragdeck.engine import engine_errors

TAIL_BYTES = 4_000_000
"""How much of a text output's end is looked at first; a dump's frame can be longer."""

_HEADER = struct.Struct("<qqi6i6d2i")
_CHUNK = struct.Struct("<i")


@dataclass(frozen=True)
class Gate:
    """One condition, what was seen, and what it asks for."""

    name: str
    passed: bool
    seen: str
    limit: str

    def as_json(self) -> dict[str, Any]:
        """For ``run.json``."""
        return asdict(self)


def check_run(
    folder: Path, case: Mapping[str, Any], columns: Mapping[str, Any], exit_status: int, parts: int
) -> list[Gate]:
    """Look at all that a run left.

    Parameters
    ----------
    folder : Path
        The run's folder.
    case, columns : mapping
        Contents of ``case.json`` and ``columns.json``.
    exit_status : int
    parts : int
        Number of parts; the last one has the end.
    """
    screen = _text(folder / f"screen.{parts}.txt")
    found = [
        _ended(screen, exit_status),
        _no_errors(screen),
        _neighbours(folder, parts),
    ]
    if case["scene"] == "fill":
        found.append(_settled(screen))
    if "thermo" in columns["outputs"]:
        found += _thermo(folder, columns["outputs"]["thermo"], case["media"]["count"], parts)
    for name, output in columns["outputs"].items():
        found.append(_frames(folder, name, output, parts))
    return found


def _text(file: Path) -> str:
    return file.read_text(encoding="utf-8", errors="replace") if file.is_file() else ""


def _ended(screen: str, exit_status: int) -> Gate:
    at_end = re.search(r"^DRAGDECK END$", screen, flags=re.MULTILINE) is not None
    seen = f"exit status {exit_status}, {'end' if at_end else 'no end'} of the deck reached"
    return Gate("ended by itself", at_end and exit_status == 0, seen, "exit status 0 at the end")


def _no_errors(screen: str) -> Gate:
    errors = engine_errors(screen)
    return Gate("no engine error", not errors, "; ".join(errors) or "none", "none")


def _neighbours(folder: Path, parts: int) -> Gate:
    text = "".join(_text(folder / f"screen.{part}.txt") for part in range(1, parts + 1))
    dangerous = sum(int(count) for count in re.findall(r"Dangerous builds = (\d+)", text))
    return Gate("no dangerous neighbour builds", dangerous == 0, str(dangerous), "0")


def _settled(screen: str) -> Gate:
    found = re.search(r"^DRAGDECK (NOT )?SETTLED: (.*)$", screen, flags=re.MULTILINE)
    seen = found.group(0).removeprefix("DRAGDECK ") if found else "no word of it"
    return Gate("bed at rest", found is not None and found.group(1) is None, seen, "SETTLED")


def _thermo(folder: Path, output: Mapping[str, Any], count: int, parts: int) -> list[Gate]:
    rows: list[list[float]] = []
    for part in range(1, parts + 1):
        lines = _text(folder / output["pattern"].format(part=part)).splitlines()[1:]
        rows += [[float(word) for word in line.split()] for line in lines if line]
    finite = all(math.isfinite(value) for row in rows for value in row)
    fewest = min((int(row[2]) for row in rows), default=0)
    return [
        Gate("every ball kept", fewest == count, f"{fewest} balls at the fewest", f"{count} asked"),
        Gate("finite numbers", finite and bool(rows), f"{len(rows)} thermo rows", "no NaN"),
    ]


def _frames(folder: Path, name: str, output: Mapping[str, Any], parts: int) -> Gate:
    gate = f"{name} whole"
    limit = "last frame whole" if output["last_step"] is None else f"to step {output['last_step']}"
    file = folder / output["pattern"].format(part=parts)
    if not file.is_file():
        return Gate(gate, False, f"no {file.name}", limit)
    step = last_frame(file, output)
    if step is None:
        return Gate(gate, False, f"{file.name} is cut short or empty", limit)
    reached = output["last_step"] is None or step == output["last_step"]
    return Gate(gate, reached, f"to step {step}", limit)


def split_gate(found: Mapping[str, Any] | None, ranks: int) -> Gate:
    """Whether the engine ran on the ranks that were asked for.

    An engine that was built for another MPI than its launcher's runs once a rank, each
    with all balls, and all write the same files.
    """
    limit = f"{ranks} rank{'s' if ranks > 1 else ''}"
    if found is None:
        return Gate("split as asked", False, "the engine names no processor grid", limit)
    seen = " by ".join(map(str, found["grid"]))
    if found["balls"]:
        seen += f", {found['balls']['least']:,} to {found['balls']['most']:,} balls a rank"
    return Gate("split as asked", math.prod(found["grid"]) == ranks, seen, limit)


def last_frame(file: Path, output: Mapping[str, Any]) -> int | None:
    """Step of a file's last frame, or None where that frame is not whole.

    Parameters
    ----------
    file : Path
    output : mapping
        Its entry in ``columns.json``.
    """
    if output["kind"] == "print":
        return _last_row(_tail(file), len(output["columns"]))
    if output["binary"]:
        return _last_binary(file)
    return _last_text(_from_last(file, b"ITEM: TIMESTEP\n"), len(output["columns"]))


def _from_last(file: Path, mark: bytes) -> bytes | None:
    """What follows the last mark in a file; None where there is none."""
    size, length = file.stat().st_size, TAIL_BYTES
    with file.open("rb") as stream:
        while True:
            stream.seek(max(0, size - length))
            _, found, rest = stream.read().rpartition(mark)
            if found:
                return rest
            if length >= size:
                return None
            length *= 4


def _tail(file: Path) -> str:
    with file.open("rb") as stream:
        stream.seek(max(0, file.stat().st_size - TAIL_BYTES))
        return stream.read().decode("ascii", errors="replace")


def _last_row(text: str, width: int) -> int | None:
    if not text.endswith("\n"):
        return None
    words = text.splitlines()[-1].split()
    return int(words[0]) if len(words) == width and words[0].isdigit() else None


def _last_text(frame: bytes | None, width: int) -> int | None:
    if frame is None or not frame.endswith(b"\n"):
        return None
    lines = frame.count(b"\n")
    head = frame.split(b"\n", 3)
    if lines < 8 or lines != 8 + int(head[2]):
        return None
    last_row = frame[:-1].rpartition(b"\n")[2]
    return int(head[0]) if lines == 8 or len(last_row.split()) == width else None


def _last_binary(file: Path) -> int | None:
    size, place, step = file.stat().st_size, 0, None
    with file.open("rb") as stream:
        while place < size:
            header = stream.read(_HEADER.size)
            if len(header) < _HEADER.size:
                return None
            step, *_, processes = _HEADER.unpack(header)
            for _ in range(processes):
                chunk = stream.read(_CHUNK.size)
                if len(chunk) < _CHUNK.size:
                    return None
                stream.seek(8 * _CHUNK.unpack(chunk)[0], 1)
            place = stream.tell()
    return step if place == size else None
