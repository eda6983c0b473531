"""A bowl of the user's from a mesh: what is inside, its sections, and what is refused."""

import math
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bowls import OWN_BOWL, hexagon
from made_scenes import BED, script
from made_study import Made, plain_study
from trimesh import Trimesh
from trimesh.creation import box

from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.mesh.bowl_file import bowl_facets
from dragdeck.mesh.files import stl_text
from dragdeck.mesh.surface import open_edges, raised, surface, weld
from dragdeck.outlook.process import workpiece_notes
from dragdeck.physics import facets
from dragdeck.physics.contact_network import touching
from dragdeck.physics.walls import Container
from dragdeck.preview.layout import layout
from dragdeck.project import Project
from dragdeck.scenes.bed_space import first_particles
from dragdeck.scenes.filling import FILLING, filling_scene
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.study.bowls.mesh import MeshBowl
from dragdeck.study.model import Study

AREA = 3 * 0.06**2 / (2 * math.sqrt(3))
"""Of a hexagon 60 mm across its flats."""


def body(corners: np.ndarray) -> Trimesh:
    points = corners.reshape(-1, 3)
    return weld(surface(points, np.arange(len(points)).reshape(-1, 3)))


def container(bowl: dict[str, Any] = OWN_BOWL) -> Container:
    return Study.model_validate({**plain_study({}), "bowl": bowl["bowl"]}).bowl.container


def trough(x: float, y: float, z: float) -> np.ndarray:
    """The inside of a rectangular trough about the axis, as facets."""
    whole = box(extents=(x, y, z))
    inwards = surface(np.add(whole.vertices, [0, 0, z / 2]), whole.faces[:, ::-1])
    return np.asarray(inwards.triangles[(inwards.triangles[:, :, 2] < z).any(axis=1)])


def ring() -> np.ndarray:
    """A trough around a square column."""
    outer, inner = trough(0.08, 0.08, 0.05), box(extents=(0.02, 0.02, 0.05))
    column = surface(np.add(inner.vertices, [0, 0, 0.025]), inner.faces)
    sides = np.abs(column.face_normals[:, 2]) < 0.5
    floor = (outer[:, :, 2] == 0).all(axis=1)
    at, ends = 0.01, 0.04
    frame = [[[-ends, -ends], [ends, -at]], [[-ends, at], [ends, ends]],
             [[-ends, -at], [-at, at]], [[at, -at], [ends, at]]]  # fmt: skip
    parts = []
    for (x, y), (u, v) in frame:
        parts += [[[x, y, 0], [u, y, 0], [u, v, 0]], [[x, y, 0], [u, v, 0], [x, v, 0]]]
    return np.concatenate([outer[~floor], column.triangles[sides], np.array(parts)])


# --- geometry ------------------------------------------------------------------------------------


def test_inside_and_distance_are_those_of_the_hexagon() -> None:
    inside = container()
    place = np.array(
        [[0, 0, 0.03], [0, 0, 0.002], [0, 0.025, 0.03], [0, 0.031, 0.03], [0, 0, -0.004],
         [0.028, 0, 0.002], [0.5, 0, 0.03], [0, 0.029, 0.08]]
    )  # fmt: skip
    distance = inside.distance(place)
    slope = math.hypot(0.015, 0.01)
    assert distance[:5] == pytest.approx([0.03, 0.002, 0.005, -0.001, -0.004], abs=1e-9)
    assert (distance[5:7] < 0).all()
    assert distance[7] == pytest.approx(0.001, abs=1e-6)
    low = inside.distance(np.array([[0.0, 0.02, 0.004]]))[0]
    assert low == pytest.approx(0.01 * 0.004 / slope, rel=1e-6)


@pytest.mark.parametrize("height", [0.0075, 0.015, 0.03, 0.0599])
def test_sections_are_hexagons(height: float) -> None:
    inside = container()
    share = min(1.0, 2 / 3 + height / 0.015 / 3)
    (outline,) = inside.sections(height)
    assert np.hypot(*outline.T).max() == pytest.approx(share * 0.06 / math.sqrt(3), rel=0.01)
    lines = facets.cut(inside.own_facets, height)
    assert facets.area(lines) == pytest.approx(share**2 * AREA, rel=1e-6)
    assert facets.chord(lines, 0.0, -1, 1) == pytest.approx(share * 0.06, rel=1e-6)
    assert facets.chord(lines, 0.0, 0.0, 0.01) == pytest.approx(0.01)


@pytest.mark.parametrize("turned", [False, True])
def test_sections_go_one_way_from_the_x_axis(turned: bool) -> None:
    """Whatever the sense of the facets; the surface of the bed in the preview looks upwards."""
    corners = ring()[:, ::-1] if turned else ring()
    bowl = {**OWN_BOWL["bowl"], "height_m": 0.05, "facets_m": corners.reshape(-1, 9).tolist()}
    sections = container({"bowl": bowl}).sections(0.02)
    for (x, y), half in zip((line.T for line in sections), (0.04, 0.01), strict=True):
        area = float((x[:-1] * y[1:] - x[1:] * y[:-1]).sum()) / 2
        assert area == pytest.approx((2 * half) ** 2, rel=0.02)
        assert x[0] == pytest.approx(half) and abs(y[0]) < half / 15


