"""Loads and removal on a mesh of the user's own are those of the contacts."""

import json
from pathlib import Path

import meshio
import numpy as np
import pandas as pd
import pytest
from loading_files import SIZE, case_json, made_contacts, write_run, write_without_picture
from made_run import run_json, stl
from report_files import process_findings, write_measured
from scipy.spatial.transform import Rotation

from dragchain.cli import main
from dragchain.errors import TableError
from dragchain.loading.contact_events import AMOUNTS, POINT
from dragchain.loading.document import LOADING_FILE, Loading
from dragchain.report.findings import FINDINGS_FILE
from dragchain.report.projection import Target, write_projection
from dragchain.run.workpiece import Surface
from dragchain.statistics.estimate import Estimate
from dragdeck.errors import InputError

GIVEN = {"coefficient_m2_n": 2e-11, "sd_m2_n": 1e-12}
LENGTH_M = 0.004


def grid(file: Path, cells: int = 12, x_m: float = 0.0, scale: float = 1.0) -> Path:
    """The plate of `made_contacts` in finer squares, as a mesh of finite elements."""
    y, z = np.meshgrid(np.linspace(-0.5, 0.5, cells + 1), np.linspace(0, 1, cells + 1))
    points = np.column_stack([np.full(y.size, x_m / SIZE), y.ravel(), z.ravel()]) * SIZE * scale
    corner = np.arange(y.size).reshape(y.shape)[:-1, :-1].ravel()
    squares = np.column_stack([corner, corner + 1, corner + cells + 2, corner + cells + 1])
    meshio.Mesh(points, [("quad", squares)]).write(file)
    return file


def packing(folder: Path, seed: int, law: bool = True) -> Path:
    """A run whose loads grow with its seed."""
    rows = made_contacts()
    for row in rows:
        row["normal_force_n"] *= seed
        row["tangential_force_n"] *= seed
    run = write_run(folder / f"results/small/process/run-{seed}", rows)
    study = {"materials.steel.density_kg_m3": 7800.0, "seed": seed}
    case = case_json(study | ({"removal": GIVEN} if law else {})) | {"run": run.name}
    (run / "case.json").write_text(json.dumps(case))
    (run / "run.json").write_text(json.dumps(run_json()))
    write_without_picture(run)
    process_findings().write(run / FINDINGS_FILE)
    load = Loading.read(run / LOADING_FILE)
    per_metre = load.totals["force_slide_n_m"] / load.path_m
    write_measured(run, force_slide=Estimate.around(per_metre, 0.1 * per_metre))
    return run


def test_sums_over_the_mesh_are_those_over_the_contact_events(tmp_path: Path) -> None:
    runs, out = [packing(tmp_path, seed) for seed in (1, 2)], tmp_path / "out"
    mesh = grid(tmp_path / "fine.vtu", scale=1e3)
    options = ["--unit", "mm", "--smoothing-length", str(LENGTH_M), "--mesh", str(mesh)]
    assert main(["project", "--out", str(out), *options, *map(str, runs)]) == 0
    found = pd.read_csv(out / "projection.csv")
    assert len(found) == 2 * 12**2
    assert found["area_m2"].sum() == pytest.approx(SIZE**2)
    events = [pd.read_parquet(run / "tables/contact_events.parquet") for run in runs]
    for name in AMOUNTS:
        whole = np.mean([one[name].sum() for one in events])
        assert found[name].sum() == pytest.approx(whole, rel=1e-12)
    seconds = 300 * 1e-3
    lost = GIVEN["coefficient_m2_n"] * found["force_slide_n_m"].sum() / seconds
    assert found["depth_m_s"] @ found["area_m2"] == pytest.approx(lost, rel=1e-12)
    loaded = found[found["depth_m_s"] > 0]
    np.testing.assert_allclose(loaded["depth_m_s_se"] / loaded["depth_m_s"], 1 / 3)  # 1 and 2
    assert (found["youngs_modulus_scale"] == 0.01).all()
    assert not found["corrected"].any()
    vtu = meshio.vtu.read(out / "projection.vtu")
    for name in ("force_slide_n_m", "depth_m_s", "smoothing_length_m"):
        np.testing.assert_allclose(vtu.cell_data[name][0], found[name])


def test_a_run_without_a_law_has_its_loads(tmp_path: Path) -> None:
    write_projection([packing(tmp_path, 1, law=False)], tmp_path, grid(tmp_path / "fine.vtu"),
                     "m", LENGTH_M)  # fmt: skip
    found = pd.read_csv(tmp_path / "projection.csv")
    assert found["action_w_m2"] @ found["area_m2"] == pytest.approx(1.0 * 0.04 * 200 / 300)
    assert "depth_m_s" not in found


