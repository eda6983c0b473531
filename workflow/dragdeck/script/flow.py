"""An input script followed command by command, as far as that can be done without running it."""

import math
import os.path
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path

from dragdeck.errors import InputError
from dragdeck.files import text_of
from dragdeck.script.commands import (
    EngineCommand,
    branches,
    inner_commands,
    is_quoted_in_full,
    lines_of,
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
    texts : dict of str to str
        Content of every file that was read, by name, in order.
    commands : list of EngineCommand
        In the order of execution, with the values of variables. A word with ``$`` has one that is
        not known.
    not_followed : dict of str
        What could not be followed, in order.
    missing : list of (EngineCommand, str, str)
        First command that uses each ``variable`` that nothing defines, ``script`` or ``label`` that
        is not there, or that ends within ``quotes``; which of these, and its name or text.
    changes_files : bool
        Whether it makes or moves files itself, so that nobody knows which are there.
    """

    file: Path
    in_memory: bool = False
    texts: dict[str, str] = field(default_factory=dict)
    commands: list[EngineCommand] = field(default_factory=list)
    not_followed: dict[str, None] = field(default_factory=dict)
    missing: list[tuple[EngineCommand, str, str]] = field(default_factory=list)
    changes_files: bool = False

    def note(self, command: EngineCommand, what: str) -> None:
        """Note what could not be followed, and where."""
        self.not_followed[f"{command.file}:{command.line}: {what}"] = None


_COMMANDS = {
    "atom_style", "clear", "compute", "dump", "echo", "fix", "group", "if", "include", "jump",
    "label", "log", "pair_style", "print", "read_data", "read_restart", "region", "run", "thermo",
    "timestep", "units", "variable",
}  # fmt: skip
"""Some of LIGGGHTS: a file without any of them is no input script."""

_UNKNOWN: tuple[str, list[str]] = ("unknown", [])
"""Style and values of a variable; the first value is the present one."""


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
    for source in filter(None, (after, file)):
        name, before = str(source), len(script.commands)
        script.texts[name] = text if text is not None and source is file else script_text(source)
        _Reader(script, source.parent, variables or {}).follow(name)
        known = (
            script.missing
            or script.not_followed
            or _COMMANDS.intersection(command.words[0] for command in script.commands[before:])
        )
        if not known and text is None:
            raise InputError("the file contains no command of LIGGGHTS", file=source,
                             remedy="give the input script of LIGGGHTS")  # fmt: skip
        if source is after:
            script.commands.append(EngineCommand("clear", ["clear"]))
    return script


def script_text(file: Path) -> str:
    """The content of an input script, or of a part of one.

    Raises
    ------
    InputError
        It is not there, too large, not text, or a template.
    """
    problem, template = "", None
    try:
        size = file.stat().st_size
        text = text_of(file.read_bytes()) if file.is_file() and size <= _LARGEST_FILE else ""
    except OSError as error:
        problem, text, size = f"cannot be read: {error.strerror}", "", 0
    if not problem and not file.is_file():
        problem = "this is no file"
    elif size > _LARGEST_FILE:
        problem = "the file is too large for an input script"
    elif "\0" in text:
        problem = "the file is not text"
    elif template := _TEMPLATE.search("\n".join(line for _, line in lines_of(text))):
        problem = f"this is a template, not an input script: {template[0]}"
    if problem:
        raise InputError(problem, file=file, remedy="give the input script, with all values")
    return text


@lru_cache(16)
def _lines(text: str) -> tuple[list[tuple[int, str]], dict[str, int]]:
    """The numbered lines of a script, and the places of its labels; without a name, its begin."""
    lines = [*lines_of(text)]
    words = [(words_of(line), at) for at, (_, line) in enumerate(lines) if "label" in line]
    labels = {w[1]: at for w, at in reversed(words) if w[:1] == ["label"] and len(w) > 1}
    return lines, {"": 0, **labels}


class _Reader:
    """Follows one script into the record of what it does."""

    def __init__(
        self, script: Script, folder: Path, variables: Mapping[str, Sequence[str]]
    ) -> None:
        self.script, self.folder = script, folder
        self.variables = {name: ("index", [*values]) for name, values in variables.items()}
        self.undefined: dict[str, EngineCommand] = {}
        self.times: Counter[object] = Counter()
        self.target: tuple[str, str] | None = None
        self.timestep: float | None = None
        self.step: float | None = 0.0
        self.skips_jump = self.passed_jump = self.ended = False
        self.count = self.depth = self.files = 0

    def follow(self, file: str) -> None:
        """Execute a script, and say which variables nothing defines."""
        self._file(file, "")
        defined = {*re.findall(r"\bvariable\s+(\w+)", "\n".join(self.script.texts.values()))}
        undefined = [name for name in self.undefined if name not in defined]
        self.script.missing += [(self.undefined[name], "variable", name) for name in undefined]

    def _file(self, name: str, label: str) -> None:
        lines, labels = _lines(self.script.texts[name])
        at, self.target, self.files = 0, (name, label), self.files + 1
        while self.target or (at < len(lines) and not self.ended):
            if self.target:
                (file, label), self.target = self.target, None
                if file != name:
                    self._file(file, label)
                    break
                if label not in labels:
                    command = EngineCommand("", [], line=at, file=name, uncertain="$" in label)
                    self._miss(command, "label", label)
                at = labels.get(label, at)
            else:
                command = EngineCommand(lines[at][1], [], line=lines[at][0], file=name)
                at += 1
                try:
                    self._execute(command)
                except RecursionError:
                    self.script.note(command, "a command that contains itself")
                    self.ended = True
        self.files -= 1

    def _other(self, command: EngineCommand, name: str) -> str:
        """Path of another script, whose content is then known; empty without."""
        file, problem = self.folder / name, ""
        if "$" in name or self.files > _MOST_FILES:
            problem = "its name is not known" if "$" in name else "too many within each other"
        elif not (os.path.exists(file) or self.script.changes_files):
            self.script.missing.append((command, "script", name))
            return ""
        else:
            try:
                self.script.texts.setdefault(str(file), script_text(file))
            except InputError as error:
                problem = error.problem
        if problem:
            self.script.note(command, f"{command.words[0]} {name}: {problem}")
        return "" if problem else str(file)

    def _miss(self, command: EngineCommand, kind: str, name: str) -> None:
        if command.uncertain:
            self.script.note(command, f"{kind}: {name}")
        else:
            self.script.missing.append((command, kind, name))

    def _execute(self, command: EngineCommand) -> None:
        """Do a command; its words are those of its text with values in place of variables."""
        self.count += 1 + len(command.text) // 200
        if self.count > _MOST:
            self.script.note(command, f"the commands after the first {_MOST:,}")
            self.ended = True
        elif not is_quoted_in_full(command.text):
            self._miss(command, "quotes", command.text.strip()[:80])
            return
        words = words_of(self._resolved(command.text, command))
        if not words or self.ended:
            return
        command = replace(command, words=words, step=self.step)
        self.script.commands.append(command)
        match words[0]:
            case "variable" if len(words) > 2:
                self._define(words, command)
            case "timestep" if len(words) > 1:
                step_s = value_of(words[1], self._word)
                self.timestep = None if command.uncertain and step_s != self.timestep else step_s
            case "if":
                self._branch(command)
            case "next":
                self._next(words[1:], command)
            case "include" | "jump" | "quit" if command.uncertain:
                self.script.note(command, f"{' '.join(words)}: its condition is not known")
                self.passed_jump |= words[0] == "jump"
            case "include" if len(words) > 1:
                if file := self._other(command, words[1]):
                    self._file(file, "")
            case "jump" if len(words) > 1:
                self._jump(command)
            case "quit":
                self.ended = not self.passed_jump
            case "run" | "read_restart" | "reset_timestep":
                self.step = None if command.uncertain else self._step_after(words)
                for inner in inner_commands(words):
                    self._execute(replace(command, text=inner, within="run"))
            case "shell":
                self.script.changes_files |= words[1:2] not in (["mkdir"], ["rmdir"], ["echo"])
            case "partition" | "python":
                self.script.note(command, command.text.strip())
                self.script.changes_files = True

    def _step_after(self, words: Sequence[str]) -> float | None:
        """The time step that is reached with a command."""
        count = value_of("".join(words[1:2]), self._word)
        if words[0] == "run" and "upto" not in words:
            return None if self.step is None or count is None else self.step + count
        return None if words[0] == "read_restart" else count

    def _define(self, words: Sequence[str], command: EngineCommand) -> None:
        name, style, values = words[1], words[2], [*words[3:]]
        if style == "loop":
            ends = [1.0, *(value_of(value, self._word) for value in values if value != "pad")]
            first, last = ends[-2:] if values else (None, None)
            if first is None or last is None:
                self.script.note(command, f"variable {name}: the number of passes of a loop")
                style, values = _UNKNOWN
            else:
                last = min(int(last), int(first) + 999)
                values = [str(number) for number in range(int(first), last + 1)]
        if command.uncertain:
            self.variables[name] = _UNKNOWN
        elif style == "delete":
            self.variables.pop(name, None)
        elif style not in _KEPT_STYLES or name not in self.variables:
            self.times[name] += 1
            self.variables[name] = style, values

    def _next(self, names: Sequence[str], command: EngineCommand) -> None:
        for name in self.variables.keys() & names:
            _, values = self.variables[name]
            self.times[name] += 1
            if command.uncertain:
                self.variables[name] = _UNKNOWN
            elif len(values) > 1:
                del values[0]
            else:
                del self.variables[name]
                self.skips_jump = True

    def _jump(self, command: EngineCommand) -> None:
        if self.skips_jump:
            self.skips_jump = False
            return
        name, label = command.words[1], "".join(command.words[2:3])
        file = command.file if name == "SELF" else self._other(command, name)
        key = command.file, command.line, file, label
        self.times[key] += 1
        if self.times[key] <= _MOST_PASSES:
            self.target = (file, label) if file else None
            return
        self.script.note(command, f"a loop after its first {_MOST_PASSES} passes")
        self.step = None
        for changed, times in self.times.items():
            if times > 1 and changed in self.variables:
                self.variables[str(changed)] = _UNKNOWN

    def _branch(self, command: EngineCommand) -> None:
        """Execute the commands of an ``if`` whose condition holds, or may hold."""
        uncertain = command.uncertain
        for condition, inner in branches(command.words):
            holds = value_of(self._resolved(condition, command), self._word)
            if holds is None:
                self.script.note(command, f"if {condition}: both ways are followed")
                uncertain = True
            for text in inner if holds != 0 else ():
                self._execute(replace(command, text=text, within="if", uncertain=uncertain))
            if holds and (command.uncertain or not uncertain):
                return

    def _resolved(self, text: str, command: EngineCommand) -> str:
        """A text with values in place of variables, but not in quotation marks."""
        self.depth += 1
        parts, at = [], 0
        while match := _REFERENCE.search(text, at):
            parts.append(text[at : match.start()])
            at = match.end()
            if match[4] and self.depth < _DEEPEST:
                at = _closing(text, at)
                formula = self._resolved(text[match.end() : at - 1], command)
                number = value_of(formula, self._word)
                parts.append("$()" if number is None else f"{number:.15g}")
            else:
                name = match[2] or match[3]
                parts.append(self._value(name, command) if name else match[0])
        self.depth -= 1
        return "".join([*parts, text[at:]])

    def _value(self, name: str, command: EngineCommand) -> str:
        style, values = self.variables.get(name, _UNKNOWN)
        if name not in self.variables and not command.uncertain:
            self.undefined.setdefault(name, command)
        number = self._word(f"v_{name}") if style == "equal" else None
        value = values[0] if values and style in ("index", "loop", "string") else ""
        value = value if number is None else f"{number:.15g}"
        return value if 0 < len(value) < _LONGEST_VALUE else f"${{{name}}}"

    def _word(self, word: str) -> float | None:
        """The value of a word in a formula."""
        known = {"PI": math.pi, "dt": self.timestep, "step": self.step}
        _, values = self.variables.get(word[2:] if word[:2] == "v_" else "", _UNKNOWN)
        self.count += 1
        if word in known or not values or self.depth > _DEEPEST or self.count > _MOST:
            return known.get(word)
        nowhere = EngineCommand("", [], uncertain=True)
        return value_of(self._resolved(values[0], nowhere), self._word)


def _closing(text: str, at: int) -> int:
    """Where the bracket that was opened before a place is closed: the place after it."""
    level = 1
    while level and at < len(text):
        level += {"(": 1, ")": -1}.get(text[at], 0)
        at += 1
    return at
