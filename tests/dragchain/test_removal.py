"""Load, sliding and friction work on a tool, on contacts made by hand."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import pyvista as pv
from PIL import Image

from dragchain.case import Circle, load_case
from dragchain.contact_events import Thresholds, event_types, find_events, surfaces
from dragchain.errors import TableError
from dragchain.forces import tool_velocity
from dragchain.removal import (
    off_facet,
    read_removal,
    read_surface,
    sample,
    turned,
    write_removal,
)
from dragchain.rod import WallContacts
from dragchain.tables import rod_contact_rows

STEP_S = 1e-4
PERIOD = 10
DT = PERIOD * STEP_S
START, LAST = 100, 3100
FRAMES = 300
SPEED = 0.1
MU = 0.25
SURFACE = 0.03
SIZE = 0.02
SLIDE, ROLL, HIT, REST = 1, 2, 3, 4

PLATE = """solid plate
facet normal 1 0 0
outer loop
vertex 0 -0.01 0
vertex 0 0.01 0
vertex 0 0.01 0.02
endloop
endfacet
facet normal 1 0 0
outer loop
vertex 0 -0.01 0
vertex 0 0.01 0.02
vertex 0 -0.01 0.02
endloop
endfacet
endsolid plate
"""
"""A square of 20 mm that looks along +x; its diagonal runs up to the left."""


def case_json(**motion: Any) -> dict[str, Any]:
    steel = {"youngs_modulus_pa": 2e11, "poissons_ratio": 0.3}
    return {
        "schema": 1, "study": "made", "scene": "process", "run": "made-process",
        "case": "made case", "upstream": {}, "timestep_s": STEP_S, "rayleigh_time_s": 2e-4,
        "gravity_m_s2": 9.81,
        "fidelity": {
            "name": "draft", "youngs_modulus_scale": 0.01, "timestep_fraction": 0.5,
            "speed_factor": 1.0, "skin_m": 0.001, "ranks": 1,
        },
        "inputs": {
            "media.material": "ceramic", "workpiece.material": "steel",
            "pairs.ceramic-steel.friction": MU,
            **{f"materials.{m}.{k}": v for m in ("ceramic", "steel") for k, v in steel.items()},
        },
        "media": {"count": 4, "radius_mean_m": 3e-3, "radius_sd_m": 0.0, "density_kg_m3": 2500.0},
        "bowl": {"radius_m": 0.1, "walls": "primitive"},
        "tool": {"kind": "mesh", "radius_m": 0.01, "length_m": SIZE, "mesh": "tool.stl",
                 "submersion_m": SIZE},
        "surface_m": SURFACE,
        "motion": {"kind": "line", "speed_m_s": SPEED, "start_m": [0.0, 0.0],
                   "heading_rad": 0.0} | motion,
        "phases": [
            {"name": "plunge", "start_step": 0, "end_step": START},
            {"name": "drag", "start_step": START, "end_step": LAST},
        ],
        "statistics": {"run_in_s": 0.0}, "assumptions": [], "reference": None,
        "versions": {"dragdeck": "0.1.0"},
    }  # fmt: skip


def contact(
    frame: int, ball: int, place: tuple[float, float], force: tuple[float, float, float],
    slip: tuple[float, float] = (0.0, 0.0), approach: float = 0.0,
) -> dict[str, Any]:  # fmt: skip
    """A contact at (y, z) of the plate; `force` is that on the tool, `slip` along y and z."""
    step = START + PERIOD * (frame + 1)
    x = SPEED * STEP_S * (step - START)
    y, z = place
    return {
        "step": step, "time_s": step * STEP_S, "phase": "drag", "ball_id": ball,
        "facet_id": int(z > y + 0.01), "point_x_m": x, "point_y_m": y, "point_z_m": 0.01 + z,
        "force_x_n": force[0], "force_y_n": force[1], "force_z_n": force[2],
        "normal_force_n": -force[0], "tangential_force_n": float(np.hypot(*force[1:])),
        "overlap_m": 1e-6, "slip_x_m_s": 0.0, "slip_y_m_s": slip[0], "slip_z_m_s": slip[1],
        "approach_m_s": approach, "bearing_rad": float(np.arctan2(y, 1e-3)),
        "depth_m": SURFACE - 0.01 - z, "counted": True,
    }  # fmt: skip


def made_contacts() -> list[dict[str, Any]]:
    """Four balls on the plate.

    One slides upwards for 200 frames without turning, at 40 mm/s under 1 N. One rolls to the left
    for all 300 frames at 60 mm/s under 2 N, across the diagonal, its friction half mobilised. One
    hits in frames 50 and 60 with 3 N, seen once each time. One is carried along for 100 frames.
    """
    sliding = [
        contact(i, SLIDE, (0.005, 0.002 + 0.04 * DT * i), (-1.0, 0.0, MU), (0.0, 0.04))
        for i in range(50, 250)
    ]
    rolling = [
        contact(i, ROLL, (-0.009 + 0.06 * DT * i, 0.01), (-2.0, 0.5 * MU * 2.0, 0.0))
        for i in range(FRAMES)
    ]
    hits = [contact(i, HIT, (0.0, 0.005), (-3.0, 0.0, 0.0), approach=0.2) for i in (50, 60)]
    rest = [contact(i, REST, (-0.005, 0.015), (-0.5, 0.0, 0.01)) for i in range(100, 200)]
    return [*sliding, *rolling, *hits, *rest]


def write_run(folder: Path, rows: list[dict[str, Any]]) -> Path:
    """A run folder with its tables."""
    (folder / "tables").mkdir(parents=True)
    (folder / "case.json").write_text(json.dumps(case_json()))
    output = {
        "kind": "local", "binary": False, "pattern": "rod_contacts.{part}.dump",
        "columns": ["point_x_m"], "engine_columns": None, "period_steps": PERIOD,
        "first_step": START, "last_step": LAST,
    }  # fmt: skip
    columns = {"schema": 1, "outputs": {"rod_contacts": output}}
    (folder / "columns.json").write_text(json.dumps(columns))
    (folder / "tool.stl").write_text(PLATE)
    contacts = pd.DataFrame(rows).sort_values(["step", "ball_id"])
    contacts.to_parquet(folder / "tables/rod_contacts.parquet")
    steps = np.arange(START + PERIOD, LAST + 1, PERIOD)
    sums = contacts.groupby("step")[["force_x_n", "force_y_n", "force_z_n"]].sum()
    sums = sums.reindex(steps, fill_value=0.0)
    rod = pd.DataFrame(
        {
            "step": steps, "heading_rad": 0.0, "ref_x_m": SPEED * STEP_S * (steps - START),
            "ref_y_m": 0.0, "ref_z_m": 0.01, "drag_n": sums["force_x_n"].to_numpy(),
            "lateral_n": sums["force_y_n"].to_numpy(), "vertical_n": sums["force_z_n"].to_numpy(),
            "counted": True,
        }
    )  # fmt: skip
    rod.to_parquet(folder / "tables/rod_force.parquet")
    return folder


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = write_run(tmp_path_factory.mktemp("made") / "run", made_contacts())
    write_removal(folder)
    return folder


@pytest.fixture
def facets(run: Path) -> pd.DataFrame:
    return pd.read_parquet(run / "tables/facets.parquet")


@pytest.fixture
def events(run: Path) -> pd.DataFrame:
    return pd.read_parquet(run / "tables/contact_events.parquet")


def test_a_facet_gets_what_its_contacts_bring(facets: pd.DataFrame) -> None:
    """The slider and the hits are on facet 0; the roller leaves facet 1 at y = 0."""
    on_1 = sum(-0.009 + 0.06 * DT * i < 0 for i in range(FRAMES))
    impulse = [200 * 1.0 + (FRAMES - on_1) * 2.0 + 2 * 3.0, on_1 * 2.0 + 100 * 0.5]
    np.testing.assert_allclose(facets["normal_impulse_ns"], np.array(impulse) * DT)
    np.testing.assert_allclose(facets["sliding_m"], [200 * 0.04 * DT, 0.0])
    np.testing.assert_allclose(facets["force_slide_nm"], [200 * 0.04 * DT * 1.0, 0.0])
    np.testing.assert_allclose(facets["friction_work_j"], [200 * 0.04 * DT * MU, 0.0])
    assert facets["samples"].tolist() == [200 + FRAMES - on_1 + 2, on_1 + 100]
    assert facets["events"].tolist() == [3, 2]
    assert facets["peak_normal_force_n"].tolist() == [3.0, 2.0]
    np.testing.assert_allclose(facets["area_m2"], SIZE**2 / 2)
    np.testing.assert_allclose(facets[["normal_x", "normal_y", "normal_z"]], [[1, 0, 0]] * 2)


def test_shares_of_area_and_way(facets: pd.DataFrame) -> None:
    area, way = SIZE**2 / 2, SPEED * FRAMES * DT
    np.testing.assert_allclose(facets["force_slide_pa"], facets["force_slide_nm"] / area / way)
    pressure = facets["normal_impulse_ns"] / area / (FRAMES * DT)
    np.testing.assert_allclose(facets["mean_pressure_pa"], pressure)


def test_every_ball_gets_the_type_it_was_made_for(events: pd.DataFrame) -> None:
    found = events[["ball_id", "type", "samples"]].apply(tuple, axis=1).tolist()
    assert found == [
        (ROLL, "rolling", FRAMES),
        (SLIDE, "sliding", 200),
        (HIT, "impact", 1),
        (HIT, "impact", 1),
        (REST, "resting", 100),
    ]
    assert events["whole"].tolist() == [False, True, True, True, True]


def test_the_paths_of_a_rolling_and_of_a_sliding_ball(events: pd.DataFrame) -> None:
    rolling, sliding = events.iloc[0], events.iloc[1]
    assert rolling["rolling_m"] == pytest.approx(0.06 * DT * (FRAMES - 1))
    assert rolling["sliding_m"] == rolling["friction_work_j"] == 0.0
    assert rolling["contact_path_m"] == pytest.approx(rolling["rolling_m"])
    assert sliding["contact_path_m"] == pytest.approx(0.04 * DT * 199)
    assert sliding["rolling_m"] == pytest.approx(0.04 * DT * 199 / 2)
    assert sliding["slide_to_roll"] == pytest.approx(2.0)
    assert (rolling["mobilised_share"], sliding["mobilised_share"]) == (0.0, 1.0)
    assert rolling["tangential_over_normal"] == pytest.approx(0.5 * MU)


def test_a_gap_of_one_sample_ends_a_stay_and_a_change_of_facet_does_not(run: Path) -> None:
    case = load_case(run)
    whole = sample(run, case, Thresholds())
    rows = whole.rows[~((whole.rows["ball_id"] == ROLL) & (whole.rows["frame"] == 120))]
    events, event = find_events(rows.reset_index(drop=True), whole.frames, whole.interval_s)
    rolled = events[events["ball_id"] == ROLL]
    assert rolled["samples"].tolist() == [120, 179]
    assert rows["facet_id"][rows["ball_id"] == ROLL].nunique() == 2
    assert len(event) == len(rows)
    np.testing.assert_array_equal(events["ball_id"].to_numpy()[event], rows["ball_id"])


def test_a_ball_with_two_contacts_has_one_stay_with_the_sum_of_both(tmp_path: Path) -> None:
    both = [
        row
        for i in range(20, 60)
        for row in (
            contact(i, SLIDE, (0.004, 0.002), (-1.0, 0.0, MU), (0.0, 0.04)),
            contact(i, SLIDE, (-0.004, 0.012), (-2.0, 0.0, 0.0)),
        )
    ]
    folder = write_run(tmp_path / "run", both)
    write_removal(folder)
    events = pd.read_parquet(folder / "tables/contact_events.parquet")
    assert events["samples"].tolist() == [40]
    assert events["peak_normal_force_n"].tolist() == [3.0]
    assert events["normal_impulse_ns"][0] == pytest.approx(40 * 3.0 * DT)
    assert events["contact_path_m"].tolist() == [0.0]


def test_totals_are_the_sums_over_facets_and_over_events(
    run: Path, facets: pd.DataFrame, events: pd.DataFrame
) -> None:
    found = read_removal(run)
    for name in ("normal_impulse_ns", "tangential_impulse_ns", "force_slide_nm", "sliding_m"):
        assert facets[name].sum() == pytest.approx(found["totals"][name], rel=1e-12)
        assert events[name].sum() == pytest.approx(found["totals"][name], rel=1e-12)
    rod = pd.read_parquet(run / "tables/rod_force.parquet")
    for axis in ("drag", "lateral", "vertical"):
        assert facets[f"{axis}_impulse_ns"].sum() == pytest.approx(rod[f"{axis}_n"].sum() * DT)
    assert found["closure"]["rod_relative_error"] < 1e-12
    assert found["closure"]["point_off_facet_max_m"] < 1e-12


def test_a_force_that_no_facet_has_is_told(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", made_contacts())
    file = folder / "tables/rod_force.parquet"
    rod = pd.read_parquet(file)
    rod["lateral_n"] += 0.5
    rod.to_parquet(file)
    write_removal(folder)
    closure = read_removal(folder)["closure"]
    assert closure["unplaced_impulse_ns"]["lateral"] == pytest.approx(0.5 * FRAMES * DT)
    assert closure["unplaced_impulse_ns"]["drag"] == pytest.approx(0.0, abs=1e-12)
    assert closure["rod_relative_error"] > 0.01


def test_the_work_of_the_tool_is_drag_times_way(run: Path) -> None:
    found = read_removal(run)
    drag = 200 * 1.0 + FRAMES * 2.0 + 2 * 3.0 + 100 * 0.5
    assert found["totals"]["tool_work_j"] == pytest.approx(drag * DT * SPEED)
    share = 200 * 0.04 * DT * MU / (drag * DT * SPEED)
    assert found["friction_share_of_work"]["value"] == pytest.approx(share)
    assert found["load_while_sliding_share"]["value"] == pytest.approx(200 / drag)
    assert found["types"]["rolling"]["share_of"]["normal_impulse_ns"]["value"] == pytest.approx(
        2.0 * FRAMES / drag
    )
    assert found["types"]["impact"]["events"] == 2
    assert found["path_m"] == pytest.approx(SPEED * FRAMES * DT)


def test_an_interval_holds_its_value_and_has_a_width(run: Path) -> None:
    per_metre = read_removal(run)["per_metre"]["force_slide_nm"]
    assert per_metre["low"] < per_metre["value"] < per_metre["high"]


def test_fewer_samples_change_the_number_of_stays(run: Path) -> None:
    """Every tenth sees the two hits as one stay of two samples, or not at all."""
    table = {row["every"]: row for row in read_removal(run)["sampling"]}
    assert table[10]["largest_relative_error"]["sliding_m"] == pytest.approx(0.0, abs=1e-12)
    assert table[10]["events"] == pytest.approx(3 + 1 / 10)
    assert table[2]["events"] == pytest.approx(3 + 1)
    assert table[2]["share_of"]["force_slide_nm"]["sliding"] == 1.0


def test_the_vtp_file_holds_the_table(run: Path, facets: pd.DataFrame) -> None:
    mesh = pv.read(run / "tables/rod.vtp")
    assert mesh.n_cells == 2
    for name in facets:
        np.testing.assert_allclose(mesh.cell_data[name], facets[name])
    centres = facets[["centre_x_m", "centre_y_m", "centre_z_m"]]
    np.testing.assert_allclose(mesh.cell_centers().points, centres, atol=1e-9)


def test_the_picture_is_whole(run: Path) -> None:
    with Image.open(run / "figures/rod.png") as picture:
        shown = np.asarray(picture.convert("RGB"))
    assert shown.shape[0] > 500
    assert shown.std() > 10


def test_a_mesh_of_another_run_is_refused(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", made_contacts())
    first, second = PLATE.split("facet normal", 2)[1:]
    swapped = f"solid plate\nfacet normal{second.replace('endsolid plate', '').rstrip()}\n"
    (folder / "tool.stl").write_text(f"{swapped}facet normal{first}endsolid plate\n")
    with pytest.raises(TableError, match="do not belong together"):
        write_removal(folder)
    (folder / "tool.stl").write_text(PLATE.split("endfacet")[0] + "endfacet\nendsolid plate\n")
    with pytest.raises(TableError, match="names facet 1, but"):
        write_removal(folder)


def test_missing_friction_is_named(run: Path) -> None:
    case = load_case(run)
    inputs = {k: v for k, v in case.inputs.items() if "friction" not in k}
    with pytest.raises(TableError, match=r"pairs\.ceramic-steel\.friction"):
        surfaces(replace(case, inputs=inputs))


def test_the_contact_time_is_that_of_hertz(run: Path) -> None:
    """Against the integral of Johnson (1985), eq. 11.23: 2.94 times overlap over speed."""
    case = load_case(run)
    modulus = 0.01 * 2e11 / (2 * (1 - 0.3**2))
    mass = 2500 * 4 / 3 * np.pi * 3e-3**3
    overlap = (15 * mass * SPEED**2 / (16 * np.sqrt(3e-3) * modulus)) ** 0.4
    assert surfaces(case).contact_time_s == pytest.approx(2.94 * overlap / SPEED, rel=5e-3)


def test_longer_impacts_count_as_impacts_when_asked(run: Path, events: pd.DataFrame) -> None:
    case = load_case(run)
    times = 0.1 / surfaces(case).contact_time_s
    limits = Thresholds(impact_times=times * 1.001)
    kinds = event_types(events, case, DT, limits)
    assert kinds.tolist() == ["rolling", "sliding", "impact", "impact", "impact"]


def test_a_point_off_a_triangle_by_hand() -> None:
    triangle = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], dtype=float)
    points = np.array([[0.2, 0.2, 0.5], [-3, 0, 4], [1, 1, 0], [0.25, 0.25, 0]])
    off = off_facet(points, np.repeat(triangle, 4, axis=0))
    np.testing.assert_allclose(off, [0.5, 5.0, np.sqrt(0.5), 0.0])


# --- the tool's motion -----------------------------------------------------------------------


def circle(turns: bool, sense: int = 1) -> dict[str, Any]:
    return {
        "kind": "circle", "radius_m": 0.05, "sense": sense, "turns_with_path": turns,
        "start_heading_rad": sense * np.pi / 2,
    }  # fmt: skip


def made_case(tmp_path: Path, **motion: Any) -> Any:
    (tmp_path / "case.json").write_text(json.dumps(case_json(**motion)))
    return load_case(tmp_path)


@pytest.mark.parametrize("sense", [1, -1])
def test_a_tool_that_turns_moves_faster_farther_out(tmp_path: Path, sense: int) -> None:
    """Reference point on the x axis, 50 mm from the bowl's axis; the point 10 mm beyond it."""
    steps, reference = np.array([200]), np.array([[0.05, 0.0]])
    point = np.array([[0.06, 0.01, 0.02]])
    turning = made_case(tmp_path, **circle(True, sense))
    moving = made_case(tmp_path, **circle(False, sense))
    rate = sense * SPEED / 0.05
    exact = [[-rate * 0.01, rate * 0.06, 0.0]]
    np.testing.assert_allclose(tool_velocity(steps, point, reference, turning), exact)
    level = [[0.0, sense * SPEED, 0.0]]
    np.testing.assert_allclose(tool_velocity(steps, point, reference, moving), level, atol=1e-15)
    assert np.isnan(tool_velocity(np.array([START]), point, reference, turning)).all()


