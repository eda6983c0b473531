"""A workpiece from the user's mesh: what is said of it, repaired and refused."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.mesh import prism, surface, write_stl
from dragdeck.scenes.process import process_scene
from dragdeck.sweep.cases import load_cases

Dragged = Callable[..., Case]


@pytest.fixture
def dragged(small: dict[str, Any], write_study: Callable[..., Path]) -> Dragged:
    """A case that drags a hexagonal bar, some of its facets turned."""

    def made(length_m: float = 0.05, turned: tuple[int, ...] = ()) -> Case:
        name = f"bar-{len(turned)}.stl"
        small["workpiece"]["shape"] = {"kind": "mesh", "file": name, "unit": "m"}
        file = write_study(small)
        bar = prism(6, 0.004, length_m, 0.004, 0.004)
        faces = np.array(bar.faces)
        faces[list(turned)] = faces[list(turned), ::-1]
        write_stl(surface(bar.vertices, faces), file.parent / name)
        (only,) = load_cases(file)
        return only

    return made


def test_a_mesh_as_it_should_be_gives_no_warning(dragged: Dragged) -> None:
    assert "mesh" not in [one.code for one in process_scene(dragged()).warnings]


def test_turned_normals_are_repaired_with_a_word(dragged: Dragged) -> None:
    whole = process_scene(dragged()).meshes["workpiece.stl"]
    scene = process_scene(dragged(turned=(0, 7)))
    (said,) = (one for one in scene.warnings if one.code == "mesh")
    assert "bar-" in said.text and "normals" in said.text and "turned outwards" in said.text
    assert not said.settings
    assert scene.meshes["workpiece.stl"].face_normals == pytest.approx(whole.face_normals, abs=1e-6)


def test_a_workpiece_shorter_than_its_immersion_is_refused(dragged: Dragged) -> None:
    case = dragged(length_m=0.011)
    assert case.study.motion.immersion_depth_m > 0.011
    with pytest.raises(InputError, match="shorter than its immersion") as caught:
        process_scene(case)
    assert caught.value.field == "motion.immersion_depth_m"
    assert "0.011 m" in str(caught.value.limit)
