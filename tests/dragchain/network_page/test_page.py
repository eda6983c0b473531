"""What network.html contains is what the tables of the run say."""

import base64
import json
import math
import re
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from figure_files import case_json
from hypothesis import given
from hypothesis import strategies as st
from made_run import line
from network_run_files import PEAK_N, PEAKS_S, accept, write_network_run
from pages import Page
from report_files import change_scripts
from scipy.spatial.transform import Rotation

from dragchain.cli import main
from dragchain.network_page import scene, shown
from dragchain.network_page.packed import ROUNDING, PackedColumns
from dragchain.network_page.page import write_page
from dragchain.network_page.shown import BODIES, DOMINANT, PATH, QUASI_LINEAR

_BYTES = {"u8": 1, "u16": 2, "u32": 4, "f24": 3}


def decoded(entries: list[dict[str, Any]], text: str) -> dict[str, np.ndarray]:
    """The columns of a page, read as the page's script does."""
    content, columns, start = zlib.decompress(base64.b64decode(text)), {}, 0
    for entry in entries:
        width, length = _BYTES[entry["kind"]], entry["length"]
        planes = np.frombuffer(content, np.uint8, width * length, start).reshape(width, length)
        start += width * length
        whole = np.zeros(length, dtype=np.uint32)
        for plane in planes:
            whole = (whole << 8) | plane
        short = (whole << 8).astype(np.uint32).view(np.float32)
        columns[entry["name"]] = short if entry["kind"] == "f24" else whole
    assert start == len(content)
    return columns


class Written:
    """A page as a reader takes it apart."""

    def __init__(self, file: Path) -> None:
        self.text = file.read_text(encoding="utf-8")
        self.head = json.loads(self.element("head"))
        self.columns = decoded(self.head["columns"], self.element("data"))

    def element(self, name: str) -> str:
        script = re.search(rf'<script [^>]*id="{name}">(.*?)</script>', self.text, re.DOTALL)
        assert script
        return script[1]

    def part(self, frame: int, name: str, kind: str = "contacts") -> np.ndarray:
        """A column of one frame."""
        start = sum(self.head["frames"][kind][:frame])
        return self.columns[name][start : start + self.head["frames"][kind][frame]]


