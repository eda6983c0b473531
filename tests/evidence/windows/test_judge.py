"""Studies with a tolerance are judged by plain runs of the same scene."""

import math

import pandas as pd
import pytest
from scene_runs import made_run

from dragchain.quantities.document import EXTRAPOLATED, MEASURED_FILE, Extrapolated, Need, Reached
from dragchain.statistics.estimate import Estimate
from dragdeck.project import Project
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.study.fidelity import Tolerance
from evidence.__main__ import main


@pytest.fixture
def kinds(inside: Project) -> Project:
    assert main(["write-kinds"]) == 0
    return inside


@pytest.mark.parametrize("kind", ["circle", "carousel", "clumps", "waypoints", "submerged"])
def test_each_kind_can_be_run_with_a_tolerance_and_plain(kinds: Project, kind: str) -> None:
    (asked,) = kinds.cases(f"kind-{kind}")
    assert isinstance(asked.requested, Tolerance)
    assert asked.study.chosen_fidelity().windows is not None, "the whole drag costs less"
    plain = kinds.cases(f"kind-{kind}-plain")
    assert {case.study.chosen_fidelity().youngs_modulus_scale for case in plain} == {1.0}
    assert asked.study.seed not in {case.study.seed for case in plain} and len(plain) == 2
    scene = {"fidelity", "seed"}
    assert asked.study.model_dump(exclude=scene) == plain[0].study.model_dump(exclude=scene)


@pytest.mark.parametrize("of_windows", [True, False])
@pytest.mark.parametrize(("value", "reached", "covered"), [(-2.1, True, True), (-3.0, True, False)])
def test_errors_are_those_against_the_plain_runs(
    kinds: Project, value: float, reached: bool, covered: bool, of_windows: bool
) -> None:
    (asked,) = kinds.cases("kind-circle")
    asked_for = Reached(tolerance=0.2, asked=("drag_mean",), reached=True, needed=Need(3, 1),
                        runs=("1", "2", "3"))  # fmt: skip
    drag = Estimate.around(value, 0.15 * abs(value))
    folder = kinds.run_folder(asked, PROCESS)
    (folder / EXTRAPOLATED).parent.mkdir(parents=True)
    values = {"drag_mean": drag}
    result = Extrapolated(values=values if of_windows else {}, tolerance=asked_for)
    result.write(folder / EXTRAPOLATED)
    process_scene(asked).case.write(folder / "case.json")
    run = made_run(0, 1.0, 7).model_copy(update={"values_of_run": {} if of_windows else values})
    run.write(folder / MEASURED_FILE)
    for seed, case in enumerate(kinds.cases("kind-circle-plain")):
        folder = kinds.run_folder(case, PROCESS)
        (folder / MEASURED_FILE).parent.mkdir(parents=True)
        made_run(0, 1.0, seed).write(folder / MEASURED_FILE)
    assert main(["judge-windows", "kinds.csv", "kind-circle"]) == 0
    (row,) = pd.read_csv("kinds.csv").to_dict("records")
    assert row["reference"] == pytest.approx(-2.0, rel=0.03)
    assert row["error"] == pytest.approx(value / row["reference"] - 1, abs=1e-4)
    assert (row["reached"], row["covered"], row["windows"]) == (reached, covered, 3)
    assert 0 < row["reference_error"] < 0.03 and math.isclose(row["half_width"], 0.15)
    assert row["estimate"] == pytest.approx(-2.0, rel=0.2) and row["estimate_covered"]
    of_drag, of_all = pd.read_csv("kinds_summary.csv").to_dict("records")
    assert (of_drag["promises"], of_drag["kept"], of_drag["covered"]) == (1, covered, covered)
    assert of_all["largest"] == pytest.approx(abs(row["error"]) / 0.2, rel=1e-3)
    assert 0.0 < of_all["by_chance"] < 0.05
