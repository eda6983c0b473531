"""Hostile meshes of a workpiece."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from attack.calls import main_of, refused
from attack.checked import ACCEPTED, REFUSED, WARNED, checked
from attack.ground import STUDY, new_project, tiny_study, write_study
from paths import ROOT

pytestmark = [pytest.mark.engine, pytest.mark.slow]
Mesh = tuple[str, Callable[[], bytes], tuple[str, ...]]


def _rod(sections: int = 12, radius: float = 4.0, height: float = 40.0) -> trimesh.Trimesh:
    rod = trimesh.creation.cylinder(radius=radius, height=height, sections=sections)
    rod.apply_translation([0, 0, 20])
    return rod


def _stl(mesh: trimesh.Trimesh) -> bytes:
    content: bytes = mesh.export(file_type="stl")
    return content


def _changed(**parts: object) -> bytes:
    rod = _rod()
    vertices, faces = np.array(rod.vertices), np.array(rod.faces)
    if "vertex" in parts:
        vertices[3] = parts["vertex"]
    if "turned" in parts:
        faces[parts["turned"]] = faces[parts["turned"]][..., ::-1]
    if "faces" in parts:
        faces = faces[parts["faces"]]
    if "scale" in parts:
        vertices = vertices * parts["scale"]
    return _stl(trimesh.Trimesh(vertices, faces, process=False))


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


def _part() -> bytes:
    return (ROOT / "meshes/shaft.step").read_bytes()


def _face_of(entity: bytes) -> bytes:
    """A part whose first face has another entity as its bound: OpenCASCADE crashes."""
    return re.sub(rb"(ADVANCED_FACE\('',\()#\d+", rb"\1" + entity, _part(), count=1)


_FILE = r"hostile\.\w+"
_NORMALS = (_FILE, "normal|inward|inside")
_BODIES = (_FILE, "bod|parts")
_HOSTILE: dict[str, Mesh] = {
    "inverted normals": (
        "stl",
        lambda: _changed(turned=slice(None)),
        _NORMALS,
    ),
    "one facet turned round": ("stl", lambda: _changed(turned=5), (_FILE,)),
    "two bodies": ("stl", lambda: _joined(_rod(), 12), _BODIES),
    "a body in a body": (
        "stl",
        lambda: _joined(_rod(8, 2.0, 20.0)),
        _BODIES,
    ),
    "a body through a body": ("stl", lambda: _joined(_rod(), 3), (_FILE,)),
    "the same body twice": ("stl", lambda: _joined(_rod()), (_FILE,)),
    "an open end": ("stl", lambda: _changed(faces=slice(2, None)), (_FILE,)),
    "a corner that is NaN": ("stl", lambda: _changed(vertex=np.nan), (_FILE,)),
    "a corner at infinity": ("stl", lambda: _changed(vertex=np.inf), (_FILE,)),
    "a corner at 1e30": ("stl", lambda: _changed(vertex=1e30), (_FILE,)),
    "all corners in one": ("stl", lambda: _changed(scale=0.0), (_FILE,)),
    "flat": ("stl", lambda: _changed(scale=np.array([1, 1, 0])), (_FILE,)),
    "metres as millimetres": ("stl", lambda: _changed(scale=1e-3), (_FILE, "unit")),
    "micrometres as millimetres": ("stl", lambda: _changed(scale=1e3), (_FILE, "unit")),
    "4 billion facets announced": ("stl", _absurd_count, (_FILE,)),
    "empty": ("stl", lambda: b"", (_FILE,)),
    "a header only": ("stl", lambda: _stl(_rod())[:84], (_FILE,)),
    "cut to half": ("stl", lambda: _stl(_rod())[:1000], (_FILE,)),
    "an OBJ in an STL": ("stl", _obj, (_FILE,)),
    "another format": ("step", lambda: b"ISO-10303-21;", (_FILE,)),
    "a STEP part cut to half": ("step", lambda: _part()[:28000], (_FILE,)),
    "a STEP part that crashes its reader": ("stp", lambda: _face_of(b"#1"), (_FILE, "damaged")),
    "a STEP part in metres": (
        "step",
        lambda: _part().replace(b".MILLI.", b"$"),
        (_FILE, "unit"),
    ),
    "a STEP part without its solid": (
        "step",
        lambda: _part().replace(b"MANIFOLD_SOLID_BREP", b"FACETED_BREP"),
        (_FILE,),
    ),
    "a script of gmsh in a STEP file": (
        "step",
        lambda: b'ISO-10303-21;\nSystemCall "touch pwned";\n',
        (_FILE,),
    ),
    "no suffix": ("", lambda: _stl(_rod()), ("hostile",)),
    "an index beyond": ("obj", lambda: _obj("f 1 2 999"), (_FILE,)),
    "an index of zero": ("obj", lambda: _obj("f 0 1 2"), (_FILE,)),
    "an index below zero": ("obj", lambda: _obj("f -1 -2 -999"), (_FILE,)),
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


@pytest.mark.attack(rows=_HOSTILE, sample=2)
def test_a_hostile_mesh_is_refused(attack: Mesh, tmp_path: Path) -> None:
    suffix, content, named = attack
    project = _project(suffix, content(), tmp_path)
    wanted = (REFUSED, WARNED, *([ACCEPTED] if attack is _HARMLESS else []))
    assert checked(project, named) in wanted


_FINE = {"1,000,000 facets in 10 s": 250_000}


@pytest.mark.attack(rows=_FINE, sample=0)
def test_a_fine_mesh_is_answered_in_10_s_of_processor_time(attack: int, tmp_path: Path) -> None:
    project = _project("stl", _stl(_rod(sections=attack)), tmp_path)
    refused(main_of("dragdeck", ["check", STUDY], project, 10.0))  # or accepted: it answers


def _project(suffix: str, content: bytes, folder: Path) -> Path:
    project = new_project(folder / "project")
    data = tiny_study()
    name = f"hostile.{suffix}" if suffix else "hostile"
    size = {"facet_size_m": 0.002} if suffix in ("step", "stp") else {}
    data["workpiece"]["shape"] = {"kind": "mesh", "file": name, "unit": "mm", **size}
    write_study(project, data)
    (project / "studies" / STUDY / name).write_bytes(content)
    return project
