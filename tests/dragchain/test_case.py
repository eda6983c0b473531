from __future__ import annotations

import json
from pathlib import Path

import pytest

from dragchain import CaseError, load_case, load_outputs
from dragchain.case import Circle, Line


def test_reads_a_process(tiny_run: Path) -> None:
    case = load_case(tiny_run)
    assert (case.scene, case.case, case.run_in_s) == ("process", "tiny", 0.02)
    assert case.bowl is not None
    assert case.bowl.radius_m == 0.04
    assert case.motion == Line(1e-4, (0.0, 0.0), 0.0)
    assert [phase.name for phase in case.phases] == ["plunge", "drag"]
    assert case.restitution is None


def test_reads_a_circle(tiny_run: Path, edit_json) -> None:
    circle = {
        "kind": "circle",
        "speed_m_s": 0.01,
        "radius_m": 0.02,
        "sense": -1,
        "turns_with_path": True,
    }
    edit_json(
        tiny_run / "case.json", lambda c: c.update(motion={**circle, "start_heading_rad": 1.5})
    )
    assert load_case(tiny_run).motion == Circle(0.01, 0.02, -1, 1.5, True)


def test_a_drop_needs_neither_bowl_nor_tool(tiny_run: Path, edit_json) -> None:
    def to_drop(case):
        for key in ("case", "bowl", "tool", "motion", "surface_m", "statistics"):
            del case[key]
        case.update(scene="drop", restitution=0.68)

    edit_json(tiny_run / "case.json", to_drop)
    case = load_case(tiny_run)
    assert (case.bowl, case.tool, case.restitution) == (None, None, 0.68)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.update(schema=2), r"case\.json: schema: is 2, this dragchain reads 1"),
        (lambda c: c.update(scene="stir"), r"scene: is 'stir', not one of drop, fill, process"),
        (lambda c: c["bowl"].pop("radius_m"), r"case\.json: bowl\.radius_m: is missing"),
        (lambda c: c["bowl"].update(radius_m="4e-2"), r"radius_m: is '4e-2', not a number"),
        (lambda c: c["bowl"].update(radius_m=-1), r"radius_m: is -1\.0, not above zero"),
        (lambda c: c.update(timestep_s=True), r"timestep_s: is True, not a number"),
        (lambda c: c["media"].update(count=4.5), r"media\.count: is 4\.5, not a whole number"),
        (lambda c: c.update(tool=None), r"tool: is NoneType, not an object"),
        (lambda c: c["phases"][1].update(start_step=30), "drag does not start where plunge ends"),
        (lambda c: c["phases"][1].pop("name"), r"phases\[1\]\.name: is missing"),
        (lambda c: c.update(gravity_m_s2=float("nan")), "not a finite number"),
    ],
)
def test_says_what_is_wrong_with_a_case(tiny_run: Path, edit_json, change, message) -> None:
    edit_json(tiny_run / "case.json", change)
    with pytest.raises(CaseError, match=message):
        load_case(tiny_run)


def test_a_missing_case_and_a_broken_one_are_told_apart(tiny_run: Path) -> None:
    (tiny_run / "case.json").write_text("{")
    with pytest.raises(CaseError, match="is not JSON"):
        load_case(tiny_run)
    (tiny_run / "case.json").unlink()
    with pytest.raises(CaseError, match="there is no such file"):
        load_case(tiny_run)


def test_reads_outputs(tiny_run: Path) -> None:
    outputs = load_outputs(tiny_run)
    assert list(outputs) == [
        *("thermo", "rod_force", "rod_balls", "rod_contacts", "contacts", "balls"),
    ]
    assert outputs["rod_force"].header == outputs["rod_force"].columns
    assert outputs["contacts"].header == tuple(f"c_x[{i}]" for i in range(6))


def test_the_last_step_may_be_open(tiny_run: Path, edit_json) -> None:
    edit_json(tiny_run / "columns.json", lambda c: c["outputs"]["thermo"].update(last_step=None))
    assert load_outputs(tiny_run)["thermo"].last_step is None


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kind": "movie"}, r"outputs\.contacts\.kind: is 'movie'"),
        ({"binary": True}, "a local output is always text"),
        ({"pattern": "contacts.dump"}, r"pattern: is 'contacts.dump', without \{part\}"),
        ({"engine_columns": ["a"]}, "engine_columns: has another length"),
        ({"columns": ["a", "a"]}, "names a column twice"),
        ({"period_steps": 0}, "period_steps: is 0, not at least 1"),
    ],
)
def test_says_what_is_wrong_with_an_output(tiny_run: Path, edit_json, change, message) -> None:
    edit_json(tiny_run / "columns.json", lambda c: c["outputs"]["contacts"].update(change))
    with pytest.raises(CaseError, match=message):
        load_outputs(tiny_run)


def test_an_error_names_file_and_remedy(tiny_run: Path) -> None:
    file = tiny_run / "columns.json"
    file.write_text(json.dumps({"schema": 1}))
    with pytest.raises(CaseError) as caught:
        load_outputs(tiny_run)
    assert (caught.value.file, caught.value.field) == (file, "outputs")
    assert "remedy:" in str(caught.value)
