"""What the log of a run tells: warnings, and how many particles there should be."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from dragdeck.engine.log import engine_errors
from dragdeck.script.findings import Finding, NotApplied

_INSERTED = re.compile(r"INFO: Particle insertion \S+: inserted (\d+) particle templates")
_WARNINGS = {
    "Less insertions than requested": "fewer particles were inserted than requested",
    "timestep is > ": "the check of the time step failed",
}


@dataclass(frozen=True)
class Balance:
    """Particles that were there or inserted, that were counted as they left, and at the end."""

    expected: int
    counted: int
    last: int


def log_findings(
    file: Path, text: str, balance: Balance | None, outlets: Sequence[str], unknown: str
) -> Iterator[Finding | NotApplied]:
    """What DK203 and DK208 say of a log.

    Parameters
    ----------
    file : Path
    text : str
        Its content.
    balance : Balance or None
        Of `balance_of`.
    outlets : sequence of str
        Ids of ``massflow/mesh``, which counts particles.
    unknown : str
        Why the balance cannot be told; empty if it can.
    """
    for error in engine_errors(text):
        yield Finding("DK208", f"LIGGGHTS ended with {error}", str(file), severity="error")
    for part, meaning in _WARNINGS.items():
        lines = [line.strip() for line in text.splitlines() if part in line]
        if lines:
            message = f"{meaning}, {len(lines)} times: {lines[0][:120]}"
            yield Finding("DK208", message, str(file), values={"lines": len(lines)})
    builds = sum(map(int, re.findall(r"^Dangerous builds = (\d+)", text, re.MULTILINE)))
    if builds:
        message = f"{builds} neighbour lists were rebuilt too late (dangerous builds)"
        yield Finding("DK208", message, str(file), values={"builds": builds})
    if unknown or balance is None:
        yield NotApplied("DK203", unknown or f"no thermo column Atoms in {file.name}")
    elif (missing := balance.expected - balance.counted - balance.last) > 0:
        counted = f", {balance.counted} counted at outlets" if outlets else ""
        message = f"{missing} particles are missing: {balance.expected} were there or inserted"
        message += f"{counted}, {balance.last} at the end"
        yield Finding("DK203", message, str(file), values={"missing": missing})


def balance_of(text: str, outlets: Sequence[str] = ()) -> Balance | None:
    """Particles of a run by its log; None if its thermo table does not count them."""
    header: list[str] = []
    expected, before, last, counted = None, 0, None, 0
    for line in text.splitlines():
        words = line.split()
        if match := _INSERTED.search(line):
            before += int(match[1])
        elif words[:1] == ["Step"]:
            header = words
        elif words and len(words) == len(header) and words[0].isdigit():
            row = dict(zip(header, words, strict=True))
            if not row.get("Atoms", "").isdigit():
                continue
            last = int(row["Atoms"])
            if expected is None:
                expected, before = last, 0
            expected, before = expected + before, 0
            counts = [row[name] for name in (f"{outlet}[2]" for outlet in outlets) if name in row]
            counted = round(sum(map(float, counts)))
    return None if expected is None or last is None else Balance(expected, counted, last)
