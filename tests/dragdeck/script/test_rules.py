"""Each rule on an own small script that it hits, and on one that it does not."""

from pathlib import Path
from typing import Any

import pytest
from audit_decks import DECK, LAW, cases, edited, write
from paths import ROOT

from dragdeck.decks.render import findings_on
from dragdeck.errors import InputError
from dragdeck.script.facts import Facts
from dragdeck.script.findings import NOT_APPLIED, acceptances, rules, without_accepted
from dragdeck.script.flow import read_script
from dragdeck.script.rules import script_findings

CASES = cases("rules")


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["id"])
def test_a_rule_hits_or_does_not(tmp_path: Path, case: dict[str, Any]) -> None:
    text = edited(case.get("edits", ()), case.get("before", ""))
    script = read_script(write(tmp_path, text))
    every = script_findings(script)
    left, _ = without_accepted(every, script, ())
    assert sorted({finding.rule for finding in left}) == case["finds"]
    unknown = {result.rule for result in every if result.severity == NOT_APPLIED}
    assert sorted(unknown) == case.get("unknown", [])
    assert (case["dialect"] in (dialect := Facts(script).dialect) and dialect if "dialect" in case
            else not Facts(script).dialect)  # fmt: skip


def test_every_rule_on_scripts_has_a_case() -> None:
    assert {rule for rule in rules() if rule < "DK2"} == {
        rule for c in CASES for rule in c["finds"]
    }


def test_comments_accept_findings_and_unused_ones_are_noted(tmp_path: Path) -> None:
    text = DECK.replace("DK111 the bed", "DK111, DK106 the bed")
    script = read_script(write(tmp_path, text))
    left, notes = without_accepted(script_findings(script), script, rules())
    assert left == [] and "DK106" in notes[0]
    assert without_accepted([], script, ["DK106"])[1] == notes
    for comment, problem in (("DK111", "no reason"), ("DK999 a reason", "no such rule")):
        file = write(tmp_path, DECK.replace("DK111 the bed is at rest", comment))
        with pytest.raises(InputError, match=problem):
            acceptances(read_script(file))


GOLDEN = sorted((ROOT / "tests" / "golden").glob("*.liggghts"))


@pytest.mark.parametrize("file", GOLDEN, ids=lambda file: file.name)
def test_scripts_of_the_project_have_no_finding(file: Path) -> None:
    text = file.read_text()
    assert findings_on(text) == []
    assert sum("dragdeck: ignore" in line for line in text.splitlines()) <= 1


@pytest.mark.parametrize(
    ("edit", "rule"),
    [
        (f"pair_style gran model {LAW} => pair_style gran model hertz", "DK101"),
        (f"wall/gran model {LAW} primitive => wall/gran model hertz primitive", "DK102"),
        ("dump write_c => compute late all pair/gran/local id\ndump write_c", "DK112"),
    ],
)
def test_what_a_template_spoils_is_found(edit: str, rule: str) -> None:
    (text,) = (file.read_text() for file in GOLDEN if "process" in file.name)
    assert [finding.rule for finding in findings_on(edited([edit], text=text))] == [rule]
