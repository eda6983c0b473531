"""What could stand for a machine, before anything is run."""

from collections.abc import Sequence
from typing import Any

import pytest
from made_study import Made
from made_tradeoff import made_tradeoff

from dragdeck.advice.smaller_scenes import smaller_scenes
from dragdeck.records.advice import WayEntry

RING: dict[str, Any] = {
    "media": {"material": "ceramic", "radius_mean_m": 2e-3, "radius_std_m": 0.0,
              "fill_height_m": 0.06, "count": None},
    "bowl": {"kind": "annulus", "material": "steel", "radius_m": 0.2, "core_radius_m": 0.05,
             "height_m": 0.12},
    "workpiece.shape": {"kind": "cylinder", "radius_m": 3e-3, "facet_size_m": 1e-3},
    "motion": {"path": {"kind": "circle", "radius_m": 0.12, "revolutions": 1}, "speed_m_s": 0.5,
               "immersion_depth_m": 0.03, "transient_m": 0.05, "plunge_at_m": [0.12, 0]},
}  # fmt: skip


@pytest.fixture
def scenes(made: Made) -> Any:
    """The scenes of the ring, with these fields changed, for these quantities."""

    def only(quantities: Sequence[str] = ("drag_mean",), **changes: Any) -> list[WayEntry]:
        return smaller_scenes(made({**RING, **changes}), quantities, made_tradeoff())

    return only


def test_smaller_scenes_cost_less_and_say_less(scenes: Any) -> None:
    larger_cut, cut, larger, machine = scenes()
    assert machine.relative_cost == 1 and machine.name.startswith("machine: ")
    assert cut.half_width > machine.half_width
    assert larger.half_width > 3 * machine.half_width
    assert larger_cut.half_width > cut.half_width
    costs = [way.relative_cost for way in (larger_cut, cut, larger, machine)]
    assert costs == sorted(costs)


def test_a_study_that_has_a_smaller_scene_is_told_the_same(scenes: Any) -> None:
    assert scenes(reduction={"cut_out": True}) == scenes()


def test_quantities_without_a_rule_are_not_extrapolated(scenes: Any) -> None:
    cut, machine = scenes(quantities=("coordination_number",))
    assert "larger" not in cut.name and machine.relative_cost == 1
    (_, unknown) = scenes(quantities=("drag_peak",))
    assert unknown.half_width is None


def test_nothing_stands_for_a_narrow_bowl(scenes: Any) -> None:
    """Its circle is too narrow for a line, and its gap too narrow for larger particles."""
    path = {"kind": "circle", "radius_m": 0.012, "revolutions": 1}
    narrow = {"kind": "cylinder", "material": "steel", "radius_m": 0.025, "height_m": 0.12}
    assert scenes(bowl=narrow, motion={**RING["motion"], "path": path, "plunge_at_m": None}) == []
