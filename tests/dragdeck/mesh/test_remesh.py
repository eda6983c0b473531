"""Closed surfaces with sharp facets, meshed anew: what is kept, and how far they are off."""

import json
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from trimesh import Trimesh

from dragdeck.errors import InputError
from dragdeck.mesh import checks, files, remesher
from dragdeck.mesh.surface import CAD_VOLUME, REMESHED

pytest.importorskip("mmgpy", reason="mmgpy is not made for every machine")

SIZE_M = 0.0015


@pytest.fixture(scope="module")
def bar(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A bar of 10 mm x 40 mm as CAD programs export it: two long facets for each strip."""
    file = tmp_path_factory.mktemp("bar") / "bar.stl"
    trimesh.creation.cylinder(radius=5, height=40, sections=240).export(file)
    return file


@pytest.fixture(scope="module")
def made(bar: Path) -> Trimesh:
    """The bar meshed anew."""
    return files.read(bar, "mm", SIZE_M)


def problems(mesh: Trimesh) -> list[str]:
    return [finding.problem for finding in checks.findings(mesh)]


def test_sharp_facets_are_meshed_anew_and_sharp_edges_kept(bar: Path, made: Trimesh) -> None:
    given = files.read(bar, "mm")
    assert problems(given) == ["the angle of a facet is too sharp for LIGGGHTS"]
    assert problems(made) == []
    assert made.is_watertight
    assert np.median(made.edges_unique_length) == pytest.approx(SIZE_M, rel=0.25)
    np.testing.assert_allclose(made.extents, given.extents, rtol=0.003)
    rim = made.face_adjacency_edges[made.face_adjacency_angles > np.radians(60)]
    assert set(np.abs(made.vertices[rim][:, :, 2]).ravel().round(9)) == {0.02}
    assert made.metadata[CAD_VOLUME] == pytest.approx(given.volume)


def test_the_deviation_is_that_of_the_two_surfaces(bar: Path, made: Trimesh) -> None:
    given = files.read(bar, "mm")
    deviation = made.metadata[REMESHED]
    assert deviation.facets == len(given.faces)
    assert deviation.volume == pytest.approx(made.volume / given.volume - 1)
    assert deviation.area == pytest.approx(made.area / given.area - 1)
    middle = np.hypot(*made.triangles_center[:, :2].T)
    side = np.abs(made.triangles_center[:, 2]) < 0.0199
    assert deviation.distance_m == pytest.approx(0.005 - middle[side].min(), abs=2e-6)
    assert deviation.distance_m < 0.1 * SIZE_M
    assert f"from {len(given.faces)} facets: at most 0.0" in str(deviation)


def test_the_same_surface_gives_the_same_bytes(bar: Path, made: Trimesh) -> None:
    assert files.stl_text(files.read(bar, "mm", SIZE_M)) == files.stl_text(made)


def test_an_open_surface_is_left_and_all_its_defects_are_named(bar: Path, tmp_path: Path) -> None:
    given = trimesh.load(bar)
    assert isinstance(given, Trimesh)
    Trimesh(given.vertices, given.faces[3:]).export(tmp_path / "open.stl")
    left = files.read(tmp_path / "open.stl", "mm", SIZE_M)
    assert REMESHED not in left.metadata
    assert problems(left) == [
        "the angle of a facet is too sharp for LIGGGHTS",
        "the mesh is not closed",
    ]


def test_far_too_small_facets_are_refused(bar: Path) -> None:
    with pytest.raises(InputError, match="too many facets") as caught:
        files.read(bar, "mm", 1e-5)
    assert caught.value.file == bar
    assert "facet_size_m" in str(caught.value.remedy)


def test_what_mmg_cannot_do_is_an_answer(tmp_path: Path) -> None:
    given, answer = tmp_path / "given.json", tmp_path / "answer.json"
    given.write_text(json.dumps({"points": [[0, 0, 0]], "triangles": [[0, 1, 2]]}))
    remesher.main(str(given), str(answer), "1.0")
    problem, *_, remedy = json.loads(answer.read_text())["refused"]
    assert problem == "the surface cannot be meshed anew"
    assert "facet_size_m" in remedy


def test_without_mmg_the_remedy_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mmgpy", None)
    given, answer = tmp_path / "given.json", tmp_path / "answer.json"
    given.write_text(json.dumps({"points": [[0, 0, 0]], "triangles": [[0, 1, 2]]}))
    remesher.main(str(given), str(answer), "1.0")
    assert "dragdeck[cad]" in json.loads(answer.read_text())["refused"][3]


@pytest.mark.parametrize("code", [-signal.SIGXCPU, -signal.SIGSEGV])
def test_however_mmg_ends_the_remedy_is_one_for_a_surface(
    bar: Path, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    def ended(*_: object, **__: object) -> subprocess.CompletedProcess[bytes]:
        return subprocess.CompletedProcess([], code, b"", b"")

    monkeypatch.setattr(subprocess, "run", ended)
    with pytest.raises(InputError, match=r"too long|damaged") as caught:
        files.read(bar, "mm", SIZE_M)
    assert "facet_size_m" in str(caught.value.remedy)
    assert not re.search("edge_facet_size_m|STEP", str(caught.value.remedy))
