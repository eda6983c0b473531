"""The commands of an input script: what they reach, whether they end, the contact law they set."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

_PROGRAMS = ("include", "partition", "python", "shell")
"""Commands that start programs or scripts, or carry other commands."""

_WORD = re.compile(r'"""(.*?)"""|"([^"]*)"|\'([^\']*)\'|(\S+)', re.DOTALL | re.ASCII)

_COMMENT = re.compile(r"""((?:[^#'"]|'[^']*'|"[^"]*")*)#.*""", re.DOTALL)
"""A line up to the first ``#`` that is in no quotation marks, and the rest."""

_OUTSIDE = re.compile(r"[/~].|.*(\.\.|\})/|.*\.gz$", re.DOTALL)
"""An absolute path, one upwards or through a variable, or a file that gzip is started for."""


@dataclass(frozen=True)
class EngineCommand:
    """A command of an input script.

    Attributes
    ----------
    text : str
    words : list of str
        Without quotation marks; at least one.
    within : str
        The command that carries it: ``if`` or ``run``; empty for one that stands alone.
    line : int
        Where it begins in its file, from 1.
    file : str
        Its file, if several were read.
    step : float or None
        The time step that the run has reached before it, if that is known.
    uncertain : bool
        Whether it is executed on a condition that is not known.
    """

    text: str
    words: list[str]
    within: str = ""
    line: int = 0
    file: str = ""
    step: float | None = None
    uncertain: bool = False


def lines_of(deck: str) -> Iterator[tuple[int, str]]:
    """The lines of an input script without comments, each with what ``&`` adds, and its number."""
    parts: list[str] = []
    lines = deck.split("\n")
    for number, line in enumerate(lines, start=1):
        line = line.rstrip(" \t\r\v\f")
        if line.endswith("&") and number < len(lines):
            parts.append(line[:-1])
            continue
        yield number - len(parts), without_comment("".join([*parts, line]))
        parts.clear()


def without_comment(line: str) -> str:
    """A line up to its comment."""
    comment = _COMMENT.fullmatch(line) if "#" in line else None
    return comment[1] if comment else line


def commands(deck: str) -> Iterator[EngineCommand]:
    """The commands of an input script, those that another one carries after it."""
    for number, line in lines_of(deck):
        yield from _commands(line, "", number)


def words_of(text: str) -> list[str]:
    """The words of a command, without quotation marks."""
    return [next(filter(None, groups), "") for groups in _WORD.findall(text)]


def is_quoted_in_full(text: str) -> bool:
    """Whether every quotation mark that begins a word is closed: LIGGGHTS stops at another one."""
    return not any(plain.startswith(("'", '"')) for *_, plain in _WORD.findall(text))


def _commands(text: str, within: str, line: int) -> Iterator[EngineCommand]:
    words = words_of(text)
    if words:
        yield EngineCommand(text, words, within, line)
        for inner in inner_commands(words):
            yield from _commands(inner, within or words[0], line)


def leaving_folder(deck: str, source: str) -> Iterator[tuple[str, str]]:
    """Commands of a deck that reach beyond LIGGGHTS and the run's folder, each with the reason.

    Parameters
    ----------
    deck : str
        Text of the input script.
    source : str
        The one file outside of the folder that it may name.
    """
    for command in commands(deck):
        words, first = command.words, command.words[0]
        if first in _PROGRAMS or (first == "jump" and words[1:2] != ["SELF"]):
            yield command.text, "start another program or script"
        elif "$" in first:
            yield command.text, "take a command from a variable"
        elif first == "variable" and words[2:3] == ["getenv"]:
            yield command.text, "read the environment"
        elif not (first == "variable" and words[2:3] in (["equal"], ["atom"])):
            for word in words[1:]:
                if word != source and _OUTSIDE.match(word):
                    yield command.text, f"access a file outside the run's folder: {word}"


def files_read(deck: str) -> set[str]:
    """Names of the files that a deck reads, its source included, as far as it names them itself.

    A file that another of its commands names too, such as one that it writes, is not among them.
    """
    read, others = set(), set()
    for command in commands(deck):
        names = names_read(command.words)
        read.update(names)
        others.update([] if names else command.words)
    return {name for name in read - others if "$" not in name}


def names_read(words: list[str]) -> list[str]:
    """The files that a command reads."""
    kind = " ".join([words[0], *words[2:4]])
    if words[0] in ("read_data", "read_dump", "read_restart"):
        return words[1:2]
    if kind.startswith(("variable file ", "variable atomfile ")) or words[1:3] == ["from", "index"]:
        return words[3:4]
    if re.match("fix .* (mesh|particletemplate)/", kind):
        return [value for word, value in pairwise(words) if word == "file"]
    return []


def endless(deck: str) -> Iterator[tuple[str, str]]:
    """Jumps back of a deck between whose label and itself nothing can end the loop."""
    every = list(commands(deck))
    labels = {c.words[1]: at for at, c in reversed([*enumerate(every)])
              if c.words[0] == "label" and len(c.words) > 1}  # fmt: skip
    for at, command in enumerate(every):
        if command.words[:2] != ["jump", "SELF"] or command.within == "if":
            continue
        start = labels.get(command.words[2], at) if command.words[2:] else 0
        ways_out = {"next", "quit"}, {"next", "quit", "jump"}
        if start < at and not any(
            c.words[0] in ways_out[c.within == "if"] for c in every[start:at]
        ):
            yield command.text, "run for ever: no `next` and no `if` ends this loop"


def late_lists(deck: str) -> Iterator[tuple[str, str]]:
    """Commands of a deck after which neighbour lists are not rebuilt as soon as they need it.

    With ``delay 0`` no contact of a moving particle is seen too late, however thin the skin
    (docs/development/liggghts.md).
    """
    allowed = {"delay": "0", "every": "1", "check": "yes", "once": "no"}
    for command in commands(deck):
        if command.words[0] == "neigh_modify":
            for name, value in pairwise(command.words):
                if allowed.get(name, value) != value:
                    yield command.text, "rebuild neighbour lists too late, and miss contacts"


def contact_laws(deck: str) -> Iterator[list[str]]:
    """The words of a deck that give particles or a wall their contact law."""
    for command in commands(deck):
        words = command.words
        if words[0] == "pair_style":
            yield words[1:]
        elif words[0] == "fix" and any(word.startswith("wall/gran") for word in words[3:4]):
            yield words[3:]


def law_commands(deck: str) -> list[str]:
    """What sets the contact law in a deck: its commands, those of walls without their shapes."""
    law_lines = []
    for command in commands(deck):
        kind = command.words[3:4]
        if command.words[0] in ("pair_style", "pair_coeff") or kind == ["property/global"]:
            law_lines.append(" ".join(command.words))
        elif command.words[0] == "fix" and kind and kind[0].startswith("wall/gran"):
            text = " ".join(command.words[3:])
            law_lines.append(
                re.sub(r"(primitive type|mesh n_meshes) .*?(?=store_force |$)", "", text)
            )
    return list(dict.fromkeys(law_lines))


def branches(words: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
    """The conditions of an ``if``, each with its commands; that of ``else`` is 1."""
    parts: list[list[str]] = [[]]
    for word in words[1:]:
        if word in ("elif", "else"):
            parts.append(["1"] if word == "else" else [])
        else:
            parts[-1].append(word)
    for condition, *inner in filter(None, parts):
        yield condition, [without_comment(command) for command in inner if command != "then"]


def inner_commands(words: Sequence[str]) -> Sequence[str]:
    """The commands that ``if`` and ``run every`` carry as words."""
    if words[0] == "if":
        return [command for _, inner in branches(words) for command in inner]
    carried = words[words.index("every") + 2 :] if words[0] == "run" and "every" in words else ()
    return [without_comment(command) for command in carried]
