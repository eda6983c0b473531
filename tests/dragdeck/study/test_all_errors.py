"""Every error of a study is named at once: fields, tables, meshes, and all defects of each."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from dragdeck.errors import InputError
from dragdeck.mesh.checks import findings
from dragdeck.mesh.files import stl_text
from dragdeck.mesh.shapes import cylinder
from dragdeck.mesh.surface import surface
from dragdeck.sweep.cases import load_cases

Write = Callable[..., Path]


def damaged(folder: Path) -> Path:
    """An STL file with a hole, and with a facet that is given twice."""
    body = cylinder(0.004, 0.03, 0.002, 0.01)
    faces = np.vstack([body.faces[:-1], body.faces[:1]])
    file = folder / "part.stl"
    file.write_text(stl_text(surface(body.vertices, faces)))
    return file


@pytest.mark.parametrize("valid", [True, False])
def test_fields_tables_and_meshes_are_named_together(
    small: dict[str, Any], write_study: Write, valid: bool
) -> None:
    """Seven unknown keys, a bad particle mesh, two bad tables, and a bad part with its defects."""
    small["media"] |= {"shape": {"kind": "mesh", "points": "grain.stl", "spheres": 4}}
    small["media"] |= {"sieve": "sieve.csv"}
    small["motion"] |= {"path": {"kind": "waypoints", "file": "path.csv"}, "speed_m_s": None}
    small["workpiece"] |= {"shape": {"kind": "mesh", "file": "part.stl", "unit": "m"}}
    small |= {} if valid else {f"unknown_{n}": n for n in range(7)}
    file = write_study(small)
    damaged(file.parent)
    (file.parent / "grain.stl").write_text("solid\nendsolid\n")
    (file.parent / "sieve.csv").write_text("diameter_m,mass_passing\n0.004,0\n0.006\n")
    (file.parent / "path.csv").write_text("time_s,x_m,y_m\n0,a,0\n1,0.01,b\n")
    with pytest.raises(InputError) as caught:
        load_cases(file)
    said = str(caught.value)
    words = ["path.csv:2: x_m", "path.csv:3: y_m", "sieve.csv:3: the row has 1 values"]
    words += ["grain.stl", "a facet is duplicated", "the mesh is not closed"]
    words += [] if valid else [f"unknown_{n}: unknown key" for n in range(7)]
    assert [word for word in words if word not in said] == []
    assert "give either file or points" not in said
    assert "a list is required" not in said


def test_a_good_table_hides_no_error_elsewhere(small: dict[str, Any], write_study: Write) -> None:
    small["motion"] |= {"path": {"kind": "waypoints", "file": "none.csv", "fraction": 2}}
    small["motion"]["path"]["unknown"] = 1
    with pytest.raises(InputError) as caught:
        load_cases(write_study(small))
    for words in ("no such file", "motion.path.unknown: unknown key", "fraction: the value is out"):
        assert words in str(caught.value)


def test_a_sharp_facet_beside_one_without_area_is_found() -> None:
    corners = [[0, 0, 0], [0.01, 0, 0], [0.02, 0, 0], [0, 0.01, 0], [0.01, 1e-5, 0]]
    found = findings(surface(np.array(corners), np.array([[0, 1, 2], [0, 2, 4], [0, 1, 3]])))
    problems = [one.problem for one in found if one.severity == "error"]
    assert {"a facet has no area", "the angle of a facet is too sharp for LIGGGHTS"} <= {*problems}
