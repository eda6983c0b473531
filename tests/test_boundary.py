"""What is said of errors that a user can cause, and of those that nobody expected."""

import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from dragchain import cli as dragchain
from dragchain.errors import DragchainError
from dragdeck import cli as dragdeck
from dragdeck.errors import DragdeckError
from dragdeck.files import replace_bytes

PACKAGES = [
    pytest.param("dragdeck", dragdeck.guarded, DragdeckError, id="dragdeck"),
    pytest.param("dragchain", dragchain.guarded, DragchainError, id="dragchain"),
]

Guarded = Callable[[Callable[[], None]], int]


def raising(error: BaseException) -> Callable[[], None]:
    def call() -> None:
        raise error

    return call


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(("name", "guarded", "expected"), PACKAGES)
def test_the_unexpected_is_short_and_kept_in_a_log(
    name: str, guarded: Guarded, expected: type[Exception],
    tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    assert guarded(raising(KeyError("a key"))) == 1
    said = capsys.readouterr().err
    assert said.startswith(f"{name}: unexpected error: KeyError: 'a key'\n  log: ")
    assert "Traceback" not in said
    assert "Reporting a problem" in said
    (log,) = tmp_path.glob(f"{name}-error-*.log")
    assert str(log) in said
    text = log.read_text()
    assert "Traceback" in text
    assert "Python 3" in text


@pytest.mark.parametrize(("name", "guarded", "expected"), PACKAGES)
def test_what_is_expected_leaves_no_log(
    name: str, guarded: Guarded, expected: type[Exception],
    tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    errors: list[tuple[BaseException, str]] = [
        (expected("what is wrong"), "what is wrong"),
        (PermissionError(13, "Permission denied", "results/x"), "results/x: Permission denied"),
        (OSError(36, "File name too long", "a" * 300), "a" * 20),
        (MemoryError("8 TiB"), "not enough memory: 8 TiB"),
    ]
    for error, words in errors:
        assert guarded(raising(error)) == 1
        assert capsys.readouterr().err.startswith(f"{name}: {words[:20]}")
    assert guarded(raising(KeyboardInterrupt())) == 130
    assert guarded(lambda: None) == 0
    assert list(tmp_path.iterdir()) == []


def test_a_full_disk_is_named_with_the_file_and_what_is_free(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "preview.png"
    (tmp_path / f".preview.png.{os.getpid()}").symlink_to("/dev/full")
    assert dragdeck.guarded(lambda: replace_bytes(file, b"1")) == 1
    said = capsys.readouterr().err
    assert re.match(rf"dragdeck: {file}: [\d,]+ bytes free: No space left on device\n", said)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("name", "guarded", "expected"), PACKAGES)
def test_a_log_that_cannot_be_written_here_is_written_elsewhere(
    name: str, guarded: Guarded, expected: type[Exception],
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    elsewhere, gone = tmp_path / "elsewhere", tmp_path / "gone"
    elsewhere.mkdir()
    gone.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(elsewhere))
    monkeypatch.chdir(gone)
    gone.rmdir()
    assert guarded(raising(KeyError("a key"))) == 1
    (log,) = elsewhere.iterdir()
    assert str(log) in capsys.readouterr().err


@pytest.mark.parametrize("module", ["dragdeck", "dragchain"])
def test_a_reader_that_has_seen_enough_is_no_error(module: str) -> None:
    code = (
        f"import sys; from {module}.cli import guarded;"
        "sys.exit(guarded(lambda: [print(n) for n in range(100_000)] and None))"
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
