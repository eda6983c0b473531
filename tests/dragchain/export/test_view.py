"""The script for ParaView beside an export: constant, and right about what the export has."""

import importlib.util
import itertools
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pandas as pd
import pytest
import pyvista as pv
from finished_runs import analysed_tiny_run
from PIL import Image
from tiny_run_files import BOWL_RADIUS_M, LAST, TIMESTEP_S, workpiece_x_m

from dragchain.export import paraview as paraview_export
from dragchain.export.paraview import View
from dragchain.export.write import write_export
from dragchain.run.workpiece import read_surface
from dragdeck.records.case import load_case

PACKAGED = Path(paraview_export.__file__).with_name("view.py")
HOSTILE = "'\"}}; import os; os._exit(7) #\\"


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The tiny run with tables, chains and a load map that rises with the number of the facet."""
    folder = analysed_tiny_run(tmp_path_factory.mktemp("made") / "tiny")
    facets(len(read_surface(folder, load_case(folder)).corners)).to_parquet(
        folder / "tables/facets.parquet"
    )
    return folder


def facets(count: int) -> pd.DataFrame:
    names = ("mean_pressure_pa", "friction_work_pa", "peak_normal_force_n")
    return pd.DataFrame({name: 10.0 * np.arange(count) for name in names})


@pytest.fixture
def run(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "tiny"))


def export(run: Path, **options: Any) -> Path:
    return write_export(run, "paraview", **options).file.parent


def last_frame(folder: Path, part: str) -> Any:
    reader = pv.PVDReader(folder / f"{part}.pvd")
    reader.set_active_time_value(LAST * TIMESTEP_S)
    (found,) = reader.read()
    return found


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The script as a module, without a ParaView."""
    monkeypatch.setitem(sys.modules, "paraview", ModuleType("paraview"))
    monkeypatch.setattr(sys.modules["paraview"], "simple", None, raising=False)
    spec = importlib.util.spec_from_file_location("view_of_an_export", PACKAGED)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_nothing_of_a_study_gets_into_the_script(run: Path, edit_json) -> None:
    edit_json(run / "case.json", lambda case: case.update(study=HOSTILE, title=HOSTILE))
    folder = export(run)
    assert (folder / "view.py").read_bytes() == PACKAGED.read_bytes()
    told = json.loads((folder / "view.json").read_text())
    assert HOSTILE not in json.dumps(told) and set(told) == {
        "schema", "chains", "bowl_radius_m", "bowl_height_m", "particle_radius_m", "upper"
    }  # fmt: skip


def test_the_script_names_arrays_and_files_that_the_export_has(
    run: Path, script: ModuleType
) -> None:
    folder = export(run)
    arrays = {part: last_frame(folder, part).array_names for part in (*script.CUTS, "workpiece")}
    of_part = {"speed": "particles", "force": "particles"}
    for key, (name, _, _) in script.COLOURS.items():
        assert name in arrays[of_part.get(key, key)]
    assert "radius" in arrays["particles"]
    assert set(script.CHAINS) <= set(arrays["contacts"])
    assert set(View.read(folder / "view.json").upper) == {row[0] for row in script.COLOURS.values()}
    listed = json.loads((folder / "export.json").read_text())["files"]
    assert {"view.py", "view.json"} <= set(listed)


def test_scales_cover_nearly_all_of_most_frames(run: Path, edit_json) -> None:
    edit_json(run / "case.json", lambda case: case["inputs"].update({"bowl.height_m": 0.25}))
    view = View.read(export(run) / "view.json")
    particles = pd.read_parquet(run / "tables/particles.parquet")
    speed = np.linalg.norm(particles[["vx_m_s", "vy_m_s", "vz_m_s"]], axis=1)
    of_frames = pd.Series(speed).groupby(particles["step"]).quantile(0.99)
    assert view.upper["v"] == pytest.approx(of_frames.median())
    assert (view.bowl_radius_m, view.bowl_height_m) == (BOWL_RADIUS_M, 0.25)


def test_each_particle_has_the_largest_normal_force_of_its_contacts(run: Path) -> None:
    particles = last_frame(export(run), "particles")
    contacts = pd.read_parquet(run / "tables/contacts.parquet").query(f"step == {LAST}")
    for number, found in zip(particles["id"], particles["max_normal_force_n"], strict=True):
        own = contacts[(contacts["a_id"] == number) | (contacts["b_id"] == number)]
        assert found == own["normal_force_n"].max() > 0


def test_the_load_map_is_on_the_right_facets(run: Path) -> None:
    mesh = last_frame(export(run), "workpiece")
    surface = read_surface(run, load_case(run))
    centres = mesh.cell_centers().points - [workpiece_x_m(LAST), 0, 0.02]
    near = np.linalg.norm(centres[:, None] - surface.centres, axis=2).argmin(axis=1)
    np.testing.assert_array_equal(mesh["mean_pressure_pa"], 10.0 * near)
    assert len(set(near)) == mesh.n_cells


