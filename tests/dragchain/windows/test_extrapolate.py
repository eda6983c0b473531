"""The quantities of a run as it is, and at the physical Young's modulus from its windows."""

import json
from pathlib import Path

import pytest
from figure_files import case_json

from dragchain.report.extrapolated import FILE, Extrapolated, Need
from dragchain.statistics.estimate import Estimate
from dragchain.tradeoff.measures import PathQuantities
from dragchain.windows import extrapolate
from dragchain.windows.document import Round, WindowedQuantity, WindowOfRun
from dragchain.windows.extrapolate import extrapolate_run


def test_a_run_without_windows_is_measured_and_not_corrected(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "case.json").write_text(json.dumps(case_json("process")))
    along = PathQuantities(arc_m=0.1, block_m=0.01, blocks={"workpiece_contacts": (30.0,) * 10})
    monkeypatch.setattr(extrapolate, "quantities_along", lambda *_: along)
    extrapolate_run(tmp_path)
    found = Extrapolated.read(tmp_path / FILE)
    (contacts,) = found.quantities
    assert (contacts.name, contacts.measured) == ("workpiece_contacts", 30.0)
    assert contacts.estimate is None and found.windows is None


def test_windows_give_the_values_they_have_and_say_which_they_are(tmp_path: Path) -> None:
    (tmp_path / "tables").mkdir()
    refused = WindowOfRun(run="w-3", refused="a particle was lost", cpu_time_s=9.0)
    drag, peaks = (
        WindowedQuantity(
            name=name, label=name, unit="N", asked=asked, soft=2.0, value=value,
            ci95_low=0.9 * value, ci95_high=1.1 * value,
        )
        for name, asked, value in (("drag", True, 1.8), ("peaks", False, float("nan")))
    )  # fmt: skip
    Round(
        tolerance=0.05, wanted=3, last=True, reached=False, needed=Need(8, 2),
        windows=(*(WindowOfRun(run=f"w-{n}", cpu_time_s=9.0) for n in (1, 2)), refused),
        quantities=(drag, peaks),
    ).write(tmp_path / "round-1.json")  # fmt: skip
    extrapolate_run(tmp_path, tmp_path / "round-1.json")
    found = Extrapolated.read(tmp_path / FILE)
    one, other = found.quantities
    assert one.estimate == Estimate(1.8, pytest.approx(1.62), pytest.approx(1.98))
    assert other.estimate is None and other.measured == 2.0
    assert found.windows is not None and found.windows.refused == {"w-3": "a particle was lost"}
    assert found.windows.said == (
        "2 windows at the physical Young's modulus do not give the drag to within 5 %: "
        "about 2 seeds would."
    )
