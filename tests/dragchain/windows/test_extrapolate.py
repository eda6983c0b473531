"""The quantities of a run as it is, and at the physical Young's modulus from its windows."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from figure_files import case_json
from paths import WINDOWS_RECORD
from report_files import ASKED

from dragchain.quantities.along import PathQuantities
from dragchain.quantities.document import (
    EXTRAPOLATED,
    Extrapolated,
    ExtrapolatedQuantity,
    Need,
    Reached,
)
from dragchain.statistics.estimate import Estimate
from dragchain.windows import extrapolate
from dragchain.windows.estimate import Round, WindowOfRun
from dragchain.windows.extrapolate import extrapolate_run


@pytest.fixture
def contacts(monkeypatch: pytest.MonkeyPatch) -> Callable[..., Extrapolated]:
    """What is found of a run whose blocks have these numbers of contacts."""

    def found(folder: Path, blocks: tuple[float, ...], scale: float, **asked: Any) -> Extrapolated:
        along = PathQuantities(arc_m=0.1, block_m=0.01, blocks={"workpiece_contacts": blocks})
        monkeypatch.setattr(extrapolate, "quantities_along", lambda *_: along)
        case = case_json("process")
        case["fidelity"]["youngs_modulus_scale"] = scale
        case |= {"asked": {**ASKED, **asked}} if asked else {}
        (folder / "case.json").write_text(json.dumps(case))
        extrapolate_run(folder, WINDOWS_RECORD)
        return Extrapolated.read(folder / EXTRAPOLATED)

    return found


STEADY = (30.0, 31.0, 29.0, 30.5, 29.5, 30.0, 31.0, 29.0, 30.0)
UNEVEN = (30.0, 40.0, 20.0, 35.0, 25.0, 30.0, 40.0, 20.0, 30.0)


@pytest.mark.parametrize("scale", [0.01, 1.0])
def test_a_run_without_windows_is_measured_and_not_corrected(
    contacts: Callable[..., Extrapolated], tmp_path: Path, scale: float
) -> None:
    (one,) = contacts(tmp_path, STEADY, scale).quantities
    assert one.measured.value == pytest.approx(30.0)
    assert one.measured.ci95_low < 29.8 < 30.2 < one.measured.ci95_high
    assert one.value == (one.measured if scale == 1.0 else None)


@pytest.mark.parametrize(
    ("tolerance", "more", "reached"),
    [(0.1, [], False), (0.5, [], True), (0.5, ["drag_mean"], False)],  # no drag is known
)
def test_a_stiff_run_says_whether_it_is_inside_the_tolerance(
    contacts: Callable[..., Extrapolated],
    tmp_path: Path,
    tolerance: float,
    more: list[str],
    reached: bool,
) -> None:
    quantities = ["workpiece_contacts", *more]
    found = contacts(tmp_path, UNEVEN, 1.0, tolerance=tolerance, quantities=quantities)
    assert found.tolerance is not None and found.tolerance.reached == reached
    assert ("does not give" in found.said) == (not reached)
    if not more:
        assert (found.tolerance.needed.packings > 1) == (not reached)


def test_a_tolerance_of_the_restitution_says_nothing_of_the_process(
    contacts: Callable[..., Extrapolated], tmp_path: Path
) -> None:
    asked = {"quantities": ["restitution"], "error": 0.1}
    assert contacts(tmp_path, STEADY, 0.01, **asked).tolerance is None


def test_windows_give_the_values_they_have_and_say_which_they_are(tmp_path: Path) -> None:
    (tmp_path / "tables").mkdir()
    one, none = Estimate(1.8, 1.62, 1.98), Estimate(math.nan, math.nan, math.nan)
    drag, peaks = (
        ExtrapolatedQuantity(name=name, label=name, unit="N", measured=none, value=value)
        for name, value in (("drag", one), ("peaks", None))
    )
    asked = Reached(
        tolerance=0.05, asked=("drag",), reached=False, needed=Need(8, 2), runs=("w-1", "w-2"),
        refused={"w-3": "a particle was lost"},
    )  # fmt: skip
    windows = tuple(WindowOfRun(run=f"w-{n}", cpu_time_s=9.0) for n in (1, 2, 3))
    Round(tolerance=asked, wanted=3, last=True, windows=windows, quantities=(drag, peaks)).write(
        tmp_path / "round-1.json"
    )
    extrapolate_run(tmp_path, WINDOWS_RECORD, tmp_path / "round-1.json")
    found = Extrapolated.read(tmp_path / EXTRAPOLATED)
    assert [each.value for each in found.quantities] == [one, None]
    assert found.tolerance == asked
    assert "windows" not in json.loads((tmp_path / EXTRAPOLATED).read_text())
    assert found.said == (
        "2 windows at the physical Young's modulus do not give the drag to within 5 %: "
        "about 2 seeds would."
    )
