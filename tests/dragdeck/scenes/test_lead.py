"""Runs that go on from a softer run: what decks, steps and names say of it."""

import math
import re
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_scenes import BED, script

from dragdeck.cases.case import Case, of_each_workpiece
from dragdeck.errors import InputError
from dragdeck.project import Project
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.lead import RAMP_STAGES, covered, spread_out, step_at, windows_of, with_lead
from dragdeck.scenes.motion import course
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.scenes.workpiece import reference_height
from dragdeck.study.base import Json
from dragdeck.study.drive import Drive
from dragdeck.study.rotations import by_vector, rotated
from dragdeck.sweep.cases import load_cases

START = {"youngs_modulus_scale": 0.01, "timestep_fraction": 0.5}
STIFF = {"youngs_modulus_scale": 1, "soft_start": START, "timestep_fraction": 0.5, "ranks": 1}
WINDOWS = {"tolerance": 0.1, "quantities": ["drag_mean", "workpiece_contacts"], "most": 5}
SOFT = {"youngs_modulus_scale": 0.01, "timestep_fraction": 0.5, "ranks": 1, "windows": WINDOWS}

PATHS: dict[str, Json] = {
    "circle": {"kind": "circle", "radius_m": 0.010, "revolutions": 1},
    "line": {"kind": "line", "start_m": [-0.028, 0], "direction_deg": 0, "length_m": 0.056},
    "rest": {"kind": "rest", "radius_m": 0.010, "bowl_rpm": -20, "revolutions": 1},
}

Make = Callable[..., Case]


@pytest.fixture
def made(small: dict[str, Any], write_study: Callable[..., Path]) -> Make:
    """The small study with these settings, a longer path, and these fields of its motion."""

    def make(fidelity: Json, **motion: Any) -> Case:
        small["bowl"]["radius_m"] = 0.04
        small["motion"] |= {"path": PATHS["circle"], "transient_m": 0.01, **motion}
        if small["motion"]["path"]["kind"] == "rest":
            del small["motion"]["speed_m_s"]
            small["bowl"]["facet_size_m"] = 0.005
        small["fidelity"] = fidelity
        (only,) = load_cases(write_study(small))
        return only

    return make


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("more", [{}, {"orientation": "fixed"}, {"spin": {"rpm": 100}}])
def test_a_run_begins_where_its_course_is(path: str, more: Json, made: Make) -> None:
    case = with_lead(made(STIFF, path=PATHS[path], **more))
    scene, way = process_scene(case, BED), course(case.study, BED)
    (body,), entry = scene.deck.workpieces, scene.deck.entry_step
    place, rotation = way.poses(way.legs[-1], np.array([entry - way.drag.start]))
    assert body.start_m == pytest.approx(place[0], abs=1e-12)
    assert math.radians(body.turn_deg) == pytest.approx(rotation.turn_rad[0], abs=1e-12)
    assert [leg.name for leg in body.legs] == ["drag"]
    assert scene.steps == way.drag.end - entry


def test_a_run_begins_with_an_inclined_workpiece_as_far_as_it_has_spun(made: Make) -> None:
    """The mesh is turned about its axis first, and then with the path."""
    case = with_lead(made(STIFF, path=PATHS["circle"], tilt_deg=20, spin={"rpm": 100}))
    scene = process_scene(case, BED)
    way = course(case.study, BED, reference_height(case))
    (body,), entry = scene.deck.workpieces, scene.deck.entry_step
    place, rotation = way.poses(way.legs[-1], np.array([entry - way.drag.start]))
    *axis, angle = body.own_turn
    own = by_vector(math.radians(angle) * np.array(axis))
    turned = np.column_stack([rotated(own[:, k], math.radians(body.turn_deg)) for k in range(3)])
    np.testing.assert_allclose(turned, rotation.matrices[0], atol=1e-12)
    assert body.start_m == pytest.approx(place[0], abs=1e-12)


def test_the_moduli_are_raised_to_those_of_the_run(made: Make, project: Project) -> None:
    case = made(STIFF)
    text = script(case, project)
    stages = re.findall(
        r"youngsModulus peratomtype (\S+) (\S+)\n(?:if.*reset.*\n)?if.*< (\d+)", text
    )
    assert len(stages) == RAMP_STAGES
    moduli = [float(first) for first, _, _ in stages]
    ratios = [after / before for before, after in pairwise(moduli)]
    assert ratios == pytest.approx([100 ** (1 / RAMP_STAGES)] * (RAMP_STAGES - 1), rel=1e-9)
    assert [float(one) for one in stages[-1][:2]] == [77e9, 210e9]
    steps = covered(with_lead(case), course(case.study, BED).drag)
    assert int(stages[-1][2]) == steps.ramp_end < steps.counted < steps.end
    assert text.index("dump write_particles") > text.rindex("youngsModulus")
    assert f'"reset_timestep {steps.entry}"' in text


def test_a_lead_is_soft_and_ends_where_the_run_goes_on(made: Make, project: Project) -> None:
    case = with_lead(made(STIFF))
    lead = case.lead
    assert lead is not None
    scene = process_scene(lead, BED)
    assert scene.deck.materials.youngs_modulus_scale == 0.01
    assert scene.case.marks == ("state.1.restart",)
    text = script(lead, project)
    last = scene.case.phases[-1].end_step
    assert f'"run {last} upto" "write_restart state.1.restart"' in text
    assert (
        process_scene(case, BED).deck.source
        == f"../../process/{PROCESS.run_id(lead)}/state.1.restart"
    )
    reached = (last - scene.case.phases[-1].start_step) * scene.deck.timestep_s
    stiff = process_scene(case, BED)
    begun = (stiff.deck.entry_step - stiff.case.phases[-1].start_step) * stiff.deck.timestep_s
    assert reached == pytest.approx(begun, abs=scene.deck.timestep_s)


