"""What is said of errors that a user can cause, and of those that nobody expected."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from dragdeck.command_line import guarded
from dragdeck.errors import DragdeckError
from dragdeck.files import write_bytes


def raising(error: BaseException) -> Callable[[], None]:
    def call() -> None:
        raise error

    return call


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_the_unexpected_is_short_and_kept_in_a_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert guarded("program", raising(KeyError("a key"))) == 1
    said = capsys.readouterr().err
    assert said.startswith("program: unexpected error: KeyError: 'a key'\n  log: ")
    assert "Traceback" not in said
    assert "Reporting a problem" in said
    (log,) = tmp_path.glob("program-error-*.log")
    assert str(log) in said
    text = log.read_text()
    assert "Traceback" in text
    assert "Python 3" in text


def test_what_is_expected_leaves_no_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    errors: list[tuple[BaseException, str]] = [
        (DragdeckError("what is wrong"), "what is wrong"),
        (PermissionError(13, "Permission denied", "results/x"), "results/x: Permission denied"),
        (OSError(36, "File name too long", "a" * 300), "a" * 20),
        (MemoryError("8 TiB"), "not enough memory: 8 TiB"),
    ]
    for error, words in errors:
        assert guarded("program", raising(error)) == 1
        assert capsys.readouterr().err.startswith(f"program: {words[:20]}")
    assert guarded("program", raising(KeyboardInterrupt())) == 130
    assert guarded("program", lambda: None) == 0
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_named_with_the_file_and_what_is_free(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "preview.png"
    (tmp_path / f".preview.png.{os.getpid()}").symlink_to("/dev/full")
    assert guarded("program", lambda: write_bytes(file, b"1")) == 1
    said = capsys.readouterr().err
    assert re.match(rf"program: {file}: [\d,]+ bytes free: No space left on device\n", said)
    assert list(tmp_path.iterdir()) == []


def test_a_log_that_cannot_be_written_here_is_written_elsewhere(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere, gone = tmp_path / "elsewhere", tmp_path / "gone"
    elsewhere.mkdir()
    gone.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(elsewhere))
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert guarded("program", raising(KeyError("a key"))) == 1
    (log,) = elsewhere.iterdir()
    assert str(log) in capsys.readouterr().err


def test_a_reader_that_has_seen_enough_is_no_error() -> None:
    code = (
        "import sys; from dragdeck.command_line import guarded;"
        "sys.exit(guarded('program', lambda: [print(n) for n in range(100_000)] and None))"
    )
    whole = subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip
    assert whole.stdout is not None and whole.stderr is not None
    assert whole.stdout.readline() == "0\n"
    whole.stdout.close()
    assert whole.stderr.read() == ""
    assert whole.wait() == 0


def python(code: str, *arguments: str, **settings: str) -> subprocess.CompletedProcess[str]:
    """A program that ended, with these words and environment."""
    environs = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **settings}
    words = [sys.executable, "-c", code, *arguments]
    return subprocess.run(words, capture_output=True, text=True, env=environs)


PROGRAM = """
import atexit, ctypes, sys
from dragdeck.command_line import Command, Program

def command(how):
    libc = ctypes.CDLL(None)  # as destructors of C++ libraries do now and then
    libc.__cxa_atexit(ctypes.cast(libc.abort, ctypes.c_void_p), None, None)
    atexit.register(print, "closed")
    if how == "wrong":
        raise ValueError("wrong")
    return "done"

sys.modules["package.module"] = sys.modules[__name__]
about = ("command", "help", "about", "module:command", {"how": {}})
Program("package", "about", [Command(*about)])()
"""


def test_settings_of_the_user_do_not_reach_figures(tmp_path: Path) -> None:
    settings = tmp_path / "settings"
    settings.mkdir()
    (settings / "matplotlibrc").write_text("lines.linewidth: 7\n")
    code = PROGRAM.replace('return "done"', "import matplotlib.pyplot as plt; return plt.rcParams")
    code = code.replace("plt.rcParams", 'f"{plt.rcParams[how]}, {plt.get_backend()}"')
    given = {"MPLBACKEND": "module://of_a_notebook", "MATPLOTLIBRC": str(settings)}
    ended = python(code, "command", "lines.linewidth", **given)
    assert ended.stdout == "1.5, agg\nclosed\n", ended.stderr


@pytest.mark.parametrize(
    ("arguments", "status", "printed"),
    [
        (["command", "right"], 0, "done\nclosed\n"),
        (["command", "wrong"], 1, "closed\n"),
        (["no command"], 2, ""),
    ],
)
def test_a_library_that_aborts_at_the_end_costs_no_result(
    arguments: list[str], status: int, printed: str
) -> None:
    ended = python(PROGRAM, *arguments)
    assert (ended.returncode, ended.stdout) == (status, printed), ended.stderr
