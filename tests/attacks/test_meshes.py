"""Hostile meshes of a workpiece."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from attack.checked import ACCEPTED, REFUSED, WARNED, checked
from attack.ground import STUDY, new_project, tiny_study, write_study

pytestmark = [pytest.mark.engine, pytest.mark.slow]
Mesh = tuple[str, Callable[[], bytes], tuple[str, ...]]


def _rod() -> trimesh.Trimesh:
    rod = trimesh.creation.cylinder(radius=4.0, height=40.0, sections=12)
    rod.apply_translation([0, 0, 20])
    return rod


def _stl(mesh: trimesh.Trimesh) -> bytes:
    content: bytes = mesh.export(file_type="stl")
    return content


def _scaled(scale: object) -> bytes:
    """A rod whose coordinates are scaled; no corner is merged with another."""
    rod = _rod()
    return _stl(trimesh.Trimesh(rod.vertices * np.array(scale), rod.faces, process=False))


def _joined(other: trimesh.Trimesh, x: float = 0.0) -> bytes:
    """A rod and another body beside it."""
    other.apply_translation([x, 0, 0])
    return _stl(trimesh.util.concatenate([_rod(), other]))


def _obj(*faces: str) -> bytes:
    rod = _rod()
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in rod.vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in rod.faces]
    return "\n".join([*lines, *faces, ""]).encode()


def _absurd_count() -> bytes:
    content = bytearray(_stl(_rod()))
    content[80:84] = b"\xff\xff\xff\xff"
    return bytes(content)


_FILE = r"hostile\.\w+"
_HOSTILE: dict[str, Mesh] = {
    "a body through a body": ("stl", lambda: _joined(_rod(), 3), (_FILE,)),
    "the same body twice": ("stl", lambda: _joined(_rod()), (_FILE,)),
    "all corners in one": ("stl", lambda: _scaled(0.0), (_FILE,)),
    "flat": ("stl", lambda: _scaled([1, 1, 0]), (_FILE,)),
    "4 billion facets announced": ("stl", _absurd_count, (_FILE,)),
    "a header only": ("stl", lambda: _stl(_rod())[:84], (_FILE,)),
    "an OBJ in an STL": ("stl", _obj, (_FILE,)),
    "no suffix": ("", lambda: _stl(_rod()), ("hostile",)),
    "an index of 1e30": ("obj", lambda: _obj(f"f 1 2 {10**30}"), (_FILE,)),
    "a facet of two corners": ("obj", lambda: _obj("f 1 2"), (_FILE,)),
    "a facet of 1000 corners": ("obj", lambda: _obj("f " + " ".join(["1", "2"] * 500)), (_FILE,)),
    "a facet with a hole": ("obj", lambda: _obj("f 1 1 1"), (_FILE,)),
    "text in a corner": ("obj", lambda: _obj("v a b c"), (_FILE,)),
    "a corner of two numbers": ("obj", lambda: _obj("v 1 2"), (_FILE,)),
    "a material from /etc/passwd": ("obj", lambda: _obj("mtllib /etc/passwd"), (_FILE,)),
    "PLY that announces 1e12 corners": (
        "ply",
        lambda: (
            b"ply\nformat ascii 1.0\nelement vertex 1000000000000\nproperty float x\n"
            b"property float y\nproperty float z\nelement face 1\nproperty list uchar int "
            b"vertex_indices\nend_header\n0 0 0\n"
        ),
        (_FILE,),
    ),
    "VTK that announces 1e12 points": (
        "vtk",
        lambda: (
            b"# vtk DataFile Version 3.0\na\nASCII\nDATASET UNSTRUCTURED_GRID\n"
            b"POINTS 1000000000000 float\n0 0 0\n"
        ),
        (_FILE,),
    ),
}


_HARMLESS = _HOSTILE["a material from /etc/passwd"]


@pytest.mark.attack(sample=2)
@pytest.mark.parametrize("attack", _HOSTILE.values(), ids=_HOSTILE)
def test_a_hostile_mesh_is_refused(attack: Mesh, tmp_path: Path) -> None:
    suffix, content, named = attack
    project = _project(suffix, content(), tmp_path)
    wanted = (REFUSED, WARNED, *([ACCEPTED] if attack is _HARMLESS else []))
    assert checked(project, named) in wanted


def _project(suffix: str, content: bytes, folder: Path) -> Path:
    project = new_project(folder / "project")
    data = tiny_study()
    name = f"hostile.{suffix}" if suffix else "hostile"
    data["workpiece"]["shape"] = {"kind": "mesh", "file": name, "unit": "mm"}
    write_study(project, data)
    (project / "studies" / STUDY / name).write_bytes(content)
    return project