def test_what_templates_changed_is_told(tmp_path: Path) -> None:
    folder = write_network_run(tmp_path / "run")
    write_page(folder)
    assert 'id="changed"' not in (folder / "network.html").read_text(encoding="utf-8")
    change_scripts(folder, "base.in.j2 (contact_model)")
    write_page(folder)
    line = "Input scripts changed by templates: base.in.j2 (contact_model)."
    assert line in (folder / "network.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The made run with its page; not to be changed."""
    folder = write_network_run(tmp_path_factory.mktemp("made") / "run")
    accept(folder)
    assert str(folder / "network.html") in write_page(folder)
    return folder


@pytest.fixture(scope="module")
def page(run: Path) -> Written:
    return Written(run / "network.html")


def table(run: Path, name: str, step: int | None = None) -> pd.DataFrame:
    rows = pd.read_parquet(run / f"tables/{name}.parquet")
    return rows if step is None else rows[rows["step"] == step].reset_index(drop=True)


@given(
    st.lists(st.floats(1e-12, 1e9), min_size=1, max_size=40), st.lists(st.integers(0, 2**32 - 1))
)
def test_columns_keep_what_they_promise(numbers: list[float], ids: list[int]) -> None:
    columns = PackedColumns()
    columns.add("numbers", "f24", np.array(numbers))
    columns.add("ids", "u32", np.array(ids, dtype=np.int64))
    columns.add("zero", "f24", np.zeros(1))
    read = decoded(columns.entries, columns.text())
    np.testing.assert_allclose(read["numbers"], numbers, rtol=1.01 * ROUNDING)
    assert read["ids"].tolist() == ids
    assert read["zero"].tolist() == [0.0]


def test_each_contact_is_that_of_the_table(run: Path, page: Written) -> None:
    for frame, step in enumerate(page.head["steps"]):
        rows, ids = table(run, "contacts", step), page.part(frame, "id", "particles")
        a, b = page.part(frame, "a"), page.part(frame, "b").astype(np.int64)
        assert ids[a].tolist() == rows["a_id"].tolist()
        outer = b > BODIES - 4
        others = np.where(outer, b - BODIES, ids[np.where(outer, 0, b)].astype(np.int64))
        assert others.tolist() == rows["b_id"].tolist()
        for name in ("normal", "tangential"):
            forces = rows[f"{name}_force_n"]
            np.testing.assert_allclose(page.part(frame, name), forces, rtol=1.01 * ROUNDING)


def test_each_particle_is_where_the_table_has_it(run: Path, page: Written) -> None:
    centre, step_mm = page.columns["centre"].reshape(3, -1), page.head["frames"]["step"]
    start = 0
    for frame, step in enumerate(page.head["steps"]):
        rows = table(run, "particles", step)
        end = start + len(rows)
        places = np.array(page.head["frames"]["low"]) + step_mm * centre[:, start:end].T
        off = np.abs(places - 1e3 * rows[["x_m", "y_m", "z_m"]].to_numpy())
        assert off.max() <= 0.51 * step_mm
        start = end
        speed = 1e3 * np.linalg.norm(rows[["vx_m_s", "vy_m_s", "vz_m_s"]], axis=1)
        np.testing.assert_allclose(
            page.part(frame, "speed", "particles"), speed, rtol=1.01 * ROUNDING
        )


def test_flags_and_paths_are_those_of_the_chains(run: Path, page: Written) -> None:
    for frame, step in enumerate(page.head["steps"]):
        chains, flags = table(run, "chains", step), page.part(frame, "flags")
        paths, path = chains[chains["dominant"]], page.head["paths"][frame]
        assert (path is None) == paths.empty
        if path is not None:
            assert path["bottleneck"] == paths["bottleneck_n"].iloc[0]
            assert path["particles"] == list(paths["particle_ids"].iloc[0])
            on_path = (flags & DOMINANT) > 0
            assert on_path.sum() == len(path["particles"]) + 1
            assert (flags[on_path] & PATH).all()
            weakest = page.part(frame, "normal")[on_path].min()
            assert weakest == pytest.approx(path["bottleneck"], rel=1e-4)
        peters = chains[chains["definition"] == "peters"]
        links = (peters["n_particles"] - 1).sum()
        assert ((flags & QUASI_LINEAR) > 0).sum() == links


def test_peaks_come_by_height_with_their_nearest_frames(page: Written) -> None:
    peaks, times = page.head["peaks"], np.array(page.head["times"])
    assert [peak["time"] for peak in peaks] == pytest.approx(PEAKS_S)
    assert [peak["force"] for peak in peaks] == pytest.approx(PEAK_N, rel=1e-3)
    for peak in peaks:
        assert abs(times[peak["frame"]] - peak["time"]) == np.abs(times - peak["time"]).min()


def test_the_curve_is_the_drag_over_its_phase(run: Path, page: Written) -> None:
    force, curve = table(run, "workpiece_force"), page.head["curve"]
    drag = force[force["phase"] == "drag"]["drag_n"]
    np.testing.assert_allclose(page.columns["resistance"], -drag, rtol=1.01 * ROUNDING)
    assert (curve["first"], curve["interval"], curve["every"]) == pytest.approx((1e-3, 1e-3, 1))
    assert curve["counted"] == pytest.approx(0.1)
    assert curve["window"] == pytest.approx(0.1 * 0.006 / 0.1)


def test_frames_are_equally_spaced_and_hold_the_peaks(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shown, "FRAMES", 4)
    even = {200, 300, 400, 500}
    page = shown_again(run, tmp_path)
    peak_steps = [page.head["steps"][peak["frame"]] for peak in page.head["peaks"]]
    assert peak_steps == [240, 400, 360]
    assert set(page.head["steps"]) == even | set(peak_steps)


def shown_again(run: Path, folder: Path) -> Written:
    """The page of a run, written anew beside links to its files."""
    for file in run.iterdir():
        if file.name != "network.html":
            (folder / file.name).symlink_to(file)
    write_page(folder)
    return Written(folder / "network.html")


def test_a_wide_bowl_shows_the_surroundings_and_says_so(
    run: Path, page: Written, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (scene, shown):
        monkeypatch.setattr(module, "MOST_PARTICLES", 80)
    part = shown_again(run, tmp_path)
    assert "216 particles" in part.text and "only the 80 that are nearest" in part.text
    assert "that are nearest" not in page.text
    for frame, step in enumerate(part.head["steps"]):
        rows, ids = table(run, "particles", step), part.part(frame, "id", "particles")
        x, y = part.head["workpieces"][0]["poses"][frame][:2]
        away = np.hypot(1e3 * rows["x_m"] - x, 1e3 * rows["y_m"] - y)
        nearest = rows["particle_id"][np.argsort(away)[: len(ids)]]
        assert set(ids) == set(nearest) and len(ids) <= 80
        contacts = table(run, "contacts", step)
        inside = contacts["a_id"].isin(ids) & ((contacts["b_id"] <= 0) | contacts["b_id"].isin(ids))
        assert part.head["frames"]["contacts"][frame] == inside.sum()


@pytest.mark.parametrize(("kind", "turn"), [("cylinder", 0.7), ("mesh", 0.0)])
def test_the_pose_puts_the_facets_where_the_run_has_them(
    tmp_path: Path, kind: str, turn: float
) -> None:
    """A cylinder lies in its file as it is put into the bowl, a mesh of a user looks along +x."""
    motion = line(0.1, start_m=[-0.01, 0.0], direction_deg=math.degrees(turn))
    folder = write_network_run(tmp_path / "run", kind, motion=motion)
    write_page(folder)
    page = Written(folder / "network.html")
    (workpiece,) = page.head["workpieces"]
    place, turn = workpiece["poses"][0][:3], workpiece["poses"][0][3:]
    corners = page.columns["corners"].reshape(-1, 3)
    placed = Rotation.from_quat(turn).apply(corners) + place
    first = table(folder, "workpiece_force", page.head["steps"][0]).iloc[0]
    import meshio

    mesh = meshio.stl.read(folder / "workpiece.stl")
    expected = mesh.points[mesh.cells_dict["triangle"]].reshape(-1, 3)
    expected = 1e3 * (expected + first[["ref_x_m", "ref_y_m", "ref_z_m"]].to_numpy(float))
    np.testing.assert_allclose(placed, expected, atol=2e-3)


def test_loads_of_facets_are_those_of_the_table(run: Path, page: Written) -> None:
    facets = table(run, "facets")
    assert [load["name"] for load in page.head["workpieces"][0]["loads"]] == [
        *("force_slide_pa", "mean_pressure_pa", "friction_work_pa")
    ]
    for load in page.head["workpieces"][0]["loads"]:
        values = page.columns[load["name"]]
        np.testing.assert_allclose(values, facets[load["name"]], rtol=1.01 * ROUNDING)


def test_the_page_stands_alone(page: Written) -> None:
    shell = re.sub(r"<script.*?</script>", "", page.text, flags=re.DOTALL)
    assert not re.search(r"@import|url\(|<link|https?:", shell)
    shown = Page(re.sub(r"<input[^>]*>", "", shell))
    assert shown.open == []
    assert not shown.images
    assert not re.search(r"\b(None|nan|Undefined)\b", shown.words)
    assert page.text.count("</script>") == 3


HOSTILE = '</script><script>alert("1")</script><!-- & \u2028'


def test_no_name_of_a_study_becomes_code(tmp_path: Path) -> None:
    run = write_network_run(tmp_path / "run", study_name=HOSTILE, case=HOSTILE)
    accept(run, passed=False, name=HOSTILE)
    write_page(run)
    text = (run / "network.html").read_text(encoding="utf-8")
    assert text.count("</script>") == 3 and text.count("<script") == 3
    assert "alert(" not in text.replace("alert(&#34;1&#34;)", "")


def test_a_rejected_run_is_marked(tmp_path: Path) -> None:
    run = write_network_run(tmp_path / "run")
    accept(run, passed=False)
    write_page(run)
    text = (run / "network.html").read_text(encoding="utf-8")
    assert "This run is not a result" in text and "no particle lost" in text
    accept(run)
    write_page(run)
    assert "This run is not a result" not in (run / "network.html").read_text(encoding="utf-8")


def with_fidelity(folder: Path, **changes: Any) -> Written:
    """The page of a run with other settings."""
    run = write_network_run(folder, fidelity=case_json("process")["fidelity"] | changes)
    write_page(run)
    return Written(run / "network.html")


def test_times_and_speeds_of_a_faster_run_are_those_of_the_process(
    page: Written, tmp_path: Path
) -> None:
    fast = with_fidelity(tmp_path / "run", speed_factor=4.0)
    for name in ("first", "interval", "counted", "window"):
        assert fast.head["curve"][name] == pytest.approx(4 * page.head["curve"][name])
    assert fast.head["times"] == pytest.approx([4 * time for time in page.head["times"]])
    for peak, plain in zip(fast.head["peaks"], page.head["peaks"], strict=True):
        assert peak == plain | {"time": pytest.approx(4 * plain["time"])}
    assert 4 * fast.head["scales"]["speed"] == pytest.approx(page.head["scales"]["speed"])
    speeds = 4 * fast.columns["speed"], page.columns["speed"]
    np.testing.assert_allclose(*speeds, rtol=3 * ROUNDING)
    np.testing.assert_array_equal(fast.columns["normal"], page.columns["normal"])


def test_a_run_without_a_network_has_no_page(tmp_path: Path, capsys: Any) -> None:
    run = write_network_run(tmp_path / "run")
    columns = json.loads((run / "columns.json").read_text())
    del columns["outputs"]["contacts"]
    (run / "columns.json").write_text(json.dumps(columns))
    assert main(["network", str(run)]) == 1
    assert "wrote no contact network" in capsys.readouterr().err
    assert not (run / "network.html").exists()
