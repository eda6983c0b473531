"""The records that decide windows and time steps are made from runs of designed scenes."""

import io
import math
import re
import tarfile
from pathlib import Path

import numpy as np
import pytest
from made_study import plain_study
from paths import ROOT, SNAKEFILES

from dragchain.errors import SeriesError
from dragchain.quantities.document import RunCost, RunQuantities
from dragdeck.physics.contact_mechanics import damping_ratio
from dragdeck.records.case import FidelityOfRun
from dragdeck.records.stability import StableStepRecord
from dragdeck.records.windows import WindowsRecord
from dragdeck.study.model import Study
from evidence.__main__ import COMMANDS, main
from evidence.windows.record import SceneRun, Windowed, read_scenes, read_windows, windows_record

DATA = ROOT / "workflow/dragdeck/data"
COST = RunCost(steps=1, wall_time_s=1, cpu_time_s=1, ranks=1, timestep_s=1e-6, axis_speed_m_s=0.1,
               steps_per_m=1e7)  # fmt: skip
LAW = {"stiffness": 80.0, "damping": 40.0, "spread": -1.5}


def made_run(
    scene: int, scale: float, seed: int, *, ratio: float, packing: float = 0.0, speed: float = 1.0
) -> SceneRun:
    """A run whose drag is 2 N at the physical modulus over `ratio` at a reduced one."""
    rng = np.random.default_rng([scene, seed, round(1 / scale)])
    mean = 2.0 / (1.0 if scale == 1.0 else ratio) * math.exp(packing * rng.normal())
    mean *= 10.0 if speed != 1.0 else 1.0
    restitution, spread, fraction = 0.4 + 0.02 * scene, 0.02 * (scene % 3), 0.3 + 0.05 * (seed % 3)
    kappa = 1e4 * (1 + scene)
    u = fraction * (kappa * scale ** (2 / 3)) ** -0.25
    squared = LAW["stiffness"] * u**2 + LAW["damping"] * damping_ratio(restitution) * u
    return SceneRun(
        study_name="made", run=f"{scene}-{scale}-{seed}", bed=None, complete=True, cost=COST,
        versions={"engine": "3.8.0"}, started=f"2026-01-{10 + scene}T00:00:00+00:00",
        study=Study.model_validate(plain_study({
            "seed": seed, "pairs.ceramic-ceramic.restitution": restitution,
            "media.radius_mean_m": 1.0, "media.radius_std_m": spread})),
        fidelity=FidelityOfRun(name="made", youngs_modulus_scale=scale, timestep_fraction=fraction,
                               speed_factor=speed, skin_m=1e-4, ranks=1),
        numbers={"stiffness_number": kappa, "particles": 300.0 + seed},
        arc_m=1.0, block_m=0.1,
        blocks={"drag_mean": tuple(-mean * (1 + 0.05 * rng.normal(size=40))),
                "workpiece_contacts": (3.0, None)},
        stability_number=math.sqrt(squared) * math.exp(LAW["spread"] * spread),
    )  # fmt: skip


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


def scenes(packing: float = 0.0, number: int = 6, seeds: int = 2) -> list[SceneRun]:
    return [
        made_run(scene, scale, seed, ratio=1.1, packing=packing)
        for scene in range(number)
        for scale in (1.0, 0.001)
        for seed in range(seeds)
    ]


SLOPE, ABOUT, WINDOWS = 0.7, 0.5, 12
"""Of windows on the soft run; variance about it over that of the soft run's stretches."""


def with_windows(ratios: list[float]) -> dict[str, RunQuantities]:
    """A soft run of so many blocks and as many windows in each scene, by their names."""
    runs = dict[str, RunQuantities]()
    for scene, ratio in enumerate(ratios):
        rng = np.random.default_rng([7, scene])
        noise, rest = 0.1 * rng.normal(size=(2, WINDOWS))
        base = made_run(scene, 0.001, 0, ratio=ratio).model_copy(update={"stability_number": None})
        soft = base.model_copy(
            update={"arc_m": float(WINDOWS), "block_m": 1.0,
                    "blocks": {"drag_mean": tuple(-2.0 * (1 + noise))}}
        )  # fmt: skip
        runs[f"{scene}/soft"] = soft
        for place, value in enumerate(-2.0 * ratio * (1 + SLOPE * noise + ABOUT**0.5 * rest)):
            runs[f"{scene}/{place}"] = base.model_copy(
                update={"run": f"{place}", "begin_m": float(place), "arc_m": 1.0, "block_m": 1.0,
                        "blocks": {"drag_mean": (value,)}}
            )  # fmt: skip
    return runs


