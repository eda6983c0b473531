"""The command ``audit``: rules on a script, its dumps and its log."""

import json
import re
import sys
from collections.abc import Iterator, Sequence
from fnmatch import fnmatch
from functools import cached_property
from pathlib import Path

from dragdeck.errors import DragdeckError, InputError
from dragdeck.script.commands import words_of
from dragdeck.script.facts import Facts
from dragdeck.script.findings import Finding, NotApplied, Rule, check_ids, rules, without_accepted
from dragdeck.script.flow import Script, read_script
from dragdeck.script.rules import script_findings

_FAILS = ("error", "warning")
_OF_CONTACTS = ("pos", "vel")


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
            print(explained(explain))
            return 0
        if script is None:
            raise InputError("no input script is given", remedy="give SCRIPT, or --explain ID")
        report = Report(script, {name: values for name, *values in var}, after, select, ignore)
        report.add_script()
        if engine:
            from dragdeck.audit.zero_steps import engine_findings

            report.add(engine_findings(report.script), ["DK300"])
        if dump:
            report.add_dumps(dump, contacts)
        if log is not None:
            report.add_log(log)
        print(report.as_json() if format == "json" else report.as_text())
    except (DragdeckError, OSError) as error:
        print(f"dragdeck: {error}", file=sys.stderr)
        return 2
    return int(any(finding.graded in _FAILS for finding in report.judged[0]))


def explained(id: str) -> str:
    """What a rule means, with its evidence."""
    check_ids([id])
    return "\n\n".join(_explained(rule) for name, rule in rules().items() if name.startswith(id))


def _explained(rule: Rule) -> str:
    head = f"{rule.id} {rule.severity}: {rule.title}"
    return f"{head}\n  evidence: {rule.evidence}\n  remedy:   {rule.remedy}"


