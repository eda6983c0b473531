"""What a study file may hold, and what a user is told when it does not."""

import math
from pathlib import Path
from typing import Any

import pytest
from paths import ROOT

from dragdeck.errors import InputError
from dragdeck.study.check import validate
from dragdeck.study.model import BUILT_IN_FIDELITIES
from dragdeck.study.yaml import read_study

FILE = Path("study.yaml")


def put(data: dict[str, Any], field: str, value: Any) -> None:
    *parents, last = field.split(".")
    for name in parents:
        data = data[name]
    data[last] = value


@pytest.mark.parametrize(
    ("field", "value", "limit"),
    [
        ("media.count", 0, "at least 1"),
        ("media.radius_mean_m", -1e-3, "greater than 0"),
        ("media.radius_mean_m", math.nan, "a finite number"),
        ("motion.speed_m_s", math.inf, "a finite number"),
        ("materials.steel.youngs_modulus_pa", 0, "greater than 0"),
        ("materials.steel.poissons_ratio", 0.5, "less than 0.5"),
        ("materials.steel.poissons_ratio", -1, "greater than -1"),
        ("pairs.ceramic-steel.restitution", 0.05, "greater than 0.05"),
        ("pairs.ceramic-steel.restitution", 1.01, "at most 1"),
        ("pairs.ceramic-steel.friction", -0.1, "at least 0"),
    ],
)
def test_a_value_beyond_its_limit_is_named(
    small: dict[str, Any], field: str, value: float, limit: str
) -> None:
    put(small, field, value)
    with pytest.raises(InputError) as caught:
        validate(small, FILE)
    assert caught.value.field == field
    assert caught.value.limit == limit
    assert "study.yaml" in str(caught.value)


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("media.count", "many", "'many' is text, not a number"),
        ("media.count", True, "a number is required"),
        ("media.count", 10.5, "integer"),
        ("media.colour", "red", "unknown key"),
        ("bowl.material", "tin", "no such material 'tin'"),
        ("fidelity", "perfect", "unknown fidelity 'perfect'"),
        ("media.radius_std_m", 2e-3, "0.3 of radius_mean_m"),
        ("motion.path.kind", "zigzag", "'zigzag'"),
        ("outputs", {"workpiece_force_hz": 10}, "rates must not increase"),
        ("materials.a-b", {"youngs_modulus_pa": 1e9}, "required key"),
    ],
)
def test_a_wrong_value_is_explained(
    small: dict[str, Any], field: str, value: Any, words: str
) -> None:
    put(small, field, value)
    with pytest.raises(InputError, match=r"study\.yaml") as caught:
        validate(small, FILE)
    assert words in str(caught.value)


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


def test_yaml_numbers_with_an_exponent_are_numbers(tmp_path: Path) -> None:
    assert (
        read_study(ROOT / "studies/uhlmann2015/study.yaml")["materials"]["ceramic"][
            "youngs_modulus_pa"
        ]
        == "77e9"
    )  # what YAML 1.1 makes of it
    study = validate(read_study(ROOT / "studies/uhlmann2015/study.yaml"), FILE)
    assert study.materials["ceramic"].youngs_modulus_pa == 77e9


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a: 1\na: 2\n", "key 'a' is given twice"),
        ("a: [1\n", "not YAML"),
        ("- 1\n", "the file must be a mapping"),
        ("", "the file must be a mapping"),
    ],
)
def test_a_file_that_is_no_study_is_refused(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "study.yaml"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        read_study(file)
    assert words in str(caught.value)
    assert str(file) in str(caught.value)


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


def test_the_papers_values(tmp_path: Path) -> None:
    """Uhlmann et al. 2015, section 4 and the table beside Fig. 4."""
    study = validate(read_study(ROOT / "studies/uhlmann2015/study.yaml"), FILE)
    ceramic, steel = study.materials["ceramic"], study.materials["steel"]
    assert (ceramic.youngs_modulus_pa, ceramic.poissons_ratio, ceramic.density_kg_m3) == (
        77e9,
        0.19,
        2656,
    )
    assert (steel.youngs_modulus_pa, steel.poissons_ratio, steel.density_kg_m3) == (
        210e9,
        0.30,
        7610,
    )
    assert (study.media.count, study.media.radius_mean_m, study.media.radius_std_m) == (
        1422,
        3.27e-3,
        0.15e-3,
    )
    assert (study.motion.immersion_depth_m, study.motion.speed_m_s) == (0.05, 0.01)
    particles, walls = study.pair("ceramic", "ceramic"), study.pair("ceramic", "steel")
    assert (particles.restitution, particles.friction) == (0.86, 0.34)
    assert (walls.restitution, walls.friction) == (0.68, 0.28)


def test_every_value_the_paper_lacks_is_marked(tmp_path: Path) -> None:
    study = validate(read_study(ROOT / "studies/uhlmann2015/study.yaml"), FILE)
    assumed = {entry.field for entry in study.assumptions}
    assert {"bowl.radius_m", "motion.path.radius_m", "workpiece.shape.radius_m"} <= assumed
