"""What the log of a run tells: errors, warnings, and how many particles there should be."""

import re
from pathlib import Path

from dragdeck.audit.measures import is_clumped, removal
from dragdeck.engine.log import engine_errors, never_settled
from dragdeck.errors import InputError
from dragdeck.files import text_of
from dragdeck.script.facts import Facts, as_numbers
from dragdeck.script.findings import Hits, hit, unknown

_INSERTED = re.compile(r"INFO: Particle insertion \S+: inserted (\d+) particle templates")
_WARNINGS = ("Less insertions than requested", "timestep is > ")
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
            row = (
                dict(zip(self.table, words, strict=False)) if len(words) == len(self.table) else {}
            )
            if words[:1] == ["Step"] or line.startswith("Loop time of"):
                self.table = words if words[0] == "Step" else []
            elif match := _INSERTED.search(line):
                inserted += int(match[1])
            elif row and _NO_NUMBERS & {*words}:
                self.not_finite = self.not_finite or line.strip()
            elif row.get("Atoms", "").isdecimal():
                last = int(row["Atoms"])
                self.expected += last if self.last is None else inserted
                counts = as_numbers([row[name] for name in self.outlets if name in row])
                self.last, inserted, self.counted = last, 0, round(sum(counts or ()))
        begins = re.search(r"^\s*(LIGGGHTS \(|Step )", self.text, re.MULTILINE)
        if not (begins or engine_errors(self.text)):
            raise InputError("the file is no log of LIGGGHTS", file=file,
                             remedy="give log.liggghts, or the output on the screen")  # fmt: skip

    def warnings(self) -> Hits:
        """Errors and warnings of LIGGGHTS (DK208)."""
        errors = engine_errors(self.text)
        yield from (hit("error", None, "error", what=error) for error in errors)
        if self.not_finite:
            yield hit("number", None, "error", what=self.not_finite)
        elif self.table and not errors:
            yield hit("end", None, "error")
        for part in _WARNINGS:
            lines = [line.strip() for line in self.text.split("\n") if part in line]
            if lines:
                yield hit(part, lines=len(lines), what=lines[0][:120])
        builds = sum(map(int, re.findall(r"^Dangerous builds = (\d+)", self.text, re.MULTILINE)))
        if builds:
            yield hit("builds", builds=builds)

    def rest(self) -> Hits:
        """Whether a filling of dragdeck came to rest (DK206)."""
        if never_settled(self.text):
            yield hit("log")

    def balance(self) -> Hits:
        """Particles that were lost (DK203)."""
        clumped = "particles are clumps" if is_clumped(self.facts) else ""
        unused = clumped or ("" if self.counted else removal(self.facts))
        if unused or self.last is None:
            yield unknown(unused or f"no thermo column Atoms in {self.file.name}")
        elif (missing := self.expected - self.counted - self.last) > 0:
            yield hit("log", missing=missing, there=self.expected, counted=self.counted,
                      last=self.last)  # fmt: skip