@pytest.mark.parametrize("turns", [True, False])
def test_a_ball_that_moves_with_the_tool_does_not_slip(tmp_path: Path, turns: bool) -> None:
    """A ball glued to a turning tool spins with it; one on a tool that does not turn, not."""
    case = made_case(tmp_path, **circle(turns))
    reference, centre = np.array([0.0, 0.05]), np.array([-0.013, 0.05, 0.02])
    point = centre + np.array([0.003, 0, 0])
    spin = np.array([0, 0, SPEED / 0.05 if turns else 0.0])
    velocity = np.cross(spin, centre) if turns else np.array([-SPEED, 0.0, 0.0])
    surface = velocity + np.cross(spin, point - centre)
    contacts = WallContacts(
        ball_id=np.array([1]), facet_id=np.array([0]), point_m=point[None],
        force_n=np.array([[-1.0, 0, 0]]), evaluated_n=np.zeros((1, 3)),
        normal=np.array([[-1.0, 0, 0]]), surface_m_s=surface[None],
        overlap_m=np.zeros(1), silent=np.array([False]),
    )  # fmt: skip
    rows = rod_contact_rows(200, contacts, reference, case)
    slip = [rows[f"slip_{axis}_m_s"][0] for axis in "xyz"]
    np.testing.assert_allclose([*slip, rows["approach_m_s"][0]], 0.0, atol=1e-15)
    wrong = rod_contact_rows(200, contacts, reference, made_case(tmp_path, **circle(not turns)))
    assert abs(wrong["slip_y_m_s"][0]) + abs(wrong["approach_m_s"][0]) > 1e-3


def test_a_cylinder_is_turned_back_into_its_own_frame(tmp_path: Path) -> None:
    """Its STL file goes into the bed unturned: what looks ahead at the start becomes +x."""
    (tmp_path / "tool.stl").write_text(PLATE)
    case = made_case(tmp_path, **circle(True))
    assert isinstance(case.motion, Circle)
    as_mesh = read_surface(tmp_path, case)
    np.testing.assert_allclose(as_mesh.normals, [[1, 0, 0]] * 2)
    case = replace(case, tool=replace(case.tool, kind="cylinder"))
    np.testing.assert_allclose(read_surface(tmp_path, case).normals, [[0, -1, 0]] * 2, atol=1e-12)
    np.testing.assert_allclose(turned(np.array([0.0, 2.0, 1.0]), 0.0), [0, 2, 1])
    quarter = turned(np.array([[0.0, 2.0, 1.0]]), np.array([-np.pi / 2]))
    np.testing.assert_allclose(quarter, [[2, 0, 1]], atol=1e-12)
