"""From a tolerance to settings: windows, stiff runs and drop tests."""

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from made_study import Made
from made_tradeoff import cost, made_tradeoff
from paths import ROOT

from dragdeck import commands
from dragdeck.advice.advise import advised_settings, consistent, plain_option, resolve, with_option
from dragdeck.advice.forecast import question
from dragdeck.advice.ways import Work, step_cost
from dragdeck.cases.bed import full_stiffness_number
from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.project import Project
from dragdeck.records.tradeoff import TradeoffRecord, measured_tradeoff
from dragdeck.scenes.drop_test import drop_scene
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.lead import FIRST_WINDOWS, with_leads
from dragdeck.scenes.process import PROCESS, SCENES, process_scene
from dragdeck.study.fidelity import BUILT_IN_FIDELITIES, Tolerance
from dragdeck.sweep.cases import load_cases

Write = Callable[..., Path]

SEVERAL = ["drag_mean", "workpiece_contacts"]


@pytest.fixture
def small(small: dict[str, Any]) -> dict[str, Any]:
    """The small study in a bowl in which no particle jams."""
    small["bowl"]["radius_m"] = 0.028
    return small


@pytest.fixture
def tradeoff() -> TradeoffRecord:
    return made_tradeoff()


@pytest.fixture(scope="module")
def paper() -> Case:
    """A slow drag along a long path."""
    return Project(ROOT).cases("uhlmann2015")[0]


def test_no_tolerance_is_promised_where_particles_may_jam(
    made: Made, tradeoff: TradeoffRecord
) -> None:
    deep = {"motion.immersion_depth_m": 0.028}
    for narrow in ({"bowl.radius_m": 0.025}, deep):
        with pytest.raises(InputError, match="jam") as caught:
            resolve(made(narrow), asked(), tradeoff)
        assert caught.value.field == "fidelity.tolerance"
    resolve(made(deep), asked(0.1, quantity="restitution"), tradeoff)


def asked(tolerance: float = 0.1, **more: Any) -> Tolerance:
    return Tolerance(tolerance=tolerance, **more)


def changed(case: Case, **materials: float) -> Case:
    """The case with other values of its particles' material."""
    name = case.study.media.material
    other = case.study.materials[name].model_copy(update=materials)
    known = {**case.study.materials, name: other}
    return replace(case, study=case.study.model_copy(update={"materials": known}))


def moved(case: Case, **motion: float) -> Case:
    own = case.study.motion.model_copy(update=motion)
    return replace(case, study=case.study.model_copy(update={"motion": own}))


# --- the choice ----------------------------------------------------------------------------------


def test_a_soft_run_with_windows_costs_less_than_the_plain_run(
    paper: Case, tradeoff: TradeoffRecord
) -> None:
    found = advised_settings(paper, asked(0.2, quantity=SEVERAL), tradeoff)
    chosen = found.chosen.fidelity
    assert chosen.youngs_modulus_scale < 0.01 and chosen.soft_start is None
    assert chosen.windows is not None
    assert (chosen.windows.tolerance, chosen.windows.quantities) == (0.2, SEVERAL)
    assert chosen.windows.timestep_fraction > 0.64
    assert found.chosen.relative_cost < found.chosen.largest_cost < 1
    assert found.reference == plain_option(paper)
    assert found.reference.fidelity.youngs_modulus_scale == 1 == found.reference.relative_cost
    assert found.fallback is None and found.chosen.error is None


def test_the_tolerance_changes_when_windows_stop_and_nothing_else(
    paper: Case, tradeoff: TradeoffRecord
) -> None:
    first, second = (advised_settings(paper, asked(one), tradeoff).chosen for one in (0.02, 0.5))
    assert first.relative_cost == second.relative_cost
    one, other = (chosen.fidelity.model_dump() for chosen in (first, second))
    assert (one["windows"].pop("tolerance"), other["windows"].pop("tolerance")) == (0.02, 0.5)
    assert one == other


def test_where_windows_would_take_the_path_the_whole_drag_is_stiff(
    paper: Case, tradeoff: TradeoffRecord
) -> None:
    found = advised_settings(moved(paper, speed_m_s=0.3), asked(), tradeoff).chosen
    assert found.fidelity.windows is None and found.fidelity.youngs_modulus_scale == 1
    start = found.fidelity.soft_start
    assert start is not None and start.youngs_modulus_scale < 0.3
    assert found.relative_cost == found.largest_cost < 1


def test_where_the_material_is_soft_nothing_is_softened(
    paper: Case, tradeoff: TradeoffRecord
) -> None:
    found = advised_settings(changed(paper, youngs_modulus_pa=2e7), asked(), tradeoff).chosen
    assert (found.fidelity.youngs_modulus_scale, found.fidelity.soft_start) == (1, None)
    assert found.fidelity.windows is None


