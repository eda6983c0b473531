"""Scripts followed without running them, compared by hand and with what LIGGGHTS echoes."""

import re
import subprocess
from pathlib import Path

import pytest
from audit_decks import FOLDER, cases, followed, words_of

from dragdeck.engine.process import find_engine, plain_command
from dragdeck.errors import InputError
from dragdeck.script.flow import read_script
from dragdeck.script.formula import value_of

FLOW = (FOLDER / "flow.in").read_text()


def test_variables_loops_branches_and_includes(tmp_path: Path) -> None:
    (tmp_path / "more.in").write_text("variable e equal v_half*4\n")
    script = followed(tmp_path, FLOW)
    assert words_of(script, "print") == ["print pass"] * 3 + ["print yes", "print done"]
    assert "variable b3 equal 1.5+4" in words_of(script, "variable")
    assert "variable c equal 1.5" in words_of(script, "variable")
    assert "variable e equal v_half*4" in words_of(script, "variable")
    assert not script.not_followed and not script.missing
    assert words_of(followed(tmp_path, FLOW, a="8"), "quit") == ["quit"]


@pytest.mark.engine
def test_every_command_is_the_one_that_liggghts_executes(tmp_path: Path) -> None:
    (tmp_path / "more.in").write_text("variable e equal v_half*4\n")
    box = "region b block 0 1 0 1 0 1 units box\natom_style sphere\n"
    box += "atom_modify sort 0 0\ncreate_box 1 b\n"
    text = FLOW.replace("run 0", f"{box}pair_style none\nrun 0", 1)
    script = followed(tmp_path, text)
    call = [*plain_command(find_engine(), "in.deck"), "-echo", "screen"]
    said = subprocess.run(call, cwd=tmp_path, capture_output=True, check=False).stdout
    shown = said.decode(errors="replace")
    # A label that is jumped to is not echoed.
    told = (c.text for c in script.commands if not c.within and not c.text.startswith("label"))
    expected = [re.sub(r"\s", "", text) for text in told]
    echoed = [re.sub(r"\s", "", line.partition("#")[0]) for line in shown.splitlines()]
    places = iter(echoed)
    assert all(line in places for line in expected), shown


@pytest.mark.parametrize(
    ("text", "note"),
    [
        ("label a\njump SELF a\n", "a loop after its first"),
        ("variable x equal ke\nif '${x} > 1' then quit\nprint y\n", "both ways"),
        ("include in.deck\n", "include in.deck"),
        ("partition yes 1 print x\n", "partition"),
        ("variable x equal v_x\nprint $x\n", ""),
    ],
)
def test_what_is_not_followed_is_said(tmp_path: Path, text: str, note: str) -> None:
    script = followed(tmp_path, text)
    assert any(note in said for said in script.not_followed) or not note


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        (b"", "no command"),
        (b"\0\1", "not text"),
        (b"run {{ steps }}\n", "template"),
        (b"x" * 4_000_001, "too large"),
    ],
)
def test_what_is_no_script_is_refused(tmp_path: Path, content: bytes, problem: str) -> None:
    file = tmp_path / "in.deck"
    file.write_bytes(content)
    with pytest.raises(InputError, match=problem):
        read_script(file)


@pytest.mark.parametrize(("formula", "value"), cases("formulas"))
def test_formulas(formula: str, value: float | None) -> None:
    result = value_of(formula, lambda word: 3.14159265 if word == "PI" else None)
    assert result == (None if value is None else pytest.approx(value))
