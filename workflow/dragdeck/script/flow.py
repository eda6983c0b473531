"""An input script followed command by command, as far as that can be done without running it."""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from dragdeck.errors import InputError
from dragdeck.script.commands import (
    EngineCommand,
    inner_commands,
    lines_of,
    without_comment,
    words_of,
)
from dragdeck.script.formula import value_of

_MOST_COMMANDS = 20_000
_MOST_PASSES = 20
"""Passes of a loop that are followed: what differs after so many is a number of output files."""

_LARGEST_FILE = 4_000_000
_QUOTED = r""""[^"]*"|'[^']*'"""
_REFERENCE = re.compile(rf"({_QUOTED})|\$\{{(\w+)\}}|\$(\w)|(\$\()")
_TEMPLATE = re.compile(r"\{\{.*?\}\}|\{%")
_KEPT_STYLES = ("index", "loop", "world", "universe", "uloop")
"""Of variables that keep the value that they have."""


@dataclass
class Script:
    """An input script, and what can be said of it without running it.

    Attributes
    ----------
    file : Path
    in_memory : bool
        Whether it is no file, and has no folder.
    texts : mapping of str to str
        Content of every file that was read, by name; the script itself is first.
    commands : list of EngineCommand
        In the order of execution, with the values of variables. A word with ``$`` has one that is
        not known.
    not_followed : list of str
        What could not be followed.
    undefined : mapping of str to EngineCommand
        Variables that nothing defines, with the first command that uses each.
    absent : list of (EngineCommand, str)
        Scripts that it includes, or jumps to, and that are not there.
    """

    file: Path
    in_memory: bool = False
    texts: dict[str, str] = field(default_factory=dict)
    commands: list[EngineCommand] = field(default_factory=list)
    not_followed: list[str] = field(default_factory=list)
    undefined: dict[str, EngineCommand] = field(default_factory=dict)
    absent: list[tuple[EngineCommand, str]] = field(default_factory=list)


@dataclass
class _Variable:
    style: str
    values: Sequence[str]
    at: int = 0


def read_script(
    file: Path,
    variables: Mapping[str, Sequence[str]] | None = None,
    text: str | None = None,
    after: Path | None = None,
) -> Script:
    """Follow an input script.

    Parameters
    ----------
    file : Path
    variables : mapping, optional
        Values that its command line gives (``-var``).
    text : str, optional
        Its content, if it is not in the file.
    after : Path, optional
        The script that wrote the restart file from which this one starts; it is followed first.

    Raises
    ------
    InputError
        A file cannot be read, or is no input script.
    """
    script = Script(file, text is not None)
    if after is not None:
        _Reader(script, after, variables or {}, None).follow()
        script.commands.append(EngineCommand("clear", ["clear"]))
    _Reader(script, file, variables or {}, text).follow()
    return script


def script_text(file: Path) -> str:
    """The content of an input script.

    Raises
    ------
    InputError
        It is not there, too large, not text, or a template.
    """
    remedy = "give the input script of LIGGGHTS"
    try:
        if file.stat().st_size > _LARGEST_FILE:
            raise InputError("the file is too large for an input script", file=file, remedy=remedy)
        data = file.read_bytes()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file, remedy=remedy) from None
    if b"\0" in data:
        raise InputError("the file is not text", file=file, remedy=remedy)
    text = data.decode("utf-8", "replace")
    if template := _TEMPLATE.search("\n".join(line for _, line in lines_of(text))):
        raise InputError("this is a template, not an input script", file=file, value=template[0],
                         remedy="fill in its values, and give the script that results")  # fmt: skip
    if not any(line.strip() for _, line in lines_of(text)):
        raise InputError("the file contains no command", file=file, remedy=remedy)
    return text


