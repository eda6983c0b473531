"""Designs: which points a variation makes, and what a file of designs cannot say."""

import json
from pathlib import Path

import pytest
import yaml

from dragdeck.errors import InputError
from dragdeck.sweep.design import Design, Variation

BASE = {"base": {"friction": 0.3}, "reference": {"vary": {"step": [0.1]}}}


def test_points_combine_and_change_one_at_a_time_with_what_all_share() -> None:
    block = Variation.model_validate(
        {"vary": {"a": [1, 2], "b": [3]}, "one_by_one": {"c": [4, 5], "d": [6]}, "with": {"e": 7}}
    )
    found = list(block.points())
    assert [point.axis for point in found] == 2 * ["c", "c", "d"]
    assert [tuple(point.values.items()) for point in found[:1]] == [
        (("e", 7), ("a", 1), ("b", 3), ("c", 4))
    ]
    assert [point.values.get("d") for point in found] == 2 * [None, None, 6]
    assert list(Variation().points()) == [("", {})]


def test_a_file_may_hold_several_designs(tmp_path: Path) -> None:
    file = tmp_path / "designs.yaml"
    file.write_text(json.dumps({"one": BASE, "other": {**BASE, "points": [{"with": {}}]}}))
    assert len(Design[Variation].read(file, "other").points) == 1
    with pytest.raises(InputError, match="no such design") as caught:
        Design[Variation].read(file, "onee")
    assert "did you mean 'one'" in str(caught.value)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"reference": {"vary": {"step": [0.1, 0.2]}}}, "a single point"),
        ({"points": [{"wit": {}}]}, "unknown key"),
        ({"base": None}, "block of fields"),
    ],
)
def test_what_a_design_cannot_say(tmp_path: Path, change: dict[str, object], words: str) -> None:
    file = tmp_path / "design.yaml"
    file.write_text(yaml.safe_dump({**BASE, **change}))
    with pytest.raises(InputError, match=words):
        Design[Variation].read(file)
