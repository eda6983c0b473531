"""Findings on a script: rules as a table, where each was met, and comments that accept one."""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

from dragdeck.errors import InputError, choices
from dragdeck.files import table_rows
from dragdeck.script.commands import EngineCommand
from dragdeck.script.flow import Script

_ACCEPTS = re.compile(r"#\s*dragdeck:\s*ignore((?:[\s,]+DK\d+)+)(.*)")
NOT_APPLIED = "not applied"
"""Severity of a rule that could not be applied."""


class Rule(NamedTuple):
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


@cache
def _messages() -> Mapping[tuple[str, str], str]:
    """The message of each hit, by rule and name."""
    rows = table_rows(Path(__file__).with_name("messages.csv"))
    return {(row["rule"], row["name"]): row["message"] for row in rows}


class Hit(NamedTuple):
    """What a rule says: name of its message, or why it is not applied; numbers and words in it."""

    name: str
    values: Mapping[str, float | str]
    command: EngineCommand | None = None
    severity: str = ""


Hits = Iterator[Hit]


def hit(
    name: str, command: EngineCommand | None = None, severity: str = "", **values: float | str
) -> Hit:
    """A hit of a rule, at a command."""
    return Hit(name, values, command, severity)


def unknown(why: str) -> Hit:
    """A rule could not be applied."""
    return Hit(why, {}, severity=NOT_APPLIED)


class Finding(NamedTuple):
    """What a rule says of a script or a run.

    Attributes
    ----------
    rule, message : str
    file : str
    line : int
        0 if it is about the whole file.
    values : mapping of str to float
        The numbers of the message, which is one sentence without a full stop.
    severity : str
        That of the rule or of the hit, or `NOT_APPLIED`.
    """

    rule: str
    message: str
    file: str = ""
    line: int = 0
    values: Mapping[str, float] = {}
    severity: str = ""

    def __str__(self) -> str:
        where = f"{self.file}:{self.line}" if self.line else self.file
        return f"{where}: {self.rule} {self.severity}: {self.message}"


def as_findings(rule: str, hits: Iterable[Hit], source: str = "") -> Iterator[Finding]:
    """The hits of a rule, as findings on a script or on another file."""
    for name, values, command, severity in hits:
        message = _messages().get((rule, name), "").format(**values) or name
        file, line = (command.file, command.line) if command else (source, 0)
        numbers = {key: value for key, value in values.items() if not isinstance(value, str)}
        yield Finding(rule, message, file, line, numbers, severity or rules()[rule].severity)


class Acceptance(NamedTuple):
    """A comment that accepts a finding: on the line of a command, or on a line before it."""

    file: str
    lines: range
    rule: str

    def holds(self, finding: Finding) -> bool:
        """Whether it accepts a finding; those from dumps have no line."""
        there = finding.file == self.file and finding.line in self.lines
        return finding.rule == self.rule and (there or finding.rule >= "DK2")


def acceptances(script: Script) -> list[Acceptance]:
    """Comments ``# dragdeck: ignore ID REASON`` of a script, by id.

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
                ids = sorted({*re.findall(r"DK\d+", comment[1])})
                check_ids(ids, file, number)
                if not comment[2].strip():
                    problem = "a comment that accepts a finding gives no reason"
                    raise InputError(problem, file=file, line=number, value=comment[0],
                                     remedy=f"write it after {ids[-1]}")  # fmt: skip
                accepted += [Acceptance(file, range(number, last + 1), rule) for rule in ids]
    return accepted


def check_ids(ids: Iterable[str], file: str | None = None, line: int | None = None) -> None:
    """Refuse ids of which no rule begins so."""
    for name in ids:
        if not any(known.startswith(name) for known in rules()):
            raise InputError("there is no such rule", file=file, line=line, value=name,
                             limit=choices(name, rules()), remedy="see --explain")  # fmt: skip


def without_accepted(
    every: Iterable[Finding], script: Script, applied: Collection[str]
) -> tuple[list[Finding], list[str]]:
    """The findings that no comment accepts, and notes on comments that accept nothing.

    Only those for a rule whose id is in `applied` can be unused.
    """
    accepted, used = acceptances(script), set[Acceptance]()
    left = []
    for finding in every:
        holding = [comment for comment in accepted if comment.holds(finding)]
        used.update(holding)
        if not holding and finding.severity != NOT_APPLIED:
            left.append(finding)
    return left, [
        f"{comment.file}:{comment.lines[0]}: nothing to ignore for {comment.rule}"
        for comment in accepted
        if comment.rule in applied and comment not in used
    ]
