"""Own small scripts for the audit: a sound one, and what a line changes in it."""

import re
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import yaml
from paths import DATA

from dragdeck.engine.process import find_engine, plain_command
from dragdeck.script.flow import Script, read_script

FOLDER = DATA / "audit"
LAW = "hertz tangential history"
DECK, SPINNING = ((FOLDER / f"{name}.in").read_text() for name in ("box", "spin"))
PRESS = f"""fix plate all mesh/surface file plate.stl type 2
fix press all wall/gran model {LAW} mesh n_meshes 1 meshes plate
"""


def cases(name: str) -> list[Any]:
    """The cases of a file."""
    every: list[Any] = yaml.safe_load((FOLDER / f"{name}.yaml").read_text())
    return every


def edited(edits: Iterable[str] = (), before: str = "", text: str = DECK) -> str:
    """A script with changes, each `old => new`, and with commands before its first run."""
    text = text.replace("run 1\n", f"{before}\nrun 1\n", 1) if before else text
    for old, _, new in (edit.partition(" => ") for edit in edits):
        assert old in text, old
        text = text.replace(old, new)
    return text


SQUEEZED = edited(
    ["run 8000 => run 4000\nfix down all move/mesh mesh plate linear 0 0 -0.2\nrun 3675"], PRESS
)
"""A plate presses the spheres to two thirds of their height."""


def write(folder: Path, text: str = DECK) -> Path:
    """Write a script, and the mesh that it may read."""
    (folder / "post").mkdir(parents=True, exist_ok=True)
    (folder / "plate.stl").write_text((FOLDER / "plate.stl").read_text())
    file = folder / "in.deck"
    file.write_text(text)
    return file


def followed(folder: Path, text: str, **variables: str) -> Script:
    """A script that has been followed."""
    (folder / "in.deck").write_text(text)
    values = {name: [value] for name, value in variables.items()}
    return read_script(folder / "in.deck", values)


def words_of(script: Script, *names: str) -> list[str]:
    """The commands of these names, with the values of variables."""
    return [" ".join(c.words) for c in script.commands if c.words[0] in names]


def run(folder: Path, text: str = DECK) -> Path:
    """Write a script and run it; what it prints is in ``log``."""
    file = write(folder, text)
    words = plain_command(find_engine(), file.name)
    with (folder / "log").open("w") as screen:
        subprocess.run(words, cwd=folder, stdout=screen, stderr=screen, check=False, timeout=300)
    return file


def without(text: str, pattern: str) -> str:
    """A script without the lines that contain a pattern."""
    return "".join(line for line in text.splitlines(True) if not re.search(pattern, line))
