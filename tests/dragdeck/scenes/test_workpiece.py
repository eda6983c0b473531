"""A workpiece from the user's mesh: what is said of it, repaired and refused."""

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from blades import twisted_blade
from trimesh import Trimesh

from dragdeck.cases.bed import box_half_widths
from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.mesh.contacts import gap_fraction
from dragdeck.mesh.files import stl_text
from dragdeck.mesh.shapes import prism
from dragdeck.mesh.surface import surface
from dragdeck.scenes.bed_space import expected_bed
from dragdeck.scenes.fit import clearances
from dragdeck.scenes.motion import course
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.scenes.workpiece import (
    fastest_surface,
    reference_height,
    workpiece_mesh,
    workpiece_radius,
)
from dragdeck.sweep.cases import load_cases

Dragged = Callable[..., Case]


@pytest.fixture
def dragged(small: dict[str, Any], write_study: Callable[..., Path]) -> Dragged:
    """A case that drags a hexagonal bar, some of its facets turned."""

    def made(length_m: float = 0.05, turned: tuple[int, ...] = (), **shape: object) -> Case:
        name = f"bar-{len(turned)}.stl"
        small["workpiece"]["shape"] = {"kind": "mesh", "file": name, "unit": "m", **shape}
        file = write_study(small)
        bar = prism(6, 0.004, length_m, 0.004, 0.004)
        faces = np.array(bar.faces)
        faces[list(turned)] = faces[list(turned), ::-1]
        (file.parent / name).write_text(stl_text(surface(bar.vertices, faces)))
        (only,) = load_cases(file)
        return only

    return made


def test_a_mesh_as_it_should_be_gives_no_warning(dragged: Dragged) -> None:
    assert "mesh" not in [one.code for one in process_scene(dragged()).warnings]


def test_turned_normals_are_repaired_with_a_word(dragged: Dragged) -> None:
    whole, case = workpiece_mesh(dragged()), dragged(turned=(0, 7))
    scene = process_scene(case)
    (said,) = (one for one in scene.warnings if one.code == "mesh")
    assert "bar-" in said.text and "normals" in said.text and "turned outwards" in said.text
    assert not said.settings
    assert workpiece_mesh(case).face_normals == pytest.approx(whole.face_normals, abs=1e-6)


def test_a_workpiece_shorter_than_its_immersion_is_refused(dragged: Dragged) -> None:
    case = dragged(length_m=0.011)
    assert case.study.motion.immersion_depth_m > 0.011
    with pytest.raises(InputError, match="shorter than its immersion") as caught:
        process_scene(case)
    assert caught.value.field == "motion.immersion_depth_m"
    assert "0.011 m" in str(caught.value.limit)


def test_a_part_that_was_moved_off_its_axis_is_told_so(dragged: Dragged) -> None:
    with pytest.raises(InputError, match="does not fit") as caught:
        process_scene(dragged(offset_m=[0.1, 0.02]))
    assert caught.value.remedy.startswith("leave workpiece.shape.offset_m out")


def test_a_part_that_lies_is_turned_upright_and_moved_to_its_clamping_axis(
    dragged: Dragged,
) -> None:
    whole = workpiece_mesh(dragged())
    case = dragged(axis="-z")
    assert workpiece_mesh(case).bounds == pytest.approx(whole.bounds)
    assert PROCESS.run_id(case) != PROCESS.run_id(dragged())
    moved = workpiece_mesh(dragged(offset_m=[0.001, 0]))
    assert moved.bounds[0] == pytest.approx(whole.bounds[0] - [0.001, 0, 0])


def test_the_default_axis_names_no_new_run(dragged: Dragged) -> None:
    plain = dragged().study.workpiece.shape.plain()
    assert plain == dragged(axis="+z").study.workpiece.shape.plain()
    assert set(plain) == {"kind", "file", "unit"}


