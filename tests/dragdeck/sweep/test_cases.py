"""Cases, and what their runs are named by."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from made_study import Load, Made

from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.project import Project, by_run
from dragdeck.scenes.drop_test import DROP_TEST
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import PROCESS, SCENES, process_scene
from dragdeck.sweep.cases import load_cases, new_study, settle_case, study_file


def ids(case: Case) -> dict[str, str]:
    """Name of its run of every scene."""
    return {name: scene.run_id(case) for name, scene in SCENES.items()}


@pytest.mark.parametrize(
    ("field", "value", "scenes"),
    [
        ("bowl.facet_size_m", 0.005, {"process"}),
        ("fidelities.quick.timestep_fraction", 0.4, {"process"}),
        ("fidelities.quick.youngs_modulus_scale", 0.01, {"filling", "process"}),
    ],
)
def test_a_run_is_named_by_what_it_depends_on(
    case: Case, made: Made, field: str, value: Any, scenes: set[str]
) -> None:
    """And of all fields: `tests/dragdeck/scenes/test_run_names.py`."""
    before, after = ids(case), ids(made({field: value}))
    assert {scene for scene in SCENES if before[scene] != after[scene]} == scenes


def test_the_order_of_keys_does_not_matter(
    case: Case, small: dict[str, Any], write_study: Callable[..., Path]
) -> None:
    (reversed_,) = load_cases(write_study(dict(reversed(small.items()))))
    assert ids(reversed_) == ids(case)


def test_a_matrix_makes_every_combination(load: Load) -> None:
    cases = load({"sweep": {"motion.speed_m_s": [0.01, 0.02], "seed": [1, 2, 3]}})
    assert len(cases) == len({PROCESS.run_id(case) for case in cases}) == 6
    assert cases[3].name == "quick_speed_m_s-0.02_seed-1"
    assert cases[3].study.motion.speed_m_s == 0.02
    assert len(by_run(cases, FILLING)) == 3
    assert len(by_run(cases, DROP_TEST)) == 1


def test_a_point_does_not_change_the_values_of_the_next(small: dict[str, Any]) -> None:
    base = {"pairs.ceramic-steel": {"restitution": 0.7, "friction": 0.3}}
    frictions = [
        settle_case(Path("design.yaml"), small, {**base, **point}).study.pairs["ceramic-steel"]
        for point in ({"pairs.ceramic-steel.friction": 0.5}, {})
    ]
    assert [pair.friction for pair in frictions] == [0.5, 0.3]


@pytest.mark.parametrize("order", [1, -1])
def test_a_field_counts_beside_its_block_in_any_order(load: Load, order: int) -> None:
    block = {"kind": "circle", "radius_m": 0.008, "revolutions": 0.2}
    sweep = {"motion.path": [block], "motion.path.radius_m": [0.009]}
    (case,) = load({"sweep": dict([*sweep.items()][::order])})
    assert case.study.motion.path.radius_m == 0.009


def test_many_cases_need_a_confirmation(small: dict[str, Any], load: Load) -> None:
    small["sweep"] = {"seed": list(range(201))}
    assert len(load({"accepted": {"cases": 201}})) == 201


def test_problems_of_all_cases_are_named_together(load: Load) -> None:
    with pytest.raises(InputError) as caught:
        load({"sweep": {"motion.speed_m_s": [0.01, -1, -2], "seed": [1, -3]}})
    values = [error.value for error in (caught.value, *caught.value.more)]
    assert sorted(map(str, values)) == ["-1", "-2", "-3"]


@pytest.mark.parametrize("name", ["../small", "a b", "x;date", "$(date)", "", "small\n"])
def test_a_study_has_a_plain_name(project: Project, case: Case, name: str) -> None:
    with pytest.raises(InputError, match="its name has up to 64 letters"):
        study_file(project.studies, name)


def test_the_fidelity_of_the_command_line_goes_first(
    small: dict[str, Any], write_study: Callable[..., Path]
) -> None:
    (case,) = load_cases(write_study(small), "draft")
    assert case.study.fidelity == "draft"
    assert PROCESS.run_id(case).startswith("draft-")


def test_an_edited_mesh_names_another_run(
    project: Project, small: dict[str, Any], write_study: Callable[..., Path]
) -> None:
    small["workpiece"]["shape"] = {"kind": "mesh", "file": "workpiece.stl", "unit": "mm"}
    file = write_study(small)
    (file.parent / "workpiece.stl").write_text("one")
    (before,) = load_cases(file)
    first = PROCESS.run_id(before)
    (file.parent / "workpiece.stl").write_text("two")
    (after,) = load_cases(file)
    assert first != PROCESS.run_id(after)
    assert FILLING.run_id(before) == FILLING.run_id(after)


DEPTH, KIND = "motion.immersion_depth_m", "workpiece.shape.kind"
DEPTHS = [0.010, "1.5e-2", 0.020]
SCALING = {"field": DEPTH, "expected_exponent": 2, "source": "somebody"}
SWEPT = {DEPTH: DEPTHS, "seed": [1, 2]}
MANY = {"seed": list(range(9999)), "media.count": list(range(9999))}
REFUSED = [
    *(({"sweep": sweep}, field, words) for sweep, field, words in [
        ({"motion.colour": [1]}, "motion.colour", "unknown key"),
        ({"seed": []}, "sweep.seed", "no values"),
        ({"seed": [1, 1]}, "", "given twice"),
        ({"seed": [1, 1.0]}, "", "given twice"),
        ({"motion.speed_m_s": [0.01, "1e-2"]}, "", "given twice"),
        ({"bowl.radius_m.deeper": [1]}, "", "below a single value"),
        ({"motion.speed_m_s": [0.01, -1]}, "motion.speed_m_s", ""),
        ({"sweep": [{"seed": [1, 2]}]}, "sweep.sweep", "no run depends on it"),
        ({"sweep.seed": [1, 2]}, "sweep.sweep.seed", "no run depends on it"),
        ({"title": ["a", "b"]}, "sweep.title", "no run depends on it"),
        ({"seed": [[1, 2], [3]]}, "seed", ""),
        ({"seed": list(range(201))}, "", "makes 201 cases, more than are accepted"),
        (MANY, "", "makes 99980001 cases"),
    ]),
    *(({"sweep": sweep, "scaling": {**SCALING, **scaling}}, field, words)
      for scaling, sweep, field, words in [
        ({"field": "motion.depth_m"}, SWEPT, "scaling.field", "not a field of sweep"),
        ({}, {**SWEPT, "motion.speed_m_s": [0.01, 0.02]}, "sweep", "exactly one field"),
        ({}, {**SWEPT, DEPTH: [0.01, 0.02]}, f"sweep.{DEPTH}", "too few levels"),
        ({"fit_range": [0.01, 0.015]}, SWEPT, f"sweep.{DEPTH}", "too few levels"),
        ({"fit_range": [0.02, 0.01]}, SWEPT, "scaling", "fit_range must increase"),
        ({"field": "seed"}, SWEPT, "scaling", "seed"),
        ({"slope": 2}, SWEPT, "scaling.slope", "unknown key"),
        ({"field": KIND}, {"seed": [1, 2], KIND: ["cylinder"]}, f"sweep.{KIND}", "numbers above 0"),
    ]),
    *(({"assumptions": [{"field": "media", "why": "any"}, {"field": field, "why": "any"}]},
       "assumptions.1.field", f"no such field {field!r}")
      for field in ("media.cuont", "path", "motion.path.lenght_m", "media.")),
    ({"assumptions": [{"field": "media.material", "why": "any", "std": 0.1}]},
     "assumptions.0.std", "is no number"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "field", "words"), REFUSED)
def test_what_no_run_can_be_made_of_is_refused(
    load: Load, changes: dict[str, Any], field: str, words: str
) -> None:
    with pytest.raises(InputError) as caught:
        load(changes)
    found = [caught.value, *caught.value.more]
    assert any(str(one.field).startswith(field) and words in str(one) for one in found)


def test_a_scaling_is_part_of_no_run(load: Load) -> None:
    before = load({"sweep": {DEPTH: DEPTHS, "seed": [1, 2]}})
    after = load({"scaling": SCALING})
    assert len(after) == 6
    for one, other in zip(before, after, strict=True):
        for scene in SCENES.values():
            assert scene.run_id(one) == scene.run_id(other)
            assert scene.digest(one) == scene.digest(other)
    assert after[0].study.scaling is not None and before[0].study.scaling is None


@pytest.mark.parametrize("field", ["media.count", "pairs", "motion.tilt_deg", "reference"])
def test_an_assumption_may_be_about_a_field_or_a_block(field: str, load: Load) -> None:
    assert load({"assumptions": [{"field": field, "why": "any"}]})


@pytest.mark.parametrize("name", [".", "..", "", "a/b"])
def test_a_name_that_can_be_none_is_not_called_taken(
    project: Project, case: Case, name: str
) -> None:
    with pytest.raises(InputError, match="this name cannot be used for a study"):
        new_study(project.studies, name, "small")


def test_an_assumption_about_another_kind_of_path_is_left_out(made: Made) -> None:
    circle = made({"assumptions": [{"field": "motion.path.radius_m", "why": "a guess"}]})
    line = made({"motion.path": {"kind": "line", "start_m": [-0.01, 0.0], "length_m": 0.02}})
    assumed = [process_scene(one).case.assumptions for one in (circle, line)]
    assert [len(one) for one in assumed] == [1, 0]
