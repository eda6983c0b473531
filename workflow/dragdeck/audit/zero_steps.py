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
from dragdeck.script.findings import Finding, NotApplied, at
from dragdeck.script.flow import Script

_LEFT_OUT = {
    "dump", "dump_modify", "undump", "restart", "write_restart", "write_data", "write_dump",
    "shell", "log", "processors", "jump", "label", "include", "quit", "echo", "info",
}  # fmt: skip
_WRITES = ("print", "ave/", "massflow/mesh", "balance")
_MARK = "DRAGDECK AUDIT "
_SECONDS = 60.0
_MEMORY_KB = 4_000_000
_FILE_BLOCKS = 100_000


def engine_findings(script: Script) -> Iterator[Finding | NotApplied]:
    """DK300: the error of LIGGGHTS in the first run of a script, with its line."""
    commands = list(_reduced(script))
    if unknown := next((command for command in commands if command.uncertain), None):
        yield NotApplied("DK300", f"whether LIGGGHTS executes {unknown.text.strip()} is not known")
        return
    text = "\n".join(command.text for command in commands) + "\n"
    outside = next(leaving_folder(text, ""), None)
    if outside:
        yield NotApplied("DK300", f"the script would {outside[1]}: {outside[0].strip()}")
        return
    with tempfile.TemporaryDirectory(prefix="dragdeck-audit-") as folder:
        for name in {name for command in commands for name in names_read(command.words)}:
            source, target = script.file.parent / name, Path(folder) / name
            if source.is_file():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, target)
        marked = [f'print "{_MARK}{n}"\n{c.text}\n' for n, c in enumerate(commands)]
        Path(folder, "in.audit").write_text("".join(marked), encoding="utf-8")
        screen = _screen(Path(folder))
    errors = engine_errors(screen)
    if errors:
        last = screen.rpartition(_MARK)[2].split(maxsplit=1)
        yield at("DK300", commands[int(last[0])], f"{errors[0]}")


def _screen(folder: Path) -> str:
    """What LIGGGHTS prints with limits of time, memory and size of files."""
    limits = f'ulimit -v {_MEMORY_KB}; ulimit -f {_FILE_BLOCKS}; exec "$@"'

    def watch(seconds: float) -> None:
        if seconds > _SECONDS:
            raise EngineError(f"LIGGGHTS did not end a run of zero steps in {_SECONDS:.0f} s")

    words = ["sh", "-c", limits, "sh", *plain_command(find_engine(), "in.audit")]
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
        if words[0] not in (*_LEFT_OUT, "if", "next") and not writes:
            yield replace(command, text=_quoted(words))


def _quoted(words: list[str]) -> str:
    """A command from its words."""
    return " ".join(f'"{word}"' if not word or set(word) & set(" \t#&") else word for word in words)