def windowed(ratios: list[float], folder: Path) -> list[Windowed]:
    return read_windows(archive(folder / "windows.tar.xz", with_windows(ratios)))


def test_the_command_makes_records_that_the_product_reads(tmp_path: Path) -> None:
    """Of small made-up inputs of which ratio, slope and law are known."""
    runs = [*scenes(), made_run(0, 1.0, 9, ratio=1.1, speed=2.0)]
    half = len(runs) // 2
    drawn = archive(tmp_path / "drawn.tar.xz", with_windows([1.1] * 12))
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
    assert drag.ratio_log == pytest.approx(math.log(1.1), abs=0.02)
    assert 0 < drag.ratio_log_std < 0.03
    assert drag.slope == pytest.approx(SLOPE, abs=2 * drag.slope_std)
    assert 0 < drag.slope_std < 0.25
    assert drag.variance_ratio == pytest.approx(ABOUT, rel=0.4) and drag.degrees > 5
    assert drag.correlation == pytest.approx(0.0, abs=0.1)  # blocks are drawn independently
    law = StableStepRecord.read(tmp_path / "stable_step.json").stable_step
    assert {name: getattr(law, name) for name in LAW} == pytest.approx(LAW, rel=1e-3)
    assert law.runs == len(runs) and law.scatter < 1e-4


@pytest.mark.parametrize(
    ("ratios", "std"), [([1.0, 1.1] * 3, (0.04, 0.08)), ([1.0, 1.5] * 3, (math.inf, math.inf))]
)
def test_a_ratio_that_scatters_between_scenes_says_little(
    ratios: list[float], std: tuple[float, float], tmp_path: Path
) -> None:
    drag = windows_record([], windowed(ratios, tmp_path), []).quantities["drag_mean"]
    assert std[0] <= drag.ratio_log_std <= std[1]


@pytest.mark.parametrize(("packing", "between"), [(0.0, (0.0, 0.01)), (0.1, (0.07, 0.13))])
def test_scatter_between_packings_is_that_beyond_the_path(
    packing: float, between: tuple[float, float], tmp_path: Path
) -> None:
    """Seeds at one time step are compared, 0 with 3."""
    number = 20 if packing else 6
    runs = scenes(packing, number, seeds=4)
    by_scene = [[run for run in runs if run.run.startswith(f"{k}-")] for k in range(number)]
    drag = windows_record(by_scene, windowed([1.1] * 6, tmp_path), []).quantities["drag_mean"]
    assert between[0] <= drag.packing_std <= between[1]


def test_too_few_scenes_make_no_record(tmp_path: Path) -> None:
    few = read_scenes([archive(tmp_path / "few.tar.xz", numbered(scenes(number=4)))])
    assert len(few) == 4
    with pytest.raises(SeriesError, match="5 scenes"):
        windows_record(few, windowed([1.1] * 4, tmp_path), [])


@pytest.mark.slow
def test_the_shipped_records_are_those_of_the_archives(tmp_path: Path) -> None:
    archives = sorted((ROOT / "docs/data/scenes").glob("*.tar.xz"))
    assert main(["record-scenes", "--out", str(tmp_path), *map(str, archives)]) == 0
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
    known = {f"./run {name}" for name in targets}
    known |= {f"python -m evidence {one.name}" for one in COMMANDS}
    for name, made_by in rows.items():
        if not made_by.startswith("by hand"):
            command = re.match(r"`((?:\./run|python -m evidence) [\w-]+)", made_by)
            assert command and command[1] in known, f"{name}: {made_by}"
    assert [name for name, made_by in rows.items() if made_by.startswith("by hand")] == [
        "plausible.csv", "templates.csv", "colours.json",
    ]  # fmt: skip
