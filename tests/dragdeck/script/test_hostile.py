"""Scripts that no honest user writes: an answer within seconds, no traceback and no guess."""

import os
import random
import time
from pathlib import Path

import pytest
from audit_decks import DECK, PRESS, SPINNING
from paths import ROOT

from dragdeck.audit.command import audit
from dragdeck.errors import InputError
from dragdeck.script.findings import NOT_APPLIED
from dragdeck.script.flow import Script, read_script
from dragdeck.script.rules import script_findings

SECONDS = 8.0
"""CPU time of a script that is cut; an ordinary one takes some hundredths."""

LONG = {
    "ten thousand passes within each other": (
        "variable a loop 10000\nlabel a\nvariable b loop 10000\nlabel b\nrun 1\n"
        "next b\njump SELF b\nnext a\njump SELF a\nprint end\n"
    ),
    "values that double": "variable a string xx\n" + "variable a string ${a}${a}\n" * 60,
    "formulas that double": "".join(
        f"variable v{n} equal v_v{n + 1}+v_v{n + 1}\n" for n in range(60)
    ) + "variable v60 equal 1\nprint ${v0}\n",
    "brackets within brackets": f"print {'$(' * 5000}1{')' * 5000}\n",
    "a formula of brackets": f"variable x equal {'(' * 900}1\nprint $x\n",
    "signs without end": f"variable x equal {'-' * 900}1\nprint $x\n",
    "lines that go on": "a &\n" * 100_000 + "\n",
    "one long line": "print " + "$x" * 100_000 + "\n",
    "quotation marks": "print " + "'\"" * 100_000 + "\n",
    "a seed of 30 digits": "fix t all particletemplate/sphere " + "9" * 30 + " radius constant 1\n",
    "a seed of 5000 digits": "fix t all insert/pack seed " + "9" * 5000 + "\n",
    "many meshes": "".join(f"fix m{n} all mesh/surface file x.stl\n" for n in range(8000)),
    "many motions": "".join(
        f"fix m{n} all move/mesh mesh a linear {n} 0 1\n" for n in range(3000)
    ),
    "many walls": DECK + "".join(
        f"fix w{n} all wall/gran model hertz primitive type 2 xplane {n}\n" for n in range(4000)
    ),
    "many regions": "".join(
        f"region r{n} block 0 1 0 1 0 1\nfix p{n} all insert/pack seed 15485863 region r{n}\n"
        for n in range(3000)
    ),
    "many comments": "# dragdeck: ignore DK101 as a test\n" * 20_000 + "run 1\n",
    "a command that contains itself": 'variable c string \'if 1==1 then "${c}"\'\n${c}\n',
    "braces": "print " + "{{" * 100_000 + "\n",
    "blanks": "print" + " " * 1_000_000 + "#\n",
    "jumps": "label a\n" + "jump SELF b\nlabel b\n" * 20 + "jump SELF a\n" * 4000,
}  # fmt: skip


def followed(folder: Path, text: str) -> Script:
    file = folder / "in.deck"
    file.write_text(text)
    return read_script(file)


def words(script: Script, name: str) -> list[str]:
    return [" ".join(c.words[1:]) for c in script.commands if c.words[0] == name]


@pytest.mark.parametrize("name", LONG)
def test_no_script_takes_long(tmp_path: Path, name: str) -> None:
    start = time.process_time()
    file = tmp_path / "in.deck"
    file.write_text(LONG[name])
    assert audit(file, format="json") in (0, 1)
    assert time.process_time() - start < SECONDS


@pytest.mark.parametrize(
    "lines",
    [
        "region r cylinder q 0 0 1 0 1\ncreate_box 1 r\n",
        "region\nregion r\nregion r block\ncreate_box\n",
        "fix\nfix a\nfix a all\nfix a all gravity\nfix g all gravity 9.81 vector 0 0\n",
        "fix a all property/global\nfix b all property/global a peratomtypepair 1e300 1\n",
        "fix w all wall/gran model\npair_style gran model\npair_style gran\npair_style\n",
        "fix w all wall/gran model hertz mesh n_meshes ² meshes a\n",
        "fix t all particletemplate/sphere ² atom_type ² radius constant\n",
        "compute\ncompute a\ncompute a all pair/gran/local force\ndump\ndump a\ndump_modify\n",
        "variable\nvariable a\nvariable a loop\nvariable a loop 1e999\nvariable a loop 5 2\n$a\n",
        "if\nif 1\nif 1 then\nif 1 else\nif 1 elif\nelif\nelse\nnext\njump\nlabel\ninclude\nrun\n",
        "run 5 every 2\nrun x every\nrun 5 every 2 'if 1 then \"run 5 every 2\"'\nunfix\nclear\n",
        f"include {'x' * 5000}\ninclude /\ninclude .\nread_data\nread_data {'x' * 5000}\n",
        '${\n$\n$(\n$(1\n${}\n$()\n${a$b}\n\'\n"\n"""\n',
        "\v\fprint\v1\f2\n\x85\u2028 x\n",
        "massflow\nfix m all massflow/mesh\nfix i all insert/pack\nfix m all move/mesh mesh\n",
    ],
)
def test_commands_without_sense(tmp_path: Path, lines: str) -> None:
    for text in (lines, DECK + lines, PRESS + lines):
        script_findings(followed(tmp_path, text))


