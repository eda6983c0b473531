"""A box in files as programs write them, and as they should not: read rightly, or refused."""

import gzip
import locale
import math
import struct
import tracemalloc
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path

import meshio
import numpy as np
import pytest
import pyvista
import trimesh
from trimesh import Trimesh
from vtkmodules.vtkIOLegacy import vtkPolyDataWriter, vtkUnstructuredGridWriter

from dragdeck.errors import InputError
from dragdeck.mesh.checks import check, findings
from dragdeck.mesh.files import read
from dragdeck.mesh.vtk_legacy import vtk_legacy

POINTS = [(x, y, z) for z in (0, 40) for y in (-6, 6) for x in (-6, 6)]
QUADS = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
FACETS = [facet for a, b, c, d in QUADS for facet in ((a, b, c), (a, c, d))]
BOX = 12, 2 * 12 * 12 + 4 * 12 * 40, 12 * 12 * 40
"""Facets, area in mm2 and volume in mm3."""

NODES = "".join(f"v {x} {y} {z}\n" for x, y, z in POINTS)
ROWS = "".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACETS)
POLYGONS = "".join("f " + " ".join(str(node + 1) for node in quad) + "\n" for quad in QUADS)


def prism(*corners: tuple[float, float]) -> bytes:
    """An OBJ file of a right prism, 30 mm high, of two polygons and rectangles."""
    count = len(corners)
    nodes = "".join(f"v {x} {y} {z}\n" for z in (0, 30) for x, y in corners)
    ends = [range(count, 0, -1), range(count + 1, 2 * count + 1)]
    sides = [(k, k % count + 1, k % count + 1 + count, k + count) for k in range(1, count + 1)]
    return (nodes + "".join(f"f {' '.join(map(str, face))}\n" for face in [*ends, *sides])).encode()


def stl(name: str = "solid x", end: str = "endsolid x", facets: Sequence[Sequence[int]] = FACETS,
        normal: str = "facet normal 0 0 1", form: str = "{}") -> str:  # fmt: skip
    rows = [
        f"{normal}\nouter loop\n"
        + "".join(f"vertex {' '.join(map(form.format, POINTS[node]))}\n" for node in facet)
        + "endloop\nendfacet\n"
        for facet in facets
    ]
    return f"{name}\n{''.join(rows)}{end}\n"


def binary_stl(head: bytes = b"box", count: int = 12, order: str = "<") -> bytes:
    rows = [np.ravel([POINTS[node] for node in facet]) for facet in FACETS]
    facets = b"".join(struct.pack(f"{order}12fH", 0, 0, 0, *row, 7) for row in rows)
    return head.ljust(80, b"\0") + struct.pack(f"{order}I", count) + facets


def ply(vertex: str = "property float x\nproperty float y\nproperty float z\n",
        face: str = "property list uchar int vertex_indices\n", head: str = "", more: str = "",
        nodes: str = "{} {} {}\n", row: str = "3 {} {} {}\n") -> str:  # fmt: skip
    return (
        f"ply\nformat ascii 1.0\n{head}element vertex 8\n{vertex}element face 12\n{face}{more}"
        "end_header\n"
        + "".join(nodes.format(*point) for point in POINTS)
        + "".join(row.format(*facet) for facet in FACETS)
    )


def binary_ply(list_count: str = "uchar", row: str = "<B3i", count: int = 3) -> bytes:
    axes = "property double x\nproperty double y\nproperty double z\n"
    head = ply(axes, f"property list {list_count} int vertex_indices\n").split("end_header")[0]
    return (
        head.replace("ascii", "binary_little_endian").encode()
        + b"end_header\n"
        + b"".join(struct.pack("<3d", *point) for point in POINTS)
        + b"".join(struct.pack(row, count, *facet) for facet in FACETS)
    )


