"""Plans: which points they make of a study."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from paths import ROOT

from dragdeck.errors import InputError
from dragdeck.project import Project
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import PROCESS, SCENES
from dragdeck.study.fidelity import Fidelity
from dragdeck.sweep.cases import load_cases
from dragdeck.sweep.plan import Plan, Points, plan_points

WriteStudy = Callable[[dict[str, Any]], Path]
PLAN: dict[str, Any] = {
    "base": {"fidelity.youngs_modulus_scale": 0.01, "fidelity.timestep_fraction": 0.5},
    "reference": {"vary": {"fidelity.youngs_modulus_scale": [0.1]}, "seeds": 1},
    "seeds": 2,
    "arc": 0.5,
    "points": [
        {"vary": {"fidelity.speed_factor": [1, 2], "fidelity.timestep_fraction": [0.5, 0.8]}},
        {"vary": {}, "seeds": 3, "arc": 2},
    ],
    "drop_test": {"drop_test.timestep_fraction": [0.02, 0.1]},
}


@pytest.fixture
def make(tmp_path: Path, write_study: WriteStudy, small: dict[str, Any]) -> Callable[..., Points]:
    def points(**changes: Any) -> Points:
        file = tmp_path / "plan.yaml"
        file.write_text(yaml.safe_dump({**PLAN, **changes}, sort_keys=False))
        (case,) = load_cases(write_study(small))
        return plan_points(Plan.read(file), file, case, SCENES)

    return points


def fidelities(points: Points) -> list[Fidelity]:
    return [case.study.chosen_fidelity() for case in points.processes]


def test_a_point_whose_path_is_mostly_transient_is_refused(make: Callable[..., Points]) -> None:
    rates = ("workpiece_force_hz", "workpiece_contacts_hz", "network_hz")
    base = PLAN["base"] | {f"outputs.{rate}": 1000 for rate in rates}
    with pytest.raises(InputError, match=r"arc: of the 1\.57 mm .* 0\.571 mm remain"):
        make(arc=0.25, base=base, points=[])


def test_every_combination_is_a_point_once(make: Callable[..., Points]) -> None:
    points = make()
    assert len(points.processes) == 1 + 4 * 2 + 3
    assert len({PROCESS.run_id(case) for case in points.processes}) == 12
    assert fidelities(points)[0].youngs_modulus_scale == 0.1
    asked = {(f.speed_factor, f.timestep_fraction) for f in fidelities(points)[1:9]}
    assert asked == {(1, 0.5), (1, 0.8), (2, 0.5), (2, 0.8)}


def test_a_point_asked_for_twice_is_run_once(make: Callable[..., Points]) -> None:
    once = make(points=[{"vary": {}}])
    twice = make(points=[{"vary": {}}, {"vary": {"fidelity.speed_factor": [1]}}])
    assert len(once.processes) == len(twice.processes) == 3


def test_the_path_is_a_share_of_the_studys(make: Callable[..., Points], small: Any) -> None:
    whole = small["motion"]["path"]["revolutions"]
    paths = [case.study.motion.path.model_dump()["revolutions"] for case in make().processes]
    assert paths == [pytest.approx(0.5 * whole)] * 9 + [pytest.approx(2 * whole)] * 3


def test_beds_are_shared_by_points_that_differ_in_step_or_speed(
    make: Callable[..., Points],
) -> None:
    points = make().processes[1:9]
    assert len({FILLING.run_id(case) for case in points}) == 2
    assert {case.study.seed for case in points} == {points[0].study.seed, points[0].study.seed + 1}


def test_drops_are_named_by_what_they_depend_on(make: Callable[..., Points]) -> None:
    assert len(make().drops) == 2  # 0.02 is what the study asks for already


def test_scenes_change_the_study(make: Callable[..., Points]) -> None:
    points = make(scenes={"deep": {"motion.immersion_depth_m": 0.016}, "as it is": {}}, points=[])
    assert [case.study.motion.immersion_depth_m for case in points.processes] == [0.016, 0.015]


def test_a_scene_may_have_a_path_of_its_own(make: Callable[..., Points]) -> None:
    points = make(scenes={"short": {"motion.path.revolutions": 0.4}}, points=[])
    paths = [case.study.motion.path.model_dump()["revolutions"] for case in points.processes]
    assert paths == [pytest.approx(0.2)]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"points": [{"vary": {"motion.sped_m_s": [1]}}]}, "unknown key"),
        ({"points": [{"vary": {"fidelity.speed_factor": [0.1]}}]}, "at least 1"),
        ({"points": [{"vary": {"title.long": [1]}}]}, "below a single value"),
        ({"seeds": 0}, "at least 1"),
        ({"parameters": {}}, "unknown key"),
    ],
)
def test_what_a_plan_cannot_say(
    make: Callable[..., Points], change: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError, match=words) as caught:
        make(**change)
    assert "plan.yaml" in str(caught.value)


def test_a_scene_may_name_the_seed_to_begin_with(make: Callable[..., Points]) -> None:
    points = make(scenes={"other beds": {"seed": 11}}, points=[{"vary": {}}]).processes
    assert [case.study.seed for case in points] == [11, 11, 12]


@pytest.mark.parametrize("plan", sorted(file.stem for file in (ROOT / "workflow/plans").iterdir()))
def test_shipped_plans_fit_the_study_that_they_were_made_for(plan: str) -> None:
    assert Project(ROOT).points("uhlmann2015", plan).processes
