"""What a study file may hold, and what a user is told when it does not."""

import math
from pathlib import Path
from typing import Any

import pytest
from made_study import put
from paths import ROOT

from dragdeck.errors import InputError
from dragdeck.study.check import validate
from dragdeck.study.fidelity import BUILT_IN_FIDELITIES
from dragdeck.study.model import Study
from dragdeck.study.yaml import read_study

FILE = Path("study.yaml")


PAIR = {"restitution": 0.5, "friction": 0.1}
WRONG = [
    ("media.count", 0, "at least 1"),
    ("media.count", "many", "'many' is text, not a number"),
    ("media.count", True, "a number is required"),
    ("media.count", 10.5, "whole number"),
    *(("media.count", text, "is text, not a number")
      for text in ("0300", "1:30", "0x1F", "1_000", "\u0661\u0662", "nan", "1e", "", ".")),
    ("media.radius_mean_m", -1e-3, "greater than 0"),
    ("media.radius_mean_m", math.nan, "a finite number"),
    ("media", {"radius_std_m": 2e-3}, "0.3 of radius_mean_m"),
    ("media.colour", "red", "unknown key"),
    ("bowl.material", "tin", "no such material 'tin'"),
    ("bowl.radius_m", 40, "did you mean 40 mm? That is 0.04"),
    ("motion.sped_m_s", 1, "did you mean 'speed_m_s'"),
    ("motion.spin_rpm", 1, "did you mean 'spin.rpm'"),
    ("motion.radius_mean_m", 1, "did you mean 'classes.radius_mean_m' or 'media.radius_mean_m'"),
    ("media.seed", 1, "did you mean 'seed'"),
    ("motion.speed_m_s", math.inf, "a finite number"),
    ("motion.speed_m_s", 100, "did you mean 100 mm/s? That is 0.1"),
    ("motion.plunge_at_m", [0, 20], "did you mean 20 mm? That is 0.02"),
    ("motion.immersion_depth_m", 50, "did you mean 50 mm? That is 0.05"),
    ("motion.transient_m", 0.0063, "no path is left"),
    ("motion.path.kind", "zigzag", "'zigzag'"),
    ("motion.path.direction", True, "'ccw' or 'cw'"),
    ("workpiece.shape.radius_m", 5, "did you mean 5 mm? That is 0.005"),
    ("materials.steel.youngs_modulus_pa", 0, "greater than 0"),
    ("materials.steel.poissons_ratio", 0.5, "less than 0.5"),
    ("materials.steel.poissons_ratio", -1, "greater than -1"),
    ("materials.ceramic.youngs_modulus_pa", 77, "did you mean 77 GPa? That is 7.7e+10"),
    ("materials.ceramic.youngs_modulus_pa", "77e3", "did you mean 77000 MPa? That is 7.7e+10"),
    ("materials.ceramic.density_kg_m3", 2.656, "did you mean 2.656 g/cm3? That is 2656"),
    ("materials.tin", {"youngs_modulus_pa": 1e9}, "required key"),
    *(("materials", {name: {}}, "name")
      for name in ("a b", "a;b", "a\nb", "$x", "../a", "-a", "", "\u00e4", "x" * 65, "a-b")),
    ("pairs.ceramic-steel.restitution", 0.05, "greater than 0.05"),
    ("pairs.ceramic-steel.restitution", 1.01, "at most 1"),
    ("pairs.ceramic-steel.friction", -0.1, "at least 0"),
    ("pairs.steel-ceramic", PAIR, "differs from ceramic-steel"),
    ("pairs.ceramic-stele", PAIR, "did you mean 'ceramic-steel'"),
    ("fidelity", "perfect", "unknown fidelity 'perfect'"),
    ("fidelity", "standart", "did you mean 'standard'"),
    ("fidelities", {"a;b": {}}, "a name has up to 64 letters"),
    ("filling.energy_ratio", 2e-3, "at most 0.001"),
    ("outputs", {"workpiece_force_hz": 10}, "rates must not increase"),
    ("outputs.network_hz", 1, "not one frame"),
    ("outputs.network_hz", 1e-9, "check the value and its unit"),
    ("gravity_m_s2", 981, "did you mean 981 cm/s2? That is 9.81"),
    *(("title", title, "must be one line")
      for title in ("a\nshell date", "a\tb", "a\u2028b", "a\x00b", "x" * 301)),
]  # fmt: skip