def test_a_contact_is_shared_by_a_cone_among_the_facets_of_its_side() -> None:
    """Centres at 0, 1 and 2 mm of areas 1, 2 and 1, and one at 0 that faces away."""

    def facet(y: float, size: float, turn: int = 1) -> np.ndarray:
        return np.array([[0, y - size, -size], [0, y + size, -size], [0, y, 2 * size]])[::turn]

    corners = [facet(0, 1e-4), facet(1e-3, 1e-4 * 2**0.5), facet(2e-3, 1e-4), facet(0, 1e-4, -1)]
    rows = pd.DataFrame([[0.0, 0.0, 0.0, 0]], columns=[*POINT, "facet_id"])
    target = Target(Surface(np.array(corners)), 1.5e-3)
    found = target.receive(rows, np.array([[1.0, 0.0, 0.0]]), np.array([[5.0, 10.0]]))
    shares = np.array([1.0, 2 * (1 - 1 / 1.5), 0.0, 0.0])
    np.testing.assert_allclose(found, np.outer(shares / shares.sum(), [5.0, 10.0]), atol=1e-15)


def test_rounding_gives_a_face_at_a_right_angle_nothing() -> None:
    """A contact at the edge of two faces that are turned at random."""
    corner = [[0, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 0, 0], [-1, 0, 0], [0, 0, 1]]
    rows = pd.DataFrame([[0.0, 0.0, 0.0, 0]], columns=[*POINT, "facet_id"])
    for turn in Rotation.random(50, np.random.default_rng(0)).as_matrix():
        surface = Surface(1e-3 * np.array(corner) @ turn)
        found = Target(surface, 3e-3).receive(rows, turn[:1], np.ones((1, 1)))
        np.testing.assert_array_equal(found, [[1.0], [0.0]])


FLIPPED = stl([facet[::-1] for facet in [
    ((0.0, -0.01, 0.0), (0.0, 0.01, 0.0), (0.0, 0.01, 0.02)),
    ((0.0, -0.01, 0.0), (0.0, 0.01, 0.02), (0.0, -0.01, 0.02)),
]])  # fmt: skip
SOLID = meshio.Mesh(np.eye(4, 3), [("tetra", [[0, 1, 2, 3]])])


@pytest.mark.parametrize(
    ("mesh", "unit", "length", "message"),
    [
        ("none.stl", "m", LENGTH_M, "there is no such mesh file"),
        ("solid.vtu", "m", LENGTH_M, "cells that are no polygons"),
        ("empty.stl", "m", LENGTH_M, "the mesh has no facets"),
        ("fine.vtu", "m", 0.0, "smoothing length is not positive"),
        ("fine.vtu", "m", float("nan"), "smoothing length is not positive"),
        ("fine.vtu", "m", 0.002, "smaller than the facets of the mesh"),
        ("fine.vtu", "mm", LENGTH_M, "farther from a contact on the workpiece"),
        ("far.vtu", "m", LENGTH_M, "farther from a contact on the workpiece"),
        ("flipped.stl", "m", 0.03, "face the other way"),
    ],
)
def test_a_mesh_that_cannot_be_used_is_refused(
    made: Path, tmp_path: Path, mesh: str, unit: str, length: float, message: str
) -> None:
    grid(tmp_path / "fine.vtu")
    grid(tmp_path / "far.vtu", x_m=-0.005)
    SOLID.write(tmp_path / "solid.vtu")
    (tmp_path / "flipped.stl").write_text(FLIPPED)
    (tmp_path / "empty.stl").write_text("solid x\nendsolid x\n")
    with pytest.raises(InputError, match=message):
        write_projection([made], tmp_path / "out", tmp_path / mesh, unit, length)
    assert not (tmp_path / "out").exists()


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return packing(tmp_path_factory.mktemp("made"), 1)


def test_runs_of_several_cases_are_refused(made: Path, tmp_path: Path) -> None:
    other = packing(tmp_path, 3, law=False)
    changed = json.loads((other / "case.json").read_text())
    changed["study"]["gravity_m_s2"] = 9.8
    (other / "case.json").write_text(json.dumps(changed))
    with pytest.raises(TableError, match="2 cases"):
        write_projection([made, other], tmp_path, grid(tmp_path / "fine.vtu"), "m", LENGTH_M)
