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
        ("0300", "0300"),
        ("0300.5", "0300.5"),
        ("1:30", "1:30"),
        ("1:30.5", "1:30.5"),
        ("0x1F", "0x1F"),
        ("1_000", "1_000"),
        ("2015-01-01", "2015-01-01"),
        ("yes", "yes"),
        ("on", "on"),
    ],
)
def test_numbers_are_decimal(tmp_path: Path, text: str, value: object) -> None:
    file = tmp_path / "study.yaml"
    file.write_text(f"a: {text}\n")
    found = read_yaml(file)["a"]
    assert (found, type(found)) == (value, type(value))


@pytest.mark.parametrize("text", ["0300", "1:30", "0x1F", "1_000", "١٢", "nan", "1e", "", "."])
def test_a_number_of_another_notation_is_refused(small: dict[str, Any], text: str) -> None:
    small["media"]["count"] = text
    with pytest.raises(InputError, match="is text, not a number"):
        validate(small, FILE)


def test_a_truth_value_is_no_direction(small: dict[str, Any]) -> None:
    small["motion"]["path"]["direction"] = True
    with pytest.raises(InputError, match="'ccw' or 'cw'") as caught:
        validate(small, FILE)
    assert caught.value.field == "motion.path.direction"


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
    places = [(error.line, error.field) for error in (caught.value, *caught.value.more)]
    assert sorted(places) == [
        (3, "media.count"),
        (4, "media.colour"),
        (6, "bowl.radius_m"),
        (7, "seed"),
    ]
    assert f"{file}:6: bowl.radius_m: is not plausible" in str(caught.value)


