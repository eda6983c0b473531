"""Commands as a table: each names the function that it calls, and that function's parameters."""

import argparse
import atexit
import contextlib
import os
import platform
import shlex
import shutil
import sys
import tempfile
import traceback
from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import yaml

from dragdeck import __version__
from dragdeck.errors import DragdeckError
from dragdeck.files import FULL_DISK

_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

_OF_FIGURES = {"MPLBACKEND": "agg", "MATPLOTLIBRC": os.devnull}
"""Figures have the defaults of matplotlib, not a user's: a notebook's backend draws no file."""


_TYPES = {"path": Path, "float": float, "int": int}
"""Types of arguments by their names in a table of commands."""


@dataclass(frozen=True)
class Command:
    """A command: the function that it calls, and that function's parameters.

    `help` is for the list of commands, `about` for the command's own help. What the function
    returns is printed if it is text, and the exit status if it is a number.

    Attributes
    ----------
    calls : str
        Module within the package and function, ``module:function``.
    arguments : mapping
        By name, what argparse takes of each; its name is that of the function's parameter.
    """

    name: str
    help: str
    about: str
    calls: str
    arguments: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    example: str = ""

    def run(self, package: str, options: Mapping[str, object]) -> int:
        """Import the function, which is named within a package, and call it: its exit status."""
        module, _, name = self.calls.partition(":")
        said = getattr(import_module(f"{package}.{module}"), name)(**options)
        if isinstance(said, str):
            print(said)
        return said if isinstance(said, int) else 0


@dataclass(frozen=True)
class Program:
    """A program: the commands of a package.

    Attributes
    ----------
    package : str
        Its package, whose name messages begin with.
    about : str
        For its help.
    commands, steps : sequence of Command
        What a user calls, and what the rules call: ``PROGRAM step NAME``.
    call : str
        How it is called; like its package if empty.
    shared : mapping
        Arguments that several commands have.
    """

    package: str
    about: str
    commands: Sequence[Command]
    steps: Sequence[Command] = ()
    call: str = ""
    shared: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @classmethod
    def read(cls, package: str, file: Path, *others: "Program") -> "Program":
        """A program from the table of its commands in YAML.

        An argument without options is one of ``shared`` there, or in the table of another program.
        """
        table = yaml.load(file.read_bytes(), Loader=_Loader)
        shared = dict(ChainMap(table["shared"], *(dict(other.shared) for other in others)))

        def commands(kind: str) -> Iterator[Command]:
            for name, entry in table.get(kind, {}).items():
                given = entry.pop("arguments", {})
                arguments = {key: options or shared[key] for key, options in given.items()}
                yield Command(name, arguments=arguments, **entry)

        about, call = table["about"], table.get("call", "")
        return cls(package, about, [*commands("commands")], [*commands("steps")], call, shared)

    def __call__(self) -> NoReturn:
        """Run the command of this process, and end it without the destructors of C++ libraries.

        Arrow's threads abort a process there now and then, or keep it from ending, although all
        its results are whole (github.com/apache/arrow, issues 34314 and 50482).
        """
        os.environ.update(_OF_FIGURES)
        status: object = 1

        def end() -> None:
            with contextlib.suppress(OSError):  # which `guarded` has told
                sys.stdout.flush()
            os._exit(status if isinstance(status, int) else status is not None)

        atexit.register(end)  # the first to be registered is the last to be called
        try:
            status = self.main()
        except SystemExit as wrong_use:
            status = wrong_use.code
        sys.exit()

    def main(self, arguments: Sequence[str] | None = None) -> int:
        """Run a command and return its exit status; see `guarded`.

        Parameters
        ----------
        arguments : sequence of str, optional
            The arguments, without the program's name; those of the process if None. A wrong use
            of the program exits with 2.
        """
        parsed = vars(self.parser().parse_args(arguments))
        command = parsed.pop("_command")
        options = {name: _once(value) for name, value in parsed.items()}
        return guarded(self.package, lambda: command.run(self.package, options))

    def parser(self) -> argparse.ArgumentParser:
        """What understands the arguments."""
        name, called = self.call or self.package, self.call or f"./run {self.package}"
        parser = argparse.ArgumentParser(
            prog=name,
            description=self.about,
            epilog=f"Each command has its own help: {called} COMMAND --help",
        )
        parser.add_argument("--version", action="version", version=f"{name} {__version__}")
        commands = parser.add_subparsers(required=True, metavar="COMMAND")
        _add(commands, self.commands)
        if self.steps:
            step = commands.add_parser(
                "step", help=f"run a step of the workflow: {called} step --help"
            )
            _add(step.add_subparsers(required=True, metavar="STEP"), self.steps)
        return parser