def mixed_ply(order: str) -> bytes:
    """Quadrilaterals and triangles in turn, each behind a list and a number of its own."""
    faces = [QUADS[0], *FACETS[2:4], QUADS[2], *FACETS[6:8], QUADS[4], *FACETS[10:]]
    extra = "property list ushort double knots\nproperty uchar part\n"
    head = ply(face=f"{extra}property list char uint vertex_index\n").split("end_header")[0]
    head = head.replace("face 12", f"face {len(faces)}")
    if order == "ascii":
        rows = [f"{n % 3}{n % 3 * ' 0.5'} {n} {len(face)} {' '.join(map(str, face))}\n"
                for n, face in enumerate(faces)]  # fmt: skip
        return f"{head}end_header\n{ply().split('end_header')[1][1:].split('3 0')[0]}".encode() + (
            "".join(rows).encode()
        )
    mark = {"little": "<", "big": ">"}[order]
    content = b"".join(struct.pack(f"{mark}3f", *point) for point in POINTS)
    for n, face in enumerate(faces):
        content += struct.pack(f"{mark}H{n % 3}dB", n % 3, *[0.5] * (n % 3), n)
        content += struct.pack(f"{mark}b{len(face)}I", len(face), *face)
    return head.replace("ascii", f"binary_{order}_endian").encode() + b"end_header\n" + content


def vtk(cells: Sequence[Sequence[int]] = FACETS, kind: int = 5, dataset: str = "") -> str:
    size = sum(len(cell) + 1 for cell in cells)
    rows = "".join(f"{len(cell)} {' '.join(map(str, cell))}\n" for cell in cells)
    head = f"# vtk DataFile Version 3.0\nx\nASCII\nDATASET {dataset or 'UNSTRUCTURED_GRID'}\n"
    points = "POINTS 8 float\n" + "".join(f"{x} {y} {z}\n" for x, y, z in POINTS)
    if dataset:
        return f"{head}{points}POLYGONS {len(cells)} {size}\n{rows}"
    types = f"{kind}\n" * len(cells)
    return f"{head}{points}CELLS {len(cells)} {size}\n{rows}CELL_TYPES {len(cells)}\n{types}"


READ: dict[str, str | bytes] = {
    "colours.obj": NODES.replace("\n", " 0.5 0.5 0.5\n") + ROWS,
    "weights.obj": NODES.replace("\n", " 1.0\n") + ROWS,
    "lines and points.obj": f"{NODES}{ROWS}l 1 2 3\np 1\n",
    "a curve.obj": f"{NODES}{ROWS}vp 0.3 0.4\ncstype bspline\ndeg 3\ncurv 0 1 1 2\nend\n",
    "tabs.obj": (NODES + ROWS).replace(" ", "\t"),
    "two spaces.obj": (NODES + ROWS).replace("v ", "v  ").replace("\n", " \n"),
    "nodes last.obj": ROWS + NODES,
    "groups.obj": f"g a b\n{NODES}s 1\nusemtl x y\n{ROWS}",
    "quadrilaterals and triangles.obj": NODES
    + "".join([*POLYGONS.splitlines(True)[:1], *ROWS.splitlines(True)[2:]]),
    "a corner of a pentagon twice.obj": NODES + POLYGONS.replace("f 1 3 4", "f 1 3 3 3 4"),
    "a corner twice in a row.obj": NODES + POLYGONS.replace("f 1 3 4", "f 1 3 3 4"),
    "it goes on at its end.obj": NODES + ROWS.rstrip() + " \\",
    "decimal commas.obj": (NODES + ROWS).replace("40", "40,0"),
    "UTF-16, big-endian.obj": b"\xfe\xff" + (NODES + ROWS).encode("utf-16-be"),
    "binary, named solid.STL": binary_stl(b"solid part"),
    "binary, named solid, two bytes more.stl": binary_stl(b"solid part") + b"\0\0",
    "colours of Magics.stl": binary_stl(b"COLOR=\1\2\3\4,MATERIAL=abc"),
    "facets without normals.stl": stl(normal="facet"),
    "normals of no length.stl": stl(normal="facet normal -nan(ind) nan 1.#IND"),
    "two solids.stl": stl(facets=FACETS[:6]) + stl("solid y", "endsolid y", FACETS[6:]),
    "no name.stl": stl("solid", "endsolid"),
    "a mark of UTF-8.stl": b"\xef\xbb\xbf" + stl().encode(),
    "a name in Japanese.stl": stl("solid 部品").encode("shift-jis"),
    "an end of CP-M.stl": stl() + "\x1a",
    "zeros behind it.stl": stl().encode() + bytes(300),
    "a name of facets.stl": stl("solid facet normal", "endsolid facet normal"),
    "signs.stl": stl(form="{:+.3E}"),
    "comments and a blank line.ply": ply(head="obj_info n 1\ncomment Würfel\n").replace(
        "end_header\n", "end_header\n\n").encode("latin-1"),
    "old line ends.ply": ply().replace("\n", "\r"),
    "edges.ply": ply(more="element edge 1\nproperty int vertex1\nproperty int vertex2\n") + "0 1\n",
    "a list of each node.ply": ply(
        "property list uchar float q\nproperty float x\nproperty float y\nproperty float z\n",
        nodes="2 1 1 {} {} {}\n"),
    "whole coordinates.ply": ply("property int x\nproperty int y\nproperty int z\n"),
    "binary.ply": binary_ply(),
    "binary, counts of 4 bytes.ply": binary_ply("int", "<4i"),
    **{f"of several sizes, {order}.ply": mixed_ply(order) for order in ("ascii", "little", "big")},
    "nodes without facets that are no numbers.obj": NODES + "v nan nan nan\n" + ROWS,
    "a backslash that leads nowhere.obj": f"# C:\\parts\\\n# box\n{NODES}{ROWS}",
    "decimal commas with three digits.obj": NODES.replace("40", "40,125").replace("6 0", "6 0,125")
    + ROWS,
    "triangles.vtk": vtk(),
    "quadrilaterals.vtk": vtk(QUADS, 9),
    "polygon data.vtk": vtk(dataset="POLYDATA"),
    "polygons of several sizes.vtk": vtk([*QUADS[:3], *FACETS[6:]], dataset="POLYDATA"),
    "small letters.vtk": vtk(dataset="polydata").replace("ASCII", "ascii"),
    "lines and values.vtk": vtk(dataset="POLYDATA").replace(
        "POLYGONS", "METADATA\nINFORMATION 0\n\nLINES 1 3\n2 0 1\nPOLYGONS")
    + "POINT_DATA 8\nSCALARS a float\nLOOKUP_TABLE default\n1 2 3 4 5 6 7 8\n",
}  # fmt: skip


