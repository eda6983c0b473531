"""Fuzzed dumps, tables and meshes: the right values, or an error that names the file."""

import struct
import tempfile
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import trimesh
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from made_run import Raw
from plain_dumps import WholeFrame, binary_frames, text_frames
from spoilt_dumps import NAMES, ROWS, text

from dragdeck.decks.outputs import OutputOfRun
from dragdeck.dumps.reader import read_dump, read_prints
from dragdeck.errors import DragdeckError
from dragdeck.mesh.checks import findings
from dragdeck.mesh.files import _polygons, _triangles, read
from dragdeck.study.table import user_table
from dragdeck.sweep.cases import load_cases

_TOKENS = [
    *(b"nan", b"-1", b"1e999", b"-0", b"9" * 40, b"0x10", b"1_000", b"1.5", b"--1", b"+", b"e5"),
    *(b"1e", b".", b"infinity", b"\xd9\xa1", b"\x00", b"\n", b" ", b"\r\n", b"ITEM: TIMESTEP\n"),
    *(b"\xff" * 8, b"\x00" * 8, b"\x7f" + b"\xff" * 7, b"1/9/9", b"f 1 2 99", b"vertex"),
    *(b",", b";", b"1,5", b"#", b"solid", b"endsolid", b"18446744073709551616", b"2147483648"),
]

Frames = list[WholeFrame]


@st.composite
def spoilt(draw: st.DrawFn, wholes: list[bytes]) -> bytes:
    """A good file with up to four things done to it."""
    content = draw(st.sampled_from(wholes))
    for _ in range(draw(st.integers(1, 4))):
        place = draw(st.integers(0, len(content)))
        end = min(len(content), place + draw(st.integers(0, 40)))
        what = draw(st.sampled_from(["cut", "delete", "insert", "replace", "double", "bytes"]))
        if what == "cut":
            content = content[:place]
        elif what == "delete":
            content = content[:place] + content[end:]
        elif what == "insert":
            content = content[:place] + draw(st.sampled_from(_TOKENS)) + content[place:]
        elif what == "replace":
            content = content[:place] + draw(st.sampled_from(_TOKENS)) + content[end:]
        elif what == "double":
            content = content[:end] + content[place:]
        else:
            content = content[:place] + draw(st.binary(max_size=8)) + content[end:]
    return content


# --- what was read, and what a file says ------------------------------------------------


def prefix(frames: Iterator[WholeFrame]) -> tuple[Frames, bool]:
    """The frames before the first error, and whether there was none."""
    found: Frames = []
    try:
        for frame in frames:
            found.append(frame)
    except (ValueError, IndexError, struct.error, OverflowError, MemoryError, UnicodeDecodeError):
        return found, False
    return found, True


def _agree(found: Frames, whole: bool, wanted: Frames, wanted_whole: bool) -> None:
    """What was read is what the file says, and what cannot be read was refused."""
    assert len(found) <= len(wanted), f"{len(found)} frames of {len(wanted)}"
    for one, other in zip(found, wanted, strict=False):
        assert one[0] == other[0], f"step {one[0]} is {other[0]}"
        assert list(one[1]) == list(other[1]), "other columns"
        for name, values in one[1].items():
            same = np.array_equal(values, other[1][name], equal_nan=True)
            assert same, f"{name}: {values} is {other[1][name]}"
    assert not whole or wanted_whole, "a file that is not whole was taken for whole"
    assert not whole or len(found) == len(wanted), "frames were left out without a word"


def _names_sorted(frames: Frames) -> Frames:
    return [(step, {name: columns[name] for name in sorted(columns)}) for step, columns in frames]


# --- the files ------------------------------------------------------------------------


def _text_dumps() -> list[bytes]:
    return [text(kind=kind) for kind in ("custom", "local")]


def _binary_dumps() -> list[bytes]:
    return [
        b"".join(Raw.binary(step, rows, len(NAMES), ranks) for step, rows in ROWS.items())
        for ranks in (1, 2)
    ]


def _try_text_dump(folder: Path, content: bytes) -> None:
    file = folder / "a.dump"
    file.write_bytes(content)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        whole = _compare(lambda: read_dump(file), lambda: text_frames(content))
    assert not whole or content.endswith(b"\n") or warned, "a last row may be cut, without a word"


def _try_binary_dump(folder: Path, content: bytes) -> None:
    file = folder / "a.bin"
    file.write_bytes(content)
    _compare(lambda: read_dump(file, NAMES), lambda: binary_frames(content, NAMES))


