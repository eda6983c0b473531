"""The records that decide windows and time steps are made from runs of designed scenes."""

import io
import math
import re
import tarfile
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from paths import ROOT, SNAKEFILES
from scene_runs import LAW, PER_SOFTNESS, made_run

from dragchain.errors import SeriesError
from dragchain.quantities.document import RunQuantities
from dragdeck.records.stability import StableStepRecord
from dragdeck.records.windows import WindowsRecord
from evidence.__main__ import PROGRAM, main
from evidence.windows.record import Windowed, read_windows, windows_record
from evidence.windows.scene_runs import SceneRun, read_scenes

DATA = ROOT / "workflow/dragdeck/data"


def archive(file: Path, runs: dict[str, RunQuantities]) -> Path:
    """An archive of runs by their names in it."""
    with tarfile.open(file, "w:xz") as out:
        for name, run in runs.items():
            text = run.as_text().encode()
            info = tarfile.TarInfo(f"{name}.json")
            info.size = len(text)
            out.addfile(info, io.BytesIO(text))
    return file


def numbered(runs: list[SceneRun]) -> dict[str, RunQuantities]:
    return {f"made/{number:03}": run for number, run in enumerate(runs)}


def scenes(
    packing: float = 0.0, number: int = 6, seeds: int = 2,
    ratios: Sequence[float] = (PER_SOFTNESS,), scales: Sequence[float] = (1.0, 0.001),
) -> list[SceneRun]:  # fmt: skip
    return [
        made_run(scene, scale, seed, per_softness=ratios[scene % len(ratios)], packing=packing)
        for scene in range(number)
        for scale in scales
        for seed in range(seeds)
    ]


SLOPE, ABOUT, WINDOWS = 0.7, 0.5, 12
"""Of windows on the soft run; variance about it over that of the soft run's stretches."""


def with_windows(number: int) -> dict[str, RunQuantities]:
    """A soft run of so many blocks and as many windows in each scene, by their names."""
    runs = dict[str, RunQuantities]()
    for scene in range(number):
        rng = np.random.default_rng([7, scene])
        noise, rest = 0.1 * rng.normal(size=(2, WINDOWS))
        base = made_run(scene, 0.001, 0).model_copy(update={"stability_number": None})
        soft = base.model_copy(
            update={"arc_m": float(WINDOWS), "block_m": 1.0,
                    "blocks": {"drag_mean": tuple(-2.0 * (1 + noise))}}
        )  # fmt: skip
        runs[f"{scene}/soft"] = soft
        for place, value in enumerate(-2.2 * (1 + SLOPE * noise + ABOUT**0.5 * rest)):
            runs[f"{scene}/{place}"] = base.model_copy(
                update={"run": f"{place}", "begin_m": float(place), "arc_m": 1.0, "block_m": 1.0,
                        "blocks": {"drag_mean": (value,)}}
            )  # fmt: skip
    return runs


def windowed(folder: Path) -> list[Windowed]:
    return read_windows(archive(folder / "windows.tar.xz", with_windows(6)))


def test_the_command_makes_records_that_the_product_reads(tmp_path: Path) -> None:
    """Of small made-up inputs of which ratio, slope and law are known."""
    runs = [*scenes(), made_run(0, 1.0, 9, speed=2.0)]
    half = len(runs) // 2
    drawn = archive(tmp_path / "drawn.tar.xz", with_windows(12))
    files = [
        archive(tmp_path / "a.tar.xz", numbered(runs[:half])),
        archive(tmp_path / "b.tar.xz", numbered(runs[half:])),
    ]
    call = ["record-scenes", "--out", str(tmp_path), *map(str, files)]
    assert main([*call, "--windows", str(drawn)]) == 0
    record = WindowsRecord.read(tmp_path / "windows.json")
    assert list(record.quantities) == ["drag_mean"]
    assert record.measured == "2026-01-21"
    assert record.source.endswith(": drawn.tar.xz, a.tar.xz, b.tar.xz")
    drag = record.quantities["drag_mean"]
    assert drag.per_softness == pytest.approx(PER_SOFTNESS, abs=0.02) and drag.scenes == 6
    assert 0 < drag.per_softness_std < 0.03
    assert drag.slope == pytest.approx(SLOPE, abs=2 * drag.slope_std)
    assert 0 < drag.slope_std < 0.25
    assert drag.variance_ratio == pytest.approx(ABOUT, rel=0.4) and drag.degrees > 5
    assert drag.front_power == pytest.approx(0.0, abs=0.3)  # of whatever width of the front
    assert drag.correlation == pytest.approx(0.0, abs=0.1)  # blocks are drawn independently
    law = StableStepRecord.read(tmp_path / "stable_step.json").stable_step
    assert {name: getattr(law, name) for name in LAW} == pytest.approx(LAW, rel=1e-3)
    assert law.runs == len(runs) and law.scatter < 1e-4


