"""The command ``audit``: rules on a script, its dumps and its log."""

import json
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from fnmatch import fnmatch
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dragdeck.errors import DragdeckError, InputError, TruncatedDumpError
from dragdeck.script.commands import words_of
from dragdeck.script.facts import Facts
from dragdeck.script.findings import (
    NOT_APPLIED,
    Finding,
    as_findings,
    check_ids,
    rules,
    unknown,
    without_accepted,
)
from dragdeck.script.flow import Script, read_script
from dragdeck.script.rules import script_findings

if TYPE_CHECKING:
    from dragdeck.dumps.frame import Frame

_SEVERITIES = ("error", "warning", "note")


def audit(
    script: Path | None,
    dump: Sequence[str] = (),
    contacts: Sequence[str] = (),
    log: Path | None = None,
    after: Path | None = None,
    var: Sequence[Sequence[str]] = (),
    engine: bool = False,
    select: str = "DK",
    ignore: str = "",
    format: str = "text",
    explain: str | None = None,
) -> int:
    """Print what the rules say.

    Returns
    -------
    int
        0 if there is neither an error nor a warning, 1 if there is one, 2 if an input cannot be
        read.
    """
    try:
        if explain is not None:
            print(rule_text(explain))
            return 0
        if script is None:
            raise InputError("no input script is given", remedy="give SCRIPT, or --explain ID")
        chosen = [tuple(filter(None, ids.split(","))) for ids in (select, ignore)]
        check_ids(id for ids in chosen for id in ids)
        wanted = {id for id in rules() if id.startswith(chosen[0])
                  and not (chosen[1] and id.startswith(chosen[1]))}  # fmt: skip
        if contacts and not dump:
            raise InputError("--contacts is read only with --dump", remedy="give --dump, too")
        for name, *values in var:
            if not values:
                raise InputError("a variable without a value", field="--var", value=name,
                                 remedy="write --var NAME VALUE")  # fmt: skip
        followed = read_script(script, {name: values for name, *values in var}, after=after)
        report = Report(followed, wanted, str(after))
        report.add(script_findings(followed), "DK1")
        if engine:
            from dragdeck.audit.zero_steps import engine_findings

            report.add(as_findings("DK300", engine_findings(followed)), "DK3")
        if dump:
            report.add_dumps(dump, contacts)
        if log is not None:
            report.add_log(log)
        print(json.dumps(report.document, indent=2) if format == "json" else report.text)
    except OSError as error:
        print(f"dragdeck: {error.filename}: cannot be read: {error.strerror}", file=sys.stderr)
        return 2
    except DragdeckError as error:
        print(f"dragdeck: {error}", file=sys.stderr)
        return 2
    return int(any(finding.severity != "note" for finding in report.judged[0]))


def rule_text(id: str) -> str:
    """What the rules are whose ids begin so, with their evidence."""
    check_ids([id])
    return "\n\n".join(
        f"{rule.id} {rule.severity}: {rule.title}\n"
        f"  evidence: {rule.evidence}\n  remedy:   {rule.remedy}"
        for rule in rules().values()
        if rule.id.startswith(id)
    )


def _order(file: Path) -> tuple[str, list[int]]:
    """The name of a file without its numbers, and these."""
    return re.sub(r"\d+", "", file.name), [*map(int, re.findall(r"\d+", file.name))]


