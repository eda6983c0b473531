"""Each rule on an own small script that it hits, and on one that it does not."""

from pathlib import Path

import audit_decks
import pytest
from audit_decks import DECK, LAW, PRESS, SIDES, without
from paths import ROOT

from dragdeck.decks.render import findings_on
from dragdeck.errors import InputError
from dragdeck.script.findings import NOT_APPLIED, Finding, acceptances, rules, without_accepted
from dragdeck.script.flow import read_script
from dragdeck.script.rules import script_findings

ROLLING = (
    "fix rolling all property/global coefficientRollingFriction peratomtypepair 2 0 0.2 0.2 0\n"
)
CDT = f"{LAW} rolling_friction cdt"
SIDE = f"wall/gran model {LAW} primitive type 2 {SIDES[0]}"
MESH = "fix plate all mesh/surface file plate.stl type 2\n"
TURN = "fix turn all move/mesh mesh plate rotate origin 0 0 0 axis 0 0 1 period 1\n"
SHIFT = "fix shift all move/mesh mesh plate linear {} 0 {}\n"


def before_run(text: str) -> str:
    return DECK.replace("run 1\n", f"{text}run 1\n", 1)


def changed(old: str, new: str, count: int = -1) -> str:
    assert old in DECK
    return DECK.replace(old, new, count)


CASES = {
    "DK101": (
        changed(f"pair_style gran model {LAW}", "pair_style gran model hertz"),
        changed("2 0.5 0.5 0.5 0.5", "2 0 0 0 0").replace(
            f"pair_style gran model {LAW}", "pair_style gran model hertz"
        ),
    ),
    "DK102": (
        changed(SIDE, SIDE.replace(LAW, "hertz")),
        changed(SIDE, SIDE.replace(LAW, "hertz")).replace("2 0.5 0.5 0.5 0.5", "2 0.5 0 0 0.5"),
    ),
    "DK103": (before_run(ROLLING), before_run(ROLLING).replace(LAW, CDT)),
    "DK104": (
        before_run(ROLLING).replace(LAW, f"{LAW} rolling_friction epsd2"),
        before_run(ROLLING).replace(LAW, f"{LAW} rolling_friction epsd2 torsionTorque on"),
    ),
    "DK105": (
        changed("-0.01 0.05 -0.01 0.05 -0.01 0.05", "-1 1 -1 1 -1 1"),
        changed("-0.01 0.05 -0.01 0.05 -0.01 0.05", "-1 1 -1 1 -1 1").replace("f f f", "s s s"),
    ),
    "DK106": (changed("region 100", "region 900"), changed("region 100", "region 500")),
    "DK107": (
        changed("5e6 5e6", "1e6 5e6"),
        changed("5e6 5e6", "1e6 5e6").replace("units si\n", "units si\nsoft_particles yes\n"),
    ),
    "DK108": (
        changed("run 8000", "run ${steps}"),
        changed("run 8000", "variable steps equal 5\nrun ${steps}"),
    ),
    "DK109": (before_run(MESH), before_run(PRESS)),
    "DK110": (
        before_run(PRESS + TURN + SHIFT.format(1, 0)),
        before_run(PRESS + SHIFT.format(1, 0) + TURN),
    ),
    "DK111": (without(DECK, "# dragdeck"), without(DECK, "# dragdeck|dump pairs")),
    "DK112": (without(DECK, "radius$").replace("omegay &\n", "omegay\n"), DECK),
}  # fmt: skip


def findings(folder: Path, text: str) -> list[Finding]:
    script = read_script(audit_decks.write(folder, text))
    return [result for result in script_findings(script) if result.severity != NOT_APPLIED]


@pytest.mark.parametrize("rule", CASES)
def test_a_rule_hits_and_does_not(tmp_path: Path, rule: str) -> None:
    hit, sound = CASES[rule]
    assert rule in {finding.rule for finding in findings(tmp_path, hit)}
    assert rule not in {finding.rule for finding in findings(tmp_path, sound)}