@pytest.mark.parametrize(
    ("shape", "field", "words"),
    [
        ({"file": "a.STEP"}, "facet_size_m", "but the facet size is missing"),
        ({"file": "a.stl", "unit": None}, "unit", "states no unit"),
        (
            {"file": "a.obj", "edge_facet_size_m": 0.001},
            "edge_facet_size_m",
            "is a mesh: its sharp",
        ),
        ({"file": "a.stp", "facet_size_m": 0.001, "edge_facet_size_m": 0.002}, "edge_", "larger"),
        ({"file": "a.stp", "facet_size_m": 1.5}, "facet_size_m", "1.5 mm"),
        ({"file": "a.stp", "facet_size_m": 0.002, "edge_facet_size_m": 1.5}, "edge_", "1.5 mm"),
        ({"axis": "z"}, "axis", "'+x', '-x'"),
        ({"offset_m": [0.1]}, "offset_m", "required"),
        ({"offset_m": [20, 0]}, "offset_m.0", "20 mm"),
    ],
)
def test_fields_that_do_not_fit_are_named(
    dragged: Dragged, shape: dict[str, object], field: str, words: str
) -> None:
    with pytest.raises(InputError) as caught:
        dragged(**shape)
    assert f"workpiece.shape.{field}" in str(caught.value)
    assert words in str(caught.value)


def test_a_step_part_is_meshed_checked_and_placed(dragged: Dragged) -> None:
    pytest.importorskip("gmsh", reason="gmsh is not made for every machine")
    shape = {"file": "shaft.step", "unit": "mm", "facet_size_m": 0.003, "axis": "+x"}
    found = workpiece_mesh(dragged(**shape))
    assert found.bounds[:, 2] == pytest.approx([0.0, 0.085])
    assert found.is_watertight
    with pytest.raises(InputError, match="another unit") as caught:
        workpiece_mesh(dragged(**{**shape, "unit": "m"}))
    assert "shaft.step: workpiece.shape.unit" in str(caught.value)


# --- wide above the bed --------------------------------------------------------------------------


def flared(wide_m: float, above_m: float, bottom_m: float = 0.008) -> Trimesh:
    """A square bar of 80 mm whose upper part, from a height on, is a plate of another width."""
    sections = ((0.0, bottom_m), (above_m, bottom_m), (above_m + 0.001, wide_m), (0.08, wide_m))
    square = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / 2
    points = np.vstack([np.c_[width * square, np.full(4, z)] for z, width in sections])
    ring = np.arange(4)
    beside = (ring + 1) % 4
    sides = [
        np.column_stack([low + one, low + two, low + 4 + three])
        for low in (0, 4, 8)
        for one, two, three in ((ring, beside, beside), (ring, beside + 4, ring))
    ]
    ends = [[[0, 2, 1], [0, 3, 2]], [[12, 13, 14], [12, 14, 15]]]
    return surface(points, np.vstack([*sides, *ends]))


@pytest.fixture
def with_part(small: dict[str, Any], write_study: Callable[..., Path]) -> Callable[..., Case]:
    """A case that drags a mesh."""
    number = itertools.count()

    def made(mesh: Trimesh, **motion: object) -> Case:
        name = f"part-{next(number)}.stl"
        small["workpiece"]["shape"] = {"kind": "mesh", "file": name, "unit": "m"}
        small["motion"].update(motion)
        file = write_study(small)
        (file.parent / name).write_text(stl_text(mesh))
        (only,) = load_cases(file)
        return only

    return made


SPIN = {"spin": {"rpm": 300}}


@pytest.mark.parametrize("wide_m", [0.02, 0.03, 0.045])
def test_a_part_that_is_wide_above_the_bed_is_that_of_its_lower_part(
    with_part: Callable[..., Case], wide_m: float
) -> None:
    """Holder plates within the bowl, up to its wall and beyond: gap, speed, numbers, warnings."""
    bar = with_part(flared(0.008, above_m=0.02), **SPIN)
    assert bar.study.motion.immersion_depth_m == 0.015
    straight = process_scene(bar)
    plate = with_part(flared(wide_m, above_m=0.02), **SPIN)
    scene = process_scene(plate)
    assert scene.case.workpiece.radius_m == straight.case.workpiece.radius_m
    assert scene.case.numbers == straight.case.numbers
    assert clearances(plate, 0.03) == clearances(bar, 0.03)
    assert fastest_surface(plate) == fastest_surface(bar)
    left_out = [str(one) for one in scene.warnings if "leave the simulation box" in one.text]
    assert bool(left_out) is (wide_m == 0.045)
    assert set(map(str, scene.warnings)) - set(left_out) == set(map(str, straight.warnings))