class Report:
    """The findings on a script and a run.

    Parameters
    ----------
    script : Script
    wanted : set of str
        Ids of the rules to apply.
    after : str
        Script of the restart file, which is not judged.
    """

    def __init__(self, script: Script, wanted: set[str], after: str = "") -> None:
        self.script, self.facts, self.wanted, self.after = script, Facts(script), wanted, after
        self.every: list[Finding] = []
        self.applied: set[str] = set()
        self.known: dict[str, float | str] = {}

    def add(self, hits: Iterable[Finding], *ids: str) -> None:
        """Add what rules say whose ids begin so."""
        added = [hit for hit in hits if hit.rule in self.wanted and hit.file != self.after]
        self.every += added
        skipped = {hit.rule for hit in added if hit.severity == NOT_APPLIED}
        self.applied |= {id for id in self.wanted if id.startswith(ids)} - skipped

    def add_log(self, file: Path) -> None:
        """Apply the rules on the log."""
        from dragdeck.audit.run_log import RunLog

        log = RunLog(file, self.facts)
        if log.last is not None:
            self.known |= {"inserted or there": log.expected, "at the end": log.last}
        hits = {"DK208": log.warnings(), "DK206": log.rest(), "DK203": log.balance()}
        self.add((finding for rule in hits for finding in as_findings(rule, hits[rule], str(file))),
                 "DK203", "DK208")  # fmt: skip

    def add_dumps(self, dump: Sequence[str], contacts: Sequence[str]) -> None:
        """Apply the rules on the dumps."""
        from dragdeck.audit.measures import RULES, Measures

        run, source = Measures(self.facts), ", ".join(dump)
        columns = self._contact_columns() if contacts else []
        pairs = self._frames(contacts) if columns else iter(())
        pair = next(pairs, None)
        if pair is not None and not {*columns} <= pair.columns.keys():
            pair, columns = None, []
        lacking, step, left_out = set[str](), -1, 0
        for frame in self._frames(dump):
            columns_there = {"radius" if name == "diameter" else name for name in frame.columns}
            lacking = {"id", "x", "y", "z", "radius"} - columns_there
            if lacking or frame.step <= step:  # another dump, of contacts or of a group
                left_out += 1
                continue
            step = frame.step
            run.add(frame)
            while pair is not None and pair.step < frame.step:
                pair = next(pairs, None)
            if pair is not None and pair.step == frame.step:
                run.add_contacts(pair, columns[:2], columns[2:])
        if not run.frames:
            names = ", ".join(sorted(lacking)) or "whole frame"
            raise InputError(f"the dump has no {names}", file=source,
                             remedy="give the dump of the particles")  # fmt: skip
        run.left_out = self._left_out(dump)
        for rule, measure in RULES.items():
            self.add(as_findings(rule, measure(run), source), rule)
        self.known |= run.known | ({"frames left out": left_out} if left_out else {})
        if contacts and not columns:
            why = "no compute pair/gran/local with id and force, or other columns in its dump"
            self.add(as_findings("DK207", [unknown(why)]))
        elif contacts:
            self.add(as_findings("DK207", run.limited(), ", ".join(contacts)), "DK207")
            self.known["contacts above Coulomb's limit"] = f"{run.n_beyond} of {run.n_contacts}"

    def _frames(self, patterns: Sequence[str]) -> "Iterator[Frame]":
        """The frames of all files, in the order of their names and of the numbers in these."""
        from dragdeck.dumps.reader import dump_files, layout_of, read_frames

        files: list[Path] = []
        for pattern in patterns:
            paths = Path(pattern).parent.glob(Path(pattern).name or "none")
            files += sorted(filter(Path.is_file, paths), key=_order) or dump_files(pattern)
        for file in files:
            words = self._dump_of(file.name) if ".bin" in file.suffixes[-2:] else []
            try:  # a run that was killed leaves part of a frame
                yield from read_frames([file], layout_of(file, words[6:] or None))
            except TruncatedDumpError as error:
                self.known["ends within a frame"] = str(error.file)

    def _dump_of(self, name: str) -> list[str]:
        """The words of the last dump of the script that writes files of such a name."""
        words: list[str] = []
        for command in self.facts.named("dump"):
            pattern = re.sub(r"\$\{\w+\}|\$\w", "*", "".join(words_of(command.text)[5:6]))
            if fnmatch(Path(name).name, Path(pattern).name):
                words = command.words
        return words

    def _left_out(self, patterns: Sequence[str]) -> str:
        """Why the dumps need not contain all particles; empty if they must."""
        ids = {id for name in patterns for id in self._dump_of(name)[1:2]}
        partial = [c.words[1] for c in self.facts.named("dump_modify")
                   if ids & {*c.words[1:2]} and {"thresh", "region"} & {*c.words}]  # fmt: skip
        return f"the dump {partial[0]} leaves particles out" if partial else ""

    def _contact_columns(self) -> list[str]:
        """Columns with ids and forces of contacts between particles; none if not known."""
        for words in (command.words for command in self.facts.named("compute")):
            if words[3:4] == ["pair/gran/local"] and {"id", "force"} <= set(words):
                begin = 6 * len({"pos", "vel"} & {*words})  # six columns each come first
                return [f"c_{words[1]}[{begin + n}]" for n in (1, 2, 4, 5, 6)]
        return []

    @cached_property
    def judged(self) -> tuple[list[Finding], list[str]]:
        """Of all rules: findings that no comment accepts, and notes on unused comments."""
        return without_accepted(self.every, self.script, self.applied)

    @property
    def skipped(self) -> list[Finding]:
        """The rules that were not applied."""
        return [finding for finding in self.every if finding.severity == NOT_APPLIED]

    @property
    def text(self) -> str:
        """A line for each finding with its remedy, and what was not checked."""
        judged, unused = self.judged
        measured = [f"{name} {value:.4g}" if isinstance(value, float) else f"{name} {value}"
                    for name, value in self.known.items()]  # fmt: skip
        counts = {grade: sum(f.severity == grade for f in judged) for grade in _SEVERITIES}
        counted = [f"{count} {severity}(s)" for severity, count in counts.items() if count]
        return "\n".join([
            *(f"{finding}\n    {rules()[finding.rule].remedy}" for finding in judged),
            *(f"{note} (unused comment)" for note in unused),
            *(["measured: " + "; ".join(measured)] if measured else []),
            *([f"dialect: {self.facts.dialect}"] if self.facts.dialect else []),
            *(f"not followed: {note}" for note in self.script.not_followed),
            *(f"not applied: {skip.rule}: {skip.message}" for skip in self.skipped),
            ", ".join(counted) or "no findings",
        ])  # fmt: skip

    @property
    def document(self) -> dict[str, Any]:
        """The same for programs."""
        judged, unused = self.judged
        return {
            "version": 1, "file": str(self.script.file), "dialect": self.facts.dialect,
            "findings": [{**finding._asdict(), "remedy": rules()[finding.rule].remedy}
                         for finding in judged],
            "unused": unused, "known": self.known, "not_followed": [*self.script.not_followed],
            "not_applied": [{"rule": skip.rule, "why": skip.message} for skip in self.skipped],
        }  # fmt: skip
