"""The quantities of a run as it is, and at the physical Young's modulus from its windows."""

import json
import math
from pathlib import Path

import pytest
from figure_files import case_json
from paths import WINDOWS_RECORD
from report_files import ASKED

from dragchain.report.values import EXTRAPOLATED, Extrapolated, Need
from dragchain.statistics.estimate import Estimate
from dragchain.tradeoff.measures import PathQuantities
from dragchain.windows import extrapolate
from dragchain.windows.estimate import Round, WindowedQuantity, WindowOfRun
from dragchain.windows.extrapolate import extrapolate_run


def test_a_run_without_windows_is_measured_and_not_corrected(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocks = (30.0, 31.0, 29.0, 30.5, 29.5, 30.0, 31.0, 29.0, 30.0)
    along = PathQuantities(arc_m=0.1, block_m=0.01, blocks={"workpiece_contacts": blocks})
    monkeypatch.setattr(extrapolate, "quantities_along", lambda *_: along)
    for scale in (0.01, 1.0):
        case = case_json("process")
        case["fidelity"]["youngs_modulus_scale"] = scale
        (tmp_path / "case.json").write_text(json.dumps(case))
        extrapolate_run(tmp_path, WINDOWS_RECORD)
        (contacts,) = Extrapolated.read(tmp_path / EXTRAPOLATED).quantities
        assert contacts.measured.value == pytest.approx(30.0)
        assert contacts.measured.ci95_low < 29.8 < 30.2 < contacts.measured.ci95_high
        assert contacts.value == (contacts.measured if scale == 1.0 else None)


def test_a_stiff_run_says_whether_it_is_inside_the_tolerance(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    blocks = (30.0, 40.0, 20.0, 35.0, 25.0, 30.0, 40.0, 20.0, 30.0)
    along = PathQuantities(arc_m=0.1, block_m=0.01, blocks={"workpiece_contacts": blocks})
    monkeypatch.setattr(extrapolate, "quantities_along", lambda *_: along)
    case = case_json("process")
    case["fidelity"]["youngs_modulus_scale"] = 1.0
    case["asked"] = {
        "tolerance": 0.1, "quantities": ["workpiece_contacts"], "error": None,
        "relative_cost": 0.3, "largest_cost": 0.3, "fallback": None,
    }  # fmt: skip
    for tolerance, reached in ((0.1, False), (0.5, True)):
        case["asked"]["tolerance"] = tolerance
        (tmp_path / "case.json").write_text(json.dumps(case))
        extrapolate_run(tmp_path, WINDOWS_RECORD)
        found = Extrapolated.read(tmp_path / EXTRAPOLATED)
        assert found.tolerance is not None and found.tolerance.reached == reached
        assert (found.tolerance.needed.packings > 1) == (not reached)
        assert ("does not give" in found.said) == (not reached)
    case["asked"]["quantities"] = ["workpiece_contacts", "drag_mean"]
    (tmp_path / "case.json").write_text(json.dumps(case))
    extrapolate_run(tmp_path, WINDOWS_RECORD)
    found = Extrapolated.read(tmp_path / EXTRAPOLATED)
    assert found.tolerance is not None and not found.tolerance.reached  # no drag is known


def test_a_tolerance_of_the_restitution_says_nothing_of_the_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(extrapolate, "quantities_along", lambda *_: PathQuantities())
    case = case_json("process") | {"asked": {**ASKED, "quantities": ["restitution"], "error": 0.1}}
    (tmp_path / "case.json").write_text(json.dumps(case))
    extrapolate_run(tmp_path, WINDOWS_RECORD)
    assert Extrapolated.read(tmp_path / EXTRAPOLATED).tolerance is None


def test_windows_give_the_values_they_have_and_say_which_they_are(tmp_path: Path) -> None:
    (tmp_path / "tables").mkdir()
    refused = WindowOfRun(run="w-3", refused="a particle was lost", cpu_time_s=9.0)
    none = Estimate(math.nan, math.nan, math.nan)
    drag, peaks = (
        WindowedQuantity(name=name, label=name, unit="N", asked=asked, soft=2.0, value=value)
        for name, asked, value in (
            ("drag", True, Estimate(1.8, 1.62, 1.98)), ("peaks", False, none),
        )
    )  # fmt: skip
    Round(
        tolerance=0.05, asked=("drag",), wanted=3, last=True, reached=False, needed=Need(8, 2),
        windows=(*(WindowOfRun(run=f"w-{n}", cpu_time_s=9.0) for n in (1, 2)), refused),
        quantities=(drag, peaks),
    ).write(tmp_path / "round-1.json")  # fmt: skip
    extrapolate_run(tmp_path, WINDOWS_RECORD, tmp_path / "round-1.json")
    found = Extrapolated.read(tmp_path / EXTRAPOLATED)
    one, other = found.quantities
    assert one.value == Estimate(1.8, 1.62, 1.98)
    assert other.value is None and other.measured.value == 2.0
    assert found.tolerance is not None
    assert found.tolerance.refused == {"w-3": "a particle was lost"}
    assert found.said == (
        "2 windows at the physical Young's modulus do not give the drag to within 5 %: "
        "about 2 seeds would."
    )
