"""The table in which the suite of attacks ends: attack, expected, got."""

import dataclasses
from collections import Counter
from pathlib import Path

import pytest
from paths import ROOT

from attack.case import SEED, Attack, Row, sample

FILE = ROOT / "results" / "attacks" / "table.md"
"""Where the table stands after a run of the suite, unless --attack-table says otherwise."""

_PROPERTY = "attack"
_STATES = ("as expected", "unexpected", "not run")


def add_options(parser: pytest.Parser) -> None:
    parser.addoption("--attacks", action="store_true", help="all attacks instead of a sample")
    parser.addoption("--attack-seed", type=int, default=SEED, help="seed of the attacks")
    parser.addoption("--attack-table", type=Path, default=FILE, help="file of their table")


class AttackTable:
    """A plug-in that leaves out what is not in the sample, and writes the table at the end."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self.seed: int = config.getoption("--attack-seed")
        self.file: Path = config.getoption("--attack-table")
        self.rows: list[Row] = []

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        if self.config.getoption("--attacks"):
            return
        attacks = {item: attack for item in items if (attack := _attack_of(item))}
        wanted = {id(attack) for attack in sample(attacks.values(), self.seed)}
        left_out = [item for item, attack in attacks.items() if id(attack) not in wanted]
        if len(attacks) > 1 and left_out:  # one that is named on the command line is run
            self.config.hook.pytest_deselected(items=left_out)
            gone = set(left_out)
            items[:] = [item for item in items if item not in gone]

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Write the table anew with every row: the whole suite takes an hour."""
        if report.when != "call" or hasattr(self.config, "workerinput"):
            return
        rows = [Row(**value) for name, value in report.user_properties if name == _PROPERTY]
        if rows:
            self.rows += rows
            self.file.parent.mkdir(parents=True, exist_ok=True)
            self.file.write_text(as_page(self.rows, self.seed), encoding="utf-8")

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        if self.rows:
            terminalreporter.section(f"attacks (seed {self.seed})")
            rows = [
                f"{row.state}: {row.kind}: {row.name} | {row.expected} | {row.got}"
                for row in _in_order(self.rows)
            ]
            lines = [
                "attack | expected | got",
                *rows,
                "",
                *_unexpected(self.rows),
                *_counts(self.rows),
                f"table: {self.file}",
            ]
            for line in lines:
                terminalreporter.write_line(_cell(line))


def _attack_of(item: pytest.Item) -> Attack | None:
    callspec = getattr(item, "callspec", None)
    found = callspec.params.get("attack") if callspec else None
    return found if isinstance(found, Attack) else None


def note(row: Row, request: pytest.FixtureRequest) -> None:
    """Hand a row to the process that writes the table."""
    request.node.user_properties.append((_PROPERTY, dataclasses.asdict(row)))


def _counts(rows: list[Row]) -> list[str]:
    """A line per kind, and one for all."""
    count = Counter((row.kind, row.state) for row in rows)
    kinds = sorted({row.kind for row in rows})
    lines = ["{:<12}{:>8}{:>14}{:>12}{:>10}".format("kind", "attacks", *_STATES)]
    for kind in (*kinds, "all"):
        of_kind = [
            sum(number for (each, found), number in count.items()
                if kind in (each, "all") and found == state)
            for state in _STATES
        ]  # fmt: skip
        lines.append("{:<12}{:>8}{:>14}{:>12}{:>10}".format(kind, sum(of_kind), *of_kind))
    return lines


def _unexpected(rows: list[Row]) -> list[str]:
    lines = []
    for row in sorted(rows, key=lambda row: (row.kind, row.name)):
        if row.state == "unexpected":
            lines += [
                f"unexpected: {row.kind}: {row.name}",
                f"  expected: {row.expected}",
                f"  got:      {row.got}",
                *(f"            {line}" for line in row.seen.strip().splitlines()[-6:]),
            ]
    return lines


def as_page(rows: list[Row], seed: int) -> str:
    """The table as a page."""
    lines = [f"# Attacks (seed {seed})", "", "```", *_counts(rows), "```", ""]
    lines += ["| | attack | expected | got |", "| --- | --- | --- | --- |"]
    for row in _in_order(rows):
        cells = (row.state, f"{row.kind}: {row.name}", row.expected, row.got)
        lines.append("| " + " | ".join(_cell(cell).replace("|", "or") for cell in cells) + " |")
    seen = [row for row in rows if row.state == "unexpected"]
    for row in seen:
        lines += [
            "",
            f"## {_cell(row.kind)}: {_cell(row.name)}",
            "",
            "```",
            row.seen[-3000:],
            "```",
        ]
    return "\n".join(lines) + "\n"


def _in_order(rows: list[Row]) -> list[Row]:
    """What is unexpected first, then what was not run."""
    order = ("unexpected", "not run", "as expected")
    return sorted(rows, key=lambda row: (order.index(row.state), row.kind, row.name))


def _cell(text: str) -> str:
    """Text that no table and no terminal stumbles over."""
    return text.encode("unicode_escape").decode("ascii")
