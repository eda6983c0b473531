"""Commands that messages, help, templates and pages of results name can be called as they stand."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from paths import ROOT, SNAKEFILES

from dragchain.cli import PROGRAM as DRAGCHAIN
from dragdeck.cli import PROGRAM as DRAGDECK

PROGRAMS = {
    program.package: {
        *(command.name for command in program.commands),
        *(f"step {step.name}" for step in program.steps),
    }
    for program in (DRAGDECK, DRAGCHAIN)
}
OF_RUN = {
    name
    for file in (*(ROOT / "workflow").glob("usage*.txt"), ROOT / "workflow/run.sh", *SNAKEFILES)
    for name in re.findall(r"(?:\./run |^rule )([a-z_]+)", file.read_text(), re.MULTILINE)
}
SHIPPED = [
    file
    for folder in ("workflow", "analysis", "evidence", "templates")
    for file in sorted((ROOT / folder).rglob("*"))
    if file.suffix in (".py", ".yaml", ".j2", ".csv", ".rst", ".js") and file.name != "network.js"
] + sorted((ROOT / ".github/workflows").iterdir())


def texts(file: Path) -> Iterator[str]:
    """What a file may show: all of a template, of Python the strings that are no docstrings."""
    if file.suffix != ".py":
        yield file.read_text(encoding="utf-8")
        return
    tree = ast.parse(file.read_text(encoding="utf-8"))
    silent = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            silent |= {id(part) for part in node.values}
            parts = (part.value if isinstance(part, ast.Constant) else "X" for part in node.values)
            yield "".join(map(str, parts))
        elif isinstance(node, ast.Constant) and id(node) not in silent:
            yield str(node.value)


def wrong_commands(text: str) -> list[str]:
    """Commands of a text that are not on the PATH of a user of ``./run``, or do not exist."""
    found = []
    for start, program, words in re.findall(
        r"(\./run )?(?<![\w./-])(dragdeck|dragchain|snakemake) (step [a-z-]+|[a-z-]+)", text
    ):
        known = PROGRAMS.get(program, OF_RUN)
        called = bool(start) or words.split()[0] in {"step", *known}
        if (program, words) == ("dragdeck", "init"):  # makes the project that has ./run
            called = False
        if called and not (start and program in PROGRAMS and words in known):
            found.append(f"{program} {words}")
    for words in re.findall(r"\./run ([a-z]+)", text):
        if words not in OF_RUN:
            found.append(f"./run {words}")
    return found


def test_every_named_command_can_be_called() -> None:
    assert len(SHIPPED) > 200
    assert not [
        (file, wrong) for file in SHIPPED for text in texts(file) for wrong in wrong_commands(text)
    ]


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("make it with: dragdeck check", ["dragdeck check"]),
        ("`./run dragdeck step run` runs", ["dragdeck step run"]),
        ("run `snakemake verify`", ["snakemake verify"]),
        ("./run dragchain tables DIR; ./run all; not inside a dragdeck project", []),
        ("./run nothing", ["./run nothing"]),
    ],
)
def test_a_command_that_cannot_be_called_is_found(text: str, wrong: list[str]) -> None:
    assert wrong_commands(text) == wrong
