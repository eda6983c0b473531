"""A straight trough in place of the machine: its size, what it keeps of it, and what is refused."""

import copy
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from made_study import Made
from paths import ROOT

from dragchain.quantities.basis import Basis, judge
from dragchain.quantities.registry import REPORTED
from dragchain.statistics.estimate import Estimate
from dragdeck.cases.bed import expected_surface
from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.outlook.process import reduced
from dragdeck.physics.walls import Wall
from dragdeck.scenes.bed_space import expected_bed
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.fit import clearances
from dragdeck.scenes.moving_bowl import bed_in_motion, path_tilt_deg
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.scenes.workpiece import workpiece_radius
from dragdeck.study.bowls.trough import TroughBowl
from dragdeck.study.paths.line import LinePath
from dragdeck.sweep.cases import load_cases
from dragdeck.sweep.plan import Plan, plan_points

D = 0.004
"""Diameter of the particles; the rod's is 1.5 times as large."""

RADIUS = 0.003
SIDE = max(6.7 * D, 4 * 2 * RADIUS)
BELOW = 4 * D
WIDE: dict[str, Any] = {
    "media": {"material": "ceramic", "radius_mean_m": D / 2, "radius_std_m": 0.0,
              "fill_height_m": 0.05, "count": None},
    "bowl": {"radius_m": 0.12, "height_m": 0.12},
    "workpiece.shape": {"kind": "cylinder", "radius_m": RADIUS, "facet_size_m": 0.001},
    "motion.path": {"kind": "circle", "radius_m": 0.06, "revolutions": 1},
    "motion.transient_m": 0.005,
    "reduction": {"cut_out": True},
}  # fmt: skip
REST = {"kind": "rest", "radius_m": 0.06, "bowl_rpm": 120, "revolutions": 1}
RING = {"kind": "annulus", "material": "steel", "radius_m": 0.08, "core_radius_m": 0.045,
        "height_m": 0.12}  # fmt: skip
ROUNDED = {"kind": "revolved", "material": "steel", "height_m": 0.12,
           "profile_m": [[0, 0], [0.03, 0], [0.08, 0.02], [0.085, 0.12]]}  # fmt: skip


@pytest.fixture
def cut(made: Made) -> Made:
    """The case of the wide machine, cut out, with these fields changed."""

    def only(changes: Mapping[str, Any]) -> Case:
        return made(copy.deepcopy({**WIDE, **changes}))

    return only


def tip_of(case: Case) -> float:
    """Height of the tip above the floor, m."""
    bed = bed_in_motion(case.study, expected_bed(case.study))
    return bed.surface_m - case.study.motion.immersion_depth_m


def sides(case: Case) -> tuple[float, float]:
    """Gaps to the walls on the left and on the right of a path along +x, m."""
    bowl, path = case.study.bowl, case.study.motion.path
    assert isinstance(bowl, TroughBowl) and isinstance(path, LinePath)
    reach, y = workpiece_radius(case), path.start_m[1]
    return bowl.width_m / 2 - y - reach, bowl.width_m / 2 + y - reach


def test_a_wide_machine_gives_a_trough_of_the_sizes_of_the_laws(cut: Made) -> None:
    case = cut({})
    motion, bowl, path = case.study.motion, case.study.bowl, case.study.motion.path
    assert isinstance(bowl, TroughBowl) and isinstance(path, LinePath)
    reach = workpiece_radius(case)
    side = max(6.7 * D, 8 * reach)
    assert sides(case) == pytest.approx((side, side), abs=2e-6)
    assert tip_of(case) == pytest.approx(BELOW, rel=0.01)
    assert path.start_m[0] + bowl.length_m / 2 - reach == pytest.approx(side, abs=2e-6)
    end = path.start_m[0] + path.length_m
    assert bowl.length_m / 2 - end == pytest.approx(14 * D, abs=2e-6)
    assert motion.transient_m == pytest.approx(12 * D)
    assert path.length_m - motion.uncounted_m == pytest.approx(40 * D, abs=2e-6)
    assert motion.speed_m_s == 0.02 and motion.immersion_depth_m == 0.015
    assert case.study.particle_count < 0.5 * case.written.particle_count
    gaps = clearances(case, expected_surface(case.study))
    assert gaps.wall_m == pytest.approx(side, abs=2e-6)


