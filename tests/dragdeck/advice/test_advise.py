"""From a tolerance to settings, on a trade-off with made-up numbers."""

import copy
import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made_tradeoff import error, made_tradeoff, setting, with_settings
from paths import ROOT

from dragdeck import commands
from dragdeck.advice.advise import advise, resolve
from dragdeck.advice.forecast import question, remarks
from dragdeck.advice.options import consistent, with_option
from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.outlook import timestep as stability
from dragdeck.outlook.measured import MeasuredSetting, Prediction, Tradeoff, measured_tradeoff
from dragdeck.project import Project
from dragdeck.scenes.dimensionless import describe
from dragdeck.scenes.drop_test import drop_scene
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.scenes.registry import SCENES
from dragdeck.study.model import BUILT_IN_FIDELITIES, Fidelity, Tolerance
from dragdeck.sweep.cases import load_cases

Write = Callable[..., Path]


@pytest.fixture
def tradeoff(case: Case) -> Tradeoff:
    return made_tradeoff(case)


def asked(tolerance: float, **more: Any) -> Tolerance:
    return Tolerance(tolerance=tolerance, **more)


def changed(small: dict[str, Any], write_study: Write, field: str, value: Any) -> Case:
    data = copy.deepcopy(small)
    *parents, last = field.split(".")
    place = data
    for name in parents:
        place = place[name]
    place[last] = value
    (found,) = load_cases(write_study(data))
    return found


def level(fidelity: Fidelity) -> tuple[float, float, float]:
    return fidelity.youngs_modulus_scale, fidelity.timestep_fraction, fidelity.speed_factor


# --- the choice ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("tolerance", "chosen"),
    [
        (0.2, (1e-3, 0.6, 1.0)), (0.13, (1e-3, 0.6, 1.0)), (0.1, (1e-2, 0.5, 4.0)),
        (0.05, (1e-2, 0.5, 1.0)), (0.03, (0.1, 0.5, 1.0)), (0.01, (1.0, 0.2, 1.0)),
    ],
)  # fmt: skip
def test_the_cheapest_that_holds_is_chosen_at_exactly_its_level(
    case: Case, tradeoff: Tradeoff, tolerance: float, chosen: tuple[float, float, float]
) -> None:
    found = advise(case, asked(tolerance), tradeoff)
    assert level(found.chosen.fidelity) == chosen
    assert found.outside == []
    assert (found.fallback is None) == (tolerance > 0.02)


