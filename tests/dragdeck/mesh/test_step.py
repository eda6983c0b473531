"""CAD parts in STEP files: meshed, checked, turned and placed, or refused."""

import re
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from trimesh import Trimesh

from dragdeck.errors import InputError
from dragdeck.mesh import checks, files, step_mesher
from dragdeck.mesh.surface import CAD_VOLUME

gmsh = pytest.importorskip("gmsh", reason="gmsh is not made for every machine")

MESHES = Path(__file__).parents[3] / "meshes"
SHAFT, CUTTER = MESHES / "shaft.step", MESHES / "cutter.step"
SHAFT_VOLUME_MM3 = 6285.5


def made(file: Path, draw: Callable[[], object], unit: str = "MM") -> Path:
    """Write what OpenCASCADE draws as STEP."""
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setString("Geometry.OCCTargetUnit", unit)
        draw()
        gmsh.model.occ.synchronize()
        gmsh.write(str(file))
    finally:
        gmsh.finalize()
    return file


@pytest.fixture(scope="module")
def cube(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cube of 10 mm."""
    file = tmp_path_factory.mktemp("cube") / "cube.step"
    return made(file, lambda: gmsh.model.occ.addBox(0, 0, 0, 10, 10, 10))


def longest_edge(mesh: Trimesh) -> float:
    return float(mesh.edges_unique_length.max())


# --- what is read ----------------------------------------------------------------


@pytest.mark.parametrize("size_m", [0.0015, 0.0025])
def test_the_facets_have_the_size_that_is_asked_for(size_m: float) -> None:
    shaft = files.read(SHAFT, "mm", size_m)
    assert np.median(shaft.edges_unique_length) == pytest.approx(size_m, rel=0.15)
    assert longest_edge(shaft) < 1.5 * size_m
    assert shaft.volume == pytest.approx(SHAFT_VOLUME_MM3 * 1e-9, rel=0.08)


def test_sharp_edges_can_be_finer() -> None:
    coarse, fine = (files.read(CUTTER, "mm", 0.002, edge) for edge in (None, 0.0007))

    def at_cutting_edges(mesh: Trimesh) -> float:
        sharp = mesh.face_adjacency_angles > np.radians(60)
        ends = mesh.vertices[mesh.face_adjacency_edges[sharp]]
        return float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)))

    assert at_cutting_edges(coarse) == pytest.approx(0.002, rel=0.3)
    assert at_cutting_edges(fine) == pytest.approx(0.0007, rel=0.3)
    assert longest_edge(fine) > 0.0014


def test_the_same_part_gives_the_same_bytes(cube: Path) -> None:
    first, second = (files.stl_text(files.read(cube, "mm", 0.002)) for _ in range(2))
    assert first == second


@pytest.mark.parametrize("name", ["PART.STEP", "part.stp"])
def test_suffixes(cube: Path, tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(cube.read_bytes())
    body = files.read(tmp_path / name, "mm", 0.005)
    assert body.volume == pytest.approx(1e-6)
    assert checks.findings(body) == []


def inches(text: str) -> str:
    """The same numbers, in inches."""
    return text.replace(
        "( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) )",
        "( CONVERSION_BASED_UNIT('INCH',#9001) LENGTH_UNIT() NAMED_UNIT(#9002) )",
    ).replace(
        "ENDSEC;\nEND-ISO",
        "#9001 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#9003);\n"
        "#9002 = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);\n"
        "#9003 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );\nENDSEC;\nEND-ISO",
    )


@pytest.mark.parametrize("unit", ["m", "cm", "um", "in"])
def test_the_unit_of_the_file(cube: Path, tmp_path: Path, unit: str) -> None:
    text = cube.read_text()
    prefix = {"m": "$", "cm": ".CENTI.", "um": ".MICRO."}
    other = inches(text) if unit == "in" else text.replace(".MILLI.", prefix[unit])
    (tmp_path / "other.step").write_text(other)
    one = files.UNITS[unit]
    for stated in (unit, None):
        body = files.read(tmp_path / "other.step", stated, 5 * one)
        assert body.extents / one == pytest.approx([10, 10, 10], rel=1e-9)
        assert body.metadata[CAD_VOLUME] == pytest.approx(1e3 * one**3)
    with pytest.raises(InputError, match="another unit") as caught:
        files.read(tmp_path / "other.step", "mm", 5 * one)
    assert caught.value.value == "0.001 m"
    assert f"({one:g} m)" in str(caught.value.limit)
    assert caught.value.remedy


@pytest.mark.parametrize(
    ("name", "factor", "prefix", "length_m"),
    [
        ("FOOT", 304.8, ".MILLI.", 0.3048),
        ("METRE", 1.0, "$", 1.0),
        ("MILLIMETRE", 1.0, ".MILLI.", 1e-3),
        ("thou", 0.0254, ".MILLI.", 2.54e-5),
    ],
)
def test_any_unit_that_the_file_converts(
    cube: Path, tmp_path: Path, name: str, factor: float, prefix: str, length_m: float
) -> None:
    text = inches(cube.read_text()).replace("'INCH'", f"'{name}'")
    text = text.replace("LENGTH_MEASURE(25.4)", f"LENGTH_MEASURE({factor})")
    (tmp_path / "part.step").write_text(text.replace(".MILLI.,.METRE.", f"{prefix},.METRE."))
    body = files.read(tmp_path / "part.step", None, 5 * length_m)
    assert body.extents == pytest.approx([10 * length_m] * 3, rel=1e-9)


@pytest.mark.parametrize("coding", ["utf-8-sig", "utf-16"])
def test_marks_of_encodings_are_passed_over(cube: Path, tmp_path: Path, coding: str) -> None:
    (tmp_path / "part.step").write_text(cube.read_text(), encoding=coding)
    assert files.read(tmp_path / "part.step", "mm", 0.005).volume == pytest.approx(1e-6)


def test_a_part_too_large_for_the_bowl_is_told_so(cube: Path, tmp_path: Path) -> None:
    text = cube.read_text().replace(".MILLI.", "$")
    (tmp_path / "large.step").write_text(text)
    with pytest.raises(InputError, match="too large for the bowl") as caught:
        files.read(tmp_path / "large.step", None, 0.0015, None, 0.08)
    assert caught.value.value == "10 x 10 x 10 m"
    assert "0.08 m" in str(caught.value.limit)


def test_facets_that_are_coarse_for_the_part_are_said() -> None:
    (said,) = checks.check(files.read(SHAFT, "mm", 0.006))
    assert said.problem == "the facets are coarse for this part"
    assert "facet_size_m" in said.remedy


# --- what is refused -------------------------------------------------------------


def sphere_beside_a_box() -> None:
    gmsh.model.occ.addBox(0, 0, 0, 10, 10, 10)
    gmsh.model.occ.addSphere(30, 0, 0, 5)


@pytest.mark.parametrize(
    ("draw", "problem", "value"),
    [
        (sphere_beside_a_box, "contains several parts", "2 solids, 7 faces"),
        (
            lambda: gmsh.model.occ.addRectangle(0, 0, 0, 9, 9),
            "contains no solid",
            "no BREP of a solid",
        ),
    ],
)
def test_one_solid_is_a_workpiece(
    tmp_path: Path, draw: Callable[[], object], problem: str, value: str
) -> None:
    file = made(tmp_path / "part.step", draw)
    with pytest.raises(InputError, match=problem) as caught:
        files.read(file, "mm", 0.002)
    assert (caught.value.file, caught.value.value) == (file, value)
    assert caught.value.limit and caught.value.remedy and "STL" not in caught.value.remedy


def test_a_cube_without_one_face_is_refused(cube: Path, tmp_path: Path) -> None:
    start, rest = cube.read_text().split("CLOSED_SHELL('',(", 1)
    faces, rest = rest.split(")", 1)
    fewer = ",".join(faces.split(",")[1:])
    (tmp_path / "open.step").write_text(f"{start}CLOSED_SHELL('',({fewer}){rest}")
    with pytest.raises(InputError, match=r"not closed|no solid"):
        checks.check(files.read(tmp_path / "open.step", "mm", 0.005))


@pytest.mark.parametrize("part", [0.02, 0.6])
def test_a_file_that_was_cut_short(cube: Path, tmp_path: Path, part: float) -> None:
    content = cube.read_bytes()
    (tmp_path / "cut.step").write_bytes(content[: int(part * len(content))])
    with pytest.raises(InputError) as caught:
        files.read(tmp_path / "cut.step", "mm", 0.005)
    assert caught.value.file == tmp_path / "cut.step"
    assert caught.value.limit and caught.value.remedy


def test_a_file_that_ends_the_reader_is_damage(cube: Path, tmp_path: Path) -> None:
    text = cube.read_text()
    assert "ADVANCED_FACE('',(#18)" in text
    damaged = text.replace("ADVANCED_FACE('',(#18)", "ADVANCED_FACE('',(#1)", 1)
    (tmp_path / "loop.step").write_text(damaged)
    with pytest.raises(InputError, match="STEP file is damaged") as caught:
        files.read(tmp_path / "loop.step", "mm", 0.005)
    assert caught.value.value == f"the mesher ended with code -{int(signal.SIGSEGV)}"


def test_a_script_of_gmsh_is_not_run(tmp_path: Path) -> None:
    for name in ("part.step", "part.stp"):
        (tmp_path / name).write_text(f'SystemCall "touch {tmp_path}/ran";\n')
        with pytest.raises(InputError, match="not a STEP file"):
            files.read(tmp_path / name, "mm", 0.002)
    script = f'ISO-10303-21;\nSystemCall "touch {tmp_path}/ran";\nBox(1) = {{0,0,0,9,9,9}};\n'
    (tmp_path / "part.step").write_text(script)
    with pytest.raises(InputError):
        files.read(tmp_path / "part.step", "mm", 0.002)
    assert not (tmp_path / "ran").exists()


def test_the_configuration_of_gmsh_is_not_read(
    cube: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / ".gmshrc").write_text(f'SystemCall "touch {tmp_path}/ran";\n')
    monkeypatch.setenv("HOME", str(tmp_path))
    files.read(cube, "mm", 0.005)
    assert not (tmp_path / "ran").exists()


def test_facets_that_are_far_too_fine(cube: Path) -> None:
    with pytest.raises(InputError, match="too many facets") as caught:
        files.read(cube, "mm", 1e-5)
    assert "facet_size_m" in str(caught.value.remedy)


def test_a_large_file_is_not_opened(cube: Path, tmp_path: Path) -> None:
    with (tmp_path / "large.step").open("wb") as stream:
        stream.truncate(60_000_000)
    with pytest.raises(InputError, match="too large") as caught:
        files.read(tmp_path / "large.step", "mm", 0.002)
    assert caught.value.value == "60 MB"


def test_without_gmsh_the_remedy_is_named(cube: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "gmsh", None)
    with pytest.raises(step_mesher.Refusal, match=r"dragdeck\[cad\]") as caught:
        step_mesher._gmsh()
    assert len(caught.value.args) == 4
    (packages,) = re.findall('cad_packages="(.*)"', (MESHES.parent / "run").read_text())
    assert packages in str(caught.value)


@pytest.mark.parametrize(
    ("code", "problem"), [(-11, "damaged"), (-9, "too long to mesh"), (1, "damaged")]
)
def test_however_the_mesher_ends_the_file_is_named(
    cube: Path, monkeypatch: pytest.MonkeyPatch, code: int, problem: str
) -> None:
    def ended(*_: object, **__: object) -> subprocess.CompletedProcess[bytes]:
        return subprocess.CompletedProcess([], code, b"", b"a\nlast line\n" if code == 1 else b"")

    monkeypatch.setattr(subprocess, "run", ended)
    with pytest.raises(InputError, match=problem) as caught:
        files.read(cube, "mm", 1e-3)
    assert caught.value.value == (
        "last line" if code == 1 else f"the mesher ended with code {code}"
    )