@pytest.mark.parametrize(
    ("changes", "left", "right", "below"),
    [
        ({"bowl.radius_m": 0.075}, SIDE, 0.012, BELOW),
        ({"bowl.radius_m": 0.075, "motion.path.direction": "cw"}, 0.012, SIDE, BELOW),
        ({"bowl": RING}, 0.012, 0.017, BELOW),
        ({"media.fill_height_m": 0.02}, SIDE, SIDE, 0.005),
        ({"motion.oscillation": {"amplitude_m": 0.002, "frequency_hz": 1}}, SIDE, SIDE, BELOW),
    ],
)
def test_a_narrower_machine_keeps_its_own_room(
    cut: Made, changes: dict[str, Any], left: float, right: float, below: float
) -> None:
    """Counter-clockwise, the wall of the bowl is on the right and a column on the left."""
    case = cut(changes)
    assert sides(case) == pytest.approx((left, right), rel=0.01)
    lowest = 0.002 if case.study.motion.oscillation else 0.0
    assert tip_of(case) - lowest == pytest.approx(below, rel=0.02)


def test_a_sloping_wall_counts_where_it_is_nearest(cut: Made) -> None:
    case = cut({"bowl": ROUNDED})
    tip = tip_of(cut({"bowl": ROUNDED, "reduction": None}))
    wall = 0.08 + 0.005 * (tip - 0.02) / 0.1 if tip > 0.02 else 0.03 + 0.05 * tip / 0.02
    assert sides(case)[1] == pytest.approx(wall - 0.06 - RADIUS, rel=0.03)
    outer = cut({"bowl": {**ROUNDED, "profile_m": [[0, 0], [0.02, 0], [0.1, 0.06],
                                                            [0.105, 0.12]]}})  # fmt: skip
    assert tip_of(outer) < BELOW and sides(outer)[1] < sides(case)[1]


def test_a_line_is_cut_out_in_its_own_direction(cut: Made) -> None:
    trough = {"kind": "trough", "material": "steel", "length_m": 0.3, "width_m": 0.2,
              "height_m": 0.12}  # fmt: skip
    path = {"kind": "line", "start_m": [0.0, -0.12], "direction_deg": 90, "length_m": 0.2}
    line = {"bowl": {**trough, "length_m": 0.2, "width_m": 0.3}, "motion.path": path}
    case = cut({**line, "motion.path": {**path, "start_m": [0.08, -0.13]}})
    assert sides(case) == pytest.approx((SIDE, 0.017), rel=0.01)
    bowl, new = case.study.bowl, case.study.motion.path
    assert isinstance(bowl, TroughBowl) and isinstance(new, LinePath)
    assert new.start_m[0] + bowl.length_m / 2 == pytest.approx(0.02, rel=0.01)
    assert new.direction_deg == 0.0


def test_gravity_is_turned_as_the_bed_of_a_turning_bowl(cut: Made) -> None:
    """Outwards, by the angle of a liquid; the bed is inclined by less, and as deep at the tip."""
    turning = {"motion.path": REST, "motion.speed_m_s": None, "motion.transient_m": 0.005}
    case, machine = cut(turning), cut({**turning, "reduction": None})
    scene = process_scene(case)
    rate = 120 * math.tau / 60
    liquid = math.atan(rate**2 * 0.06 / 9.81)
    x, y, z = scene.deck.gravity_direction
    assert (x, math.atan2(y, -z)) == pytest.approx((0.0, liquid))
    assert scene.deck.gravity_m_s2 == pytest.approx(9.81 / math.cos(liquid))
    assert FILLING.build(case, None).deck.gravity_direction == (0, 0, -1)
    assert case.study.motion.speed_m_s == pytest.approx(rate * 0.06)
    assert path_tilt_deg(case.study) == pytest.approx(math.degrees(liquid) - 26)
    assert path_tilt_deg(case.study) == pytest.approx(path_tilt_deg(machine.study))
    assert tip_of(case) == pytest.approx(BELOW, rel=0.01)
    assert case.study.bowl_facet_size_m is None
    against = cut({**turning, "motion.path": {**REST, "bowl_rpm": -120}})
    assert process_scene(against).deck.gravity_direction == pytest.approx((x, -y, z))
    faster = cut({**turning, "fidelities.quick.speed_factor": 1.2})
    steeper = math.atan(1.44 * math.tan(liquid))
    assert process_scene(faster).deck.gravity_direction[1] == pytest.approx(math.sin(steeper))
    assert tip_of(faster) == pytest.approx(BELOW, rel=0.01)


def test_a_bowl_that_turns_below_a_moving_workpiece(cut: Made) -> None:
    """The speed of the line is that relative to the bowl."""
    for rpm in (30, -30):
        case = cut({"motion.bowl": {"kind": "rotation", "rpm": rpm}})
        relative = 0.02 - rpm * math.tau / 60 * 0.06
        assert case.study.motion.speed_m_s == pytest.approx(abs(relative))
        (_, y, _) = process_scene(case).deck.gravity_direction
        assert math.copysign(1, y) == -math.copysign(1, relative)


