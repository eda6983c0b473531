"""Fuzzed dumps, tables and meshes: the right values, or an error that names the file."""

from pathlib import Path

import pytest
import trimesh
from attack.calls import main_of
from attack.fuzz import FUZZES
from attack.ground import SEED

from dragdeck.errors import InputError
from dragdeck.mesh.checks import findings
from dragdeck.mesh.files import read

FEW, MANY = 150, 3000
"""Examples of each fuzz in the sample, and in the whole suite."""


@pytest.mark.engine
@pytest.mark.slow
@pytest.mark.attack(sample=3)
@pytest.mark.parametrize("attack", FUZZES, ids=[f"fuzzed {name}" for name in FUZZES])
def test_it_is_read_rightly_or_refused(
    attack: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    examples = MANY if request.config.getoption("--attacks") else FEW
    said = main_of("fuzz", (attack, SEED, examples), tmp_path, 300.0)
    assert said.status == 0, said.tail


ROD = trimesh.creation.cylinder(radius=4.0, height=40.0, sections=12)
STL, OBJ = ROD.export(file_type="stl"), f"{ROD.export(file_type='obj')}\n".encode()
FLAT = trimesh.Trimesh(ROD.vertices * [1, 1, 0], ROD.faces, process=False)
PLY = b"""ply\nformat ascii 1.0\nelement vertex 1000000000000\nproperty float x\nproperty float y
property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n"""
VTK = b"""# vtk DataFile Version 3.0\na\nASCII\nDATASET UNSTRUCTURED_GRID
POINTS 1000000000000 float\n0 0 0\n"""


@pytest.mark.parametrize(
    ("suffix", "content"),
    [
        *((".stl", FLAT.export(file_type="stl")), (".stl", OBJ), ("", STL)),
        *((".stl", STL[:84]), (".stl", STL[:80] + b"\xff" * 4 + STL[84:])),
        *((".obj", OBJ + line) for line in (b"f 1 2", b"f 1 1 1", b"v a b c", b"v 1 2")),
        *((".obj", OBJ + b"f 1 2 " + number) for number in (b"9" * 30, b"1 2 " * 250)),
        *((".ply", PLY), (".vtk", VTK)),
    ],
)
def test_a_hostile_mesh_is_refused(suffix: str, content: bytes, tmp_path: Path) -> None:
    file = tmp_path / f"hostile{suffix}"
    file.write_bytes(content)
    try:
        refused = findings(read(file, "mm"))
    except InputError as error:
        refused = [str(error)] if file.name in str(error) else []
    assert refused