def test_stiffer_and_lighter_particles_are_softened_more(
    paper: Case, tradeoff: TradeoffRecord
) -> None:
    for values in (
        [{"youngs_modulus_pa": one} for one in (20e9, 77e9, 300e9)],
        [{"density_kg_m3": one} for one in (8000, 2656, 1000)],
    ):
        cases = [changed(paper, **one) for one in values]
        chosen = [advised_settings(case, asked(0.2), tradeoff).chosen.fidelity for case in cases]
        scales = [one.youngs_modulus_scale for one in chosen]
        assert all(after < before for before, after in pairwise(scales))
        softened = [
            scale ** (2 / 3) * full_stiffness_number(case.study)
            for scale, case in zip(scales, cases, strict=True)
        ]
        assert softened == pytest.approx([softened[0]] * 3, rel=0.05)


@pytest.mark.parametrize("speed", [0.01, 0.3])
def test_the_work_that_is_compared_is_that_of_the_runs(paper: Case, speed: float) -> None:
    """Steps of lead, process and first windows, where every step costs the same."""
    case = moved(paper, speed_m_s=speed)
    tradeoff = made_tradeoff()
    option = advised_settings(case, asked(), tradeoff).chosen
    runs = with_leads([replace(case, study=with_option(case.study, option))])
    steps = [process_scene(one).steps for one in runs if one.rank_of_window <= FIRST_WINDOWS]
    assert len(steps) == (4 if option.fidelity.windows else 2)
    counted = Work.of(case, tradeoff).steps(option.fidelity, FIRST_WINDOWS)
    assert counted == pytest.approx(sum(steps), rel=0.03)


def test_steps_of_softer_particles_cost_what_was_timed() -> None:
    modulus = "youngs_modulus_scale"
    costs = [
        cost("stiff", parameter=modulus, level=1.0, per_step=0.8),
        cost("soft", parameter=modulus, level=1e-4, per_step=1.6),
        cost("fast", parameter="speed_factor", level=5.0, per_step=3.0),
        cost("plain", per_step=9.0),
    ]
    tradeoff = made_tradeoff(costs=costs)
    assert step_cost(1.0, tradeoff) == pytest.approx(0.8)
    assert step_cost(1e-6, tradeoff) == pytest.approx(1.6)
    assert step_cost(0.01, tradeoff) == pytest.approx((0.8 * 1.6) ** 0.5)
    assert step_cost(0.01, made_tradeoff()) == 1.0


# --- the step stays within the stability limits --------------------------------------------------


def test_strong_damping_shortens_the_steps_of_the_filling(
    small: dict[str, Any], tradeoff: TradeoffRecord, made: Made
) -> None:
    for pair in small["pairs"].values():
        pair["restitution"] = 0.3
    damped = made()
    found = advised_settings(damped, asked(), tradeoff)
    study = damped.study.model_copy(update={"fidelity": BUILT_IN_FIDELITIES["standard"]})
    named = consistent(replace(damped, study=study))
    for fidelity in (found.chosen.fidelity, found.reference.fidelity, named):
        assert fidelity.filling_timestep_fraction == pytest.approx(0.8 * 0.2)


# --- the drop test -------------------------------------------------------------------------------


def test_a_tolerance_about_restitution_sets_the_drop_alone(
    case: Case, tradeoff: TradeoffRecord
) -> None:
    found = resolve(case, asked(0.005, quantity="restitution"), tradeoff)
    assert found.study.drop_test.timestep_fraction == 0.1
    assert found.study.fidelity == BUILT_IN_FIDELITIES["standard"]
    assert found.fidelity_name == "tolerance-0.005-restitution"
    assert found.advised is not None and found.advised.error == 4e-3
    strict = resolve(case, asked(1e-3, quantity="restitution"), tradeoff)
    assert strict.study.drop_test.timestep_fraction == 0.02
    drops = [one.model_copy(update={"restitution_error": 2e-3}) for one in tradeoff.drop_test]
    coarse = tradeoff.model_copy(update={"drop_test": drops})
    beyond = advised_settings(case, asked(1e-3, quantity="restitution"), coarse)
    assert beyond.fallback is not None and beyond.chosen.drop_timestep_fraction == 0.02
    assert "0.2 %" in beyond.fallback


def test_restitution_goes_with_no_quantity_of_the_process(
    case: Case, tradeoff: TradeoffRecord
) -> None:
    with pytest.raises(InputError, match="restitution alone, or quantities of the process"):
        advised_settings(case, asked(quantity=["drag_mean", "restitution"]), tradeoff)


# --- a study that asks ---------------------------------------------------------------------------


@pytest.fixture
def asking(small: dict[str, Any], write_study: Write, tradeoff: TradeoffRecord) -> Case:
    (found,) = load_cases(
        write_study(small | {"fidelity": {"tolerance": 0.05, "quantity": SEVERAL}}),
        resolve=partial(resolve, tradeoff=tradeoff),
    )
    return found


