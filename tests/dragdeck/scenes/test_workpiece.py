"""A workpiece from the user's mesh: what is said of it, repaired and refused."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.mesh.files import stl_text
from dragdeck.mesh.shapes import prism
from dragdeck.mesh.surface import surface
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.scenes.workpiece import workpiece_mesh
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
        ({"file": "a.stl", "facet_size_m": 0.001}, "facet_size_m", "a mesh already"),
        ({"file": "a.obj", "edge_facet_size_m": 0.001}, "edge_facet_size_m", "a mesh already"),
        (
            {"file": "a.stp", "facet_size_m": 0.001, "edge_facet_size_m": 0.002},
            "edge_facet_size_m",
            "larger than the others",
        ),
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