def test_a_value_of_a_sweep_has_the_line_of_the_sweep(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_text("motion:\n  speed_m_s: 1\nsweep:\n  motion.speed_m_s: [1, 2]\n")
    assert located(InputError("wrong", file=file, field="motion.speed_m_s")).line == 4
    assert located(InputError("wrong", file=file, field="motion.path.radius_m")).line == 1
    assert located(InputError("wrong", file=file, field="bowl")).line is None


def test_a_misspelt_key_is_shown_what_it_resembles(small: dict[str, Any]) -> None:
    small["motion"]["sped_m_s"] = 1
    with pytest.raises(InputError, match="did you mean 'speed_m_s'"):
        validate(small, FILE)


@pytest.mark.parametrize("title", ["a\nshell date", "a\tb", "a\u2028b", "a\x00b", "x" * 301])
def test_a_title_is_one_line(small: dict[str, Any], title: str) -> None:
    small["title"] = title
    with pytest.raises(InputError, match="must be one line"):
        validate(small, FILE)


@pytest.mark.parametrize(
    "name", ["a b", "a;b", "a\nb", "$x", "../a", "-a", "", "ä", "x" * 65, "a-b"]
)
def test_a_material_has_a_plain_name(small: dict[str, Any], name: str) -> None:
    small["materials"][name] = small["materials"]["steel"]
    with pytest.raises(InputError, match="name") as caught:
        validate(small, FILE)
    assert str(caught.value.field).startswith("materials")


def test_a_fidelity_has_a_plain_name(small: dict[str, Any]) -> None:
    small["fidelities"]["a;b"] = {}
    with pytest.raises(InputError, match="a name has up to 64 letters"):
        validate(small, FILE)


@pytest.mark.parametrize(
    ("field", "value", "hint"),
    [
        ("motion.immersion_depth_m", 50, "did you mean 50 mm? That is 0.05"),
        ("workpiece.shape.radius_m", 5, "did you mean 5 mm? That is 0.005"),
        ("bowl.radius_m", 40, "did you mean 40 mm? That is 0.04"),
        ("materials.ceramic.youngs_modulus_pa", 77, "did you mean 77 GPa? That is 7.7e+10"),
        ("materials.ceramic.youngs_modulus_pa", "77e3", "did you mean 77000 MPa? That is 7.7e+10"),
        ("materials.ceramic.density_kg_m3", 2.656, "did you mean 2.656 g/cm3? That is 2656"),
        ("motion.speed_m_s", 100, "did you mean 100 mm/s? That is 0.1"),
        ("motion.plunge_at_m", [0, 20], "did you mean 20 mm? That is 0.02"),
        ("outputs.network_hz", 1e-9, "check the value and its unit"),
        ("gravity_m_s2", 981, "did you mean 981 cm/s2? That is 9.81"),
    ],
)
def test_a_slip_of_a_unit_is_refused_as_such(
    small: dict[str, Any], field: str, value: object, hint: str
) -> None:
    *parents, last = field.split(".")
    place = small
    for name in parents:
        place = place.setdefault(name, {})
    place[last] = value
    with pytest.raises(InputError, match="is not plausible") as caught:
        validate(small, FILE)
    found = [caught.value, *caught.value.more]
    assert next(error.remedy for error in found if str(error.field).startswith(field)) == hint


def test_an_unusual_value_is_a_warning(small: dict[str, Any]) -> None:
    assert warnings(validate(small, FILE)) == []
    small["motion"]["speed_m_s"] = 10
    small["outputs"] = {"network_hz": 1e3}
    small["outputs"] |= {"workpiece_force_hz": 1e3, "workpiece_contacts_hz": 1e3}
    small["motion"]["path"]["revolutions"] = 1
    (warning,) = warnings(validate(small, FILE))
    assert "motion.speed_m_s 10 is not plausible; did you mean 10 mm/s?" in warning.text


@pytest.mark.parametrize(
    ("changes", "field", "words"),
    [
        ({"motion": {"transient_m": 0.0063}}, "motion.transient_m", "no path is left"),
        ({"outputs": {"network_hz": 1}}, "outputs.network_hz", "not one frame"),
        (
            {"filling": {"energy_ratio": 2e-3}},
            "filling.energy_ratio",
            "less than or equal to 0.001",
        ),
        (
            {"pairs": {"steel-ceramic": {"restitution": 0.5, "friction": 0.1}}},
            "pairs.steel-ceramic",
            "differs from ceramic-steel",
        ),
        (
            {"pairs": {"ceramic-stele": {"restitution": 0.5, "friction": 0.1}}},
            "pairs.ceramic-stele",
            "did you mean 'ceramic-steel'",
        ),
        ({"fidelity": "standart"}, "fidelity", "did you mean 'standard'"),
    ],
)
def test_a_contradiction_is_refused(
    small: dict[str, Any], changes: dict[str, Any], field: str, words: str
) -> None:
    for name, value in changes.items():
        small[name] = {**small.get(name, {}), **value} if isinstance(value, dict) else value
    with pytest.raises(InputError, match=words) as caught:
        validate(small, FILE)
    assert caught.value.field == field


def test_a_pair_may_be_given_twice_with_the_same_values(small: dict[str, Any]) -> None:
    small["pairs"]["steel-ceramic"] = small["pairs"]["ceramic-steel"]
    validate(small, FILE)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("title: A bowl\n".encode("utf-16"), "not UTF-8 text"),
        ("title: Schüssel\n".encode("latin-1"), "not UTF-8 text"),
        (b"title: a\x00b\n", "not YAML"),
        (b"title: !!binary aGVsbG8=\n", "a binary is not a plain value"),
        (b"sweep: !!set {a, b}\n", "a set is not a plain value"),
        (b"? [a, b]\n: 1\n", "not YAML"),
        (b"a: " + 5000 * b"[", "nested too deeply"),
        (5000 * b"{a: ", "nested too deeply"),
        (b"", "the file must be a mapping"),
    ],
)
def test_each_is_named_with_its_file(tmp_path: Path, content: bytes, words: str) -> None:
    file = tmp_path / "study.yaml"
    file.write_bytes(content)
    with pytest.raises(InputError, match=words) as caught:
        read_yaml(file)
    assert caught.value.file == file


def test_a_byte_order_mark_is_no_trouble(tmp_path: Path) -> None:
    file = tmp_path / "study.yaml"
    file.write_bytes("title: Schüssel\n".encode("utf-8-sig"))
    assert read_yaml(file) == {"title": "Schüssel"}
