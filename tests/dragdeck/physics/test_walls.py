"""Distances from the walls of a bowl."""

from typing import Literal

import numpy as np
import pytest
from trimesh import Trimesh

from dragdeck.mesh import shapes
from dragdeck.physics import facets
from dragdeck.physics.walls import Wall


@pytest.mark.parametrize(
    ("inwards", "mesh"),
    [(-1, shapes.bowl(0.04, 0.1, 0.008)), (1, shapes.tube(0.04, 0.1, 0.008))],
    ids=["bowl", "column"],
)
def test_a_cylinder_that_is_a_mesh_has_the_distances_of_its_facets(
    inwards: Literal[1, -1], mesh: Trimesh
) -> None:
    """Far from floor and ends; and the ideal cylinder is off by the height of the corners."""
    wall = Wall(name="side", shape="zcylinder", at_m=0.04, inwards=inwards)
    random = np.random.default_rng(3)
    angle, gap = random.uniform(0, 2 * np.pi, 200), random.uniform(0.0005, 0.004, 200)
    place = 0.04 + inwards * gap + (0.0008 if inwards > 0 else 0.0)
    points = np.column_stack([place * np.cos(angle), place * np.sin(angle), np.full(200, 0.05)])
    expected, towards = facets.nearest(points, np.array(mesh.triangles))
    polygon = wall.model_copy(update={"sides": shapes.polygon_sides(0.04, 0.008)})
    distance, normal = polygon.contacts(points)
    np.testing.assert_allclose(distance, expected, atol=1e-9)
    np.testing.assert_allclose(normal, towards, atol=1e-6)
    assert np.abs(wall.contacts(points)[0] - expected).max() > 1e-4


def test_a_cone_has_the_distances_of_its_facets() -> None:
    """A column that narrows upwards, with points in front of sides and corners."""
    ends = (0.04, 0.0), (0.03, 0.1)
    random = np.random.default_rng(3)
    angle, gap = random.uniform(0, 2 * np.pi, 300), random.uniform(0.0005, 0.003, 300)
    height = random.uniform(0.02, 0.08, 300)
    place = 0.0408 - 0.1 * height + gap
    points = np.column_stack([place * np.cos(angle), place * np.sin(angle), height])
    expected, towards = facets.nearest(points, np.array(shapes.revolved(ends, 0.008).triangles))
    sides = shapes.polygon_sides(0.04, 0.008)
    wall = Wall(name="part_1", shape="cone", ends_m=(*ends[0], *ends[1]), sides=sides)
    distance, normal = wall.contacts(points)
    np.testing.assert_allclose(distance, expected, atol=5e-6)
    np.testing.assert_allclose(normal, towards, atol=2e-2)
