"""Rounds of windows: when they stop, how many more they ask for, what they refuse."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from dragchain.quantities.document import Extrapolated, PathQuantities, RunQuantities
from dragchain.statistics.estimate import Estimate
from dragchain.windows.estimate import Round, WindowOfRun
from dragchain.windows.rounds import Asked, judged, unsettled, with_drag
from dragdeck.records.windows import Known, WindowsRecord

CONTACTS = Known(
    per_softness=0.0, per_softness_std=math.inf, scenes=0, covered=0.0, slope=0.0, slope_std=0.0,
    variance_ratio=1.2, degrees=10.0, packing_std=0.03, correlation=0.2, block_std=0.07,
    front_power=0.0,
)  # fmt: skip
RECORD = WindowsRecord(measured="", source="", quantities={"workpiece_contacts": CONTACTS})
SOFT = PathQuantities(
    arc_m=0.1, block_m=0.01, blocks={"workpiece_contacts": (19.0, 20.0, 21.0, 20.0) * 3}
)


def windows(values: Sequence[float]) -> list[WindowOfRun]:
    """Windows with these numbers of contacts."""
    return [
        WindowOfRun(
            run=f"w-{number}", values={"workpiece_contacts": value}, arc_m=0.01, cpu_time_s=1.0
        )
        for number, value in enumerate(values)
    ]


def judge(values: Sequence[float], tolerance: float, most: int = 16) -> Round:
    return judged(SOFT, windows(values), asked(tolerance, most), RECORD)


def asked(
    tolerance: float, most: int = 16, lengths: float = 99.0,
    quantities: tuple[str, ...] = ("workpiece_contacts",),
) -> Asked:  # fmt: skip
    """What is asked for; the whole drag is dearer than all windows by default."""
    return Asked(tolerance, quantities, most, lengths)


@pytest.mark.parametrize(
    ("tolerance", "lengths", "whole"),
    [(0.08, 99.0, False), (0.08, 2.0, True), (0.3, 2.0, False), (0.001, 2.0, False)],
    ids=["windows are cheaper", "they are not", "few are enough", "nothing is"],
)
def test_the_soft_run_decides_whether_windows_are_run(
    tolerance: float, lengths: float, whole: bool
) -> None:
    first = judged(SOFT, [], asked(tolerance, lengths=lengths), RECORD)
    assert (first.whole, first.wanted) == ((True, 0) if whole else (False, 3))
    assert not first.last and not first.values and not first.tolerance.reached


def test_windows_follow_a_whole_drag_that_failed(small_run: RunQuantities) -> None:
    before = judged(SOFT, [], asked(0.08, lengths=2.0), RECORD)
    failed = small_run.model_copy(update={"complete": False})
    after = with_drag(before, failed, asked(0.08))
    assert (after.whole, after.last, after.wanted) == (False, False, 3)
    assert small_run.run in after.tolerance.refused


def test_it_stops_when_the_tolerance_is_reached() -> None:
    found = judge([15.0, 15.5, 14.5], 0.2)
    assert found.tolerance.reached and found.last and found.wanted == 3
    contacts = found.values["workpiece_contacts"]
    assert contacts.contains(15.0) and contacts.relative_half_width <= 0.2


def test_a_round_asks_for_the_windows_that_would_do_but_at_most_twice_as_many() -> None:
    close, far = judge([15.0, 16.5, 13.5], 0.085), judge([15.0, 19.0, 11.0], 0.1)
    assert not close.tolerance.reached and not close.last
    assert 3 < close.wanted == close.tolerance.needed.windows <= 6
    assert far.wanted == 6 < far.tolerance.needed.windows


def test_the_last_window_is_the_last() -> None:
    found = judge([15.0, 19.0, 11.0], 0.01, most=3)
    assert found.last and not found.tolerance.reached
    assert found.wanted == 3 and found.tolerance.needed.packings > 1


def test_each_of_several_packings_may_be_further_off_than_their_mean() -> None:
    values = [15.0, 16.5, 13.5]
    alone = judge(values, 0.08)
    of_four = judged(SOFT, windows(values), replace(asked(0.08), packings=4), RECORD)
    assert not alone.tolerance.reached and of_four.tolerance.reached
    assert alone.values == of_four.values
    assert (of_four.tolerance.tolerance, of_four.tolerance.packings) == (0.08, 4)
    said = Extrapolated(tolerance=of_four.tolerance).said
    assert "to within 16 % in this packing, which makes 8 % for the mean over 4 packings" in said


@pytest.mark.parametrize(("lengths", "whole"), [(0.5, True), (99.0, False)])
def test_the_whole_drag_goes_on_where_it_is_cheaper(lengths: float, whole: bool) -> None:
    next_round = judged(SOFT, windows([15.0, 16.5, 13.5]), asked(0.085, lengths=lengths), RECORD)
    assert (next_round.whole, next_round.last) == (whole, False)
    assert (next_round.wanted == 3) == whole


def test_the_whole_drag_goes_on_where_no_window_is_left() -> None:
    ended = judged(SOFT, windows([15.0, 17.5, 12.5]), asked(0.085, most=3), RECORD)
    assert ended.whole and not ended.last


def test_what_nothing_can_reach_is_said_after_the_round_that_shows_it() -> None:
    ended = judge([15.0, 19.0, 11.0], 0.01)
    assert ended.last and not ended.whole and not ended.tolerance.reached
    assert ended.tolerance.needed.packings > 30


def test_the_whole_drag_gives_its_own_values(small_run: RunQuantities) -> None:
    drag = small_run
    before = judged(SOFT, windows([15.0, 16.5, 13.5]), asked(0.085, lengths=0.5), RECORD)
    ended = with_drag(before, drag, asked(0.085))
    assert ended.last and ended.tolerance.whole and ended.tolerance.runs == (drag.run,)
    assert ended.values == drag.values_of_run and ended.tolerance.reached
    failed = drag.model_copy(update={"complete": False})
    kept = with_drag(before, failed, asked(0.085))
    assert kept.last and not kept.tolerance.whole and kept.values == before.values
    assert drag.run in kept.tolerance.refused


@pytest.fixture
def small_run() -> RunQuantities:
    """The whole drag of the scene."""
    contacts = Estimate.around(15.0, 1.0)
    return RunQuantities.model_construct(
        run="whole", complete=True, failure=(), values_of_run={"workpiece_contacts": contacts}
    )


def test_a_refused_window_does_not_enter_and_is_made_up_for() -> None:
    good = windows([15.0, 15.1, 14.9, 15.0])
    bad = good[3].model_copy(update={"refused": "lost", "values": {"workpiece_contacts": 99.0}})
    found = judged(SOFT, [*good[:3], bad], asked(0.068), RECORD)
    assert found.values["workpiece_contacts"].value == pytest.approx(15.0)
    assert found.tolerance.runs == ("w-0", "w-1", "w-2")
    assert found.tolerance.refused == {"w-3": "lost"}
    assert found.wanted == min(8, 4 + max(1, found.tolerance.needed.windows - 3)) > 4


def test_the_whole_drag_is_tried_where_no_window_was_good() -> None:
    bad = [window.model_copy(update={"refused": "lost"}) for window in windows([15.0, 15.1, 14.9])]
    first = judged(SOFT, bad, asked(0.2), RECORD)
    assert first.whole and not first.last and first.wanted == 3


def test_a_quantity_that_a_window_lacks_is_never_reached() -> None:
    some = windows([15.0, 15.0, 15.0])
    some[1] = some[1].model_copy(update={"values": {}})
    found = judged(SOFT, some, asked(0.5, 3), RECORD)
    assert not found.tolerance.reached and not found.values


def test_an_asked_quantity_that_the_run_lacks_is_never_reached() -> None:
    quantities = ("workpiece_contacts", "drag_mean")
    found = judged(SOFT, windows([15.0] * 3), asked(0.5, 3, quantities=quantities), RECORD)
    assert not found.tolerance.reached and found.tolerance.asked == quantities


def test_the_drag_fluctuates_between_windows_as_within_them() -> None:
    blocks = {"drag_mean": (-2.0,) * 12, "drag_std": (2.0, 1.9, 2.1) * 4}
    some = [
        WindowOfRun(
            run=f"w-{mean}", values={"drag_mean": mean, "drag_std": 1.0}, arc_m=0.01, cpu_time_s=1
        )
        for mean in (-1.0, -2.0, -3.0)
    ]
    soft = SOFT.model_copy(update={"blocks": blocks})
    values = judged(soft, some, asked(0.5, 3, quantities=("drag_std",)), RECORD).values
    within, between = 1.0, 1.0
    assert values["drag_std"].value == pytest.approx((within + between) ** 0.5)


@pytest.mark.parametrize(("early", "settled"), [(3.4, True), (0.3, False), (4.5, False)])
def test_a_bed_that_is_still_moving_is_refused(early: float, settled: bool, tmp_path: Path) -> None:
    (tmp_path / "tables").mkdir()
    numbers = np.array([early] * 4 + [3.5] * 8)
    table = pd.DataFrame({"coordination_number": numbers})
    table.to_parquet(tmp_path / "tables" / "network.parquet")
    assert (unsettled(tmp_path) == "") == settled