ROWS = st.lists(
    st.builds(
        setting,
        st.sampled_from([1e-3, 1e-2, 0.1, 1.0]),
        st.sampled_from([0.1, 0.2, 0.5, 0.64, 0.8]),
        st.sampled_from([1.0, 2.0, 10.0]),
        st.floats(1e-3, 2.0),
        st.one_of(st.none(), st.floats(1e-3, 0.5)),
        runs=st.integers(1, 4),
        failed=st.integers(0, 1),
    ),
    max_size=12,
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(ROWS, st.floats(1e-3, 0.6), st.floats(1e-3, 0.6), st.floats(0.2, 5.0))
def test_no_setting_beyond_its_tolerance_and_less_accuracy_is_never_dearer(
    case: Case,
    tradeoff: Tradeoff,
    rows: list[MeasuredSetting],
    one: float,
    other: float,
    stiffer: float,
) -> None:
    there = tradeoff.scene
    elsewhere = {**there, "stiffness_number": there["stiffness_number"] / stiffer}
    made = tradeoff.model_copy(update={"settings": rows, "scene": elsewhere})
    tight, loose = sorted((one, other))
    strict, easy = (advise(case, asked(tolerance), made) for tolerance in (tight, loose))
    assert easy.chosen.relative_cost <= strict.chosen.relative_cost <= 1
    believed = [
        row.errors["drag_mean"].bound
        for row in rows
        if row.errors and not row.failed and row.runs >= 2 and row.timestep_fraction <= 0.64
    ]
    for found in (strict, easy):
        if found.fallback is None:
            assert found.chosen.error is not None
            assert found.chosen.error.bound <= found.held_to <= found.asked.tolerance
            assert found.chosen.error.bound in believed
        else:
            assert found.chosen == found.reference
        if found.cheaper is not None and found.cheaper.error is not None:
            assert found.cheaper.error.bound > found.held_to


@pytest.mark.parametrize(
    "row",
    [
        setting(1e-3, 0.6, 1.0, 0.001, 0.001, failed=1),
        setting(1e-3, 0.6, 1.0, 0.001, 0.001, runs=1),
        setting(1e-3, 0.6, 1.0, 0.001, None),
        setting(1e-3, 0.65, 1.0, 0.001, 0.001),
        setting(1.0, 0.1, 1.0, 2.0, 0.001),
    ],
    ids=["failed", "one run", "no error", "unstable step", "dearer than the reference"],
)
def test_what_is_not_believed_is_not_chosen(
    case: Case, tradeoff: Tradeoff, row: MeasuredSetting
) -> None:
    found = advise(case, asked(0.05), with_settings(tradeoff, row))
    assert level(found.chosen.fidelity) == (1e-2, 0.5, 1.0)


def test_neighbours_of_the_choice(case: Case, tradeoff: Tradeoff) -> None:
    found = advise(case, asked(0.05), tradeoff)
    assert found.cheaper and level(found.cheaper.fidelity) == (1e-2, 0.5, 4.0)
    assert found.dearer and level(found.dearer.fidelity) == (0.1, 0.5, 1.0)
    assert 15 < found.speedup < 25  # the filling takes a part of what the process saves
    said = dict(remarks(found, case.study))
    assert "error up to 8 %, 3 % above the limit" in said["cheaper"]


def test_a_tolerance_beyond_all_falls_back_and_says_what_is_known(
    case: Case, tradeoff: Tradeoff
) -> None:
    found = advise(case, asked(0.01), tradeoff)
    assert level(found.chosen.fidelity) == (1.0, 0.2, 1.0)
    assert found.chosen.error is None and found.dearer is None
    assert found.fallback is not None
    assert "smallest upper bound: 2 %" in found.fallback
    assert "standard error of 2 %" in found.fallback


# --- the step stays within the stability limits --------------------------------------------------


def test_strong_damping_shortens_the_steps(
    small: dict[str, Any], write_study: Write, tradeoff: Tradeoff, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = stability.stability_map()
    drag = known.regimes["drag"].model_copy(update={"safe_fraction": 0.4})
    shorter = known.model_copy(update={"regimes": {**known.regimes, "drag": drag}})
    monkeypatch.setattr(stability, "stability_map", lambda: shorter)
    for pair in small["pairs"].values():
        pair["restitution"] = 0.3
    (damped,) = load_cases(write_study(small))
    elsewhere = advise(damped, asked(0.3), tradeoff)
    assert [number.field for number in elsewhere.outside] == ["lowest restitution"]
    for fidelity in (
        elsewhere.chosen.fidelity,
        consistent(damped, BUILT_IN_FIDELITIES["standard"]),
    ):
        assert fidelity.timestep_fraction <= 0.8 * 0.4 * (1 + 1e-9)
        assert fidelity.filling_timestep_fraction == pytest.approx(0.8 * 0.2)
    assert fidelity.timestep_fraction == pytest.approx(0.8 * 0.4)


def test_the_advised_step_is_what_check_calls_safe(case: Case, tradeoff: Tradeoff) -> None:
    found = resolve(case, asked(0.2), tradeoff)
    scene = process_scene(found)
    said = dict(stability.notes(found, PROCESS, scene))
    assert "within" in said["safe step"]


# --- other scenes --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("motion.immersion_depth_m", 0.012, "ratio of depth to particle diameter"),
        ("bowl.radius_m", 0.03, "ratio of bowl to particle diameter"),
        ("workpiece.shape.radius_m", 0.005, "ratio of workpiece to particle diameter"),
        ("pairs.ceramic-ceramic.friction", 0.6, "friction of particle on particle"),
        ("pairs.ceramic-steel.friction", 0.2, "friction of particle on workpiece"),
    ],
)
def test_outside_of_the_measured_range_a_raw_value_is_never_promised(
    small: dict[str, Any],
    write_study: Write,
    tradeoff: Tradeoff,
    field: str,
    value: float,
    words: str,
) -> None:
    other = changed(small, write_study, field, value)
    full = setting(1.0, 0.64, 1.0, 0.3, 0.03)
    for tolerance, fraction in ((0.05, 0.2), (0.06, 0.64), (0.9, 0.64)):
        found = advise(other, asked(tolerance), with_settings(tradeoff, full))
        assert level(found.chosen.fidelity) == (1.0, fraction, 1.0)
        assert [number.field for number in found.outside] == [words]
        assert found.held_to == 0.5 * tolerance
    said = dict(remarks(found, other.study))
    assert "is outside the range" in said["outside"] and "assumption" in said["safe side"]