SOURCES = (DECK, SPINNING, (ROOT / "tests/golden/process.in.liggghts").read_text())


@pytest.mark.parametrize("seed", range(6))
def test_spoilt_scripts(tmp_path: Path, seed: int) -> None:
    draw = random.Random(seed)
    pieces = ["&", '"', "'", "${x}", "$(", ")", "#", "\r\n", "1e999", "²", "then", "-", "0", ""]
    for _ in range(60):
        lines = draw.choice(SOURCES).split("\n")
        for _ in range(draw.randint(1, 8)):
            at = draw.randrange(len(lines))
            parts = lines[at].split(" ")
            parts[draw.randrange(len(parts))] = draw.choice(pieces)
            lines[at] = " ".join(parts)
            other = draw.randrange(len(lines))
            lines[at], lines[other] = lines[other], lines[at][: draw.randint(0, 200)]
        try:
            script_findings(followed(tmp_path, "\n".join(lines)))
        except InputError as error:
            assert "\n".join(lines).count("{") or "no reason" in error.problem


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_line_ends(tmp_path: Path, end: str) -> None:
    (tmp_path / "in.deck").write_bytes(
        "variable a &\n  index 5\nprint $a # a\n".replace("\n", end).encode()
    )
    assert words(read_script(tmp_path / "in.deck"), "print") == ["5"]


@pytest.mark.parametrize("mark", ["\x85", "\u2028", "\x0b", "\x1c"])
def test_only_line_ends_end_a_comment(tmp_path: Path, mark: str) -> None:
    content = f"print 1 # a comment{mark}timestep 5\n"
    (tmp_path / "in.deck").write_bytes(content.encode("utf-8"))
    assert words(read_script(tmp_path / "in.deck"), "timestep") == []
    if mark == "\x85":
        (tmp_path / "in.deck").write_bytes(content.encode("latin-1"))
        assert words(read_script(tmp_path / "in.deck"), "timestep") == []


@pytest.mark.parametrize("coding", ["latin-1", "utf-8-sig", "utf-16"])
def test_codings(tmp_path: Path, coding: str) -> None:
    (tmp_path / "in.deck").write_bytes("timestep 5 # Schüttung\n".encode(coding))
    assert words(read_script(tmp_path / "in.deck"), "timestep") == ["5"]


@pytest.mark.parametrize(
    ("text", "printed"),
    [
        ("variable a string ke\nif '$a == pe' then 'print no' else 'print yes'\n", ["no", "yes"]),
        ("variable a equal ke\nif '${a} > 1' then 'variable b string 5'\nprint $b\n", ["${b}"]),
        ("variable a equal -2^2\nprint $a\n", ["4"]),
        ("variable a equal 2^3^2\nprint $a\n", ["64"]),
        ("print 'not closed\nprint a'b\n", ["a'b"]),
        ("variable a loop 30\nlabel x\nvariable s string $a\nnext a\njump SELF x\nprint $s\n",
         ["${s}"]),
    ],
)  # fmt: skip
def test_nothing_is_guessed(tmp_path: Path, text: str, printed: list[str]) -> None:
    assert words(followed(tmp_path, text), "print") == printed


IF_UNKNOWN = "variable x equal ke\nif '${x} > 1' then '%s' else '%s'\n"


@pytest.mark.parametrize(
    ("first", "second", "rule"),
    [
        ("pair_style gran model hertz", "pair_style gran model hertz tangential history", "DK101"),
        ("region box block -1 1 -1 1 -1 1", "region box block 0 1e-2 0 1e-2 0 1e-2", "DK105"),
        ("neighbor 1e-5 bin", "neighbor 1 bin", "DK105"),
    ],
)
def test_what_depends_on_an_unknown_condition_is_no_fact(
    tmp_path: Path, first: str, second: str, rule: str
) -> None:
    name = " ".join(first.split()[:2])
    lines = [IF_UNKNOWN % (first, second) if line.startswith(name) else f"{line}\n"
             for line in DECK.replace("neighbor 0.001", "neighbor 1e-5").split("\n")]  # fmt: skip
    assert "".join(lines).count("then") == 1
    found = {result.rule for result in script_findings(followed(tmp_path, "".join(lines)))
             if result.severity != NOT_APPLIED}  # fmt: skip
    assert rule not in found


def test_includes(tmp_path: Path) -> None:
    (tmp_path / "empty").write_text("# nothing\n")
    (tmp_path / "binary").write_bytes(b"\0")
    (tmp_path / "self").write_text("include self\n")
    os.mkfifo(tmp_path / "pipe")
    names = ("empty", "binary", "self", "pipe", "none")
    script = followed(tmp_path, "".join(f"include {name}\n" for name in names))
    assert [name for *_, name in script.missing] == ["none"]
    notes = " ".join(script.not_followed)
    assert all(f"include {name}" in notes for name in ("binary", "self", "pipe"))
    moved = followed(tmp_path, "shell cd elsewhere\ninclude none\nread_data none\n")
    assert not moved.missing and "include none" in " ".join(moved.not_followed)
    assert {result.rule for result in script_findings(moved)} == {"DK105", "DK108"}
