"""How a study file is read: its numbers, and every problem at once with its line."""

from pathlib import Path
from typing import Any

import pytest

from dragdeck.errors import InputError
from dragdeck.study.check import validate, warnings
from dragdeck.study.yaml import located, read_yaml

FILE = Path("study.yaml")


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("300", 300),
        ("-3", -3),
        ("0.5", 0.5),
        (".5", 0.5),
        ("1.5e+3", 1500.0),
        ("true", True),
        ("5e6", "5e6"),  # text of YAML 1.1, a number of a study
        *((text, text) for text in ("0300", "0300.5", "1:30", "1:30.5", "0x1F", "1_000")),
        *((text, text) for text in ("2015-01-01", "yes", "on")),
    ],
)
def test_numbers_are_decimal(tmp_path: Path, text: str, value: object) -> None:
    file = tmp_path / "study.yaml"
    file.write_text(f"a: {text}\n")
    found = read_yaml(file)["a"]
    assert (found, type(found)) == (value, type(value))


def test_every_problem_is_named_with_its_line(tmp_path: Path, small: dict[str, Any]) -> None:
    file = tmp_path / "study.yaml"
    file.write_text(
        "title: a\nmedia:\n  count: 0\n  colour: red\nbowl:\n  radius_m: 40\nseed: -1\n"
    )
    small["media"] |= {"count": 0, "colour": "red"}
    small["bowl"]["radius_m"] = 40
    small["seed"] = -1
    with pytest.raises(InputError) as caught:
        validate(small, file)
    places = {error.field: error.line for error in (caught.value, *caught.value.more)}
    assert places == {"media.count": 3, "media.colour": 4, "bowl.radius_m": 6, "seed": 7}
    assert f"{file}:6: bowl.radius_m: is not plausible" in str(caught.value)


def test_a_value_of_a_sweep_has_the_line_of_the_sweep(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_text("motion:\n  speed_m_s: 1\nsweep:\n  motion.speed_m_s: [1, 2]\n")
    assert located(InputError("wrong", file=file, field="motion.speed_m_s")).line == 4
    assert located(InputError("wrong", file=file, field="motion.path.radius_m")).line == 1
    assert located(InputError("wrong", file=file, field="bowl")).line is None


def test_an_unusual_value_is_a_warning(small: dict[str, Any]) -> None:
    assert warnings(validate(small, FILE)) == []
    small["motion"]["speed_m_s"] = 10
    small["outputs"] = {"network_hz": 1e3}
    small["outputs"] |= {"workpiece_force_hz": 1e3, "workpiece_contacts_hz": 1e3}
    small["motion"]["path"]["revolutions"] = 1
    (warning,) = warnings(validate(small, FILE))
    assert "motion.speed_m_s 10 is not plausible; did you mean 10 mm/s?" in warning.text


def test_a_pair_may_be_given_twice_with_the_same_values(small: dict[str, Any]) -> None:
    small["pairs"]["steel-ceramic"] = small["pairs"]["ceramic-steel"]
    validate(small, FILE)


def test_a_byte_order_mark_is_no_trouble(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_bytes("title: Schüssel\n".encode("utf-8-sig"))
    assert read_yaml(file) == {"title": "Schüssel"}


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ("bowl: {radius_m: 0,025, height_m: 0.1}", 1, "a decimal comma in 0,025: write 0.025"),
        ("bowl: {radius_m: -1, 5}", 1, "a decimal comma in -1,5"),
        ("motion:\n  speed_m_s: 0,01\n", 2, "'0,01' has a comma: write 0.01 with a decimal point"),
        ('motion:\n  speed_m_s: "1,5e-2"\n', 2, "write 1.5e-2 with"),
        ("motion:\n  speed_m_s: [0,1]\n", 2, "if its comma is a decimal comma"),
        ("sweep:\n  motion.speed_m_s: [1,5]\n", 2, "motion.speed_m_s: [1,5]"),
    ],
)
def test_decimal_commas_are_refused_with_a_word(
    tmp_path: Path, small: dict[str, Any], text: str, line: int, words: str
) -> None:
    file = tmp_path / "study.yaml"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        changes: Any = read_yaml(file)
        for block, values in changes.items():
            small[block] = {**small.get(block, {}), **values}
        validate(small, file, whole=True)
    assert words in str(caught.value) or words in f"{caught.value.field}: {caught.value.value}"
    assert caught.value.line == line or caught.value.field == f"line {line}"


@pytest.mark.parametrize("levels", ["[1, 5]", "[1,5,7]", "[0.1,0.5]"])
def test_lists_that_are_no_decimal_commas_are_read(
    tmp_path: Path, small: dict[str, Any], levels: str
) -> None:
    file = tmp_path / "study.yaml"
    file.write_text(f"sweep:\n  seed: [1,2]\n  motion.speed_m_s: {levels}\n")
    assert validate(small | read_yaml(file), file, whole=True).sweep