def test_a_checked_scene_widens_the_range_if_it_was_met(
    small: dict[str, Any], write_study: Write, tradeoff: Tradeoff
) -> None:
    other = changed(small, write_study, "bowl.radius_m", 0.03)
    for met, outside in ((True, 0), (False, 1)):
        promise = Prediction(numbers=describe(other), met=met)
        made = tradeoff.model_copy(update={"promises": [promise]})
        assert len(advise(other, asked(0.05), made).outside) == outside


def test_softer_particles_need_a_larger_scale_and_denser_ones_too(
    small: dict[str, Any], write_study: Write, tradeoff: Tradeoff
) -> None:
    for field, values in (
        ("materials.ceramic.youngs_modulus_pa", [300e9, 77e9, 40e9, 20e9, 5e9]),
        ("materials.ceramic.density_kg_m3", [1000, 2656, 5000, 10000, 20000]),
    ):
        scales = [
            advise(changed(small, write_study, field, value), asked(0.05), tradeoff)
            .chosen.fidelity.youngs_modulus_scale
            for value in values
        ]  # fmt: skip
        assert scales == sorted(scales) and scales[1] == 0.01 and scales[0] < 0.01 < scales[-1]


def test_numbers_beyond_all_measured_ones_are_said(
    small: dict[str, Any], write_study: Write, tradeoff: Tradeoff
) -> None:
    small["motion"]["speed_m_s"] = 0.2
    small["materials"]["ceramic"]["youngs_modulus_pa"] = 2e7
    small["outputs"] = {"network_hz": 40}
    (other,) = load_cases(write_study(small | {"fidelity": "full"}))
    fields = [number.field for number in advise(other, asked(0.05), tradeoff).outside]
    assert fields == ["stiffness number at full modulus", "inertial number at the study's speed"]


@pytest.mark.parametrize("quantity", ["drag_mean", "workpiece_contacts"])
@pytest.mark.parametrize("tolerance", [0.1, 0.2])
def test_a_small_change_of_depth_does_not_change_the_cost_tenfold(
    quantity: str, tolerance: float
) -> None:
    """From inside the range of the trade-off to far outside, in steps of 1 %."""
    tradeoff = measured_tradeoff().model_copy(update={"promises": []})
    (case, *_) = Project(ROOT).cases("uhlmann2015")
    found = []
    for step in range(12):
        depth = case.study.motion.immersion_depth_m * 1.01**step
        motion = case.study.motion.model_copy(update={"immersion_depth_m": depth})
        deeper = replace(case, study=case.study.model_copy(update={"motion": motion}))
        found.append(advise(deeper, asked(tolerance, quantity=quantity), tradeoff))
    assert found[-1].outside
    costs = [one.chosen.relative_cost for one in found]
    assert all(0.1 < one / other < 10 for one, other in pairwise(costs))
    last = found[-1].chosen
    assert last.extrapolated or last.fidelity.youngs_modulus_scale == 1


def test_cheaper_settings_never_take_more_work(case: Case, tradeoff: Tradeoff) -> None:
    """The filling counts: a soft process with a stiff, slow filling is not cheap."""
    found = advise(case, asked(0.05), with_settings(tradeoff, setting(0.1, 0.5, 20.0, 2.0, 0.01)))
    rows = [one for one in (found.cheaper, found.chosen, found.dearer, found.reference) if one]
    steps = []
    for one in rows:
        other = replace(case, study=with_option(case.study, one))
        filling, process = filling_scene(other), process_scene(other)
        steps.append(7 * filling.steps / 10 + process.steps)
    assert steps == sorted(steps)


# --- chance --------------------------------------------------------------------------------------


def test_chance_of_one_run_falls_with_the_root_of_its_path(case: Case, tradeoff: Tradeoff) -> None:
    found = advise(case, asked(0.2), tradeoff).spread
    assert found is not None
    assert found.counted_m == pytest.approx(2 * 3.141592653589793 * 0.010 * 0.1 - 0.001)
    assert found.half_width == pytest.approx(1.96 * 0.04 * (0.05 / found.counted_m) ** 0.5)
    own = tradeoff.quantities["drag_mean"].model_copy(update={"arc_m": found.counted_m})
    longer = tradeoff.model_copy(update={"quantities": {"drag_mean": own}})
    same = advise(case, asked(1.96 * 0.04), longer).spread
    assert same is not None and same.needed_m == pytest.approx(same.counted_m)


