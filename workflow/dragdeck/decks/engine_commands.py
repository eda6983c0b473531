"""Commands of LIGGGHTS that would leave the run's folder: start a program, read other scripts."""

import re
from collections.abc import Iterator

_PROGRAMS = ("include", "partition", "python", "shell")
"""Commands that start programs or scripts, or carry other commands."""

_WORD = re.compile(r'"""(.*?)"""|"([^"]*)"|\'([^\']*)\'|(\S+)', re.DOTALL)

_OUTSIDE = re.compile(r"[/~].|.*(\.\.|\})/|.*\.gz$", re.DOTALL)
"""An absolute path, one upwards or through a variable, or a file that gzip is started for."""


def leaving_folder(deck: str, source: str) -> Iterator[tuple[str, str]]:
    """Commands of a deck that reach beyond LIGGGHTS and the run's folder, each with the reason.

    Parameters
    ----------
    deck : str
        Text of the input script.
    source : str
        The one file outside of the folder that it may name.
    """
    for line in re.sub(r"&[ \t]*\r?\n", "", deck).splitlines():
        if not line.lstrip().startswith("#"):
            yield from _command(line, source)


def _command(command: str, source: str) -> Iterator[tuple[str, str]]:
    words = [next(filter(None, found), "") for found in _WORD.findall(command)]
    if not words:
        return
    first = words[0]
    if first in _PROGRAMS or (first == "jump" and words[1:2] != ["SELF"]):
        yield command, "start another program or script"
    elif "$" in first:
        yield command, "take a command from a variable"
    elif first == "variable" and words[2:3] == ["getenv"]:
        yield command, "read the environment"
    elif not (first == "variable" and words[2:3] in (["equal"], ["atom"])):
        paths = (word for word in words[1:] if word != source and _OUTSIDE.match(word))
        yield from ((command, f"access a file outside the run's folder: {word}") for word in paths)
    for inner in _inner(words):
        yield from _command(inner, source)


def _inner(words: list[str]) -> Iterator[str]:
    """The commands that ``if`` and ``run every`` carry as words."""
    if words[0] == "if":
        before = ["", *words]
        yield from (
            word
            for last, word in zip(before[3:], words[3:], strict=False)
            if word not in ("else", "elif") and last != "elif"
        )
    elif words[0] == "run" and "every" in words:
        yield from words[words.index("every") + 2 :]
