"""What LIGGGHTS itself says of a script, in a run of zero steps in a copy."""

import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from dragdeck.engine.log import engine_errors
from dragdeck.engine.process import execute, find_engine, plain_command
from dragdeck.errors import EngineError
from dragdeck.script.commands import EngineCommand, leaving_folder, names_read
from dragdeck.script.findings import Hits, hit, unknown
from dragdeck.script.flow import Script

_LEFT_OUT = {
    "dump", "dump_modify", "undump", "restart", "write_restart", "write_data", "write_dump", "if",
    "shell", "log", "processors", "jump", "label", "include", "quit", "echo", "info", "next",
}  # fmt: skip
_WRITES = ("print", "ave/", "massflow/mesh", "balance")
_MARK = "DRAGDECK AUDIT "
_SECONDS = 60.0
_LIMITS = 'ulimit -v 4000000; ulimit -f 100000; exec "$@"'
"""Of memory, kB, and of the size of a file, in blocks."""


def engine_findings(script: Script) -> Hits:
    """The error of LIGGGHTS in the first run of a script, with its line (DK300)."""
    commands = list(_reduced(script))
    if unsure := next((command for command in commands if command.uncertain), None):
        yield unknown(f"whether LIGGGHTS executes {unsure.text.strip()} is not known")
        return
    for what, why in leaving_folder("\n".join(command.text for command in commands), ""):
        yield unknown(f"the script would {why}: {what.strip()}")
        return
    with tempfile.TemporaryDirectory(prefix="dragdeck-audit-") as folder:
        screen = _screen(script.file.parent, Path(folder), commands)
    for error in engine_errors(screen)[:1]:
        number = int(screen.rpartition(_MARK)[2].split(maxsplit=1)[0])
        yield hit("engine", commands[number], what=error)


def _screen(source: Path, folder: Path, commands: list[EngineCommand]) -> str:
    """What LIGGGHTS prints, with limits of time, memory and size of files."""
    for name in {name for command in commands for name in names_read(command.words)}:
        if (source / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source / name, folder / name)
    marked = [f'print "{_MARK}{n}"\n{command.text}\n' for n, command in enumerate(commands)]
    (folder / "in.audit").write_text("".join(marked), encoding="utf-8")

    def watch(seconds: float) -> None:
        if seconds > _SECONDS:
            raise EngineError(f"LIGGGHTS did not end a run of zero steps in {_SECONDS:.0f} s")

    words = ["sh", "-c", _LIMITS, "sh", *plain_command(find_engine(), "in.audit")]
    execute(words, folder, folder / "screen.txt", watch)
    return (folder / "screen.txt").read_text(encoding="utf-8", errors="replace")


def _reduced(script: Script) -> Iterator[EngineCommand]:
    """The commands up to the first run, which becomes one of zero steps."""
    for command in script.commands:
        words = command.words
        writes = words[0] == "fix" and "".join(words[3:4]).startswith(_WRITES)
        if words[0] == "run":
            yield replace(command, text="run 0")
            return
        if words[0] not in _LEFT_OUT and not writes:
            quoted = [f'"{w}"' if not w or set(w) & set(" \t#&") else w for w in words]
            yield replace(command, text=" ".join(quoted))