def test_too_much_chance_is_said_with_what_would_help(case: Case, tradeoff: Tradeoff) -> None:
    found = advise(case, asked(0.05), tradeoff)
    assert found.spread is not None and found.spread.half_width > 0.05
    said = dict(remarks(found, case.study))["scatter"]
    needed = 0.05 * (1.96 * 0.04 / 0.05) ** 2
    assert f"{(needed + 0.001) / (2 * 3.14159265 * 0.010):.3g} revolutions" in said
    assert f"the mean of {-(-needed // found.spread.counted_m):.0f} seeds" in said


# --- the drop test -------------------------------------------------------------------------------


def test_a_tolerance_about_restitution_sets_the_drop_alone(case: Case, tradeoff: Tradeoff) -> None:
    found = resolve(case, asked(0.005, quantity="restitution"), tradeoff)
    assert found.study.drop_test.timestep_fraction == 0.1
    assert found.study.fidelity == BUILT_IN_FIDELITIES["standard"]
    assert found.fidelity_name == "tolerance-0.005-restitution"
    strict = resolve(case, asked(1e-3, quantity="restitution"), tradeoff)
    assert strict.study.drop_test.timestep_fraction == 0.02
    drops = [one.model_copy(update={"restitution_error": 2e-3}) for one in tradeoff.drop_test]
    coarse = tradeoff.model_copy(update={"drop_test": drops})
    beyond = advise(case, asked(1e-3, quantity="restitution"), coarse)
    assert beyond.fallback is not None and beyond.chosen.drop_timestep_fraction == 0.02


# --- a study that asks ---------------------------------------------------------------------------


@pytest.fixture
def asking(small: dict[str, Any], write_study: Write, tradeoff: Tradeoff) -> Case:
    (found,) = load_cases(
        write_study(small | {"fidelity": {"tolerance": 0.05}}),
        resolve=partial(resolve, tradeoff=tradeoff),
    )
    return found


def test_a_study_that_asks_gets_settings_and_remembers(asking: Case) -> None:
    assert asking.asked == asked(0.05)
    assert level(asking.study.chosen_fidelity()) == (1e-2, 0.5, 1.0)
    assert asking.fidelity_name == "tolerance-0.05"
    assert PROCESS.run_id(asking).startswith("tolerance-0.05-")
    said = process_scene(asking).case
    assert said.fidelity.name == "tolerance-0.05"
    assert said.asked is not None
    assert said.asked.tolerance == 0.05 and said.asked.bound == 0.045
    assert 0.04 < said.asked.relative_cost < 0.07 and said.asked.fallback is None
    others = filling_scene(asking).case, drop_scene(asking).case
    assert not any("asked" in json.loads(other.as_text()) for other in others)


def test_the_question_is_part_of_the_process_alone(asking: Case) -> None:
    plain = replace(asking, asked=None, advised=None)
    differing = {
        scene for scene in SCENES if SCENES[scene].digest(plain) != SCENES[scene].digest(asking)
    }
    assert differing == {"process"}
    assert PROCESS.content(plain) == PROCESS.content(asking)


def test_tolerances_of_a_matrix_are_resolved_each(
    small: dict[str, Any], write_study: Write, tradeoff: Tradeoff
) -> None:
    small["fidelity"] = {"tolerance": 0.05}
    small["sweep"] = {"fidelity.tolerance": [0.05, 0.02]}
    found = load_cases(write_study(small), resolve=partial(resolve, tradeoff=tradeoff))
    scales = [case.study.chosen_fidelity().youngs_modulus_scale for case in found]
    assert scales == [0.01, 0.1]


def test_a_quantity_that_was_not_measured_is_refused(case: Case, tradeoff: Tradeoff) -> None:
    with pytest.raises(InputError, match="one of: restitution, drag_mean, drag_std"):
        advise(case, asked(0.05, quantity="chain_count"), tradeoff)
    found = advise(case, asked(0.05, quantity="drag_std"), tradeoff)  # known, but of no setting
    assert found.fallback is not None and found.chosen == found.reference