def test_the_volume_is_that_of_the_body() -> None:
    inside, whole = container(), AREA * 0.06
    frustum = AREA * 0.015 / 3 * (1 + 2 / 3 + 4 / 9)
    assert inside.volume_m3(0.06) == pytest.approx(frustum + AREA * 0.045, rel=2e-3)
    assert inside.volume_m3(0.06) < whole
    assert inside.height_m(inside.volume_m3(0.03)) == pytest.approx(0.03, rel=1e-3)


@pytest.mark.parametrize("corners", [hexagon(0.06, 0.06), ring(), trough(0.08, 0.05, 0.04)])
@pytest.mark.parametrize("at", [(0.0, 0.0), (0.012, 0.0), (-0.013, 0.005), (1e-5, 0.0)])
def test_where_a_bowl_stands_off_its_axis_is_said(
    corners: np.ndarray, at: tuple[float, float]
) -> None:
    moved = corners + np.array([*at, 0.0])
    if len(corners) == len(ring()):
        moved = corners + np.array([*at, 0.0]) / 4  # the axis stays within the column
    bowl = MeshBowl(kind="mesh", material="steel", height_m=float(corners[:, :, 2].max()),
                    facets_m=moved.reshape(-1, 9).tolist())  # fmt: skip
    places = moved[:, :, :2].reshape(-1, 2)
    x, y = np.round(500 * (places.max(axis=0) + places.min(axis=0)), 1) + 0.0
    said = f"x = {x:g}, y = {y:g} mm" if max(map(abs, at)) > 1e-3 else ""
    assert said in bowl.aside and bool(said) is bool(bowl.aside)


def test_a_bowl_around_a_column() -> None:
    bowl = {"kind": "mesh", "material": "steel", "height_m": 0.05,
            "facets_m": ring().reshape(-1, 9).tolist()}  # fmt: skip
    inside = container({"bowl": bowl})
    place = np.array([[0.025, 0, 0.02], [0, 0, 0.02], [0.012, 0, 0.02], [0.02, 0.02, 0.001]])
    assert inside.distance(place) == pytest.approx([0.015, -0.01, 0.002, 0.001], abs=1e-9)
    assert len(inside.sections(0.02)) == 2
    assert [wall.at_m for wall in inside.rim] == pytest.approx(
        [0.04, 0.01 * math.sqrt(2)], rel=1e-3
    )
    assert inside.levels[-1][1] == pytest.approx(0.08**2 - 0.02**2)


def test_a_long_bowl_is_filled_along_its_length() -> None:
    bowl = {"kind": "mesh", "material": "steel", "height_m": 0.05,
            "facets_m": trough(0.12, 0.04, 0.05).reshape(-1, 9).tolist()}  # fmt: skip
    rim = {wall.name: wall.at_m for wall in container({"bowl": bowl}).rim}
    assert rim == pytest.approx({"west": -0.06, "east": 0.06, "south": -0.02, "north": 0.02})


def test_contacts_are_with_the_nearest_facet() -> None:
    bodies, normal, overlap = touching(
        np.array([[0.0, 0.0, 0.0029], [0.0, 0.0272, 0.03], [0, 0, 0.03]]),
        np.full(3, 0.003),
        container().walls,
    )
    assert bodies.tolist() == [[0, 1], [3, 3]]
    assert overlap == pytest.approx([1e-4, 2e-4], abs=1e-9)
    assert normal == pytest.approx(np.array([[0, 0, -1], [0, 1, 0]]), abs=1e-9)


def test_particles_start_above_the_rim_within_it(made: Made) -> None:
    study = made(OWN_BOWL).study
    particles, inside = first_particles(study), study.bowl.container
    assert particles.positions_m[:, 2].min() > inside.rim_m
    outline = inside.sections(0.05)[0]
    away = np.linalg.norm(particles.positions_m[:, None, :2] - outline, axis=2).min(axis=1)
    assert (away > particles.radii_m).all()


# --- scripts, pictures and files -----------------------------------------------------------------


def test_the_mesh_is_in_the_wall_of_both_scenes(made: Made, project: Project) -> None:
    """A mesh that is in no wall would let its particles fall, without a message."""
    case = made({**deepcopy(OWN_BOWL), "bowl.lid_m": 0.055})
    text = script(case, project)
    assert "fix bowl all mesh/surface file bowl.stl" in text
    assert "meshes workpiece bowl" in text and "zplane 0.055" in text
    filling = filling_scene(case)
    mesh = filling.files["bowl.stl"]()
    assert mesh.count("endfacet") == 30 + 12
    assert process_scene(case, BED).case.bowl.own_facets.shape == (30, 3, 3)
    drawn = layout(case)
    assert len(drawn.lines) >= 5 and drawn.bowl.bounds[1, 2] == pytest.approx(0.06)