def _once(value: Any) -> Any:
    """A list of paths without those that name a file or folder again, in any way."""
    if not isinstance(value, list) or not all(isinstance(item, Path) for item in value):
        return value
    first: dict[Path, Path] = {}
    for path in value:
        first.setdefault(path.resolve(), path)
    return list(first.values())


def _add(parsers: Any, commands: Sequence[Command]) -> None:
    for command in commands:
        example = f"example: {command.example}" if command.example else None
        parser = parsers.add_parser(
            command.name, help=command.help, description=command.about, epilog=example
        )
        for name, options in command.arguments.items():
            parser.add_argument(name, **_of_argparse(options))
        parser.set_defaults(_command=command)


def _of_argparse(options: Mapping[str, Any]) -> dict[str, Any]:
    """Options of an argument with a type for its name, and tuples, which YAML does not have."""
    given = dict(options)
    if "type" in given:
        given["type"] = _TYPES[given["type"]]
    if isinstance(given.get("metavar"), list):
        given["metavar"] = tuple(given["metavar"])
    return given


def guarded(program: str, call: Callable[[], int | None]) -> int:
    """Call a function; whatever goes wrong becomes one message on standard error.

    An unexpected error is written to a log file with its traceback; the message names the file.

    Returns
    -------
    int
        The exit status: that of the function, 1 after an error, 130 if the user interrupted it.
    """
    status: int | None = 0
    try:
        status = call()
        sys.stdout.flush()
    except BrokenPipeError:  # who reads the output has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    except KeyboardInterrupt:
        print(f"{program}: interrupted", file=sys.stderr)
        return 130
    except Exception as error:
        print(f"{program}: {_message(error, program)}", file=sys.stderr)
        return 1
    return status or 0


def _message(error: Exception, program: str) -> str:
    """The message of an error."""
    if isinstance(error, DragdeckError):
        return str(error)
    if isinstance(error, OSError) and error.strerror:
        where = f"{error.filename}: " if error.filename else ""
        remedy = "check that the path exists, its permissions, and the free space on the disk"
        if error.errno in FULL_DISK:
            place = Path(error.filename or ".").resolve().parent
            free = shutil.disk_usage(place if place.is_dir() else ".").free
            where, remedy = f"{where}{free:,} bytes free: ", "free disk space, then try again"
        return f"{where}{error.strerror}\n  remedy: {remedy}"
    if isinstance(error, MemoryError):
        return f"not enough memory: {error}\n  remedy: use a machine with more memory"
    return (
        f"unexpected error: {type(error).__name__}: {str(error)[:300]}\n"
        f"  log:    {_kept(error, program)}\n"
        "  remedy: if an input file is damaged, create it again; otherwise report the problem with "
        "the log: README.md, section Reporting a problem"
    )


def _kept(error: Exception, program: str) -> str:
    """Write an error with its traceback to a new file here, or where temporary files go."""
    said = "".join(traceback.format_exception(error))
    about = f"{program} {__version__}, Python {sys.version}, {platform.platform()}"
    for folder in (".", tempfile.gettempdir()):
        with contextlib.suppress(OSError):
            number, name = tempfile.mkstemp(".log", f"{program}-error-", folder)
            with open(number, "w", encoding="utf-8", errors="replace") as stream:
                stream.write(f"{about}\n{shlex.join(sys.argv)}\n\n{said}")
            return name
    return f"none could be written\n{said}"