@pytest.mark.parametrize("count", [None, 3])
def test_without_a_load_map_of_this_mesh_there_is_none(run: Path, count: int | None) -> None:
    (run / "tables/facets.parquet").unlink()
    if count is not None:
        facets(count).to_parquet(run / "tables/facets.parquet")
    folder = export(run)
    assert last_frame(folder, "workpiece").array_names == []
    assert "mean_pressure_pa" not in View.read(folder / "view.json").upper


# --- with ParaView -----------------------------------------------------------------------------

paraview = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not (shutil.which("pvpython") and shutil.which("xvfb-run")),
        reason="needs ParaView and xvfb",
    ),
]


SCREENS = itertools.count(1000 + 10 * (os.getpid() % 4000))
"""Numbers of virtual screens: one that was just given up may not be free yet."""


def pvpython(script: Path, *arguments: object) -> subprocess.CompletedProcess[str]:
    """Run a script as on a machine without a screen; ParaView has a Python of its own."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}
    for number in itertools.islice(SCREENS, 3):
        screen = ["xvfb-run", f"--server-num={number}", "--auto-servernum"]
        words = [*screen, "pvpython", "--force-offscreen-rendering", script, *arguments]
        done = subprocess.run(
            list(map(str, words)), cwd="/", env=kept, capture_output=True, text=True
        )
        if not re.search("X server|Xvfb", done.stderr):
            break
    return done


def error_in(done: subprocess.CompletedProcess[str]) -> bool:
    return any(word in done.stderr for word in ("ERR|", "Error", "Traceback"))


def colours(picture: Path) -> int:
    """The number of colours of a picture."""
    found = Image.open(picture).convert("RGB").getcolors(maxcolors=1 << 20)
    assert found is not None
    return len(found)


FOLLOWED = """
import runpy, sys
script, picture = sys.argv[1:]
sys.argv = [script, '--picture', picture, '--frame', '1', '--size', '160', '120']
runpy.run_path(script, run_name='__main__')
from paraview import simple
scene = simple.GetAnimationScene()
for time_s in scene.TimeKeeper.TimestepValues:
    scene.AnimationTime = time_s
    print('cut', *(simple.FindSource(f'cut {name}').ClipType.Origin[0]
                   for name in ('particles', 'contacts')))
"""


class TestInParaView:
    pytestmark = paraview

    def test_it_saves_a_picture(self, run: Path, tmp_path: Path) -> None:
        folder = export(run, out=tmp_path / 'it\'s "a" folder; {x} $HOME')
        picture = tmp_path / "picture.png"
        options = ("--size", 400, 300, "--frame", 0, "--colour", "force")
        done = pvpython(folder / "view.py", "--picture", picture, *options)
        assert done.returncode == 0 and not error_in(done), done.stderr
        assert Image.open(picture).size == (400, 300)
        assert colours(picture) > 500

    def test_a_filling_is_shown_too(self, run: Path, tmp_path: Path, edit_json) -> None:
        edit_json(
            run / "case.json",
            lambda case: case.update(scene="filling", workpiece=None, motion=None),
        )
        edit_json(run / "columns.json", lambda content: content["outputs"].pop("contacts"))
        folder = export(run)
        done = pvpython(folder / "view.py", "--picture", tmp_path / "picture.png")
        assert done.returncode == 0 and not error_in(done), done.stderr
        assert colours(tmp_path / "picture.png") > 500

    def test_a_frame_that_is_not_there_is_refused(self, run: Path, tmp_path: Path) -> None:
        done = pvpython(export(run) / "view.py", "--picture", tmp_path / "none.png", "--frame", 6)
        assert done.returncode == 1
        assert "--frame 6: the frames are 0 to 5" in done.stderr
        assert not (tmp_path / "none.png").exists()

    def test_the_cuts_follow_the_workpiece(self, run: Path, tmp_path: Path) -> None:
        (tmp_path / "followed.py").write_text(FOLLOWED)
        folder = export(run)
        done = pvpython(tmp_path / "followed.py", folder / "view.py", tmp_path / "picture.png")
        assert done.returncode == 0 and not error_in(done), done.stderr
        assert colours(tmp_path / "picture.png") > 500
        lines = [line.split()[1:] for line in done.stdout.splitlines() if line.startswith("cut")]
        expected = [[workpiece_x_m(step)] * 2 for step in range(0, LAST + 1, 20)]
        np.testing.assert_allclose(np.array(lines, dtype=float), expected, atol=1e-7)