def test_other_lengths_may_be_asked_for(cut: Made) -> None:
    motion = cut({"motion.path.revolutions": 0.1}).study.motion
    counted = 0.1 * math.tau * 0.06 - 0.005
    assert motion.path_length_m - motion.uncounted_m == pytest.approx(counted, abs=1e-5)
    motion = cut({"reduction.counted_m": 0.1}).study.motion
    assert motion.path_length_m - motion.uncounted_m == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"motion.path": {"kind": "figure_eight", "radius_m": 0.02}}, "motion.path.kind"),
        ({"workpieces": {"count": 2}}, "workpieces"),
        ({"motion.orientation": "fixed"}, "motion.orientation"),
        ({"motion.bowl": {"kind": "vibration", "amplitude_m": [1e-4, 0, 0], "frequency_hz": 20}},
         "motion.bowl"),
        ({"compound": {"density_kg_m3": 1000}, "motion.path": REST, "motion.speed_m_s": None},
         "compound"),
        ({"motion.path.radius_m": 0.02}, "reduction.cut_out"),
        ({"reduction": {"counted_m": 0.1}}, "reduction"),
        ({"reduction": {"cut_out": True, "counted_m": 3.0}}, "reduction.cut_out"),
        ({"motion.bowl": {"kind": "rotation", "rpm": 0.02 / 0.06 * 60 / math.tau}}, "motion.bowl"),
    ],
)  # fmt: skip
def test_refused_is_what_a_line_cannot_stand_for(
    cut: Made, changes: dict[str, Any], field: str
) -> None:
    with pytest.raises(InputError) as refused:
        cut(changes)
    assert field in {error.field for error in (refused.value, *refused.value.more)}
    assert refused.value.file


def test_a_search_for_a_radial_force_is_refused(cut: Made) -> None:
    search = {"vary": {"motion.speed_m_s": [0.01, 0.05]}, "objective": {"quantity": "lateral_mean"}}
    with pytest.raises(InputError) as refused:
        cut({"search": search, "sweep": {"seed": [1, 2]}})
    assert "search.objective.quantity" in {
        error.field for error in (refused.value, *refused.value.more)
    }


def test_the_radial_force_of_a_cut_out_is_not_available(cut: Made) -> None:
    for changes, available in (({}, False), ({"reduction": None}, True)):
        case = process_scene(cut(changes)).case
        values = {
            quantity.name: judge(quantity, Estimate(1.0, 0.9, 1.1), case, None)
            for quantity in REPORTED
        }
        assert (values["lateral_mean"].basis is not Basis.NONE) == available
        assert values["drag_mean"].basis is Basis.SIMULATED


def test_check_and_case_say_what_stands_for_what(cut: Made) -> None:
    case = cut({})
    (entry,) = process_scene(case).case.assumptions
    assert entry.field == "reduction.cut_out" and entry.value is True
    assert f"{case.written.particle_count:,}" in entry.why and reduced(case) == entry.why
    assert reduced(cut({"reduction": None})) == ""


def test_a_plan_changes_the_machine_and_cuts_again(cut: Made) -> None:
    base = cut({})
    plan = Plan.model_validate(
        {"base": {"fidelity": "draft"}, "seeds": 1,
         "reference": {"vary": {"bowl.radius_m": [0.12]}},
         "points": [{"vary": {"bowl.radius_m": [0.075], "reduction.cut_out": [True, False]}}]}
    )  # fmt: skip
    scenes = {"process": PROCESS, "drop_test": PROCESS}
    _, narrow, whole = plan_points(plan, ROOT / "plan.yaml", base, scenes).processes
    assert sides(narrow)[1] == pytest.approx(0.012, rel=0.01)
    assert whole.machine is None and whole.study.bowl.kind == "cylinder"


def test_studies_of_the_project_are_cut_out() -> None:
    """Each fits: no error, and fewer particles."""
    for name in ("drag_finisher", "stream_finisher"):
        cases = load_cases(ROOT / "studies" / name / "study.yaml")
        cut = [case for case in cases if case.study.bowl.kind == "trough"]
        assert cut and len(cut) < len(cases)
        scene = process_scene(cut[0])
        assert scene.case.media.count < 0.75 * cut[0].written.particle_count
        planes = [Wall.model_validate(dict(wall)) for wall in scene.case.bowl.walls]
        assert np.all([wall.shape.endswith("plane") for wall in planes])