def _compare(reader: Callable, oracle: Callable) -> bool:  # type: ignore[type-arg]
    """Compare a reader with the oracle; whether the reader took the file for whole."""
    found: Frames = []
    whole = True
    try:
        for frame in reader():
            columns = {name: values.tolist() for name, values in frame.columns.items()}
            found.append((frame.step, columns))
    except DragdeckError as error:
        assert "a." in str(error), "the message does not name the file"
        whole = False
    wanted, wanted_whole = prefix(oracle())
    _agree(_names_sorted(found), whole, _names_sorted(wanted), wanted_whole)
    return whole


_PRINTED = ("step", "time_s", "force_n")


def _printed() -> list[bytes]:
    rows = [[10 * n, 1e-3 * n, -0.5 * n] for n in range(8)]
    return [Raw.prints(rows, _PRINTED)]


def _try_print_file(folder: Path, content: bytes) -> None:
    file = folder / "a.1.txt"
    file.write_bytes(content)
    layout = OutputOfRun(kind="print", binary=False, pattern="a.{part}.txt", columns=_PRINTED,
                    engine_columns=None, period_steps=10, first_step=0, last_step=70)  # fmt: skip
    steps: list[float] = []
    values: list[float] = []
    try:
        for block in read_prints(file, layout):
            steps += block["step"].tolist()
            values += block["force_n"].tolist()
    except DragdeckError as error:
        assert "a.1.txt" in str(error), "the message does not name the file"
    lines = content.decode("latin-1").split("\n")
    rows = [line.split() for line in lines if line.lstrip("# ").split() != list(_PRINTED)]
    numbers = [[float(word) for word in row] for row in rows[: len(steps)]]
    assert steps == [row[0] for row in numbers], "other steps"
    assert values == [row[2] for row in numbers], "other values"
    assert all(before < after for before, after in pairwise(steps))


def _tables(mark: str, decimal: str) -> list[bytes]:
    rows = [mark.join(f"{one:.4f}".replace(".", decimal) for one in (1e-3 * n, 2.5 - n))
            for n in range(8)]  # fmt: skip
    lines = "\n".join([mark.join(("time_s", "force_n")), "# a remark", *rows, ""])
    return [lines.encode(), lines.replace("\n", "\r\n").encode("utf-8-sig")]


def _try_table(folder: Path, content: bytes) -> None:
    file, names = folder / "a.csv", ["time_s", "force_n"]
    file.write_bytes(content)
    try:
        table = user_table(file)
        known = sorted(name for name in table.names if name in names) == sorted(names)
        read_lines, found = table.numbers(names) if known else ([], [])
    except DragdeckError as error:
        assert "a.csv" in str(error), "the message does not name the file"
        return
    if not known or b'"' in content:  # its callers ask for the names; quotes are left to csv
        return
    whole = content.decode("utf-8-sig", "replace").replace("\r\n", "\n").replace("\r", "\n")
    lines = whole.split("\n")[table.header_line - 1 :]
    lines = [line for line in lines if line.strip() and line.lstrip()[0] != "#"]
    mark = next((mark for mark in ";\t" if mark in lines[0]), ",")
    _, *rows = [[cell.strip() for cell in line.split(mark)] for line in lines]
    head = [*table.names]
    if len(rows) > len(read_lines):  # units below the names
        del rows[0]
    if table.joined:  # decimal commas between commas
        rows = [[f"{a}.{b}" for a, b in zip(row[::2], row[1::2], strict=True)] for row in rows]
    assert all(len(row) == len(head) for row in rows), "an uneven row was taken"
    for name, values in zip(names, found, strict=True):
        wanted = [float(row[head.index(name)].replace(",", ".")) for row in rows]
        assert values.tolist() == wanted, name


def _meshes(kind: str) -> list[bytes]:
    box = trimesh.creation.cylinder(radius=4.0, height=30.0, sections=6)
    if kind == "vtk":
        return [_vtk(box)]
    types = {"ascii.stl": ["stl_ascii"], "ply": ["ply"]}.get(kind, [kind])
    exported = [box.export(file_type=each) for each in types]
    if kind == "ply":
        exported.append(box.export(file_type="ply", encoding="ascii"))
    if kind == "obj":
        exported.append(_relative(box))
    return [each if isinstance(each, bytes) else each.encode() for each in exported]


def _relative(mesh: trimesh.Trimesh) -> str:
    """An OBJ file whose facets name the nodes backwards, with normals."""
    nodes = "".join(f"v {x:.9g} {y:.9g} {z:.9g}\n" for x, y, z in mesh.vertices)
    corners = (mesh.faces - len(mesh.vertices)).tolist()
    facets = "".join("f " + " ".join(f"{node}//-1" for node in facet) + "\n" for facet in corners)
    return f"# a bar\n{nodes}vn 0 0 1\n{facets}"


