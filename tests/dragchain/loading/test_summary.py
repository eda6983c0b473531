"""Load, sliding and friction work on a workpiece, on contacts made by hand."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
import pyvista as pv
from changed import changed
from loading_files import (
    DT,
    FRAMES,
    HIT,
    MU,
    PLATE,
    REST,
    ROLL,
    SIZE,
    SLIDE,
    SPEED,
    case_json,
    contact,
    made_contacts,
    write_run,
)

from dragchain.errors import TableError
from dragchain.loading.contact_events import contact_time_s, find_events
from dragchain.loading.document import LOADING_FILE, Loading
from dragchain.loading.figure import averaged_load
from dragchain.loading.samples import sample
from dragchain.loading.write import compute_loading, write_loading
from dragchain.run.workpiece import Surface, off_facet, read_surface
from dragchain.tables.workpiece_contacts import WallContacts
from dragchain.tables.write import workpiece_contact_rows
from dragdeck.records.case import load_case
from dragdeck.study.rotations import rotated


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = write_run(tmp_path_factory.mktemp("made") / "run", made_contacts())
    write_loading(folder)
    return folder


@pytest.fixture
def found(run: Path) -> Loading:
    return Loading.read(run / LOADING_FILE)


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
    np.testing.assert_allclose(facets["normal_impulse_n_s"], np.array(impulse) * DT)
    np.testing.assert_allclose(facets["sliding_m"], [200 * 0.04 * DT, 0.0])
    np.testing.assert_allclose(facets["force_slide_n_m"], [200 * 0.04 * DT * 1.0, 0.0])
    np.testing.assert_allclose(facets["friction_work_j"], [200 * 0.04 * DT * MU, 0.0])
    assert facets["samples"].tolist() == [200 + FRAMES - on_1 + 2, on_1 + 100]
    assert facets["events"].tolist() == [3, 2]
    assert facets["peak_normal_force_n"].tolist() == [3.0, 2.0]
    np.testing.assert_allclose(facets["area_m2"], SIZE**2 / 2)
    np.testing.assert_allclose(facets[["normal_x", "normal_y", "normal_z"]], [[1, 0, 0]] * 2)


def test_shares_of_area_and_way(facets: pd.DataFrame) -> None:
    area, way = SIZE**2 / 2, SPEED * FRAMES * DT
    np.testing.assert_allclose(facets["force_slide_pa"], facets["force_slide_n_m"] / area / way)
    pressure = facets["normal_impulse_n_s"] / area / (FRAMES * DT)
    np.testing.assert_allclose(facets["mean_pressure_pa"], pressure)


def test_every_particle_gets_the_type_it_was_made_for(events: pd.DataFrame) -> None:
    found = events[["particle_id", "type", "samples"]].apply(tuple, axis=1).tolist()
    assert found == [
        (ROLL, "rolling", FRAMES),
        (SLIDE, "sliding", 200),
        (HIT, "impact", 1),
        (HIT, "impact", 1),
        (REST, "resting", 100),
    ]
    assert events["complete"].tolist() == [False, True, True, True, True]


def test_the_paths_of_a_rolling_and_of_a_sliding_particle(events: pd.DataFrame) -> None:
    rolling, sliding = events.iloc[0], events.iloc[1]
    assert rolling["rolling_m"] == pytest.approx(0.06 * DT * (FRAMES - 1))
    assert rolling["sliding_m"] == rolling["friction_work_j"] == 0.0
    assert rolling["contact_path_m"] == pytest.approx(rolling["rolling_m"])
    assert sliding["contact_path_m"] == pytest.approx(0.04 * DT * 199)
    assert sliding["rolling_m"] == pytest.approx(0.04 * DT * 199 / 2)
    assert sliding["slide_to_roll"] == pytest.approx(2.0)
    assert (rolling["mobilised_fraction"], sliding["mobilised_fraction"]) == (0.0, 1.0)
    assert rolling["tangential_over_normal"] == pytest.approx(0.5 * MU)


def test_a_gap_of_one_sample_ends_a_stay_and_a_change_of_facet_does_not(run: Path) -> None:
    case = load_case(run)
    whole = sample(run, case)
    rows = whole.rows[~((whole.rows["particle_id"] == ROLL) & (whole.rows["frame"] == 120))]
    events, event = find_events(rows.reset_index(drop=True), whole.frames, whole.interval_s)
    rolled = events[events["particle_id"] == ROLL]
    assert rolled["samples"].tolist() == [120, 179]
    assert rows["facet_id"][rows["particle_id"] == ROLL].nunique() == 2
    assert len(event) == len(rows)
    np.testing.assert_array_equal(events["particle_id"].to_numpy()[event], rows["particle_id"])


CLUMP = {
    "first_id": 1, "count": 2, "first_sphere": 1, "radius_m": 3e-3, "mass_kg": 1e-3,
    "radii_m": [2e-3] * 3, "offsets_m": [[0, 0, 0], [2e-3, 0, 0], [0, 2e-3, 0]],
    "inertia_kg_m2": [1e-9] * 3,
}  # fmt: skip


def test_the_spheres_of_a_clump_add_up_and_count_once(tmp_path: Path) -> None:
    """Three slide under 1, 2 and 3 N in directions whose friction forces cancel in their sum."""
    ways = [(1.0, 0.0), (-0.5, 3**0.5 / 2), (-0.5, -(3**0.5) / 2)]
    load = [1.0, 2.0, 3.0]
    spheres, bodies = [], []
    for frame in range(20, 60):
        for (y, z), force in zip(ways, load, strict=True):
            place = (0.001 * y, 0.005 + 0.001 * z)
            pushed = (-force, MU * force * y, MU * force * z)
            spheres.append(contact(frame, 1, place, pushed, (0.04 * y, 0.04 * z)))
        bodies.append(contact(frame, 1, place, (-6.0, -0.5 * MU, 0.0), (0.04 * y, 0.04 * z)))
    folder = write_run(tmp_path / "run", bodies)
    pd.DataFrame(spheres).to_parquet(folder / "tables/sphere_contacts.parquet")
    (folder / "case.json").write_text(json.dumps(case_json() | {"bodies": [CLUMP]}))
    made = compute_loading(folder)
    way = 40 * 0.04 * DT
    wanted = {
        "normal_impulse_n_s": 40 * 6.0 * DT, "tangential_impulse_n_s": 40 * 6.0 * MU * DT,
        "relative_path_m": 3 * way, "sliding_m": 3 * way, "force_slide_n_m": 6.0 * way,
        "friction_work_j": 6.0 * MU * way,
    }  # fmt: skip
    for name, total in wanted.items():
        assert made.summary.totals[name] == pytest.approx(total)
        assert made.events[name].sum() == pytest.approx(total)
        assert made.facets[name].sum() == pytest.approx(total)
    assert made.summary.load_while_sliding_fraction.value == pytest.approx(1.0)
    assert made.facets["samples"].sum() == 40
    (event,) = made.events.to_dict("records")
    assert (event["samples"], event["mobilised_fraction"]) == (40, 1.0)
    assert event["peak_normal_force_n"] == pytest.approx(6.0)
    # the strongest sphere slides and stays where it is on the plate: 2 by the mean of the surfaces
    assert (event["type"], event["slide_to_roll"]) == ("sliding", pytest.approx(2.0, rel=0.05))


def test_a_particle_with_two_contacts_has_one_stay_with_the_sum_of_both(tmp_path: Path) -> None:
    both = [
        row
        for i in range(20, 60)
        for row in (
            contact(i, SLIDE, (0.004, 0.002), (-1.0, 0.0, MU), (0.0, 0.04)),
            contact(i, SLIDE, (-0.004, 0.012), (-2.0, 0.0, 0.0)),
        )
    ]
    events = compute_loading(write_run(tmp_path / "run", both)).events
    assert events["samples"].tolist() == [40]
    assert events["peak_normal_force_n"].tolist() == [3.0]
    assert events["normal_impulse_n_s"][0] == pytest.approx(40 * 3.0 * DT)
    assert events["contact_path_m"].tolist() == [0.0]


def test_totals_are_the_sums_over_facets_and_over_events(
    run: Path, found: Loading, facets: pd.DataFrame, events: pd.DataFrame
) -> None:
    for name in ("normal_impulse_n_s", "tangential_impulse_n_s", "force_slide_n_m", "sliding_m"):
        assert facets[name].sum() == pytest.approx(found.totals[name], rel=1e-12)
        assert events[name].sum() == pytest.approx(found.totals[name], rel=1e-12)
    workpiece = pd.read_parquet(run / "tables/workpiece_force.parquet")
    for axis in ("drag", "lateral", "vertical"):
        assert facets[f"{axis}_impulse_n_s"].sum() == pytest.approx(
            workpiece[f"{axis}_n"].sum() * DT
        )
    assert found.closure.workpiece_relative_error < 1e-12
    assert found.closure.point_off_facet_max_m < 1e-12


def test_a_force_that_no_facet_has_is_told(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", made_contacts())
    file = folder / "tables/workpiece_force.parquet"
    workpiece = pd.read_parquet(file)
    workpiece["lateral_n"] += 0.5
    workpiece.to_parquet(file)
    closure = compute_loading(folder).summary.closure
    assert closure.workpiece_relative_error > 0.01


def test_the_work_of_the_workpiece_is_drag_times_path(found: Loading) -> None:
    drag = 200 * 1.0 + FRAMES * 2.0 + 2 * 3.0 + 100 * 0.5
    assert found.totals["workpiece_work_j"] == pytest.approx(drag * DT * SPEED)
    fraction = 200 * 0.04 * DT * MU / (drag * DT * SPEED)
    assert found.friction_fraction_of_work.value == pytest.approx(fraction)
    assert found.load_while_sliding_fraction.value == pytest.approx(200 / drag)
    assert found.types["rolling"].fraction_of["normal_impulse_n_s"].value == pytest.approx(
        2.0 * FRAMES / drag
    )
    assert found.types["impact"].events == 2
    assert found.path_m == pytest.approx(SPEED * FRAMES * DT)


def test_what_is_ahead_has_its_fraction_and_an_approach_its_work(tmp_path: Path) -> None:
    ahead = [contact(i, REST, (0.0, 0.01), (-1.0, 0.0, 0.0), approach=0.2) for i in range(FRAMES)]
    behind = [
        contact(i, HIT, (0.0, 0.01), (-3.0, 0.0, 0.0)) | {"azimuth_rad": turned}
        for i, turned in enumerate(np.linspace(1.6, 2 * np.pi - 1.6, FRAMES))
    ]
    found = compute_loading(write_run(tmp_path / "run", ahead + behind)).summary
    assert found.front_fraction["normal_impulse_n_s"].value == pytest.approx(0.25)
    assert found.totals["normal_work_j"] == pytest.approx(FRAMES * 1.0 * 0.2 * DT)


def test_the_vtp_file_holds_the_table(run: Path, facets: pd.DataFrame) -> None:
    mesh = pv.read(run / "tables/workpiece.vtp")
    assert mesh.n_cells == 2
    for name in facets:
        np.testing.assert_allclose(mesh.cell_data[name], facets[name])
    centres = facets[["centre_x_m", "centre_y_m", "centre_z_m"]]
    np.testing.assert_allclose(mesh.cell_centers().points, centres, atol=1e-9)


def test_the_load_map_averages_over_areas(run: Path) -> None:
    """The load adds up as before; facets beside each other share theirs, others do not."""
    rng, case = np.random.default_rng(1), load_case(run)
    ball = pv.Sphere(radius=0.01, theta_resolution=30, phi_resolution=30)
    surface = Surface(ball.points.astype(float)[ball.faces.reshape(-1, 4)[:, 1:]])
    load = rng.exponential(1e3, len(surface.areas))
    facets = pd.DataFrame({"area_m2": surface.areas, "force_slide_pa": load})
    mean = averaged_load(surface, facets, case)
    assert (mean * surface.areas).sum() == pytest.approx((load * surface.areas).sum())
    assert 20 < len(np.unique(mean.round(6))) < 0.5 * len(mean)
    assert mean.std() < 0.7 * load.std()


def test_a_mesh_of_another_run_is_refused(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", made_contacts())
    first, second = PLATE.split("facet normal", 2)[1:]
    swapped = f"solid plate\nfacet normal{second.replace('endsolid plate', '').rstrip()}\n"
    (folder / "workpiece.stl").write_text(f"{swapped}facet normal{first}endsolid plate\n")
    with pytest.raises(TableError, match="do not match"):
        write_loading(folder)
    (folder / "workpiece.stl").write_text(PLATE.split("endfacet")[0] + "endfacet\nendsolid plate\n")
    with pytest.raises(TableError, match="contains facet 1, but"):
        write_loading(folder)


def test_a_run_without_a_workpiece_is_refused(tmp_path: Path) -> None:
    (tmp_path / "case.json").write_text(json.dumps(case_json() | {"scene": "filling"}))
    with pytest.raises(TableError, match="only a process run has a workpiece"):
        write_loading(tmp_path)


def test_missing_friction_is_named(run: Path) -> None:
    case = load_case(run)
    with pytest.raises(TableError, match=r"contact_moduli\.workpiece"):
        contact_time_s(changed(case, contact_moduli={}))


def test_the_contact_time_is_that_of_hertz(run: Path) -> None:
    """Against the integral of Johnson (1985), eq. 11.23: 2.94 times overlap over speed."""
    case = load_case(run)
    modulus = 0.01 * 2e11 / (2 * (1 - 0.3**2))
    mass = 2500 * 4 / 3 * np.pi * 3e-3**3
    overlap = (15 * mass * SPEED**2 / (16 * np.sqrt(3e-3) * modulus)) ** 0.4
    assert contact_time_s(case) == pytest.approx(2.94 * overlap / SPEED, rel=5e-3)


def test_a_point_off_a_triangle_by_hand() -> None:
    triangle = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], dtype=float)
    points = np.array([[0.2, 0.2, 0.5], [-3, 0, 4], [1, 1, 0], [0.25, 0.25, 0]])
    off = off_facet(points, np.repeat(triangle, 4, axis=0))
    np.testing.assert_allclose(off, [0.5, 5.0, np.sqrt(0.5), 0.0])


def test_points_of_narrow_facets_lie_on_them() -> None:
    """Facets of a blade are a hundred times as long as wide, and some 10 um across."""
    chance = np.random.default_rng(2)
    first, length = chance.uniform(0, 0.03, (500, 3)), chance.uniform(2e-4, 3e-3, 500)
    ways = chance.normal(size=(2, 500, 3))
    along, aside = ways / np.linalg.norm(ways, axis=2, keepdims=True)
    corners = np.stack(
        [first, first + length[:, None] * along, first + length[:, None] * along + 1e-5 * aside], 1
    )
    weights = chance.dirichlet([1, 1, 1], 500)
    points = (weights[:, :, None] * corners).sum(axis=1)
    assert off_facet(points, corners).max() < 1e-12
    normals = np.cross(corners[:, 1] - first, corners[:, 2] - first)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    np.testing.assert_allclose(off_facet(points + 1e-5 * normals, corners), 1e-5, rtol=1e-6)


# --- the workpiece's motion -----------------------------------------------------------------------


def circle(turns: bool, sense: int = 1) -> dict[str, Any]:
    return {
        "path": {"kind": "circle", "radius_m": 0.05, "direction": "ccw" if sense > 0 else "cw"},
        "orientation": "follow_path" if turns else "fixed",
    }


def made_case(tmp_path: Path, **motion: Any) -> Any:
    (tmp_path / "case.json").write_text(json.dumps(case_json(**motion)))
    return load_case(tmp_path)


@pytest.mark.parametrize("turns", [True, False])
def test_a_particle_that_moves_with_the_workpiece_does_not_slip(
    tmp_path: Path, turns: bool
) -> None:
    """A particle glued to a turning workpiece spins with it; one on a workpiece that does not
    turn, not."""
    case = made_case(tmp_path, **circle(turns))
    reference, centre = np.array([0.0, 0.05, 0.0]), np.array([-0.013, 0.05, 0.02])
    point = centre + np.array([0.003, 0, 0])
    spin = np.array([0, 0, SPEED / 0.05 if turns else 0.0])
    velocity = np.cross(spin, centre) if turns else np.array([-SPEED, 0.0, 0.0])
    surface = velocity + np.cross(spin, point - centre)
    contacts = WallContacts(
        particle_id=np.array([1]), facet_id=np.array([0]), point_m=point[None],
        force_n=np.array([[-1.0, 0, 0]]),
        normal=np.array([[-1.0, 0, 0]]), surface_m_s=surface[None],
        overlap_m=np.zeros(1), attraction_n=np.zeros(1), silent=np.array([False]),
    )  # fmt: skip
    at = np.array([200]), contacts, reference[None]
    rows = workpiece_contact_rows(*at, case)
    slip = [rows[f"slip_{axis}_m_s"][0] for axis in "xyz"]
    np.testing.assert_allclose([*slip, rows["normal_velocity_m_s"][0]], 0.0, atol=1e-15)
    wrong = workpiece_contact_rows(*at, made_case(tmp_path, **circle(not turns)))
    assert abs(wrong["slip_y_m_s"][0]) + abs(wrong["normal_velocity_m_s"][0]) > 1e-3


def test_a_cylinder_is_turned_back_into_its_own_frame(tmp_path: Path) -> None:
    """Its STL file goes into the bed unturned: what looks ahead at the start becomes +x."""
    (tmp_path / "workpiece.stl").write_text(PLATE)
    case = made_case(tmp_path, **circle(True))
    as_mesh = read_surface(tmp_path, case)
    np.testing.assert_allclose(as_mesh.normals, [[1, 0, 0]] * 2)
    case = changed(case, workpiece=changed(case.workpiece, kind="cylinder"))
    np.testing.assert_allclose(read_surface(tmp_path, case).normals, [[0, -1, 0]] * 2, atol=1e-12)
    np.testing.assert_allclose(rotated(np.array([0.0, 2.0, 1.0]), 0.0), [0, 2, 1])
    quarter = rotated(np.array([[0.0, 2.0, 1.0]]), np.array([-np.pi / 2]))
    np.testing.assert_allclose(quarter, [[2, 0, 1]], atol=1e-12)
