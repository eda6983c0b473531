"""Kinds of bowl: walls, sections, meshes, places of the particles, and what is refused."""

from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bowls import OWN_BOWL, SMALL_BOWLS
from made_study import Made, plain_study
from scipy.spatial import KDTree

from dragdeck.decks import CASE_FILE
from dragdeck.errors import InputError
from dragdeck.physics.contact_network import touching
from dragdeck.physics.domain_split import FilledBowl, split
from dragdeck.records.case import load_case
from dragdeck.scenes.bed_space import first_particles
from dragdeck.scenes.process import process_scene
from dragdeck.study.bowls.bowl import Bowl
from dragdeck.study.check import validate
from dragdeck.study.model import Study


def bowl(name: str) -> Bowl:
    shape = {"material": "steel"} | (SMALL_BOWLS | {"own": OWN_BOWL})[name]["bowl"]
    return Study.model_validate({**plain_study({}), "bowl": shape}).bowl


UNUSABLE = [
    ([[0, 0], [0, 0.02], [0.032, 0.05]], "only the first point"),
    ([[0, 0], [0.03, 0.04], [0.03, 0], [0.01, 0.03], [0.032, 0.05]], "crosses itself"),
    ([[0, 0], [0.032, 0], [0.032, 0.04], [0.032, 0.02], [0.032, 0.05]], "crosses itself"),
    ([[0, 0], [1e-4, 0], [0.032, 0], [0.032, 0.05]], "too sharp for LIGGGHTS"),
    ([[0, 0], [0.032, 0], [0.03201, 1e-6], [0.0321, 0.05]], "too sharp for LIGGGHTS"),
]
"""Profiles of a bowl, and what is wrong with them."""


def test_a_cylinder_is_what_a_bowl_was() -> None:
    assert set(plain_study({})["bowl"]) == {"material", "radius_m", "height_m"}


@pytest.mark.parametrize("name", SMALL_BOWLS)
def test_the_mesh_leaves_the_space_between_the_walls_clear(name: str) -> None:
    shape = bowl(name)
    mesh, inside = shape.mesh(0.06, 0.004), shape.container
    top = mesh.vertices[mesh.vertices[:, 2] > 0.059, :2]
    assert -0.0002 < inside.side_distance(top).min() <= inside.side_distance(top).max() < 2e-5
    assert mesh.bounds[0, 2] == 0 and mesh.bounds[1, 2] == pytest.approx(0.06)
    area = (mesh.area_faces * mesh.face_normals[:, 2]).sum()
    assert area == pytest.approx(inside.levels[-1][1], rel=0.03)  # the floor faces up
    inwards = -(mesh.face_normals * mesh.triangles_center)[:, :2].sum(axis=1)
    away = np.hypot(*mesh.triangles_center[:, :2].T)
    outer = away > 0.8 * away.max()
    assert (inwards[outer] > -1e-12).all()
    rim = mesh.edges_unique[np.bincount(mesh.edges_unique_inverse) == 1]
    assert mesh.vertices[rim][:, :, 2].min() == pytest.approx(0.06)  # closed at the bottom


@pytest.mark.parametrize("profile", [[[0, 0], [0.024, 0.008], [0.032, 0.05]], None])
def test_lines_of_a_bowl_have_a_length(profile: list[list[float]] | None) -> None:
    """Also of a floor that rises from a point on the axis."""
    shape = SMALL_BOWLS["revolved"]["bowl"] | ({"profile_m": profile} if profile else {})
    data = {**plain_study({}), "bowl": {"material": "steel"} | shape}
    lines = list(Study.model_validate(data).bowl.container.lines(0.04))
    assert len(lines) > 6 and min(np.ptp(line, axis=0).max() for line in lines) > 1e-3


@pytest.mark.parametrize("changes", [*SMALL_BOWLS.values(), OWN_BOWL], ids=[*SMALL_BOWLS, "own"])
def test_a_run_knows_its_bowl(changes: dict[str, Any], made: Made, tmp_path: Path) -> None:
    """``case.json`` has the study, which is read strictly."""
    written = process_scene(made({**deepcopy(changes), "motion.immersion_depth_m": 0.01})).case
    file = tmp_path / CASE_FILE
    file.write_text(written.as_text())
    read = load_case(tmp_path)
    assert read.study is not None and read.study.bowl == written.study.bowl


@pytest.mark.parametrize("name", SMALL_BOWLS)
def test_particles_start_within_the_walls(name: str, made: Made) -> None:
    study = made(SMALL_BOWLS[name]).study
    particles, inside = first_particles(study), study.bowl.container
    gaps = [wall.contacts(particles.positions_m)[0] for wall in inside.walls]
    assert (np.min(gaps, axis=0) > particles.radii_m).all()
    near = KDTree(particles.positions_m).query(particles.positions_m, 2)[0][:, 1]
    assert near.min() > 2 * particles.radii_m.min()
    bodies, *_ = touching(particles.positions_m, particles.radii_m, inside.walls)
    assert not bodies.size


