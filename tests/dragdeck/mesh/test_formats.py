"""Surface files as programs write them, against the surface that was written."""

import struct
from collections.abc import Sequence
from itertools import chain

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from dragdeck.errors import InputError
from dragdeck.mesh.files import _triangles
from dragdeck.mesh.obj import obj
from dragdeck.mesh.ply import ply
from dragdeck.mesh.polygons import Polygons
from dragdeck.mesh.stl import stl
from dragdeck.mesh.surface import surface, weld

RING = [(np.cos(turn), np.sin(turn)) for turn in np.arange(6) * np.pi / 3]
POINTS = np.array([(6 * x, 6 * y, z) for z in (0.0, 40.0) for x, y in RING]).round(4)
FACES = [
    *[(5, 4, 3, 2, 1, 0), (6, 7, 8, 9, 10, 11)],
    *[(a, (a + 1) % 6, 6 + (a + 1) % 6, 6 + a) for a in range(4)],
    *[(4, 5, 11), (4, 11, 10), (5, 0, 6), (5, 6, 11)],
]
"""A hexagonal bar of hexagons, quadrilaterals and triangles."""

TRUTH = trimesh.Trimesh(
    POINTS, list(chain(*([[f[0], f[k], f[k + 1]] for k in range(1, len(f) - 1)] for f in FACES)))
)
TRIANGLES = TRUTH.triangles


def measured(polygons: Polygons) -> tuple[int, float, float, bool]:
    """Triangles, area, volume, and whether the surface is closed."""
    triangles = [_triangles(nodes, polygons.points) for nodes in polygons.cells]
    mesh = weld(surface(polygons.points, np.concatenate([np.empty((0, 3), int), *triangles])))
    return len(mesh.faces), mesh.area, mesh.volume, mesh.is_watertight


def is_the_bar(polygons: Polygons) -> bool:
    expected = (len(TRUTH.faces), TRUTH.area, TRUTH.volume, True)
    return bool(np.allclose(measured(polygons), expected, rtol=1e-6, atol=0))


ENDS = st.sampled_from(["\n", "\r\n", "\r"])
CODINGS = st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "latin-1"])


@given(
    style=st.sampled_from(["{}", "{}/1", "{}/2/1", "{}//1"]),
    relative=st.booleans(), comment=st.booleans(), goes_on=st.booleans(), split=st.booleans(),
    end=ENDS, coding=CODINGS,
)  # fmt: skip
def test_an_obj_file_of_any_style_gives_the_same_surface(
    style: str, relative: bool, comment: bool, goes_on: bool, split: bool, end: str, coding: str
) -> None:
    nodes = [f"v {x} {y} {z}" for x, y, z in POINTS]
    beside = ["# Würfel", "mtllib a.mtl", "o Bar", "vn 0 0 1", "vt 0 0", "vt 1 1", "s off", "g x"]
    halves = [nodes[:6], nodes[6:]] if split and not relative else [nodes]
    corners = [
        [style.format(node - len(POINTS) if relative else node + 1) for node in face]
        for face in FACES
    ]
    joint = " \\" + end if goes_on else " "
    rows = ["f " + joint.join(face) + (" # facet" if comment else "") for face in corners]
    lines = [*beside[:4], *halves[0], *beside[4:], *chain(*halves[1:]), *rows, ""]
    assert is_the_bar(obj(end.join(lines).encode(coding)))


def stl_text(end: str, number: str = "{:.4f}", name: str = "bar", closing: bool = True) -> str:
    lines = [f"solid {name}"]
    for triangle in TRIANGLES:
        lines += ["  facet normal 0 0 0", "    outer loop"]
        lines += ["      vertex " + " ".join(map(number.format, corner)) for corner in triangle]
        lines += ["    endloop", "  endfacet"]
    return end.join([*lines, f"endsolid {name}" if closing else "", ""])


@given(
    end=st.sampled_from(["\n", "\r\n", "\r", " "]), coding=CODINGS,
    number=st.sampled_from(["{:.4f}", "{:.6e}", "{:+.5E}"]), mark=st.sampled_from([".", ","]),
    exponent=st.sampled_from("eD"), capitals=st.booleans(), closing=st.booleans(),
    name=st.sampled_from(["bar", "", "endfacet", "facet vertex 1 2 3"]),
)  # fmt: skip
def test_an_stl_text_of_any_style_gives_the_same_surface(
    end: str, coding: str, number: str, mark: str, exponent: str, capitals: bool, closing: bool,
    name: str,
) -> None:  # fmt: skip
    if end == " ":
        name = "bar"
    text = stl_text(end, number, name, closing).replace(".", mark).replace("e+", f"{exponent}+")
    assert is_the_bar(stl((text.upper() if capitals else text).encode(coding)))