def test_a_part_that_is_wide_in_the_bed_is_refused(with_part: Callable[..., Case]) -> None:
    with pytest.raises(InputError, match="does not fit between its path and the bowl"):
        process_scene(with_part(flared(0.045, above_m=0.012)))
    deep = with_part(flared(0.045, above_m=0.02), immersion_depth_m=0.0201)
    assert workpiece_radius(deep) == pytest.approx(np.hypot(*2 * [0.004 + 0.1 * 0.0185]))


TROUGH = {
    "kind": "trough",
    "material": "steel",
    "length_m": 0.06,
    "width_m": 0.04,
    "height_m": 0.05,
}
LINE = {"path": {"kind": "line", "start_m": [-0.01, 0], "length_m": 0.02}, "plunge_at_m": None}
LEANING = [[0, -0.003, 0], [0.5, 0.003, 0, 0, 0, 8, 0], [1, 0.006, 0, 0, 0, -8, 0]]


@pytest.mark.parametrize(
    ("bowl", "motion"),
    [
        ({}, {}),
        ({}, {"tilt_deg": 5}),
        ({}, {"tilt_deg": 8, "spin": {"rpm": 60}}),
        ({}, {"path": {"kind": "waypoints", "points": LEANING}, "speed_m_s": None}),
        (TROUGH, LINE),
    ],
)
def test_facets_that_would_leave_the_box_are_not_written(
    with_part: Callable[..., Case], small: dict[str, Any], bowl: Any, motion: Any
) -> None:
    """LIGGGHTS ends a run if the centre of a facet leaves its box, as it leans and spins too."""
    small["bowl"] = bowl or small["bowl"]
    case = with_part(flared(0.09, above_m=0.04), **motion)
    scene = process_scene(case)
    lines = [line.split() for line in scene.files["workpiece.stl"]().splitlines()]
    corners = np.array([line[1:] for line in lines if line[0] == "vertex"], float)
    whole = workpiece_mesh(case)
    written = surface(corners, np.arange(len(corners)).reshape(-1, 3))
    assert 0 < len(written.faces) < len(whole.faces)
    in_bed = [(mesh.triangles[:, :, 2].min(axis=1) < 0.015).sum() for mesh in (whole, written)]
    assert in_bed[0] == in_bed[1] > 0
    way = course(case.study, expected_bed(case.study), reference_height(case))
    for leg in way.legs:
        places, turns = way.poses(leg, np.linspace(0, leg.steps, 50))
        turned = np.einsum("nij,fj->nfi", turns.matrices, written.triangles_center)
        farthest = np.abs(places[:, None] + turned).max(axis=(0, 1))[:2]
        assert (farthest <= box_half_widths(case.study)).all()


def test_a_facet_from_the_bed_out_of_the_box_is_refused(with_part: Callable[..., Case]) -> None:
    """A funnel whose sides are two facets each."""
    points = np.array(prism(4, 0.0056, 0.08, 0.08, 0.08).vertices)
    points[:, :2] *= 1 + 180 * points[:, 2:]
    funnel = surface(points, prism(4, 0.0056, 0.08, 0.08, 0.08).faces)
    path = {"kind": "circle", "radius_m": 0.002, "revolutions": 2}
    with pytest.raises(InputError, match="reaches from the bed out of the simulation box"):
        process_scene(with_part(funnel, path=path, immersion_depth_m=0.01))


def test_gaps_between_nearly_coplanar_facets_are_remarked(with_part: Callable[..., Case]) -> None:
    """A face of 50 mm radius in 96 strips, 0.19 degrees apart, or in 48, whose edges are active.

    For each mm along the blade, centres touch the gaps on 2 x 0.32 rad x 3.27 mm. In all they have
    2 x 16.1 mm, the sharp edges' 2 x 2.82 rad x 3.27 mm, and the ends' share of 7.2 mm.
    """
    flat = {"chord": 0.016, "thickness": 0.00129, "length": 0.05, "twist_deg": 0, "cell_skew": 0}
    many, few = (twisted_blade(across=strips, rings=4, **flat) for strips in (96, 48))
    assert gap_fraction(many, 0.00327) == pytest.approx(2.1 / (32.2 + 2.1 + 18.4 + 7.2), rel=0.03)
    (said,) = (one.text for one in process_scene(with_part(many)).warnings if one.code == "mesh")
    assert "overlooks contacts on" in said and "larger facets" in said
    assert not [one for one in process_scene(with_part(few)).warnings if one.code == "mesh"]
