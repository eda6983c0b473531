"""What the log of a run tells: errors, warnings, and how many particles there should be."""

import re
from pathlib import Path

from dragdeck.audit.measures import is_clumped, removal
from dragdeck.engine.log import engine_errors, never_settled
from dragdeck.files import text_of
from dragdeck.script.facts import Facts, as_numbers
from dragdeck.script.findings import Finding, NotApplied, Results

_INSERTED = re.compile(r"INFO: Particle insertion \S+: inserted (\d+) particle templates")
_WARNINGS = {
    "Less insertions than requested": "fewer particles were inserted than requested",
    "timestep is > ": "the check of the time step failed",
}


_NO_NUMBERS = {"nan", "-nan", "inf", "-inf"}


class RunLog:
    """The log of a run, or what LIGGGHTS printed on the screen.

    Attributes
    ----------
    expected, counted : int
        Particles that were there or inserted, and that outlets counted.
    last : int or None
        Particles at the end; None if no thermo table counts them.
    """

    def __init__(self, file: Path, facts: Facts) -> None:
        meters = [fix.id for fix in facts.styled("massflow/mesh") if "delete_atom" in fix.words]
        self.file, self.facts, self.text = file, facts, text_of(file.read_bytes())
        self.outlets = [f"{meter}[2]" for meter in meters]
        self.expected = self.counted = inserted = 0
        self.last: int | None = None
        self.not_finite, self.table = "", list[str]()
        for line in self.text.split("\n"):
            words = line.split()
            row = dict(zip(self.table, words, strict=False)) if words[:1] != ["Step"] else {}
            if words[:1] == ["Step"] or line.startswith("Loop time of"):
                self.table = words if words[0] == "Step" else []
            elif match := _INSERTED.search(line):
                inserted += int(match[1])
            elif len(words) == len(self.table) and _NO_NUMBERS & set(words):
                self.not_finite = self.not_finite or line.strip()
            elif len(words) == len(self.table) and row.get("Atoms", "").isdecimal():
                last = int(row["Atoms"])
                self.expected += last if self.last is None else inserted
                counts = as_numbers([row[name] for name in self.outlets if name in row])
                self.last, inserted, self.counted = last, 0, round(sum(counts or ()))

    def results(self) -> Results:
        """What DK203, DK206 and DK208 say of it."""
        errors = [f"LIGGGHTS ended with {error}" for error in engine_errors(self.text)]
        if self.not_finite:
            errors.append(f"the thermo table contains a number that is none: {self.not_finite}")
        if self.table and not errors:
            errors.append("the log ends within a run")
        for message in errors:
            yield Finding("DK208", message, str(self.file), severity="error")
        for part, meaning in _WARNINGS.items():
            lines = [line.strip() for line in self.text.split("\n") if part in line]
            if lines:
                message = f"{meaning}, {len(lines)} times: {lines[0][:120]}"
                yield self._finding("DK208", message, lines=len(lines))
        builds = sum(map(int, re.findall(r"^Dangerous builds = (\d+)", self.text, re.MULTILINE)))
        if builds:
            message = f"{builds} neighbour lists were rebuilt too late (dangerous builds)"
            yield self._finding("DK208", message, builds=builds)
        if never_settled(self.text):
            yield self._finding("DK206", "the bed did not come to rest in time")
        yield from self._balance()

    def _finding(self, rule: str, message: str, **values: float) -> Finding:
        return Finding(rule, message, str(self.file), values=values)

    def _balance(self) -> Results:
        unknown = "" if self.counted else removal(self.facts)
        if is_clumped(self.facts):
            unknown = "particles are clumps"
        if unknown or self.last is None:
            why = unknown or f"no thermo column Atoms in {self.file.name}"
            yield NotApplied("DK203", why)
        elif (missing := self.expected - self.counted - self.last) > 0:
            counted = f", {self.counted} counted at outlets" if self.outlets else ""
            message = f"{missing} particles are missing: {self.expected} were there or inserted"
            message += f"{counted}, {self.last} at the end"
            yield self._finding("DK203", message, missing=missing)
