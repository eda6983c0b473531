"""The quantities of a run as it is, and at the physical Young's modulus by it or its windows."""

import json
import math
from pathlib import Path
from typing import Any

import pytest
from figure_files import case_json
from paths import ROOT
from report_files import ASKED

from dragchain.report.extrapolated import FILE, Extrapolated, Need
from dragchain.statistics.estimate import Estimate
from dragchain.tradeoff.measures import PathQuantities
from dragchain.windows import extrapolate
from dragchain.windows.document import Round, WindowedQuantity, WindowOfRun
from dragchain.windows.extrapolate import extrapolate_run

RECORD = ROOT / "workflow/dragdeck/data/windows.json"


def alone(folder: Path, patch: pytest.MonkeyPatch, scale: float, **more: Any) -> Extrapolated:
    """A run without windows that has 30 contacts, within 2 from block to block."""
    case = case_json("process") | more
    case["fidelity"] |= {"youngs_modulus_scale": scale}
    (folder / "case.json").write_text(json.dumps(case))
    blocks = {"workpiece_contacts": (28.0, 32.0) * 16}
    along = PathQuantities(arc_m=0.32, block_m=0.01, blocks=blocks)
    patch.setattr(extrapolate, "quantities_along", lambda *_: along)
    extrapolate_run(folder, RECORD)
    return Extrapolated.read(folder / FILE)


@pytest.mark.parametrize("scale", [1.0, 0.01])
def test_only_the_physical_modulus_gives_values_without_windows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, scale: float
) -> None:
    found = alone(tmp_path, monkeypatch, scale)
    (contacts,) = found.quantities
    assert contacts.measured.value == 30.0 and contacts.measured.known
    assert contacts.value == (contacts.measured if scale == 1.0 else None)
    assert found.tolerance is None and found.said == ""


@pytest.mark.parametrize(("tolerance", "reached"), [(0.5, True), (0.001, False)])
def test_a_run_at_the_physical_modulus_says_what_it_reached(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, tolerance: float, reached: bool
) -> None:
    asked = {**ASKED, "quantities": ["workpiece_contacts"], "tolerance": tolerance}
    found = alone(tmp_path, monkeypatch, 1.0, asked=asked)
    assert found.tolerance is not None and found.tolerance.reached == reached
    assert ("does not give the contacts on the workpiece" in found.said) != reached
    if not reached:
        contacts = found.quantities[0].measured
        packings = math.ceil(((contacts.ci95_high - 30.0) / 30.0 / tolerance) ** 2)
        assert f"about {packings} seeds would" in found.said


def test_a_tolerance_of_the_restitution_says_nothing_of_the_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = {**ASKED, "quantities": ["restitution"], "error": 0.004}
    assert alone(tmp_path, monkeypatch, 1.0, asked=asked).tolerance is None


def test_windows_give_the_values_they_have_and_say_which_they_are(tmp_path: Path) -> None:
    (tmp_path / "tables").mkdir()
    refused = WindowOfRun(run="w-3", refused="a particle was lost", cpu_time_s=9.0)
    drag, lateral = (
        WindowedQuantity(name=name, label=name, unit="N", asked=asked, soft=2.0, value=value)
        for name, asked, value in (
            ("drag", True, Estimate.around(1.8, 0.18)),
            ("lateral", False, Estimate(math.nan, math.nan, math.nan)),
        )
    )
    Round(
        tolerance=0.05, wanted=3, last=True, reached=False, needed=Need(8, 2),
        windows=(*(WindowOfRun(run=f"w-{n}", cpu_time_s=9.0) for n in (1, 2)), refused),
        quantities=(drag, lateral),
    ).write(tmp_path / "round-1.json")  # fmt: skip
    extrapolate_run(tmp_path, RECORD, tmp_path / "round-1.json")
    found = Extrapolated.read(tmp_path / FILE)
    one, other = found.quantities
    assert one.value == drag.value and other.value is None and other.measured.value == 2.0
    assert found.windows == ("w-1", "w-2")
    assert found.tolerance is not None and found.tolerance.refused == {"w-3": "a particle was lost"}
    assert found.said == (
        "2 windows at the physical Young's modulus do not give the drag to within 5 %: "
        "about 2 seeds would."
    )
