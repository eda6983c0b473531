"""An input script followed command by command, as far as that can be done without running it."""

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from dragdeck.errors import InputError
from dragdeck.files import text_of
from dragdeck.script.commands import (
    EngineCommand,
    inner_commands,
    is_quoted_in_full,
    lines_of,
    without_comment,
    words_of,
)
from dragdeck.script.formula import value_of

_MOST = 20_000
"""Commands and values of variables that are followed; a long command counts several times."""

_MOST_PASSES = 20
"""Passes of a loop that are followed: what differs after so many is a number of output files."""

_MOST_FILES = 10
"""That include each other."""

_LARGEST_FILE = 4_000_000
_LONGEST_VALUE = 1000
_DEEPEST = 30
"""Formulas within each other."""

_REFERENCE = re.compile(r"""("[^"]*"|'[^']*')|\$\{(\w+)\}|\$(\w)|(\$\()""")
_TEMPLATE = re.compile(r"\{\{[^{}\n]*\}\}|\{%")
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
    not_followed : dict of str
        What could not be followed, in order.
    undefined : mapping of str to EngineCommand
        Variables that nothing defines, with the first command that uses each.
    absent : list of (EngineCommand, str)
        Scripts that it includes, or jumps to, and that are not there.
    changes_files : bool
        Whether it makes or moves files itself, so that nobody knows which are there.
    """

    file: Path
    in_memory: bool = False
    texts: dict[str, str] = field(default_factory=dict)
    commands: list[EngineCommand] = field(default_factory=list)
    not_followed: dict[str, None] = field(default_factory=dict)
    undefined: dict[str, EngineCommand] = field(default_factory=dict)
    absent: list[tuple[EngineCommand, str]] = field(default_factory=list)
    changes_files: bool = False

    @property
    def folder(self) -> Path:
        """Where it finds its files."""
        return self.file.parent

    def note(self, command: EngineCommand, what: str) -> None:
        """Note what could not be followed, and where."""
        self.not_followed[f"{command.file}:{command.line}: {what}"] = None


@dataclass
class _Variable:
    style: str
    values: Sequence[str] = ()
    at: int = 0


_UNKNOWN = "unknown"
_NOWHERE = EngineCommand("", [], uncertain=True)


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
    for source in [after, file] if after else [file]:
        _Reader(script, source, variables or {}, text if source is file else None).follow()
        if source is not file:
            script.commands.append(EngineCommand("clear", ["clear"]))
    return script


def script_text(file: Path) -> str:
    """The content of an input script, or of a part of one.

    Raises
    ------
    InputError
        It is not there, too large, not text, or a template.
    """
    remedy = "give the input script of LIGGGHTS"
    try:
        if file.is_fifo():
            raise InputError("a pipe is no file", file=file, remedy=remedy)
        with file.open("rb") as stream:
            content = stream.read(_LARGEST_FILE + 1)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=file, remedy=remedy) from None
    text = text_of(content)
    if len(content) > _LARGEST_FILE:
        raise InputError("the file is too large for an input script", file=file, remedy=remedy)
    if "\0" in text:
        raise InputError("the file is not text", file=file, remedy=remedy)
    if template := _TEMPLATE.search("\n".join(line for _, line in lines_of(text))):
        raise InputError("this is a template, not an input script", file=file, value=template[0],
                         remedy="fill in its values, and give the script that results")  # fmt: skip
    return text


class _Reader:
    """Follows one script into the record of what it does."""

    def __init__(
        self, script: Script, file: Path, variables: Mapping[str, Sequence[str]], text: str | None
    ) -> None:
        self.script, self.folder, self.name = script, file.parent, str(file)
        self.variables = {name: _Variable("index", v) for name, v in variables.items()}
        self.missing: dict[str, EngineCommand] = {}
        self.times: Counter[object] = Counter()
        self.lines: dict[str, tuple[list[tuple[int, str]], dict[str, int]]] = {}
        self.stack: list[tuple[str, int]] = []
        self.timestep: float | None = None
        self.step: float | None = 0.0
        self.skips_jump = self.ended = False
        self.count = self.depth = 0
        self.left_out: dict[str, None] = {}
        script.texts[self.name] = script_text(file) if text is None else text
        if text is None and not any(line.strip() for _, line in lines_of(script.texts[self.name])):
            raise InputError("the file contains no command", file=file,
                             remedy="give the input script of LIGGGHTS")  # fmt: skip

    def follow(self) -> None:
        self._enter(self.name)
        while self.stack and not self.ended:
            file, at = self.stack.pop()
            lines, _ = self.lines[file]
            if at < len(lines):
                self.stack.append((file, at + 1))
                number, line = lines[at]
                command = EngineCommand(line, [], line=number, file=file)
                try:
                    self._execute(command)
                except RecursionError:
                    self.script.note(command, "a command that contains itself")
                    self.ended = True
        texts = "\n".join(self.script.texts.values())
        defined = set(re.findall(r"\bvariable\s+(\w+)", texts))
        for name, command in self.missing.items():
            if name not in defined:
                self.script.undefined.setdefault(name, command)

    def _enter(self, file: str, label: str = "") -> bool:
        """Go on in a file; whether it has the label."""
        if file not in self.lines:
            lines = [*lines_of(self.script.texts[file])]
            every = [(words_of(line), at) for at, (_, line) in enumerate(lines) if "label" in line]
            labels = {words[1]: at for words, at in reversed(every)
                      if words[:1] == ["label"] and len(words) > 1}  # fmt: skip
            self.lines[file] = lines, labels
        at = self.lines[file][1].get(label) if label else 0
        if at is not None:
            self.stack.append((file, at))
        return at is not None

    def _read(self, command: EngineCommand, name: str) -> str:
        """Path of another script, whose content is then known; empty without."""
        file, problem = self.folder / name, ""
        if "$" in name or len(self.stack) > _MOST_FILES:
            problem = "its name is not known" if "$" in name else "too many within each other"
        elif not is_there(file) and not self.script.changes_files:
            self.script.absent.append((command, name))
            return ""
        else:
            try:
                self.script.texts.setdefault(str(file), script_text(file))
            except InputError as error:
                problem = error.problem
        if problem:
            self.script.note(command, f"{command.words[0]} {name}: {problem}")
        return "" if problem else str(file)

    def _execute(self, command: EngineCommand) -> None:
        """Do a command; its words are those of its text with values in place of variables."""
        self.count += 1 + len(command.text) // 200
        if self.count > _MOST:
            self.script.note(command, f"the commands after the first {_MOST:,}")
            self.ended = True
        elif not is_quoted_in_full(command.text):
            self.script.note(command, "quotation marks that are not closed")
            return
        words = words_of(self._resolved(command.text, command))
        if not words or self.ended:
            return
        command = replace(command, words=words, step=self.step)
        match words[0]:
            case "variable" if len(words) > 2:
                self._define(words, command)
            case "timestep" if len(words) > 1:
                step_s = value_of(words[1], self._word)
                known = not command.uncertain or step_s == self.timestep
                self.timestep = step_s if known else None
            case "if":
                self._branch(command)
            case "next":
                self._next(words[1:], command)
            case "include" | "jump" | "quit" if command.uncertain:
                self.script.note(command, f"{' '.join(words)}: its condition is not known")
                if words[:2] == ["jump", "SELF"]:
                    self.left_out.update(dict.fromkeys(words[2:3]))
            case "include" if len(words) > 1:
                if file := self._read(command, words[1]):
                    self._enter(file)
            case "jump" if len(words) > 1:
                self._jump(command)
            case "quit":
                self.ended = True
                while self.left_out and self.ended:  # a jump may have led past it
                    self.ended = not self._enter(self.name, self.left_out.popitem()[0])
            case "run" | "read_restart" | "reset_timestep":
                self.step = None if command.uncertain else self._step_after(words)
            case "shell":
                self.script.changes_files |= words[1:2] not in (["mkdir"], ["rmdir"], ["echo"])
            case "partition" | "python":
                self.script.note(command, command.text.strip())
                self.script.changes_files = True
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
        if command.uncertain:
            style, values = _UNKNOWN, ()
        elif style == "delete":
            self.variables.pop(name, None)
            return
        elif style in _KEPT_STYLES and name in self.variables:
            return
        elif style == "loop":
            ends = [value_of(value, self._word) for value in values if value != "pad"]
            first, last = [1.0, *ends][-2:] if ends else [None, None]
            if first is None or last is None:
                self.script.note(command, f"variable {name}: the number of passes of a loop")
                style, last, first = _UNKNOWN, 0, 0
            values = [str(n) for n in range(int(first), min(int(last), int(first) + 999) + 1)]
        self.times[name] += 1
        self.variables[name] = _Variable(style, values)

    def _next(self, names: Sequence[str], command: EngineCommand) -> None:
        for name in names:
            variable = self.variables.get(name)
            if variable and command.uncertain:
                self.variables[name] = _Variable(_UNKNOWN)
            elif variable:
                self.times[name] += 1
                variable.at += 1
                if variable.at >= len(variable.values):
                    del self.variables[name]
                    self.skips_jump = True

    def _jump(self, command: EngineCommand) -> None:
        if self.skips_jump:
            self.skips_jump = False
            return
        name, label = command.words[1], "".join(command.words[2:3])
        file = self.stack[-1][0] if name == "SELF" else self._read(command, name)
        key = command.file, command.line, file, label
        self.times[key] += 1
        if self.times[key] > _MOST_PASSES:
            self.script.note(command, f"a loop after its first {_MOST_PASSES} passes")
            self.step = None
            for changed, times in self.times.items():
                if times > 1 and changed in self.variables:
                    self.variables[str(changed)] = _Variable(_UNKNOWN)
        elif file:
            before = self.stack.pop()
            if not self._enter(file, label):
                self.script.note(command, f"jump to the label {label}, which is not there")
                self.stack.append(before)

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
                carried = replace(command, within="if", uncertain=command.uncertain or not known)
                for inner in words[begin:end]:
                    self._execute(replace(carried, text=without_comment(inner)))
            if holds and known:
                return
            at = end + (words[end : end + 1] == ["elif"])

    def _holds(self, condition: str, command: EngineCommand) -> bool | None:
        text = self._resolved(condition, command)
        value = value_of(text, self._word)
        if value is None:
            self.script.note(command, f"if {condition}: both ways are followed")
        return None if value is None else bool(value)

    def _resolved(self, text: str, command: EngineCommand) -> str:
        """A text with values in place of variables, but not in quotation marks."""
        self.depth += 1
        parts, at = [], 0
        while match := _REFERENCE.search(text, at):
            parts.append(text[at : match.start()])
            at = match.end()
            if match[4] and self.depth < _DEEPEST:
                at = _closing(text, at)
                number = value_of(self._resolved(text[match.end() : at - 1], command), self._word)
                parts.append("$()" if number is None else f"{number:.15g}")
            else:
                name = match[2] or match[3]
                parts.append(self._value(name, command) if name else match[0])
        self.depth -= 1
        return "".join([*parts, text[at:]])

    def _value(self, name: str, command: EngineCommand) -> str:
        variable = self.variables.get(name)
        value = None
        if variable is None:
            if not command.uncertain:
                self.missing.setdefault(name, command)
        elif variable.style == "equal":
            number = self._word(f"v_{name}")
            value = None if number is None else f"{number:.15g}"
        elif variable.style in ("index", "loop", "string") and variable.values:
            value = variable.values[variable.at]
        return f"${{{name}}}" if value is None or len(value) > _LONGEST_VALUE else value

    def _word(self, word: str) -> float | None:
        """The value of a word in a formula."""
        known = {"PI": math.pi, "dt": self.timestep, "step": self.step}
        if word in known:
            return known[word]
        variable = self.variables.get(word[2:]) if word.startswith("v_") else None
        self.count += 1
        if not variable or not variable.values or self.depth > _DEEPEST or self.count > _MOST:
            return None
        value = variable.values[variable.at]
        return value_of(self._resolved(value, _NOWHERE), self._word)


def is_there(file: Path) -> bool:
    """Whether a file is there, whatever its name is."""
    try:
        return file.exists()
    except OSError:
        return False


def _closing(text: str, at: int) -> int:
    """Where the bracket that was opened before a place is closed: the place after it."""
    level = 1
    while level and at < len(text):
        level += {"(": 1, ")": -1}.get(text[at], 0)
        at += 1
    return at
