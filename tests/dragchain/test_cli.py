from pathlib import Path

import pytest

from dragchain.cli import main


def test_an_error_is_one_message_and_status_1(tmp_path: Path, capsys) -> None:
    assert main(["tables", str(tmp_path)]) == 1
    error = capsys.readouterr().err
    assert error.startswith(f"dragchain: {tmp_path / 'case.json'}: there is no such file\n")
    assert "Traceback" not in error


def test_an_error_of_the_system_is_told_too(tiny_run: Path, capsys) -> None:
    (tiny_run / "tables").write_text("in the way")
    assert main(["tables", str(tiny_run)]) == 1
    assert capsys.readouterr().err.startswith("dragchain: ")


@pytest.mark.parametrize("arguments", [[], ["tables"], ["stir", "x"], ["report", "x"]])
def test_a_wrong_use_ends_with_2(arguments, capsys) -> None:
    with pytest.raises(SystemExit) as caught:
        main(arguments)
    assert caught.value.code == 2
    assert "usage: dragchain" in capsys.readouterr().err