@pytest.mark.parametrize(("field", "value", "words"), WRONG)
def test_a_wrong_value_is_named_and_explained(
    small: dict[str, Any], field: str, value: object, words: str
) -> None:
    put(small, {field: value})
    with pytest.raises(InputError, match=r"study\.yaml") as caught:
        validate(small, FILE)
    found = [caught.value, *caught.value.more]
    assert any(str(one.field).startswith(field) and words in str(one) for one in found)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"a: 1\na: 2\n", "key 'a' is given twice"),
        (b"a: [1\n", "not YAML"),
        (b"- 1\n", "the file has no fields"),
        (b"", "the file has no fields"),
        ("title: A bowl\n".encode("utf-16"), "not UTF-8 text"),
        ("title: Sch\u00fcssel\n".encode("latin-1"), "not UTF-8 text"),
        (b"title: a\x00b\n", "not YAML"),
        (b"title: !!binary aGVsbG8=\n", "a binary is not a plain value"),
        (b"sweep: !!set {a, b}\n", "a set is not a plain value"),
        (b"? [a, b]\n: 1\n", "a key is text"),
        (b"a: 1\n? [a, b]\n: 1\n", "a key is text"),
        *((f"{key}: 1\n".encode(), "a key is text") for key in ("true", "1", "null", ".inf")),
        (b"a: {<<: {b: 1}}\n", "a key is text.*<<"),
        (b"a:\n\tb: 1\n", "(?s)not YAML.*no tabs"),
        (b"a: " + 5000 * b"[", "nested too deeply"),
        (5000 * b"{a: ", "nested too deeply"),
        (b"title: !!python/object/apply:os.system ['touch pwned']\n", "not YAML"),
        (b"title: a\n---\ntitle: b\n", "not YAML"),
        (b"title: &a [*a]\n", "aliases are not supported"),
        (b"title: !!omap [a: 1]\n", "not YAML"),
    ],
)
def test_a_file_that_is_no_study_is_refused(tmp_path: Path, content: bytes, words: str) -> None:
    file = tmp_path / "study.yaml"
    file.write_bytes(content)
    with pytest.raises(InputError, match=words) as caught:
        read_study(file)
    assert caught.value.file == file


@pytest.mark.parametrize(
    ("field", "words"),
    [
        ("motion.speed", "did you mean 'speed_m_s'"),
        ("motion.path.length_m", "another kind of this block"),
        ("bowl.core_radius_m", "another kind of this block"),
        ("density_kg_m3", "did you mean 'compound.density_kg_m3'"),
    ],
)
def test_an_unknown_key_has_a_remedy(small: dict[str, Any], field: str, words: str) -> None:
    put(small, {field: 1})
    with pytest.raises(InputError) as caught:
        validate(small, FILE)
    errors = {error.field: error.remedy for error in (caught.value, *caught.value.more)}
    assert words in str(errors[field])


def test_the_rate_that_is_asked_for_is_accepted(small: dict[str, Any]) -> None:
    put(small, {"outputs.network_hz": 0.01})
    with pytest.raises(InputError, match="not one frame") as caught:
        validate(small, FILE)
    least_hz = float(str(caught.value).partition("at least ")[2].split()[0])
    put(small, {"outputs.network_hz": least_hz})
    assert validate(small, FILE).motion.transient_m > 0


def test_a_missing_key_is_named(small: dict[str, Any]) -> None:
    del small["motion"]["immersion_depth_m"]
    with pytest.raises(InputError) as caught:
        validate(small, FILE)
    assert caught.value.field == "motion.immersion_depth_m"
    assert caught.value.problem == "a required key is missing"


def test_a_pair_that_will_touch_must_be_there(small: dict[str, Any]) -> None:
    del small["pairs"]["ceramic-steel"]
    with pytest.raises(InputError, match="ceramic-steel"):
        validate(small, FILE)


def test_a_pair_may_be_named_either_way_round(small: dict[str, Any]) -> None:
    small["pairs"]["steel-ceramic"] = small["pairs"].pop("ceramic-steel")
    assert validate(small, FILE).pair("ceramic", "steel").restitution == 0.68


def test_a_missing_file_names_its_neighbours(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "there/study.yaml").write_text("a: 1\n")
    with pytest.raises(InputError, match="choose one of: there"):
        read_study(tmp_path / "missing/study.yaml")


def test_own_fidelities_go_before_the_built_in(small: dict[str, Any]) -> None:
    small["fidelities"]["standard"] = {"youngs_modulus_scale": 0.5}
    small["fidelity"] = "standard"
    assert validate(small, FILE).chosen_fidelity().youngs_modulus_scale == 0.5
    assert BUILT_IN_FIDELITIES["standard"].youngs_modulus_scale != 0.5


@pytest.mark.parametrize("study", sorted((ROOT / "studies").glob("*/study.yaml")))
def test_every_shipped_study_is_valid(study: Path) -> None:
    validate(read_study(study), study)


@pytest.fixture
def paper() -> Study:
    return validate(read_study(ROOT / "studies/uhlmann2015/study.yaml"), FILE)


def test_the_papers_values(paper: Study) -> None:
    """Uhlmann et al. 2015, section 4 and the table beside Fig. 4."""
    expected = {"ceramic": (77e9, 0.19, 2656), "steel": (210e9, 0.30, 7610)}
    for name, values in expected.items():
        material = paper.materials[name]
        found = material.youngs_modulus_pa, material.poissons_ratio, material.density_kg_m3
        assert found == values
    media, motion = paper.media, paper.motion
    assert (media.count, media.radius_mean_m, media.radius_std_m) == (1422, 3.27e-3, 0.15e-3)
    assert (motion.immersion_depth_m, motion.speed_m_s) == (0.05, 0.01)
    particles, walls = paper.pair("ceramic", "ceramic"), paper.pair("ceramic", "steel")
    assert (particles.restitution, particles.friction) == (0.86, 0.34)
    assert (walls.restitution, walls.friction) == (0.68, 0.28)


def test_every_value_the_paper_lacks_is_marked(paper: Study) -> None:
    assumed = {entry.field for entry in paper.assumptions}
    assert {"bowl.radius_m", "motion.path.radius_m", "workpiece.shape.radius_m"} <= assumed