def stl_bytes(count: int, head: bytes = b"solid or not") -> bytes:
    facets = [struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 7) for triangle in TRIANGLES]
    return head.ljust(80) + struct.pack("<I", count) + b"".join(facets)


@given(rest=st.one_of(st.binary(max_size=49), st.binary(max_size=40).map(bytes(50).__add__)))
def test_bytes_after_whole_facets_are_passed_over(rest: bytes) -> None:
    assert is_the_bar(stl(stl_bytes(len(TRIANGLES)) + rest))


@given(st.integers(0, 84 + 50 * len(TRIANGLES) - 1))
def test_of_a_binary_stl_nothing_is_left_out(length: int) -> None:
    with pytest.raises(InputError):
        stl(stl_bytes(len(TRIANGLES), b"a part")[:length])
    for count in (0, len(TRIANGLES) - 1, len(TRIANGLES) + 1):
        with pytest.raises(InputError):
            stl(stl_bytes(count, b"a part"))


PLY_TYPES = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def ply_bytes(order: str, coordinate: str, names: Sequence[str], first: bool, extra: bool) -> bytes:
    kinds = {"float": "f", "double": "d"}
    before, after = (["confidence"], []) if first else ([], ["red"])
    columns = [*before, "x", "y", "z", *after]
    head = [
        "ply", f"format {order} 1.0", "comment a bar", f"element vertex {len(POINTS)}",
        *(f"property {'uchar' if name == 'red' else coordinate} {name}" for name in columns),
        f"element face {len(FACES)}", f"property list {names[0]} int {names[1]}",
        *["property list uchar float texcoord"] * extra, "property uchar flags",
        *["element edge 1", "property int vertex1"] * extra, "end_header", "",
    ]  # fmt: skip
    rows: list[list[tuple[str, float]]] = []
    for point in POINTS:
        row = {**dict(zip("xyz", point, strict=True)), "confidence": 0.5, "red": 200}
        rows.append([("B" if name == "red" else kinds[coordinate], row[name]) for name in columns])
    length = {"uchar": "B", "uint8": "B", "int": "i"}[names[0]]
    for face in FACES:
        texture = [("B", 2), ("f", 0.5), ("f", 0.25)] if extra else []
        rows.append([(length, len(face)), *(("i", node) for node in face), *texture, ("B", 1)])
    rows += [[("i", 3)]] * extra
    if order == "ascii":
        body = (
            "\n".join(" ".join(f"{value:g}" for _, value in row) for row in rows).encode() + b"\n"
        )
    else:
        body = b"".join(
            struct.pack(PLY_TYPES[order] + kind, value if kind in "fd" else int(value))
            for row in rows
            for kind, value in row
        )
    return "\n".join(head).encode() + body


STYLES = {
    "order": st.sampled_from([*PLY_TYPES]),
    "coordinate": st.sampled_from(["float", "double"]),
    "names": st.sampled_from(
        [("uchar", "vertex_indices"), ("int", "vertex_index"), ("uint8", "vertex_indices")]
    ),
    "first": st.booleans(),
    "extra": st.booleans(),
}


@given(st.fixed_dictionaries(STYLES))
def test_a_ply_file_of_any_style_gives_the_same_surface(style: dict[str, object]) -> None:
    assert is_the_bar(ply(ply_bytes(**style)))  # type: ignore[arg-type]


@given(style=st.fixed_dictionaries(STYLES), part=st.floats(0, 1, exclude_max=True))
def test_a_ply_file_that_was_cut_is_refused(style: dict[str, object], part: float) -> None:
    whole = ply_bytes(**style)  # type: ignore[arg-type]
    kept = whole[: int(part * len(whole.rstrip()))]
    with pytest.raises(InputError):
        ply(kept)


@given(part=st.floats(0, 1, exclude_max=True), kind=st.sampled_from(["stl", "obj"]))
def test_a_text_that_was_cut_is_refused_or_open(part: float, kind: str) -> None:
    """Both texts may end anywhere; a body of which facets are missing is not closed."""
    rows = [f"f {' '.join(str(node + 1) for node in face)}" for face in FACES]
    text = "\n".join([*(f"v {x} {y} {z}" for x, y, z in POINTS), *rows])
    whole = stl_text("\n") if kind == "stl" else text
    cut = whole[: int(part * len(whole))]
    try:
        polygons = {"stl": stl, "obj": obj}[kind](cut.encode())
    except InputError:
        return
    assert not measured(polygons)[3] or is_the_bar(polygons)


@pytest.mark.parametrize(
    ("number", "problem"),
    [("1,5 2.5 0", "commas"), ("1_0 0 0", "number"), ("0x10 0 0", "number"), ("1.5 2 -", "number")],
)
def test_a_number_that_could_be_two_is_refused_with_its_line(number: str, problem: str) -> None:
    with pytest.raises(InputError, match=problem) as refused:
        obj(f"v 0 0 0\nv {number}\n".encode())
    assert refused.value.line == 2
