"""A study of a user's part: what is read from its size, and that it can be run."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from trimesh import Trimesh

from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.mesh import checks
from dragdeck.mesh.checks import MeshDefect
from dragdeck.project import Project
from dragdeck.scenes.bed_space import expected_bed
from dragdeck.scenes.fit import clearances, in_diameters
from dragdeck.scenes.process import PROCESS
from dragdeck.study.workpiece import MeshShape
from dragdeck.sweep import own_part
from dragdeck.sweep.cases import load_cases, new_study


def shaft(length: float, radius: float, tooth: float) -> Trimesh:
    """A round bar with a square head, at z from 0 to a third of its length."""
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    square = ring / np.abs(ring).max(axis=1, keepdims=True)
    heights = 0.0, length / 3, 0.334 * length, length
    outlines = tooth * square, tooth * square, radius * ring, radius * ring
    rings = zip(outlines, heights, strict=True)
    return _skin(np.concatenate([np.column_stack([xy, np.full(24, z)]) for xy, z in rings]), 24)


def _skin(points: np.ndarray, count: int) -> Trimesh:
    """The closed surface through rings of so many points; round caps have a middle."""
    rings, here = len(points) // count, np.arange(count)
    after, facets = (here + 1) % count, []
    for ring in range(rings - 1):
        low, high = ring * count, (ring + 1) * count
        facets += [np.column_stack([low + here, low + after, high + after]),
                   np.column_stack([low + here, high + after, high + here])]  # fmt: skip
    ends = [[0, 0, points[0, 2]], [0, 0, points[-1, 2]]]
    last, top = (rings - 1) * count, len(points)
    facets.append(np.column_stack([np.full(count, top), after, here]))
    facets.append(np.column_stack([np.full(count, top + 1), last + here, last + after]))
    return Trimesh(np.concatenate([points, ends]), np.concatenate(facets), process=False)


def study_of(project: Project, mesh: Trimesh, name: str = "part.stl") -> tuple[Case, MeshShape]:
    file = project.root / name
    mesh.export(file)
    study = new_study(project.studies, "mine", str(file))
    (case,) = load_cases(study)
    shape = case.study.workpiece.shape
    assert isinstance(shape, MeshShape)
    return case, shape


@pytest.mark.parametrize(
    ("scale", "unit"), [(1.0, "mm"), (1e-3, "m"), (1 / 25.4, "in"), (1e3, "um"), (0.1, "mm")]
)
def test_the_unit_is_guessed_from_the_size(project: Project, scale: float, unit: str) -> None:
    mesh = shaft(60.0, 5.0, 8.0)
    mesh.apply_scale(scale)
    case, shape = study_of(project, mesh, "part.ply")
    assert shape.unit == unit
    text = case.file.read_text()
    assert f"unit: {unit}              # guessed from the size" in text
    assert f"{16 * scale:.4g} x {16 * scale:.4g} x {60 * scale:.4g} in the file" in text


@pytest.mark.parametrize("axis", ["+x", "-x", "+y", "-y", "+z", "-z"])
def test_the_round_end_is_clamped(project: Project, axis: str) -> None:
    mesh = shaft(60.0, 5.0, 8.0)
    turn = np.roll(np.eye(3), "xyz".index(axis[1]) + 1, axis=0)
    points = (mesh.vertices @ turn.T) * (1 if axis[0] == "+" else -1)
    faces = mesh.faces if axis[0] == "+" else mesh.faces[:, ::-1]
    _, shape = study_of(project, Trimesh(points, faces, process=False))
    assert shape.axis == axis


@pytest.mark.parametrize(
    ("make", "most_gap"),
    [
        (lambda: shaft(60.0, 5.0, 8.0), 4),
        (lambda: shaft(200.0, 15.0, 30.0), 4),
        (lambda: shaft(8.0, 1.0, 1.5), 12),
        (lambda: trimesh.creation.icosphere(3, 20.0), 5),
        (lambda: trimesh.creation.box((44, 44, 12)), 5),
    ],
)
def test_the_study_can_be_run(
    project: Project, make: Callable[[], Trimesh], most_gap: float
) -> None:
    case, _ = study_of(project, make())
    scene = PROCESS.build(case, None)
    assert [caution.text for caution in scene.warnings if caution.code in ("gap", "mesh")] == []
    gaps = clearances(case, expected_bed(case.study).surface_m)
    assert 2.5 < in_diameters(case, gaps.wall_m) < most_gap
    assert in_diameters(case, gaps.floor_m) > 1.5
    assert case.study.particle_count < 4500
    assert case.study.fidelity == "draft"


def test_sharp_facets_are_meshed_anew(project: Project) -> None:
    pytest.importorskip("mmgpy", reason="mmgpy is not made for every machine")
    case, shape = study_of(project, trimesh.creation.cylinder(5.0, 80.0, sections=300))
    assert shape.facet_size_m is not None
    assert "its facets are meshed anew" in case.file.read_text()
    assert PROCESS.build(case, None)


def test_a_fold_that_the_mesher_makes_is_no_defect_of_the_part(
    project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A thin edge is folded at one facet size, and not at the next."""
    pytest.importorskip("mmgpy", reason="mmgpy is not made for every machine")
    mesh, folded = trimesh.creation.cylinder(5.0, 80.0, sections=300), []
    size = study_of(project, mesh)[1].facet_size_m

    def findings(body: Trimesh, **around: object) -> list[MeshDefect]:
        if len(body.faces) != len(mesh.faces) and not folded:
            folded.append(
                MeshDefect("two facets lie on each other", "2", "none", "repair the mesh")
            )
            return folded
        return checks.findings(body, **around)  # type: ignore[arg-type]

    monkeypatch.setattr(own_part, "findings", findings)
    new_study(project.studies, "other", str(project.root / "part.stl"))
    shape = load_cases(project.studies / "other" / "study.yaml")[0].study.workpiece.shape
    assert folded and isinstance(shape, MeshShape)
    assert shape.facet_size_m == pytest.approx(size / 1.5, rel=0.1)


def test_defects_that_no_facet_size_mends_are_all_named(project: Project) -> None:
    mesh = shaft(60.0, 5.0, 8.0)
    Trimesh(mesh.vertices, mesh.faces[:-9]).export(project.root / "open.stl")
    with pytest.raises(InputError, match="not closed"):
        new_study(project.studies, "mine", str(project.root / "open.stl"))
    with pytest.raises(InputError, match="no such mesh file"):
        new_study(project.studies, "mine", str(project.root / "none.stl"))
    (project.root / "part.iges").write_text("a part\n")
    with pytest.raises(InputError, match="unknown mesh format"):
        new_study(project.studies, "mine", str(project.root / "part.iges"))
    assert not (project.studies / "mine").exists()


def test_a_step_part_has_the_unit_of_its_file(project: Project) -> None:
    pytest.importorskip("gmsh", reason="gmsh is not made for every machine")
    part = Path(__file__).parents[3] / "meshes/shaft.step"
    (case,) = load_cases(new_study(project.studies, "mine", str(part)))
    shape = case.study.workpiece.shape
    assert isinstance(shape, MeshShape)
    assert (shape.unit, shape.axis) == (None, "+x")
    assert PROCESS.build(case, None)
