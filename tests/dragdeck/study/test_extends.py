"""A study that extends another states only what differs."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml

from dragdeck.errors import InputError
from dragdeck.study.model import Filling, Study
from dragdeck.study.yaml import located, read_study
from dragdeck.sweep.cases import load_cases

Write = Callable[..., Path]


@pytest.fixture
def extend(write_study: Write, small: dict[str, Any]) -> Callable[[str], Path]:
    base = write_study(small)

    def write(text: str, name: str = "child") -> Path:
        file = base.parent.parent / name / "study.yaml"
        file.parent.mkdir(exist_ok=True)
        file.write_text(text)
        return file

    return write


def test_fields_are_replaced_one_by_one(extend: Callable[..., Path], small: dict[str, Any]) -> None:
    file = extend("extends: small\nmotion: {path: {revolutions: 0.1}}\n")
    expected = yaml.safe_load(yaml.safe_dump(small))
    expected["motion"]["path"]["revolutions"] = 0.1
    assert read_study(file) == expected
    (case,) = load_cases(file)
    assert case.study_name == "child"


def test_lists_fidelity_and_another_kind_are_replaced_as_a_whole(
    extend: Callable[..., Path],
) -> None:
    file = extend(
        "extends: small\nfidelity: {tolerance: 0.1}\nassumptions: []\n"
        "motion: {path: {kind: line, length_m: 0.02, start_m: [0, 0]}}\n"
    )
    data = read_study(file)
    assert data["fidelity"] == {"tolerance": 0.1}
    assert data["assumptions"] == []
    assert data["motion"]["path"] == {"kind": "line", "length_m": 0.02, "start_m": [0, 0]}
    assert "speed_m_s" in data["motion"]


@pytest.mark.parametrize(
    ("block", "inherited"),
    [
        ("sweep", {"seed": [1, 2]}),
        ("fidelity", "draft"),
        ("filling", {"energy_ratio": 0.01}),
        ("outputs", {"network_hz": 50}),
        ("contact", {"limit_force": False}),
        ("drop_test", {"impacts": 2}),
        ("scaling", {"field": "seed"}),
        ("accepted", {"cases": 200}),
        ("assumptions", [{"field": "seed", "why": "any"}]),
    ],
)
def test_null_removes_what_the_extended_study_has(
    extend: Callable[..., Path], block: str, inherited: Any
) -> None:
    extend(yaml.safe_dump({"extends": "small", block: inherited}), "middle")
    file = extend(f"extends: middle\n{block}: null\n")
    assert block not in read_study(file)
    (case,) = load_cases(file)
    assert getattr(case.study, block) == Study.model_fields[block].get_default(
        call_default_factory=True
    )


def test_null_removes_one_value(extend: Callable[..., Path]) -> None:
    extend("extends: small\nfilling: {energy_ratio: 0.01, max_time_s: 7}\n", "middle")
    file = extend("extends: middle\nfilling: {energy_ratio: null}\n")
    assert read_study(file)["filling"] == {"max_time_s": 7}
    (case,) = load_cases(file)
    assert case.study.filling == Filling(max_time_s=7)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("extends: smal\n", "unknown study"),
        ("extends: ../small\n", "unknown study"),
        ("extends: [small]\n", "unknown study"),
        ("extends: child\n", "extends itself"),
        ("extends: other\n", "extends itself"),
    ],
)
def test_what_cannot_be_extended(extend: Callable[..., Path], text: str, words: str) -> None:
    extend("extends: child\n", "other")
    with pytest.raises(InputError, match=words) as caught:
        load_cases(extend(text))
    assert "extends" in str(caught.value) and "small" in str(caught.value)


def test_a_study_that_extends_itself_is_offered_others_only(extend: Callable[..., Path]) -> None:
    extend("extends: small\n", "childe")
    with pytest.raises(InputError) as caught:
        load_cases(extend("extends: child\n"))
    offered, _, others = str(caught.value.limit).partition(", small")  # those of dragdeck
    assert offered == "did you mean 'childe'? one of: childe"
    assert "child," not in others


def test_an_error_names_the_file_and_line_that_has_the_value(extend: Callable[..., Path]) -> None:
    extend("extends: small\nmotion:\n  speed_m_s: -1\n", "middle")
    file = extend("extends: middle\nseed: -2\n")
    with pytest.raises(InputError) as caught:
        load_cases(file)
    found = located(caught.value)
    places = {
        one.field: (Path(str(one.file)).parent.name, one.line) for one in (found, *found.more)
    }
    assert places == {"motion.speed_m_s": ("middle", 3), "seed": ("child", 2)}


@pytest.mark.parametrize("block", ["sweep", "outputs", "contact", "assumptions", "removal"])
def test_a_block_whose_lines_are_all_comments_is_not_there(
    extend: Callable[..., Path], small: dict[str, Any], block: str
) -> None:
    file = extend(f"extends: small\n{block}:\n#  some: thing\n")
    assert read_study(file) == small
    assert len(load_cases(file)) == 1