@pytest.mark.usefixtures("same_locale")
@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("version", [42, 51])
@pytest.mark.parametrize("grid", [True, False])
def test_a_vtk_file_that_was_cut_is_refused(
    binary: bool, version: int, grid: bool, tmp_path: Path
) -> None:
    """Of each version, dataset and form; as it was, it is what was written."""
    cone = trimesh.creation.cone(radius=5, height=20, sections=8)
    surface = pyvista.PolyData.from_regular_faces(cone.vertices, cone.faces)
    writer = vtkUnstructuredGridWriter() if grid else vtkPolyDataWriter()
    writer.SetInputData(surface.cast_to_unstructured_grid() if grid else surface)
    writer.SetFileName(str(tmp_path / "cone.vtk"))
    writer.SetFileVersion(version)
    writer.SetFileType(2 if binary else 1)
    writer.Write()
    content = (tmp_path / "cone.vtk").read_bytes()
    assert measured(read(tmp_path / "cone.vtk", "mm")) == pytest.approx(
        (len(cone.faces), cone.area, cone.volume), rel=1e-6
    )
    end = max(content.rindex(name) for name in (b"POLYGONS", b"CELL_TYPES") if name in content)
    for length in range(0, end, 7):
        with pytest.raises(InputError):
            vtk_legacy(content[:length])


def measured(mesh: Trimesh) -> tuple[int, float, float]:
    return len(mesh.faces), mesh.area * 1e6, mesh.volume * 1e9


@pytest.mark.parametrize("name", READ)
def test_a_box_in_any_dress_is_the_box(name: str, tmp_path: Path) -> None:
    content = READ[name]
    file = tmp_path / name
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    mesh = read(file, "mm")
    assert measured(mesh) == pytest.approx(BOX, rel=1e-9)
    assert not [finding for finding in findings(mesh) if finding.severity == "error"]