def _vtk(mesh: trimesh.Trimesh) -> bytes:
    rows = ["# vtk DataFile Version 3.0", "a bar", "ASCII", "DATASET UNSTRUCTURED_GRID",
            f"POINTS {len(mesh.vertices)} double"]  # fmt: skip
    rows += [f"{x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices]
    rows += [f"CELLS {len(mesh.faces)} {4 * len(mesh.faces)}"]
    rows += [f"3 {a} {b} {c}" for a, b, c in mesh.faces]
    rows += [f"CELL_TYPES {len(mesh.faces)}", *["5"] * len(mesh.faces), ""]
    return "\n".join(rows).encode()


def _try_mesh(suffix: str, folder: Path, content: bytes) -> None:
    file = folder / f"a.{suffix}"
    file.write_bytes(content)
    try:
        mesh = read(file, "mm")
        problems = findings(mesh)
    except DragdeckError as error:
        assert "a." in str(error), "the message does not name the file"
        return
    if problems:
        return
    assert np.isfinite(mesh.vertices).all(), "a coordinate that is not a number"
    assert len(mesh.faces) > 0, "no facet"
    assert mesh.faces.max() < len(mesh.vertices), "a facet without its corner"
    assert mesh.is_watertight, "an open body"
    wanted = _by_trimesh(file)
    if wanted is not None:
        points, cells = _polygons(file)  # nodes closer than 10 nm are still apart
        given = trimesh.Trimesh(
            points, np.concatenate([_triangles(nodes, points) for nodes in cells]), process=False
        )
        measured = len(given.faces), given.area, abs(given.volume)
        np.testing.assert_allclose(measured, wanted, rtol=1e-9)


def _by_trimesh(file: Path) -> tuple[int, float, float] | None:
    """Triangles, area and volume by another reader; None where it cannot read the file."""
    try:
        read_by_it = trimesh.load_mesh(file, process=False)
    except Exception:
        return None
    if not isinstance(read_by_it, trimesh.Trimesh) or not len(read_by_it.faces):
        return None
    return len(read_by_it.faces), read_by_it.area, abs(read_by_it.volume)


def _studies() -> list[bytes]:
    folder = Path(__file__).parents[2] / "data"
    return [(folder / f"{name}_study.yaml").read_bytes() for name in ("small", "tiny")]


def _try_study(folder: Path, content: bytes) -> None:
    """A study is read or refused; what is read, written and read again is the same."""
    file = folder / "a" / "study.yaml"
    file.parent.mkdir(exist_ok=True)
    file.write_bytes(content)
    try:
        cases = load_cases(file)
    except DragdeckError as error:
        assert "study.yaml" in str(error), "the message does not name the file"
        return
    for case in cases:
        again = type(case.study).model_validate(case.study.model_dump(mode="json"))
        assert again == case.study, "another study"


FUZZES: dict[str, tuple[Callable[[], list[bytes]], Callable[[Path, bytes], None]]] = {
    "dump: text": (_text_dumps, _try_text_dump),
    "dump: binary": (_binary_dumps, _try_binary_dump),
    "dump: print file": (_printed, _try_print_file),
    "table: commas": (partial(_tables, ",", "."), _try_table),
    "table: semicolons, decimal commas": (partial(_tables, ";", ","), _try_table),
    "mesh: STL of text": (partial(_meshes, "ascii.stl"), partial(_try_mesh, "stl")),
    "mesh: binary STL": (partial(_meshes, "stl"), partial(_try_mesh, "stl")),
    "mesh: OBJ": (partial(_meshes, "obj"), partial(_try_mesh, "obj")),
    "mesh: PLY": (partial(_meshes, "ply"), partial(_try_mesh, "ply")),
    "mesh: VTK": (partial(_meshes, "vtk"), partial(_try_mesh, "vtk")),
    "study": (_studies, _try_study),
}


def fuzzed(name: str, number: int, examples: int) -> None:
    """Try many spoilt files of a kind, and first those that are whole."""
    make, attempt = FUZZES[name]
    known = make()

    @seed(number)
    @settings(
        max_examples=examples,
        deadline=None,
        database=None,
        phases=[Phase.generate, Phase.shrink],
        suppress_health_check=list(HealthCheck),
    )
    @given(content=spoilt(known))
    def each(content: bytes) -> None:
        with tempfile.TemporaryDirectory() as folder:
            attempt(Path(folder), content)

    with tempfile.TemporaryDirectory() as folder:
        for content in known:
            attempt(Path(folder), content)
    each()


def main(arguments: list[str]) -> int:
    """The program ``fuzz``: name, seed and number of examples."""
    name, number, examples = arguments
    fuzzed(name, int(number), int(examples))
    return 0