def test_without_a_measured_tradeoff_there_is_a_remedy(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file") as caught:
        measured_tradeoff(tmp_path / "tradeoff.json")
    assert "name a fidelity instead" in str(caught.value)
    assert "snakemake tradeoff" in str(caught.value)
    (tmp_path / "old.json").write_text('{"schema": 1}')
    with pytest.raises(InputError, match="another version"):
        measured_tradeoff(tmp_path / "old.json")


def test_the_packages_own_tradeoff_can_be_read_and_resolves_tolerances(
    small: dict[str, Any], write_study: Write
) -> None:
    tradeoff = measured_tradeoff()
    assert tradeoff.study == "uhlmann2015" and len(tradeoff.promises) == 5
    (found,) = load_cases(write_study(small | {"fidelity": {"tolerance": 0.4}}), resolve=resolve)
    assert tradeoff.stiffness is not None and found.advised is not None
    assert found.advised.source.startswith(f"measured {tradeoff.stiffness.measured}")


def test_entries_of_any_quantity_are_read(case: Case, tradeoff: Tradeoff) -> None:
    both = setting(1e-2, 0.5, 1.0, 0.03, None, errors={"drag_std": error(0.1, 0.2)})
    found = advise(case, asked(0.3, quantity="drag_std"), with_settings(tradeoff, both))
    assert level(found.chosen.fidelity) == (1e-2, 0.5, 1.0) and found.label == "spread of the drag"


# --- the command ---------------------------------------------------------------------------------


def test_advise_prints_and_keeps_what_it_says(
    case: Case,
    project: Project,
    tradeoff: Tradeoff,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(project.root)
    commands.advise("small", None, None, None, quick=True, tradeoff=tradeoff)
    said = " ".join(capsys.readouterr().out.split())
    for words in ("mean drag within 5 %", "advised", "cheaper", "dearer", "reference", "+2.2 %",
                  "sets no tolerance", "wall time", "made"):  # fmt: skip
        assert words in said
    kept = json.loads((project.root / "results/small/advice.json").read_text())
    (one,) = kept["cases"]
    assert [option["role"] for option in one["options"]] == [
        "advised", "cheaper", "dearer", "reference",
    ]  # fmt: skip
    advised = one["options"][0]
    assert advised["settings"]["youngs_modulus_scale"] == 0.01
    assert advised["wall_time_s"]["process"] == pytest.approx(
        advised["steps"]["process"] / advised["steps_per_s"]["process"], rel=1e-3
    )


def test_the_kept_advice_names_the_run_of_a_study_that_asks(
    asking: Case, tradeoff: Tradeoff, project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(project.root)
    commands.advise("small", None, None, None, quick=True, tradeoff=tradeoff)
    kept = json.loads((project.root / "results/small/advice.json").read_text())
    assert kept["cases"][0]["run"] == PROCESS.run_id(asking)
    assert kept["cases"][0]["options"][0]["inputs"] == process_scene(asking).case.inputs


def test_the_studys_own_measured_fidelity_is_shown_too(
    small: dict[str, Any],
    write_study: Write,
    project: Project,
    tradeoff: Tradeoff,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    own = {"youngs_modulus_scale": 1e-2, "timestep_fraction": 0.5, "ranks": 1}
    write_study(small | {"fidelity": own})
    monkeypatch.chdir(project.root)
    (project.root / "results").write_text("a file where the folder should be")
    commands.advise("small", None, 0.02, None, quick=True, tradeoff=tradeoff)
    shown = capsys.readouterr()
    said = " ".join(shown.out.split())
    assert "│ own │ E x 0.01, 50 % of the" in said
    assert "E0.01_dt0.5: error of mean drag +2.2 % (+0 % to +4.5 %), bound 4.5 %" in said
    assert "not written: " in shown.err


def test_the_command_line_goes_before_the_study(case: Case, asking: Case) -> None:
    assert question(case, None, None) == asked(0.05)
    assert question(asking, 0.2, None) == asked(0.2)
    assert question(asking, None, "drag_std") == asked(0.05, quantity="drag_std")


@pytest.mark.parametrize(("tolerance", "quantity"), [(2.0, None), (None, "colour")])
def test_a_wrong_question_is_explained(
    case: Case,
    project: Project,
    tradeoff: Tradeoff,
    monkeypatch: pytest.MonkeyPatch,
    tolerance: float | None,
    quantity: str | None,
) -> None:
    monkeypatch.chdir(project.root)
    with pytest.raises(InputError, match="command line: "):
        commands.advise("small", None, tolerance, quantity, quick=True, tradeoff=tradeoff)


def test_a_broken_step_is_no_candidate(case: Case, tradeoff: Tradeoff) -> None:
    cheap = setting(1e-3, 0.6, 1.0, 1.0, 0.001)
    with_it = with_settings(tradeoff, cheap)
    without = with_settings(tradeoff, cheap.model_copy(update={"breaks": True}))
    assert level(advise(case, asked(0.05), with_it).chosen.fidelity) == (1e-3, 0.6, 1.0)
    assert level(advise(case, asked(0.05), without).chosen.fidelity) != (1e-3, 0.6, 1.0)