class _Reader:
    """Follows one script into the record of what it does."""

    def __init__(
        self, script: Script, file: Path, variables: Mapping[str, Sequence[str]], text: str | None
    ) -> None:
        self.script, self.folder = script, file.parent
        self.variables = {name: _Variable("index", v) for name, v in variables.items()}
        self.missing: dict[str, EngineCommand] = {}
        self.passes: dict[tuple[str, ...], int] = {}
        self.lines: dict[str, tuple[list[tuple[int, str]], dict[str, int]]] = {}
        self.stack: list[tuple[str, Iterator[tuple[int, str]]]] = []
        self.timestep: float | None = None
        self.step: float | None = 0.0
        self.skips_jump = self.ended = False
        self.count = self.depth = 0
        self.left_out: dict[str, None] = {}
        self.name = str(file)
        script.texts[self.name] = script_text(file) if text is None else text

    def follow(self) -> None:
        self._enter(self.name)
        while self.stack and not self.ended:
            file, lines = self.stack[-1]
            number, line = next(lines, (0, ""))
            if number:
                self._execute(EngineCommand(line, [], line=number, file=file))
            elif self.stack and self.stack[-1][1] is lines:
                self.stack.pop()
        defined = set(re.findall(r"\bvariable\s+(\w+)", "\n".join(self.script.texts.values())))
        for name, command in self.missing.items():
            if name not in defined:
                self.script.undefined.setdefault(name, command)

    def _enter(self, file: str, label: str = "") -> bool:
        if file not in self.lines:
            lines = [*lines_of(self.script.texts[file])]
            every = [(words_of(line), at) for at, (_, line) in enumerate(lines) if "label" in line]
            labels = {
                "".join(words[1:2]): at for words, at in reversed(every) if words[:1] == ["label"]
            }
            self.lines[file] = lines, labels
        lines, labels = self.lines[file]
        if label and label not in labels:
            return False
        self.stack.append((file, iter(lines[labels[label] if label else 0 :])))
        return True

    def _read(self, command: EngineCommand, name: str) -> bool:
        """Whether another script is there, and read."""
        if "$" in name or len(self.stack) > 10:
            self._note(command, f"{command.words[0]} {name}")
        elif (file := self.folder / name).is_file():
            self.script.texts.setdefault(str(file), script_text(file))
            return True
        else:
            self.script.absent.append((command, name))
        return False

    def _note(self, command: EngineCommand, what: str) -> None:
        note = f"{command.file}:{command.line}: {what}"
        if note not in self.script.not_followed:
            self.script.not_followed.append(note)

    def _execute(self, command: EngineCommand) -> None:
        """Do a command; its words are those of its text with values in place of variables."""
        self.count += 1
        if self.count > _MOST_COMMANDS:
            self._note(command, f"the commands after the first {_MOST_COMMANDS:,}")
            self.ended = True
        words = words_of(self._resolved(command.text, command))
        command = replace(command, words=words, step=self.step)
        if not command.words or self.ended:
            return
        words, uncertain = command.words, command.within.endswith("?")
        match words[0]:
            case "variable" if len(words) > 2:
                self._define(words, command)
            case "timestep" if len(words) > 1:
                self.timestep = value_of(words[1], self._word)
            case "if":
                self._branch(command)
            case "next":
                self._next(words[1:])
            case "include" | "jump" | "quit" if uncertain:
                self._note(command, f"{' '.join(words)}: its condition is not known")
                if words[:2] == ["jump", "SELF"]:
                    self.left_out.update(dict.fromkeys(words[2:3]))
            case "include" if len(words) > 1 and self._read(command, words[1]):
                self._enter(str(self.folder / words[1]))
            case "jump" if len(words) > 1:
                self._jump(command)
            case "quit":
                self.ended = not any(self._enter(self.name, label) for label in self._labels())
            case "run" | "read_restart" | "reset_timestep":
                self.step = None if uncertain else self._step_after(words)
            case "partition" | "python":
                self._note(command, command.text.strip())
        self.script.commands.append(command)
        if words[0] == "run":
            for inner in inner_commands(words):
                self._execute(replace(command, text=without_comment(inner), within="run"))

    def _step_after(self, words: Sequence[str]) -> float | None:
        """The time step that is reached with a command."""
        count = value_of("".join(words[1:2]), self._word)
        if words[0] == "run" and "upto" not in words:
            return None if self.step is None or count is None else self.step + count
        return None if words[0] == "read_restart" else count

    def _define(self, words: Sequence[str], command: EngineCommand) -> None:
        name, style, values = words[1], words[2], words[3:]
        if style == "delete":
            self.variables.pop(name, None)
            return
        if style in _KEPT_STYLES and name in self.variables:
            return
        if style == "loop" and values:
            numbers = [value_of(value, self._word) for value in values if value != "pad"]
            first, last = (1, numbers[0]) if len(numbers) < 2 else (numbers[0], numbers[1])
            if first is None or last is None:
                self._note(command, f"variable {name}: the number of passes of a loop")
                last = first = 1
            values = [str(n) for n in range(int(first), min(int(last), int(first) + 999) + 1)]
        elif style == "equal" and command.within.endswith("?"):
            style = "unknown"
        self.variables[name] = _Variable(style, values)

    def _next(self, names: Sequence[str]) -> None:
        for name in names:
            variable = self.variables.get(name)
            if variable:
                variable.at += 1
                if variable.at >= len(variable.values):
                    del self.variables[name]
                    self.skips_jump = True

    def _jump(self, command: EngineCommand) -> None:
        if self.skips_jump:
            self.skips_jump = False
            return
        file, label = command.words[1], "".join(command.words[2:3])
        there = file == "SELF" or self._read(command, file)
        file = self.stack[-1][0] if file == "SELF" else str(self.folder / file)
        key = (command.file, str(command.line), file, label)
        self.passes[key] = self.passes.get(key, 0) + 1
        if self.passes[key] > _MOST_PASSES:
            self._note(command, f"a loop after its first {_MOST_PASSES} passes")
        elif there:
            before = self.stack.pop()
            if not self._enter(file, label):
                self._note(command, f"jump to the label {label}, which is not there")
                self.stack.append(before)

    def _labels(self) -> Iterator[str]:
        """Labels of jumps that may have led past a ``quit``, each once."""
        while self.left_out:
            yield self.left_out.popitem()[0]

    def _branch(self, command: EngineCommand) -> None:
        """Execute the commands of an ``if`` whose condition holds, or may hold."""
        words, at, known = command.words, 1, True
        while at < len(words):
            holds = True if words[at] == "else" else self._holds(words[at], command)
            begin = at + 1 if words[at] == "else" or words[at - 1] == "elif" else at + 2
            end = next((n for n in range(begin, len(words)) if words[n] in ("elif", "else")),
                       len(words))  # fmt: skip
            known = known and holds is not None
            if holds is not False:
                mark = "if" if known and not command.within.endswith("?") else "if?"
                for inner in words[begin:end]:
                    self._execute(replace(command, text=without_comment(inner), within=mark))
            if holds and known:
                return
            at = end + (words[end : end + 1] == ["elif"])

    def _holds(self, condition: str, command: EngineCommand) -> bool | None:
        text = self._resolved(condition, command)
        value = value_of(text, self._word)
        if value is None:
            self._note(command, f"if {condition}: both ways are followed")
        return None if value is None else bool(value)

    def _resolved(self, text: str, command: EngineCommand) -> str:
        """A text with values in place of variables, but not in quotation marks."""
        parts, at = [], 0
        while match := _REFERENCE.search(text, at):
            parts.append(text[at : match.start()])
            at = match.end()
            name = match[2] or match[3]
            if match[4]:
                at = _closing(text, at)
                number = value_of(self._resolved(text[match.end() : at - 1], command), self._word)
                parts.append("$()" if number is None else f"{number:.15g}")
            elif name:
                parts.append(self._value(name, command))
            else:
                parts.append(match[0])
        return "".join([*parts, text[at:]])

    def _value(self, name: str, command: EngineCommand) -> str:
        variable = self.variables.get(name)
        if variable is None:
            if not command.within.endswith("?"):
                self.missing.setdefault(name, command)
            return f"${{{name}}}"
        if variable.style == "equal":
            number = self._word(f"v_{name}")
            return f"${{{name}}}" if number is None else f"{number:.15g}"
        known = variable.style in ("index", "loop", "string") and variable.values
        return variable.values[variable.at] if known else f"${{{name}}}"

    def _word(self, word: str) -> float | None:
        """The value of a word in a formula."""
        if word == "PI":
            return math.pi
        if word in ("dt", "step"):
            return self.timestep if word == "dt" else self.step
        variable = self.variables.get(word[2:]) if word.startswith("v_") else None
        if variable is None or not variable.values or self.depth > 30:
            return None
        self.depth += 1
        try:
            value = variable.values[variable.at]
            return value_of(self._resolved(value, EngineCommand("", [], "?")), self._word)
        finally:
            self.depth -= 1


def _closing(text: str, at: int) -> int:
    """Where the bracket that was opened before a place is closed: the place after it."""
    level = 1
    while level and at < len(text):
        level += {"(": 1, ")": -1}.get(text[at], 0)
        at += 1
    return at
