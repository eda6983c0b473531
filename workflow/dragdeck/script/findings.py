"""Findings on a script: rules as a table, where each was met, and comments that accept one."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import ClassVar

from dragdeck.errors import InputError, choices
from dragdeck.files import table_rows
from dragdeck.script.commands import EngineCommand
from dragdeck.script.flow import Script

_ACCEPTS = re.compile(r"#\s*dragdeck:\s*ignore((?:[\s,]+DK\d+)+)(.*)")


@dataclass(frozen=True)
class Rule:
    """A rule: severity ``error`` (results are wrong), ``warning`` or ``note``, and texts."""

    id: str
    severity: str
    title: str
    remedy: str
    evidence: str


@cache
def rules() -> Mapping[str, Rule]:
    """Every rule by its id; an id is never used again."""
    rows = table_rows(Path(__file__).with_name("rules.csv"))
    return {row["id"]: Rule(**row) for row in rows}


@dataclass(frozen=True)
class Finding:
    """What a rule says of a script or a run.

    Attributes
    ----------
    rule : str
    message : str
        What is the case here, in one sentence without a full stop.
    file : str
    line : int
        0 if it is about the whole file.
    values : mapping of str to float
        The numbers of the message.
    severity : str
        That of the rule, unless it is given.
    """

    rule: str
    message: str
    file: str = ""
    line: int = 0
    values: Mapping[str, float] = field(default_factory=dict)
    severity: str = ""

    def __str__(self) -> str:
        where = f"{self.file}:{self.line}" if self.line else self.file
        return f"{where}: {self.rule} {self.graded}: {self.message}"

    @property
    def graded(self) -> str:
        """Its severity."""
        return self.severity or rules()[self.rule].severity


@dataclass(frozen=True)
class NotApplied:
    """A rule that could not be applied, and why."""

    rule: str
    why: str
    file: ClassVar[str] = ""
    line: ClassVar[int] = 0


Results = Iterator[Finding | NotApplied]


def at(
    rule: str, command: EngineCommand, message: str, severity: str = "", **values: float
) -> Finding:
    """A finding at a command."""
    return Finding(rule, message, command.file, command.line, values, severity)


@dataclass(frozen=True)
class Acceptance:
    """A comment that accepts findings: on the line of a command, or on a line before it."""

    file: str
    lines: range
    ids: frozenset[str]

    def holds(self, finding: Finding) -> bool:
        """Whether it accepts a finding; those from dumps have no line."""
        there = finding.file == self.file and finding.line in self.lines
        return finding.rule in self.ids and (there or finding.rule >= "DK2")


def acceptances(script: Script) -> list[Acceptance]:
    """Comments ``# dragdeck: ignore ID REASON`` of a script.

    Raises
    ------
    InputError
        One gives no reason, or an unknown id.
    """
    accepted = []
    for file, text in script.texts.items():
        last = 0
        for number, line in reversed([*enumerate(text.split("\n"), start=1)]):
            last = last if last and line.lstrip().startswith("#") else number
            if comment := _ACCEPTS.search(line):
                ids = frozenset(re.findall(r"DK\d+", comment[1]))
                check_ids(ids, file, number)
                if not comment[2].strip():
                    raise InputError(
                        "a comment that accepts a finding gives no reason",
                        file=file, line=number, value=comment[0],
                        remedy=f"write the reason after {' '.join(sorted(ids))}",
                    )  # fmt: skip
                accepted.append(Acceptance(file, range(number, last + 1), ids))
    return accepted[::-1]


def check_ids(ids: Iterable[str], file: str | None = None, line: int | None = None) -> None:
    """Refuse ids of which no rule begins so."""
    for name in ids:
        if not any(known.startswith(name) for known in rules()):
            raise InputError("there is no such rule", file=file, line=line, value=name,
                             limit=choices(name, rules()), remedy="see --explain")  # fmt: skip


def without_accepted(
    findings: Sequence[Finding], script: Script, applied: Iterable[str]
) -> tuple[list[Finding], list[str]]:
    """The findings that no comment accepts, and notes on comments that accept nothing.

    Parameters
    ----------
    findings : sequence of Finding
    script : Script
    applied : iterable of str
        Ids of the rules that were applied: only those can be unused.
    """
    accepted = acceptances(script)
    left = [f for f in findings if not any(comment.holds(f) for comment in accepted)]
    notes, known = [], set(applied)
    for comment in accepted:
        used = {finding.rule for finding in findings if comment.holds(finding)}
        for name in sorted((comment.ids & known) - used):
            notes.append(f"{comment.file}:{comment.lines[0]}: nothing to ignore for {name}")
    return left, notes