@pytest.fixture
def same_locale() -> Iterator[None]:
    """Afterwards: VTK leaves the process with the locale C when it writes or reads a .vtk file."""
    before = locale.setlocale(locale.LC_ALL)
    yield
    locale.setlocale(locale.LC_ALL, before)


@pytest.mark.usefixtures("same_locale")
@pytest.mark.parametrize(
    ("writer", "suffix"),
    [
        *product(["meshio", "pyvista"], [".vtk", ".vtu", ".stl", ".ply"]),
        *product(["trimesh"], [".stl", ".ply"]),
    ],
)
def test_what_other_libraries_write_is_what_they_read(
    writer: str, suffix: str, tmp_path: Path
) -> None:
    cone = trimesh.creation.cone(radius=5, height=20, sections=24)
    file = tmp_path / f"cone{suffix}"
    if writer == "meshio":
        meshio.Mesh(cone.vertices, [("triangle", cone.faces)]).write(file)
    elif writer == "pyvista":
        surface = pyvista.PolyData.from_regular_faces(cone.vertices, cone.faces)
        (surface.cast_to_unstructured_grid() if suffix == ".vtu" else surface).save(file)
    else:
        cone.export(file)
    other = pyvista.read(file).extract_surface(algorithm=None).triangulate()
    assert measured(read(file, "mm")) == pytest.approx(
        (other.n_cells, other.area, other.volume),
        rel=1e-6,  # VTK measures in single precision
    )
    assert measured(read(file, "mm")) == pytest.approx(
        (len(cone.faces), cone.area, cone.volume), rel=1e-6
    )


@pytest.mark.parametrize(
    "corners",
    [
        [(0, 0), (20, 2), (15, 0), (20, -2)],  # the shorter diagonal is outside
        [(20, 2), (15, 0), (20, -2), (0, 0)],
        [(0, 0), (20, 0), (4, 4), (0, 20)],
        [(0, 0), (20, 0), (20, 20), (10, 5), (0, 20)],
        [(0, 0), (9, 0), (9, 9), (6, 9), (6, 3), (3, 3), (3, 9), (0, 9)],
    ],
)
def test_polygons_bent_inwards_are_divided_inside(
    corners: list[tuple[float, float]], tmp_path: Path
) -> None:
    x, y = np.transpose(corners)
    area = abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
    around = np.hypot(x - np.roll(x, -1), y - np.roll(y, -1)).sum()
    turned = corners if x @ np.roll(y, -1) > y @ np.roll(x, -1) else corners[::-1]
    (tmp_path / "prism.obj").write_bytes(prism(*turned))
    _, *sizes = measured(read(tmp_path / "prism.obj", "mm"))
    assert sizes == pytest.approx([2 * area + 30 * around, 30 * area], rel=1e-9)


