"""Whether a run reached its tolerance, and what windows give at the physical Young's modulus."""

import json
from pathlib import Path
from typing import Any

import pytest
from figure_files import case_json
from report_files import ASKED, write_measured

from dragchain.quantities.document import EXTRAPOLATED, Extrapolated, Need, Reached
from dragchain.statistics.estimate import Estimate
from dragchain.windows.estimate import Round, WindowOfRun
from dragchain.windows.extrapolate import extrapolate_run


def said_of(folder: Path, half_width: float, scale: float, **asked: Any) -> Extrapolated:
    """What is said of a run with 30 contacts, give or take so many."""
    case = case_json("process")
    case["fidelity"]["youngs_modulus_scale"] = scale
    case |= {"asked": {**ASKED, **asked}} if asked else {}
    (folder / "case.json").write_text(json.dumps(case))
    write_measured(folder, workpiece_contacts=Estimate.around(30.0, half_width))
    extrapolate_run(folder)
    return Extrapolated.read(folder / EXTRAPOLATED)


@pytest.mark.parametrize(
    ("tolerance", "scale", "more", "reached"),
    [
        (0.1, 1.0, [], False), (0.5, 1.0, [], True), (0.2, 1.0, [], True), (0.5, 0.01, [], False),
        (0.5, 1.0, ["drag_mean"], False),  # no drag is known
    ],
)  # fmt: skip
def test_a_run_says_whether_it_is_inside_the_tolerance(
    tmp_path: Path, tolerance: float, scale: float, more: list[str], reached: bool
) -> None:
    quantities = ["workpiece_contacts", *more]
    said = said_of(tmp_path, 6.0, scale, tolerance=tolerance, quantities=quantities)
    assert said.tolerance is not None and said.tolerance.reached == reached and not said.values
    assert ("does not give" in said.said) == (not reached)
    if not more and scale == 1.0:
        assert said.tolerance.needed == Need(0, 1 if reached else 4)


@pytest.mark.parametrize("asked", [{}, {"quantities": ["restitution"], "error": 0.1}])
def test_a_run_of_which_nothing_is_asked_says_nothing(
    tmp_path: Path, asked: dict[str, Any]
) -> None:
    assert said_of(tmp_path, 6.0, 1.0, **asked).tolerance is None


def test_windows_give_the_values_they_have_and_say_which_they_are(tmp_path: Path) -> None:
    (tmp_path / "tables").mkdir()
    drag = Estimate(-1.8, -1.98, -1.62)
    asked = Reached(
        tolerance=0.05, asked=("drag_mean",), reached=False, needed=Need(8, 2),
        runs=("w-1", "w-2"), refused={"w-3": "a particle was lost"},
    )  # fmt: skip
    windows = tuple(WindowOfRun(run=f"w-{n}", cpu_time_s=9.0) for n in (1, 2, 3))
    last = Round(tolerance=asked, wanted=3, last=True, windows=windows, values={"drag_mean": drag})
    last.write(tmp_path / "round-1.json")
    extrapolate_run(tmp_path, round_file=tmp_path / "round-1.json")
    said = Extrapolated.read(tmp_path / EXTRAPOLATED)
    assert said.values == {"drag_mean": drag} and said.tolerance == asked
    assert "windows" not in json.loads((tmp_path / EXTRAPOLATED).read_text())
    assert said.said == (
        "2 windows at the physical Young's modulus do not give the mean drag to within 5 %: "
        "about 2 seeds would."
    )