def test_a_run_that_begins_softer_is_filled_like_a_plain_one(made: Make) -> None:
    plain, stiff, soft = made({**STIFF, "soft_start": None}), made(STIFF), made(SOFT)
    alike = [plain, stiff, with_lead(stiff).lead, soft, *windows_of(soft)]
    fillings = {FILLING.run_id(case) for case in alike if case}
    assert fillings == {FILLING.run_id(plain)}
    assert FILLING.build(soft, None).deck.materials.youngs_modulus_scale == 1
    assert PROCESS.run_id(plain) != PROCESS.run_id(stiff)


def test_a_filling_may_have_a_modulus_of_its_own(made: Make) -> None:
    soft = {**STIFF, "youngs_modulus_scale": 0.01, "soft_start": None}
    stiffer = {**soft, "filling_youngs_modulus_scale": 0.1}
    assert FILLING.build(made(soft), None).deck.materials.youngs_modulus_scale == 0.01
    assert FILLING.build(made(stiffer), None).deck.materials.youngs_modulus_scale == 0.1
    assert PROCESS.run_id(made(stiffer)) != PROCESS.run_id(made(soft))


def test_a_filling_has_the_name_of_the_fidelity(made: Make) -> None:
    assert FILLING.build(made("draft"), None).case.fidelity.name == "draft"


def test_nothing_is_counted_before_the_bed_has_settled(made: Make) -> None:
    case = made(STIFF, transient_m=0.0)
    scene = process_scene(case, BED)
    drag = scene.case.phases[-1]
    steps = covered(with_lead(case), course(case.study, BED).drag)
    counted = drag.start_step + scene.case.statistics.transient_s / scene.deck.timestep_s
    assert counted == pytest.approx(steps.counted) and steps.counted > steps.ramp_end


def test_windows_lie_beside_each_other_on_the_counted_path(made: Make) -> None:
    case = with_lead(made(SOFT))
    found = windows_of(case)
    assert 2 <= len(found) <= WINDOWS["most"]
    assert {PROCESS.run_id(one.lead) for one in found if one.lead} == {PROCESS.run_id(case)}
    assert len({PROCESS.run_id(one) for one in found}) == len(found)
    scenes = [process_scene(one, BED) for one in found]
    way = course(found[0].study, BED)
    spans = sorted((covered(one, way.drag).counted, covered(one, way.drag).end) for one in found)
    period = scenes[0].deck.thermo_steps
    assert all(before[1] <= after[0] + 2 * period for before, after in pairwise(spans))
    assert spans[-1][1] <= way.drag.end
    transient = case.study.motion.uncounted_m / case.study.motion.path_length_m
    first = min(covered(one, way.drag).counted for one in found)
    assert first >= way.drag.start + transient * (way.drag.end - way.drag.start)
    for window, scene in zip(found, scenes, strict=True):
        number = case.stretch.marks.index(window.stretch.begin) + 1
        assert scene.deck.source == f"../../process/{PROCESS.run_id(case)}/state.{number}.restart"
        assert scene.deck.materials.youngs_modulus_scale == 1


def test_a_fraction_of_the_drag_has_its_step() -> None:
    drag = Drive(100, 500, 1e-5, length_m=1.0)
    assert [step_at(fraction, drag) for fraction in (0, 0.25, 1)] == [100, 200, 500]


@pytest.mark.parametrize("count", [0, 1, 3, 4, 7, 16, 17, 64])
def test_the_first_windows_are_spread_over_the_path(count: int) -> None:
    """All are there once; the first three, six and nine are symmetric but for rounding."""
    order = spread_out(count)
    assert sorted(order) == list(range(count))
    for first in (3, 5, 7, 9):
        if count > first:
            assert abs(2 * sum(order[:first]) / first - (count - 1)) <= 1.0
    if count == 16:
        assert sorted(order[:3]) == [2, 8, 13]


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"soft_start": {"youngs_modulus_scale": 1}}, "soft_start"),
        ({"soft_start": {"youngs_modulus_scale": 0.5}, "youngs_modulus_scale": 0.1}, "not below"),
        ({"windows": WINDOWS}, "windows require a youngs_modulus_scale below 1"),
        ({**SOFT, "speed_factor": 2}, "windows require"),
        ({**SOFT, "soft_start": {"youngs_modulus_scale": 0.001}}, "windows require"),
        ({"filling_youngs_modulus_scale": 0.5}, "filling_youngs_modulus_scale is 0.5"),
    ],
)
def test_settings_that_do_not_fit_are_refused(settings: Json, said: str, made: Make) -> None:
    with pytest.raises(InputError, match=said):
        made({**STIFF, "soft_start": None, **settings})


def test_windows_of_a_further_workpiece_are_those_of_the_run(
    small: dict[str, Any], made: Make
) -> None:
    small["workpieces"] = {"count": 2}
    small["workpiece"]["shape"]["radius_m"] = 0.002
    first, second = of_each_workpiece(made(SOFT))
    runs = [PROCESS.run_id(one) for one in windows_of(first)]
    assert [PROCESS.run_id(one) for one in windows_of(second)] == [f"{run}.2" for run in runs]


def test_a_path_too_short_for_windows_is_refused(made: Make) -> None:
    path = {"kind": "circle", "radius_m": 0.010, "revolutions": 0.25}
    with pytest.raises(InputError, match="too short for 2 windows") as caught:
        process_scene(made(SOFT, path=path), BED)
    needs = float(re.search(r"at least (\S+) mm", str(caught.value))[1]) / 1e3  # type: ignore[index]
    path["revolutions"] = 1.05 * needs / (2 * math.pi * 0.010)
    process_scene(made(SOFT, path=path), BED)