def test_a_study_that_asks_gets_settings_and_remembers(asking: Case) -> None:
    assert asking.requested == asked(0.05, quantity=SEVERAL)
    assert PROCESS.run_id(asking).startswith("tolerance-0.05-")
    said = process_scene(asking).case
    assert said.fidelity.name == asking.fidelity_name
    assert said.asked is not None
    assert (said.asked.tolerance, said.asked.quantities) == (0.05, tuple(SEVERAL))
    assert 0 < said.asked.relative_cost <= said.asked.largest_cost and said.asked.fallback is None
    others = filling_scene(asking).case, drop_scene(asking).case
    assert not any("asked" in json.loads(other.as_text()) for other in others)


def test_the_question_is_part_of_the_process_alone(asking: Case) -> None:
    plain = replace(asking, requested=None, advised=None)
    differing = [name for name, kind in SCENES.items() if kind.digest(plain) != kind.digest(asking)]
    assert differing == ["process"]
    assert PROCESS.content(plain) == PROCESS.content(asking)


def test_tolerances_of_a_sweep_are_resolved_each(
    small: dict[str, Any], write_study: Write, tradeoff: TradeoffRecord
) -> None:
    small["fidelity"] = {"tolerance": 0.05, "quantity": "restitution"}
    small["sweep"] = {"fidelity.tolerance": [0.05, 0.001]}
    found = load_cases(write_study(small), resolve=partial(resolve, tradeoff=tradeoff))
    assert [case.study.drop_test.timestep_fraction for case in found] == [0.1, 0.02]


def test_without_a_measured_tradeoff_there_is_a_remedy(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file") as caught:
        measured_tradeoff(tmp_path / "tradeoff.json")
    assert "name a fidelity instead" in str(caught.value)
    assert "./run tradeoff" in str(caught.value)
    (tmp_path / "old.json").write_text('{"schema": 1}')
    with pytest.raises(InputError, match="another version"):
        measured_tradeoff(tmp_path / "old.json")


def test_the_packages_own_tradeoff_knows_costs_and_drop_tests(case: Case) -> None:
    tradeoff = measured_tradeoff()
    assert tradeoff.cost("modulus_1") and len(tradeoff.drop_test) > 4
    assert advised_settings(case, asked(), tradeoff).chosen.relative_cost > 0


# --- the command ---------------------------------------------------------------------------------


def kept_advice(project: Project, tradeoff: TradeoffRecord) -> Any:
    """What the command keeps of the only case."""
    commands.advise("small", None, None, None, tradeoff=tradeoff)
    (advice,) = json.loads((project.root / "results/small/advice.json").read_text())["cases"]
    return advice


def test_advise_prints_and_keeps_what_it_says(
    case: Case, inside: Project, tradeoff: TradeoffRecord, capsys: pytest.CaptureFixture[str]
) -> None:
    one, said = kept_advice(inside, tradeoff), " ".join(capsys.readouterr().out.split())
    assert "drag_mean within 10 %" in said and "sets no tolerance" in said
    assert [option["role"] for option in one["options"]] == ["advised", "reference"]
    for option in one["options"]:
        assert option["wall_time_s"]["process"] == pytest.approx(
            option["steps"]["process"] / option["steps_per_s"]["process"], rel=1e-3
        )
    assert one["asked"]["relative_cost"] == one["options"][0]["relative_cost"]


def test_the_kept_advice_names_the_run_of_a_study_that_asks(
    asking: Case, inside: Project, tradeoff: TradeoffRecord
) -> None:
    advice = kept_advice(inside, tradeoff)
    assert advice["run"] == PROCESS.run_id(asking)
    assert advice["options"][0]["inputs"] == process_scene(asking).case.study.inputs()


def test_an_advice_that_cannot_be_kept_is_still_shown(
    case: Case, inside: Project, tradeoff: TradeoffRecord, capsys: pytest.CaptureFixture[str]
) -> None:
    (inside.root / "results").write_text("a file where the folder should be")
    commands.advise("small", None, 0.02, None, tradeoff=tradeoff)
    shown = capsys.readouterr()
    assert "drag_mean within 2 %" in shown.out and "not written: " in shown.err


def test_the_command_line_goes_before_the_study(case: Case, asking: Case) -> None:
    assert question(case, None, None) == asked()
    assert question(asking, 0.2, None) == asked(0.2, quantity=SEVERAL)
    assert question(asking, None, "drag_std") == asked(0.05, quantity="drag_std")


@pytest.mark.usefixtures("inside")
@pytest.mark.parametrize(("tolerance", "quantity"), [(2.0, None), (None, "colour")])
def test_a_wrong_question_is_explained(
    case: Case, tradeoff: TradeoffRecord, tolerance: float | None, quantity: str | None
) -> None:
    with pytest.raises(InputError, match="command line: "):
        commands.advise("small", None, tolerance, quantity, tradeoff=tradeoff)
