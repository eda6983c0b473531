"""Scripts that no honest user writes: an answer within seconds, no traceback and no guess."""

import os
import random
import time
from pathlib import Path

import pytest
from audit_decks import DECK, PRESS, SPINNING, cases, followed, words_of
from paths import ROOT

from dragdeck.audit.command import audit
from dragdeck.errors import InputError
from dragdeck.script.findings import NOT_APPLIED
from dragdeck.script.flow import read_script
from dragdeck.script.rules import script_findings

SECONDS = 8.0
"""CPU time of a script that is cut; an ordinary one takes some hundredths."""


@pytest.mark.parametrize(
    ("begin", "part", "times", "end"), [pytest.param(*c[1:], id=c[0]) for c in cases("long")]
)
def test_no_script_takes_long(tmp_path: Path, begin: str, part: str, times: int, end: str) -> None:
    parts = [part.replace("@n", str(n)).replace("@m", str(n + 1)) for n in range(times)]
    file, start = tmp_path / "in.deck", time.process_time()
    file.write_text("".join([begin, *parts, end]))
    assert audit(file, format="json") in (0, 1)
    assert time.process_time() - start < SECONDS


@pytest.mark.parametrize("lines", [*cases("hostile"), f"include {'x' * 5000}"])
def test_commands_without_sense(tmp_path: Path, lines: str) -> None:
    for text in (f"run 0\n{lines}", DECK + lines, PRESS + lines):
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


@pytest.mark.parametrize(
    ("content", "words"),
    [
        *((f"variable a &{end}  index 5{end}timestep $a # a{end}".encode(), ["timestep 5"])
          for end in ("\n", "\r\n", "\r")),
        *(("timestep 5 # Schüttung\n".encode(coding), ["timestep 5"])
          for coding in ("latin-1", "utf-8-sig", "utf-16")),
        *((f"print 1 # a comment{mark}timestep 5\n".encode(coding), [])
          for mark in ("\x85", "\u2028", "\x0b", "\x1c")
          for coding in ("utf-8", "latin-1") if mark != "\u2028" or coding == "utf-8"),
    ],
)  # fmt: skip
def test_codings_and_line_ends(tmp_path: Path, content: bytes, words: list[str]) -> None:
    (tmp_path / "in.deck").write_bytes(content)
    assert words_of(read_script(tmp_path / "in.deck"), "timestep") == words


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
    assert words_of(followed(tmp_path, text), "print") == [f"print {word}" for word in printed]


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