@pytest.mark.parametrize("name", [*SMALL_BOWLS, "own"])
def test_ranks_share_the_whole_section(name: str) -> None:
    inside = bowl(name).container
    x, y = (half + 0.004 for half in inside.half_widths_m)
    for ranks in (2, 4, 6):
        filled = FilledBowl(1000, inside, 0.03, (x, y), -0.003, 0.2, 0.0)
        assert sum(split(ranks, filled).particles) == pytest.approx(1000, rel=0.01)
    assert inside.height_m(inside.volume_m3(0.02)) == pytest.approx(0.02, rel=1e-3)


def test_contacts_with_a_column_and_with_planes() -> None:
    ring, box = bowl("annulus").container, bowl("trough").container
    at = np.array([[0.0, 0.0129, 0.02], [0.0395, 0.0, 0.0029]])
    bodies, normal, overlap = touching(at, np.full(2, 0.003), ring.walls)
    assert bodies.tolist() == [[1, 0], [2, 2]]
    assert overlap == pytest.approx([1e-4, 1e-4])
    assert normal == pytest.approx(np.array([[0, 0, -1], [0, -1, 0]]))
    bodies, normal, overlap = touching(
        np.array([[-0.0371, 0.0196, 0.1]]), np.full(1, 0.003), box.walls
    )
    assert sorted(map(tuple, normal.tolist())) == [(-1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    assert overlap == pytest.approx([1e-4, 1e-4])


@pytest.mark.parametrize("name", ["revolved", "ring"])
def test_distances_from_a_revolved_bowl_are_those_from_its_facets(name: str) -> None:
    import pyvista

    shape = bowl(name)
    mesh, inside = shape.mesh(0.05, shape.own_facet_size_m or 0.0), shape.container
    surface = pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces)
    points = np.random.default_rng(1).uniform([-0.05, -0.05, 0.001], [0.05, 0.05, 0.045], (4000, 3))
    points = points[np.abs(inside.distance(points) - 0.0025) < 0.0015]
    _, nearest = surface.find_closest_cell(points, return_closest_point=True)
    away = np.linalg.norm(points - nearest, axis=1)
    assert len(points) > 200
    assert inside.distance(points) == pytest.approx(away, abs=1e-5)


@pytest.mark.parametrize(
    ("name", "changes", "problem"),
    [
        ("annulus", {"bowl.core_radius_m": 0.05}, "not below radius_m"),
        ("annulus", {"bowl.core_radius_m": 0.0205}, "no particle fits"),
        ("annulus", {"bowl.core_radius_m": 0.026}, "does not fit"),
        ("annulus", {"motion.plunge_at_m": None}, "does not fit"),
        ("annulus", {"motion.plunge_at_m": [-0.028, 0.0]}, "does not fit"),
        ("trough", {"motion.path.length_m": 0.05}, "no particle fits|does not fit"),
        ("trough", {"bowl.width_m": 0.019}, "no particle fits"),
        ("trough", {"bowl.width_m": 0.006}, "room to fall"),
        ("lid", {"bowl.lid_m": 0.02}, "lid is not above"),
        ("revolved", {"bowl.profile_m": [[0.01, 0], [0.032, 0.05]]}, "not closed at the bottom"),
        ("revolved", {"bowl.profile_m": [[0, 0], [0.032, 0.04]]}, "must end at the rim"),
        *(("revolved", {"bowl.profile_m": profile}, problem) for profile, problem in UNUSABLE),
        ("revolved", {"bowl.facet_size_m": 0.5}, r"bowl\.facet_size_m: .*too coarse"),
        ("revolved", {"bowl.facet_size_m": 1e-5}, r"bowl\.facet_size_m: .*would need"),
        ("revolved", {"motion.path.radius_m": 0.022}, "no particle fits|does not fit"),
        ("ring", {"motion.path.radius_m": 0.022}, "no particle fits|does not fit"),
        ("lid", {"bowl.lid_m": 0.2}, "above the rim"),
        ("lid", {"bowl.kind": "bucket"}, "unknown kind"),
    ],
)
def test_what_does_not_fit_is_refused(
    name: str, changes: dict[str, Any], problem: str, made: Made
) -> None:
    with pytest.raises(InputError, match=problem):
        process_scene(made({**deepcopy(SMALL_BOWLS[name]), **changes}))


def test_only_a_round_bowl_rotates() -> None:
    rest = {"kind": "rest", "radius_m": 0.01, "bowl_rpm": 20}
    data = plain_study({"bowl": {"material": "steel"} | SMALL_BOWLS["trough"]["bowl"]})
    data["motion"] = {**data["motion"], "path": rest, "speed_m_s": None}
    with pytest.raises(InputError, match="trough cannot rotate"):
        validate(data, "study.yaml")