class Report:
    """The findings on a script and a run.

    Parameters
    ----------
    file : Path
    variables : dict
        Values of ``-var``.
    after : Path or None
        Script of the restart file.
    select, ignore : str
        Beginnings of ids, separated by commas.
    """

    def __init__(
        self,
        file: Path,
        variables: dict[str, list[str]],
        after: Path | None,
        select: str,
        ignore: str,
    ) -> None:
        self.selected, self.ignored = (
            tuple(filter(None, ids.split(","))) for ids in (select, ignore)
        )
        check_ids([*self.selected, *self.ignored])
        self.script: Script = read_script(file, variables, after=after)
        self.facts = Facts(self.script)
        self.after = str(after)
        self.every: list[Finding] = []
        self.skipped: list[NotApplied] = []
        self.applied: set[str] = set()
        self.known: dict[str, float | str] = {}

    def add(self, results: Iterator[Finding | NotApplied], ids: Sequence[str]) -> None:
        """Add what rules say, of which these were applied."""
        for result in results:
            if isinstance(result, NotApplied):
                self.skipped.append(result)
            elif self._wanted(result.rule) and result.file != self.after:
                self.every.append(result)
        self.applied |= {id for id in ids if self._wanted(id)} - {
            skip.rule for skip in self.skipped
        }

    def _wanted(self, id: str) -> bool:
        return id.startswith(self.selected) and not (self.ignored and id.startswith(self.ignored))

    def add_script(self) -> None:
        """Apply the rules on the script."""
        self.add(iter(script_findings(self.script)), [id for id in rules() if id < "DK2"])

    def add_log(self, log: Path) -> None:
        """Apply the rules on the log."""
        from dragdeck.audit.measures import removal
        from dragdeck.audit.run_log import balance_of, log_findings

        meters = self.facts.styled("massflow/mesh")
        outlets = [fix.id for fix in meters if "delete_atom" in fix.words]
        text = log.read_text(encoding="utf-8", errors="replace")
        balance = balance_of(text, outlets)
        unknown = "" if balance and balance.counted else removal(self.facts)
        if self.facts.styled("multisphere", "particletemplate/multisphere"):
            unknown = "particles are clumps"
        if balance:
            self.known |= {"inserted or there": balance.expected, "at the end": balance.last}
        self.add(log_findings(log, text, balance, outlets, unknown), ["DK203", "DK208"])

    def add_dumps(self, dump: Sequence[str], contacts: Sequence[str]) -> None:
        """Apply the rules on the dumps."""
        from dragdeck.audit.measures import ContactSums, Measures, matched
        from dragdeck.dumps.reader import dump_files, layout_of, read_frames

        source = ", ".join(dump)
        run, sums = Measures(self.facts, source), ContactSums()
        ids, forces = self._contact_columns(contacts)

        def frames(patterns: Sequence[str]) -> Iterator:  # type: ignore[type-arg]
            files = [file for pattern in patterns for file in dump_files(pattern)]
            files.sort(key=lambda file: [int(part) for part in re.findall(r"\d+", file.name)])
            for file in files:
                binary = ".bin" in file.suffixes[-2:]
                yield from read_frames(
                    [file], layout_of(file, self._columns(file) if binary else None)
                )

        for frame, touching in matched(frames(dump), frames(contacts)):
            lacking = {"id", "x", "y", "z"} - set(frame.columns)
            if lacking or not {"radius", "diameter"} & set(frame.columns):
                names = ", ".join(sorted(lacking)) or "radius"
                self.add(iter([NotApplied("DK201", f"{source} has no column {names}")]), [])
                return
            run.add(frame)
            if touching is not None and ids and run.last is not None:
                sums.add(touching, ids, forces, run, run.last)
        self.add(run.results(), [f"DK20{n}" for n in range(1, 7)])
        self.known |= {"frames": run.frames, "contacts of": run.scope}
        self.known |= {
            "largest overlap over radius": run.overlap.value,
            "largest speed, m/s": run.speed.value,
        }
        if run.stability is not None:
            self.known["stability number"] = run.stability
        if run.energies:
            self.known["mean kinetic energy in the last frame, J/kg"] = run.energies[-1].mean
        if contacts:
            self.add(sums.results(", ".join(contacts)), ["DK207"])
            self.known["contacts above Coulomb's limit"] = f"{sums.beyond} of {sums.contacts}"

    def _columns(self, file: Path) -> list[str] | None:
        """Columns of a binary dump, as the script says them."""
        for command in reversed([*self.facts.named("dump")]):
            name = re.sub(r"\$\{\w+\}", "*", "".join(words_of(command.text)[5:6]))
            if fnmatch(file.name, Path(name).name):
                return command.words[6:]
        return None

    def _contact_columns(self, contacts: Sequence[str]) -> tuple[list[str], list[str]]:
        """Columns with the ids and the forces of contacts between particles; none if not known."""
        for compute in self.facts.named("compute") if contacts else ():
            words = compute.words
            if words[3:4] == ["pair/gran/local"] and {"id", "force"} <= set(words):
                begin = 6 * sum(name in words for name in _OF_CONTACTS)
                places = [begin + n for n in (1, 2, 4, 5, 6)]
                names = [f"c_{words[1]}[{place}]" for place in places]
                return names[:2], names[2:]
        if contacts:
            self.skipped.append(NotApplied("DK207", "no compute pair/gran/local with id and force"))
        return [], []

    @cached_property
    def judged(self) -> tuple[list[Finding], list[str]]:
        """Of all rules: findings that no comment accepts, and notes on unused comments."""
        return without_accepted(self.every, self.script, self.applied)

    def as_text(self) -> str:
        """A line for each finding with its remedy, and what was not checked."""
        findings, unused = self.judged
        lines = [f"{finding}\n    {rules()[finding.rule].remedy}" for finding in findings]
        lines += [f"{note} (unused comment)" for note in unused]
        if self.known:
            shown = (
                f"{name} {v:.4g}" if isinstance(v, float) else f"{name} {v}"
                for name, v in self.known.items()
            )
            lines.append("measured: " + "; ".join(shown))
        if self.facts.dialect:
            lines.append(f"dialect: {self.facts.dialect}")
        lines += [f"not followed: {note}" for note in self.script.not_followed]
        lines += [f"not applied: {skip.rule}: {skip.why}" for skip in self.skipped]
        counts = [f"{n} {grade}(s)" for grade in ("error", "warning", "note")
                  if (n := sum(finding.graded == grade for finding in findings))]  # fmt: skip
        return "\n".join([*lines, ", ".join(counts) or "no findings"])

    def as_json(self) -> str:
        """The same for programs."""
        findings, unused = self.judged
        rows = [
            {"rule": f.rule, "severity": f.graded, "file": f.file, "line": f.line,
             "message": f.message, "remedy": rules()[f.rule].remedy, "values": dict(f.values)}
            for f in findings
        ]  # fmt: skip
        document = {
            "version": 1, "file": str(self.script.file), "dialect": self.facts.dialect,
            "findings": rows, "unused": unused, "known": self.known,
            "not_followed": self.script.not_followed,
            "not_applied": [{"rule": skip.rule, "why": skip.why} for skip in self.skipped],
        }  # fmt: skip
        return json.dumps(document, indent=2)