def scene_by_scene(runs: Sequence[SceneRun]) -> list[list[SceneRun]]:
    return [list(same) for _, same in groupby(runs, key=lambda run: run.run.split("-")[0])]


@pytest.mark.parametrize(
    ("ratios", "std"), [((0.05, 0.15), (0.04, 0.08)), ((0.0, 0.5), (math.inf, math.inf))]
)
def test_a_ratio_that_scatters_between_scenes_says_little(
    ratios: tuple[float, ...], std: tuple[float, float]
) -> None:
    runs = scene_by_scene(scenes(ratios=ratios))
    drag = windows_record(runs, [], []).quantities["drag_mean"]
    assert std[0] <= drag.per_softness_std <= std[1]


@pytest.mark.parametrize(("wrong", "useful"), [(0.0, True), (0.1, False)])
def test_a_ratio_that_is_not_that_of_the_scene_left_out_is_not_used(
    wrong: float, useful: bool
) -> None:
    """Of one modulus the ratio is by the law, of another by another."""
    runs = scenes(number=12, seeds=4)
    more = scenes(number=12, seeds=4, ratios=(PER_SOFTNESS - 4 * wrong,), scales=(0.01,))
    by_scene = [a + b for a, b in zip(*map(scene_by_scene, (runs, more)), strict=True)]
    drag = windows_record(by_scene, [], []).quantities["drag_mean"]
    assert math.isfinite(drag.per_softness_std) == useful


@pytest.mark.parametrize(("packing", "between"), [(0.0, (0.001, 0.01)), (0.1, (0.07, 0.13))])
def test_scatter_between_packings_is_that_beyond_the_path(
    packing: float, between: tuple[float, float], tmp_path: Path
) -> None:
    """Seeds at one time step are compared, 0 with 3."""
    runs = scenes(packing, number=20, seeds=4)
    drag = windows_record(scene_by_scene(runs), windowed(tmp_path), []).quantities["drag_mean"]
    assert between[0] <= drag.packing_std <= between[1]


def test_too_few_scenes_make_no_record(tmp_path: Path) -> None:
    few = read_scenes([archive(tmp_path / "few.tar.xz", numbered(scenes(number=4)))])
    assert len(few) == 4
    with pytest.raises(SeriesError, match="5 scenes"):
        windows_record(few, read_windows(archive(tmp_path / "four.tar.xz", with_windows(4))), [])


@pytest.mark.slow
def test_the_shipped_records_are_those_of_the_archives(tmp_path: Path) -> None:
    archives = sorted((ROOT / "docs/data/scenes").glob("*.tar.xz"))
    windows = str(ROOT / "docs/data/windows/drawn.tar.xz")
    call = ["record-scenes", "--out", str(tmp_path), *map(str, archives), "--windows", windows]
    assert main(call) == 0
    for name in ("windows.json", "stable_step.json"):
        assert (tmp_path / name).read_text() == (DATA / name).read_text()


def test_every_shipped_record_has_a_command_that_exists() -> None:
    """On the page on benchmarks; a command belongs to evidence or is a target of Snakemake."""
    page = (ROOT / "docs/development/benchmarks.md").read_text(encoding="utf-8")
    part = page.partition("## Records that decide results")[2].partition("\n## ")[0]
    rows = dict(re.findall(r"^\| `([\w.]+)` \|[^|]*\| (.*?) \|$", part, re.M))
    assert set(rows) == {file.name for file in DATA.iterdir() if file.suffix != ".py"}
    rules = "".join(file.read_text() for file in SNAKEFILES)
    targets = re.findall(r"^rule (\w+):", rules, re.M)
    (direct,) = re.findall(r"^    (verify [^)]*)\)", (ROOT / "run").read_text(), re.M)
    known = {f"./run {name}" for name in [*targets, *direct.split(" | ")]}
    known |= {f"python -m evidence {command.name}" for command in PROGRAM.commands}
    for name, made_by in rows.items():
        if not made_by.startswith("by hand"):
            command = re.match(r"`((?:\./run|python -m evidence) [\w-]+)", made_by)
            assert command and command[1] in known, f"{name}: {made_by}"
    assert [name for name, made_by in rows.items() if made_by.startswith("by hand")] == [
        "plausible.csv", "templates.csv", "colours.json",
    ]  # fmt: skip