REFUSED: dict[str, tuple[str | bytes, str, int | None]] = {
    "empty.obj": ("", "no facets", 1),
    "nodes alone.obj": (NODES, "no facets", 1),
    "a page.obj": ("<!DOCTYPE html><html></html>\n", "no facets", 1),
    "a pointer of LFS.obj": ("version https://git-lfs.github.com/spec/v1\n", "no facets", 1),
    "an archive.obj": (b"PK\x03\x04\0\0abc", "a byte is 0", 1),
    "UTF-16 without its mark.obj": ((NODES + ROWS).encode("utf-16-be"), "a byte is 0", 1),
    "a zero byte.obj": (f"{NODES}\0{ROWS}", "a byte is 0", 9),
    "another file.obj": (f"{NODES}call b.obj\n{ROWS}", "takes in another one", 9),
    "two marks.obj": ((NODES + ROWS).replace("v 6 6 40", "v 6.0 6.0 40").replace("-6 0", "-6 0,5"),
                      "decimal commas beside decimal points", 1),
    "a long line.obj": (f"{NODES}f {'1 2 3 ' * 4000}\n", "too many words", 9),
    "two corners.obj": (f"{NODES}{ROWS}f 1 2\n", "too few corners", 21),
    "no node.obj": (f"{NODES}{ROWS}f 1 2 9\n", "not there", 21),
    "a bent polygon.obj": ("v -5 0 5\nv 5 0 5\nv 5 0 -5\nv -5 0 -5\nv 0 5 -5\nf 1 2 3 4 5\n",
                           "cannot be divided into triangles", None),
    "the same corners.obj": (f"{NODES}f {'1 2 4 3 ' * 9}\n", "cannot be divided", None),
    "no node 0.obj": (f"{NODES}{ROWS}f 0 1 2\n", "not there", 21),
    "no node -9.obj": (f"{NODES}{ROWS}f -9 1 2\n", "not there", 21),
    "a long number.obj": (f"{NODES}{ROWS}f 1 2 {'9' * 30}\n", "not a corner", 21),
    "two coordinates.obj": (f"{NODES}v 1 2\n{ROWS}", "too few coordinates", 9),
    "no whole number.obj": (f"{NODES}{ROWS}f 1.0 2.0 3.0\n", "not a corner", 21),
    "text of OBJ.stl": (NODES + ROWS, "neither text nor whole binary", None),
    "no suffix": (binary_stl(), "unknown mesh format", None),
    "empty.stl": ("", "neither text nor whole binary", None),
    "cut.stl": (binary_stl()[:-1], "neither text nor whole binary", None),
    "big-endian.stl": (binary_stl(order=">"), "neither text nor whole binary", None),
    "a large number.stl": (binary_stl(count=2**32 - 1), "neither text nor whole binary", None),
    "a small number.stl": (binary_stl(count=0), "more facets than the file announces", None),
    "compressed.stl": (gzip.compress(binary_stl(), mtime=0), "neither text nor whole", None),
    "UTF-16 without its mark.stl": (stl().encode("utf-16-le"), "neither text nor whole", None),
    "a remark.stl": (stl().replace("outer loop", "outer loop # here", 1), "a whole facet", 2),
    "two corners.stl": (stl().replace("vertex -6 6 0\n", "", 1), "a whole facet", 2),
    "commas between.stl": (stl(form="{}.5,"), "decimal commas beside", 4),
    "a word.stl": (stl().replace("vertex 6 6 40", "vertex 6 six 40", 1), "not a number", 18),
    "more rows.ply": (ply() + "3 0 1 2\n", "more than the header announces", None),
    "fewer rows.ply": (ply().rstrip().rpartition("\n")[0], "the end of the file", None),
    "a longer row.ply": (ply(row="3 {} {} {} 7\n"), "not a row of the element 'face'", 18),
    "broken indices.ply": (ply(face="property list uchar double vertex_indices\n",
                               row="3 {}.4 {} {}\n"), "not there", None),
    "no indices.ply": (ply(face="property list uchar int vertices\n"), "no faces", None),
    "indices twice.ply": (
        ply(face="property list uchar int vertex_index\nproperty list uchar int vertex_indices\n",
            row="3 {0} {1} {2} 3 {0} {1} {2}\n"), "two lists", None),
    "x twice.ply": (ply("property float x\nproperty float x\n"), "a name twice", None),
    "capitals.ply": (ply("property float X\nproperty float Y\nproperty float Z\n"), "no nodes",
                     None),
    "an unknown type.ply": (ply("property quad x\n"), "not a line of a PLY header", 4),
    "a cut head.ply": ("ply\nformat ascii 1.0\nelement vertex 3\n", "not a PLY file", None),
    "a huge count.ply": (ply().replace("vertex 8", "vertex 1000000000000"), "was cut short", None),
    "cut.ply": (binary_ply()[:-1], "byte 508 of 520", None),
    "cut among sizes.ply": (mixed_ply("big")[:-1], "byte 510 of 541", None),
    "a huge list.ply": (binary_ply("int", "<4i", 2**31 - 1), "not a row", None),
    "a negative list.ply": (binary_ply("int", "<4i", -3), "not a row", None),
    "thousands.obj": (NODES.replace("40", "1,040") + ROWS, "a mark of thousands", 5),
    "thousands.stl": (stl().replace("40", "1,040"), "a mark of thousands", 18),
    "thousands.ply": (ply().replace("40", "1,040"), "a mark of thousands", 14),
    "a name that goes on.obj": (f"g C:\\parts\\\n{NODES}{ROWS}", "may go on here", 2),
    "a comment that goes on.obj": (f"{NODES}# a \\\n{ROWS}", "may go on here", 10),
    "no numbers.obj": (NODES.replace("-6 -6 0", "-6 nan 0") + ROWS, "node 1 of 8", None),
    "a grid.vtk": (vtk(dataset="STRUCTURED_GRID"), "STRUCTURED_GRID", None),
    "strips.vtk": (vtk(dataset="POLYDATA").replace("POLYGONS", "TRIANGLE_STRIPS"), "strips", None),
    "a huge count.vtk": (vtk().replace("POINTS 8", "POINTS 1000000000000"), "POINTS", None),
    "points twice.vtk": (vtk() + "POINTS 1 float\n0 0 0\n", "stands there twice", None),
    "more numbers.vtk": (vtk().replace("3 0 2 3", "3 0 2 3 7", 1), "not as many CELLS", None),
    "a word.vtk": (vtk().replace("-6", "six", 1), "not numbers of POINTS", None),
    "a decimal comma.vtk": (vtk().replace("40", "40,5"), "not numbers of POINTS", None),
    "no node.vtk": (vtk([*FACETS[:-1], (0, 1, 8)]), "not there", None),
    "wrong lengths.vtk": (vtk().replace("3 0 2 3", "2 0 2 3"), "are not 12 cells of 48", None),
    "polygon data.vtp": ("<VTKFile/>", "unknown mesh format", None),
    "tetrahedra.vtk": (vtk([(0, 1, 2, 4)], 10), "no polygons", None),
    "cut.vtk": (vtk()[:200].replace("POINTS 8", "POINTS 800"), "not as many POINTS", None),
    "cut.vtu": ("<?xml version='1.0'?><VTKFile type='UnstructuredGrid'>", "cut short", None),
    "lz4.vtu": ("<VTKFile compressor='vtkLZ4DataCompressor'></VTKFile>", "with LZ4", None),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_the_rest_is_refused_with_its_place(name: str, tmp_path: Path) -> None:
    content, words, line = REFUSED[name]
    file = tmp_path / name
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    with pytest.raises(InputError) as refused:
        read(file, "mm")
    assert words in str(refused.value) and refused.value.file == file
    assert refused.value.line == line
    assert refused.value.remedy


def test_all_defects_of_a_body_are_told_at_once(tmp_path: Path) -> None:
    """A facet too many, one without area, a hole, and a second body."""
    facets = ROWS.splitlines(keepends=True)
    spoilt = NODES + "".join(facets[:-1]) + facets[0] + "f 1 1 2\n" + NODES.replace("v ", "v 1")
    (tmp_path / "part.obj").write_text(f"{spoilt}f 9 11 12\n".replace("v 1-", "v -1"))
    with pytest.raises(InputError) as refused:
        check(read(tmp_path / "part.obj", "mm"))
    for words in ("has no area", "is duplicated", "is not closed", "several bodies"):
        assert words in str(refused.value)


LARGE = trimesh.creation.icosphere(6, 5.0)
SOUP = LARGE.export(file_type="stl")
BAD = {
    "nan.stl": SOUP[:-38] + struct.pack("<f", math.nan) + SOUP[-34:],
    "cut.stl": SOUP[:-1],
    "word.stl": LARGE.export(file_type="stl_ascii").replace("vertex", "vertex x", 1).encode(),
    "node.obj": f"{LARGE.export(file_type='obj')}\nf 1 2 999999\n".encode(),
    "cut.ply": LARGE.export(file_type="ply")[:-1],
    "polygons.vtk": vtk(dataset="POLYDATA").encode() + b"1 " * 1_000_000,
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_takes_little_memory(name: str, tmp_path: Path) -> None:
    """At most ten times its size: 500 MB for the largest that are usual, of 50 MB."""
    (tmp_path / name).write_bytes(BAD[name])
    tracemalloc.start()
    try:
        with pytest.raises(InputError):
            read(tmp_path / name, "mm")
        assert tracemalloc.get_traced_memory()[1] < 10 * len(BAD[name])
    finally:
        tracemalloc.stop()