def test_a_raised_bowl_is_closed_below_its_new_rim() -> None:
    high = raised(body(hexagon(0.06, 0.06)), 0.1)
    rim = high.vertices[open_edges(high.faces)]
    assert len(rim) == 6 and (rim[:, :, 2] == 0.1).all()
    assert high.is_winding_consistent


def test_each_corner_names_the_runs(made: Made) -> None:
    case, other = made(OWN_BOWL), deepcopy(OWN_BOWL)
    other["bowl"]["facets_m"][7][4] += 1e-6
    after = made(other)
    for scene in (FILLING, PROCESS):
        assert scene.run_id(case) != scene.run_id(after)


def with_file(made: Made, project: Project, mesh: Trimesh, **bowl: Any) -> Case:
    folder = project.studies / "small"
    folder.mkdir(exist_ok=True)
    (folder / "bowl.stl").write_text(stl_text(mesh))
    own = {"kind": "mesh", "material": "steel", "height_m": 0.06, "file": "bowl.stl", "unit": "mm"}
    return made({**OWN_BOWL, "bowl": {**own, **bowl}})


def in_mm(corners: np.ndarray, lift: float = 0.0) -> Trimesh:
    return body(1e3 * np.add(corners, [0, 0, lift]))


@pytest.mark.parametrize("turned", [False, True])
def test_a_file_gives_the_same_bowl(turned: bool, made: Made, project: Project) -> None:
    """Whatever its height in the file, and whichever side its facets face."""
    corners = hexagon(0.06, 0.06)[:, ::-1] if turned else hexagon(0.06, 0.06)
    read = with_file(made, project, in_mm(corners, 0.3)).study.bowl.container
    given = container()
    np.testing.assert_allclose(read.levels, given.levels, rtol=1e-6)
    sides = [
        sorted(sorted(map(tuple, facet.round(7).tolist())) for facet in bowl.own_facets)
        for bowl in (read, given)
    ]
    assert sides[0] == sides[1]
    across, along = np.diff(read.own_facets, axis=1).transpose(1, 0, 2)
    assert np.cross(across, along)[:, 2].sum() > 0  # the floor faces up
    assert facets.is_inside(np.array([[0.0, 0.0, 0.01]]), read.own_facets).all()


def test_the_folder_of_a_run_needs_no_file(made: Made, project: Project) -> None:
    study = with_file(made, project, in_mm(hexagon(0.06, 0.06))).study
    again = Study.model_validate(study.plain())
    assert again.bowl == study.bowl


# --- what is refused -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("corners", "bowl", "says"),
    [
        (hexagon(0.06, 0.06)[1:], {}, "not closed at the bottom"),
        (hexagon(0.06, 0.06), {"unit": None}, "states no unit"),
        (hexagon(0.06, 0.06), {"unit": "cm"}, "height_m is 0.06, but the rim is 0.6"),
        (np.add(hexagon(0.06, 0.06), [0.05, 0, 0]), {}, "the z axis does not pass"),
        (hexagon(0.06, 0.06), {"facet_size_m": 0.004}, "facet_size_m cannot be used"),
        (hexagon(0.06, 0.06), {"file": "gone.stl"}, "no such file"),
        (hexagon(0.06, 0.06), {"file": None}, "needs a file"),
    ],
)
def test_bad_bowls_are_refused(
    corners: np.ndarray, bowl: dict[str, Any], says: str, made: Made, project: Project
) -> None:
    with pytest.raises(InputError, match=says):
        with_file(made, project, in_mm(corners), **bowl)


def test_a_solid_is_no_inner_surface(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="STEP") as caught:
        bowl_facets(tmp_path / "bowl.STEP", "mm")
    assert caught.value.field == "bowl.file" and "STL" in str(caught.value.remedy)


def test_a_slope_counts_as_wall(made: Made) -> None:
    """Below a workpiece in such a bowl, the floor is not where the lowest point is."""
    assert "gap between workpiece and floor" in dict(workpiece_notes(made({})))
    names = dict(workpiece_notes(made(deepcopy(OWN_BOWL))))
    assert "gap between workpiece and wall or floor" in names
    assert "gap between workpiece and floor" not in names


def test_a_closed_body_is_no_bowl(tmp_path: Path) -> None:
    (tmp_path / "solid.stl").write_text(stl_text(box(extents=(60, 60, 60))))
    with pytest.raises(InputError, match="no open top"):
        bowl_facets(tmp_path / "solid.stl", "mm")


def test_a_path_through_the_wall_is_refused(made: Made) -> None:
    line = {"kind": "line", "start_m": [-0.005, 0], "direction_deg": 90}
    process_scene(made({**OWN_BOWL, "motion.path": {**line, "length_m": 0.005}}), BED)
    with pytest.raises(InputError, match="no particle fits between the workpiece and the bowl"):
        process_scene(made({**OWN_BOWL, "motion.path": {**line, "length_m": 0.022}}), BED)
    with pytest.raises(InputError, match="does not fit between its path and the bowl"):
        process_scene(made({**OWN_BOWL, "motion.path": {**line, "length_m": 0.05}}), BED)
