"""The ways to a tolerance: what each is expected to give, and which is taken."""

import math
from dataclasses import replace

import pytest
from made_tradeoff import made_tradeoff
from paths import ROOT

from dragdeck.advice.advise import advised_settings, ways_of
from dragdeck.advice.ways import Ways
from dragdeck.project import Project
from dragdeck.records.windows import Known, WindowsRecord
from dragdeck.scenes.lead import FIRST_WINDOWS
from dragdeck.study.fidelity import Tolerance

KNOWN = Known(
    per_softness=0.1, per_softness_std=0.05, scenes=20, covered=0.95, slope=0.6, slope_std=0.1,
    variance_ratio=0.5, degrees=10.0, packing_std=0.02, correlation=0.1, block_std=0.2,
    front_power=0.0,
)  # fmt: skip


def ways(tolerance: float, quantity: str = "drag_mean", **known: float) -> Ways:
    """The ways of the paper's scene, if other scenes say this of the drag and of nothing else."""
    (case,) = Project(ROOT).cases("uhlmann2015")
    asked = Tolerance(tolerance=tolerance, quantity=quantity)
    of_case = ways_of(case, asked, made_tradeoff())
    assert of_case is not None
    quantities = {"drag_mean": KNOWN.model_copy(update=known)}
    return replace(of_case, record=WindowsRecord(measured="", source="", quantities=quantities))


def test_each_way_has_its_own_sources_of_error() -> None:
    """Blocks of the path scatter in all, windows sample a few, ratios differ between scenes."""
    blocks, sample, packing = 40.0, 2.0, 0.02**2
    soft = math.sqrt(0.2**2 / blocks + (0.05 * 0.5) ** 2 + packing)
    windows = math.sqrt(0.2**2 * (0.5 / (3 * sample) + 0.6**2 / blocks) + packing)
    whole = math.sqrt(0.2**2 * (0.5 + 0.6**2) / blocks + packing)
    assert KNOWN.soft_half_width(blocks, 0.5) == pytest.approx(1.96 * soft)
    assert KNOWN.windows_half_width(3, sample, blocks) == pytest.approx(1.96 * windows)
    assert KNOWN.whole_half_width(blocks) == pytest.approx(1.96 * whole)


def test_a_wider_front_averages_over_more_contacts() -> None:
    wide, narrow = (KNOWN.model_copy(update={"front_power": power}) for power in (1.0, 0.0))
    assert wide.at_front(40.0).block_std == pytest.approx(0.1)
    assert wide.at_front(10.0) == wide
    assert narrow.at_front(40.0) == narrow
    some = ways(0.1, front_power=1.0)
    assert replace(some, front=4 * some.front).whole.half_width < some.whole.half_width


def test_as_many_windows_as_are_expected_to_do() -> None:
    some = ways(0.1)
    enough = some.enough_windows
    assert enough is not None and enough.half_width <= 0.1
    assert enough.windows > FIRST_WINDOWS
    assert some.with_windows(enough.windows - 1).half_width > 0.1
    costs = [way.relative_cost for way in some]
    assert costs[0] < costs[1] < costs[2]
    assert sorted({way.windows for way in some}) == [0, FIRST_WINDOWS, enough.windows, some.most]


@pytest.mark.parametrize(
    ("tolerance", "known", "pay"),
    [
        (0.1, {"block_std": 0.15}, True),
        (0.1, {}, False),  # more windows than the whole drag costs
        (0.05, {}, True),  # nothing will do: windows show it for less
        (0.05, {"packing_std": 0.0, "block_std": 0.05}, True),
    ],
)  # fmt: skip
def test_the_cheapest_way_that_will_do_is_taken(
    tolerance: float, known: dict[str, float], pay: bool
) -> None:
    assert ways(tolerance, **known).windows_pay == pay


def test_of_an_unknown_quantity_nothing_is_expected() -> None:
    some = ways(0.1, "workpiece_contacts")
    assert all(math.isinf(way.half_width) for way in some)
    assert some.windows_pay and some.enough_windows is None


def test_the_option_is_that_of_the_ways(monkeypatch: pytest.MonkeyPatch) -> None:
    (case,) = Project(ROOT).cases("uhlmann2015")
    for pay in (True, False):
        monkeypatch.setattr(Ways, "windows_pay", pay)
        option = advised_settings(case, Tolerance(tolerance=0.1), made_tradeoff()).chosen
        assert (option.fidelity.windows is not None) == pay
        assert (option.fidelity.soft_start is None) == pay
