from pathlib import Path
from typing import Any

import pytest
from made_run import with_motion

from dragchain import DocumentError, TableError, load_case, load_outputs
from dragchain.run.case import changed_inputs, study_of
from dragchain.run.kinematics import motion_of
from dragdeck.records.case import StatisticsOfRun


def test_reads_a_process(tiny_run: Path) -> None:
    case = load_case(tiny_run)
    assert (case.scene, case.case, case.statistics) == (
        "process",
        "tiny",
        StatisticsOfRun(transient_s=0.02),
    )
    assert case.bowl.half_widths_m == (0.04, 0.04)
    assert case.motion is not None
    assert (case.motion.kind, case.motion.start_direction_rad) == ("line", 0.0)
    assert case.motion.axis_speed_m_s == pytest.approx(1e-4)
    assert [phase.name for phase in case.phases] == ["plunge", "drag"]
    assert case.restitution is None


def test_a_motion_that_this_version_makes_otherwise_is_refused(tiny_run: Path, edit_json) -> None:
    """The tables follow from the inputs; what was simulated stands beside them."""
    path = {"kind": "circle", "radius_m": 0.02}

    def slower(case: dict[str, Any]) -> None:
        case.update(with_motion(case, path, 0.01, spin={"rpm": 60}))
        case["superposed"][0]["stages"][0]["rate_rad_s"] *= 0.99

    edit_json(tiny_run / "case.json", slower)
    with pytest.raises(TableError, match="another version of dragdeck"):
        motion_of(load_case(tiny_run))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda c: c.update(schema=1),
            r"case\.json: schema: the file was written by another version of .*\n  value:  1\n",
        ),
        (
            lambda c: c.update(scene="stir"),
            r"scene: the scene is not one of a study\n  value:  stir",
        ),
        (lambda c: c["bowl"].pop("walls"), r"case\.json: bowl\.walls: a required key is missing"),
        (
            lambda c: c.update(bowl={"radius_m": 0.04, "walls": "primitive"}),
            r"bowl\.walls: .*\n  value:  'primitive'\n  remedy: .*dragdeck step render",
        ),
        (
            lambda c: c.update(study=c.pop("study_name"), inputs={"seed": 1}),
            r"study_name: a required key is missing\n  remedy: .*dragdeck step render",
        ),
        (lambda c: c["phases"][1].update(start_step=30), "drag does not start where plunge ends"),
        (lambda c: c.update(gravity_m_s2=float("nan")), "is not a JSON object|finite number"),
    ],
)
def test_says_what_is_wrong_with_a_case(tiny_run: Path, edit_json, change, message) -> None:
    edit_json(tiny_run / "case.json", change)
    with pytest.raises(DocumentError, match=message):
        load_case(tiny_run)


def test_the_study_is_read_without_the_files_that_it_names(tiny_run: Path, edit_json) -> None:
    shape = {"kind": "mesh", "file": "not_here.stl", "unit": "mm"}
    edit_json(tiny_run / "case.json", lambda case: case["study"]["workpiece"].update(shape=shape))
    assert study_of(load_case(tiny_run)).workpiece.shape.plain() == shape


def test_a_missing_case_and_a_broken_one_are_told_apart(tiny_run: Path) -> None:
    (tiny_run / "case.json").write_text("{")
    with pytest.raises(DocumentError, match="is not a JSON object"):
        load_case(tiny_run)
    (tiny_run / "case.json").unlink()
    with pytest.raises(DocumentError, match="there is no such file"):
        load_case(tiny_run)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"binary": True}, "a local output is always text"),
        ({"pattern": "contacts.dump"}, r"pattern is 'contacts.dump', without \{part\}"),
        ({"engine_columns": ["a"]}, "engine_columns has another length"),
        ({"columns": ["a", "a"]}, "names a column twice"),
    ],
)
def test_says_what_is_wrong_with_an_output(tiny_run: Path, edit_json, change, message) -> None:
    edit_json(tiny_run / "columns.json", lambda c: c["outputs"]["contacts"].update(change))
    with pytest.raises(DocumentError, match=message):
        load_outputs(tiny_run)


def test_an_input_that_is_left_out_is_one_that_is_none() -> None:
    own = {"seed": 1, "bowl.radius_m": None, "media.count": 4}
    assert changed_inputs(own, {"seed": 1, "media.count": 4}) == {}
    assert changed_inputs({"seed": 1}, own) == {"media.count": None}