def test_a_sound_script_has_no_finding_that_is_not_accepted(tmp_path: Path) -> None:
    script = read_script(audit_decks.write(tmp_path))
    every = findings(tmp_path, DECK)
    assert [finding.rule for finding in every] == ["DK111"]
    assert without_accepted(every, script, rules())[0] == []


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        (changed("15485863", "4"), "DK107"),
        (changed("2 0.3 0.3 0.3 0.3", "2 0.3 0.3 0.3 1.3"), "DK107"),
        (changed("2 0.5 0.5 0.5 0.5", "2 0.5 0.5 0.5"), "DK107"),
        (before_run(MESH.replace("plate.stl", "none.stl")), "DK108"),
        (before_run("include none.in\n"), "DK108"),
        (before_run(MESH + SHIFT.format(0, 1)), "DK109"),
        (before_run("read_restart a\n" + PRESS + SHIFT.format(1, 0) + TURN), "DK110"),
        (changed("run 8000", "compute late all pair/gran/local id\nrun 8000"), "DK112"),
    ],
)
def test_other_ways_to_hit(tmp_path: Path, text: str, rule: str) -> None:
    assert rule in {finding.rule for finding in findings(tmp_path, text)}


@pytest.mark.parametrize(
    "text",
    [
        before_run(PRESS + TURN + SHIFT.format(0, 1)),  # along the axis
        before_run(PRESS + TURN + "unfix turn\n" + SHIFT.format(1, 0)),  # one after the other
        changed("region 100", "region 900").replace("overlapcheck yes", "overlapcheck no"),
        changed("region 100", "region ${n}").replace(
            "units si", "variable n equal ke\nunits si", 1
        ),
    ],
)
def test_what_is_harmless_or_unknown_is_no_finding(tmp_path: Path, text: str) -> None:
    assert {finding.rule for finding in findings(tmp_path, text)} == {"DK111"}


def test_what_is_not_known_is_said(tmp_path: Path) -> None:
    text = changed("constant &\n    0.002", "gaussian number 0.002 0.0001")
    script = read_script(audit_decks.write(tmp_path, text))
    skipped = {each.rule for each in script_findings(script) if each.severity == NOT_APPLIED}
    assert skipped == {"DK105", "DK106"}


@pytest.mark.parametrize(
    ("text", "dialect"),
    [
        (changed("15485863", "1").replace("15485867", "2").replace("32452843", "3"), "before 3.4"),
        (changed("gran model", "gran/hertz/history model", 1), "before 3.0"),
        (changed("nve/sphere", "nve/nonspherical"), "fork"),
    ],
)
def test_another_dialect_is_named_and_not_judged(tmp_path: Path, text: str, dialect: str) -> None:
    script = read_script(audit_decks.write(tmp_path, text))
    (skipped,) = [r for r in script_findings(script) if r.rule == "DK107"]
    assert skipped.severity == NOT_APPLIED and dialect in skipped.message


def test_comments_accept_findings_and_unused_ones_are_noted(tmp_path: Path) -> None:
    text = DECK.replace("DK111 the bed", "DK111, DK106 the bed")
    script = read_script(audit_decks.write(tmp_path, text))
    left, notes = without_accepted(findings(tmp_path, text), script, rules())
    assert left == [] and "DK106" in notes[0]
    assert without_accepted([], script, ["DK106"])[1] == notes
    file = audit_decks.write(tmp_path, DECK.replace(" the bed is at rest", ""))
    with pytest.raises(InputError, match="no reason"):
        acceptances(read_script(file))
    file = audit_decks.write(tmp_path, DECK.replace("DK111 the", "DK999 the"))
    with pytest.raises(InputError, match="no such rule"):
        acceptances(read_script(file))


GOLDEN = sorted((ROOT / "tests" / "golden").glob("*.liggghts"))


@pytest.mark.parametrize("file", GOLDEN, ids=lambda file: file.name)
def test_scripts_of_the_project_have_no_finding(file: Path) -> None:
    text = file.read_text()
    assert findings_on(text) == []
    assert sum("dragdeck: ignore" in line for line in text.splitlines()) <= 1


@pytest.mark.parametrize(
    ("old", "new", "rule"),
    [
        ("pair_style gran model hertz tangential history", "pair_style gran model hertz", "DK101"),
        (f"wall/gran model {LAW} primitive", "wall/gran model hertz primitive", "DK102"),
        (
            "dump write_contacts",
            "compute late all pair/gran/local id\ndump write_contacts",
            "DK112",
        ),
    ],
)
def test_what_a_template_spoils_is_found(old: str, new: str, rule: str) -> None:
    (text,) = (file.read_text() for file in GOLDEN if "process" in file.name)
    assert old in text
    assert [finding.rule for finding in findings_on(text.replace(old, new))] == [rule]
