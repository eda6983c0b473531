"""Scalings from run folders whose drag follows a law that is known."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from made_run import with_motion
from report_files import write_measured
from scipy import stats
from tiny_run_files import DENSITY_KG_M3, GRAVITY_M_S2, RADIUS_M, WORKPIECE_RADIUS_M, case_json

from dragchain.cli import main
from dragchain.errors import SeriesError, TableError
from dragchain.scaling.document import ScaledRun, ScalingFile, read_scalings
from dragchain.scaling.fit import (
    draw_scalings,
    find,
    fit_power_law,
    floor_particles,
    gap_particles,
    read_scaled_runs,
    table,
)
from dragchain.statistics.correlated import estimate_mean
from dragdeck.study.model import Scaling

DEPTH = "motion.immersion_depth_m"
LEVELS = (0.01, 0.02, 0.04)
UP, DOWN = (1.99, 2.01), (2.01, 1.99)
Writer = Callable[..., Path]


@pytest.fixture
def write_run(tmp_path: Path) -> Writer:
    """Write a run folder whose drag has a mean and correlated noise of 5 % of it."""

    def write(drag_n: float, seed: int = 1, **inputs: object) -> Path:
        case = case_json(study={**inputs, "seed": seed})
        case["run"] = "-".join([*(f"{value}" for value in inputs.values()), f"seed{seed}"])
        case["upstream"]["filling"] = f"filling-{seed}"
        case["workpiece"]["immersion_depth_m"] = inputs.get(DEPTH, 0.03)
        path = {"kind": "circle", "radius_m": 0.02, "revolutions": 1}
        speed = float(str(inputs.get("motion.speed_m_s", 0.01)))
        case = with_motion(case, path, speed, orientation="follow_path")
        folder = tmp_path / case["run"]
        (folder / "tables").mkdir(parents=True)
        (folder / "case.json").write_text(json.dumps(case))
        noise = np.random.default_rng(seed).normal(size=2000)
        smooth = np.convolve(noise, np.full(10, 10**-0.5), "same")
        drag = -drag_n * (1.0 + 0.05 * (smooth - smooth.mean()))
        write_measured(folder, drag_mean=estimate_mean(drag).estimate)
        return folder

    return write


@pytest.fixture
def quadratic(write_run: Writer) -> list[Path]:
    """Two beds at three depths: 2000 N/m2 times the depth squared, 3 % more in one bed."""
    return [
        write_run(2000.0 * depth**2 * (1.0 + 0.03 * seed), seed, **{DEPTH: depth})
        for depth in LEVELS
        for seed in (1, 2)
    ]


def test_a_quadratic_drag_confirms_two_and_contradicts_one(quadratic: list[Path]) -> None:
    found = find(quadratic, Scaling(field=DEPTH, expected_exponent=2.0, source="somebody 1999"))
    assert found.verdict == "confirmed"
    assert found.fit.exponent.value == pytest.approx(2.0, abs=0.01)
    assert find(quadratic, Scaling(field=DEPTH, expected_exponent=1.0)).verdict == "contradicted"
    assert find(quadratic, Scaling(field=DEPTH)).verdict == "no expectation"


def test_the_size_is_compared_with_the_weight_on_the_workpiece(quadratic: list[Path]) -> None:
    run, case = read_scaled_runs(quadratic, DEPTH)[0]
    scale = DENSITY_KG_M3 * GRAVITY_M_S2 * 2.0 * WORKPIECE_RADIUS_M
    assert run.eta == pytest.approx(2000.0 * 1.03 / scale)
    assert find(quadratic, Scaling(field=DEPTH, expected_exponent=2.0)).eta.contains(
        2000.0 * 1.045 / scale
    )
    assert gap_particles(case) == pytest.approx(
        (0.040 - 0.020 - WORKPIECE_RADIUS_M) / (2.0 * RADIUS_M)
    )
    assert floor_particles(case) == pytest.approx((0.050 - 0.01) / (2.0 * RADIUS_M))


def test_an_expectation_for_some_levels_is_judged_there(write_run: Writer) -> None:
    field = "motion.speed_m_s"
    folders = [
        write_run(scatter * max(1.0, speed / 0.02) ** 0.5, seed, **{field: speed})
        for speed, scatters in zip((0.005, 0.01, 0.02, 0.08), (UP, DOWN, UP, DOWN), strict=True)
        for seed, scatter in enumerate(scatters, 1)
    ]
    assert find(folders, Scaling(field=field, expected_exponent=0.0)).verdict == "contradicted"
    slow = find(folders, Scaling(field=field, expected_exponent=0.0, fit_range=(0.005, 0.02)))
    assert slow.verdict == "confirmed"
    assert (slow.fit.runs, len(slow.levels)) == (6, 4)
    assert slow.fit.change_per_decade.value == pytest.approx(0.0, abs=0.02)


def test_the_command_writes_all_that_a_page_needs(
    quadratic: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    words = ["step", "scaling", "drag-depth", "--out", str(out), "--command", "made by"]
    assert main([*words, *map(str, quadratic)]) == 0
    assert "confirmed" in capsys.readouterr().out
    found = ScalingFile.read(out / "scaling.json")
    assert found.commands == ("made by",) and found.expected.exponent == 2.0
    rows = pd.read_csv(out / "scaling.csv")
    assert rows[DEPTH].tolist() == list(LEVELS) and rows.runs.tolist() == [2, 2, 2]
    assert rows.drag_n.tolist() == pytest.approx(rows.fitted_n.tolist(), rel=0.01)
    assert (out / "scaling.png").stat().st_size > 10_000
    assert len(draw_scalings([found, found, found]).axes) == 4


def test_runs_that_differ_in_more_than_the_field_are_refused(write_run: Writer) -> None:
    folders = [
        write_run(1.0, **{DEPTH: depth, "media.count": count})
        for depth, count in zip(LEVELS, (4, 4, 5), strict=True)
    ]
    with pytest.raises(TableError, match=r"media\.count is 5.*it is 4"):
        read_scaled_runs(folders, DEPTH)


@pytest.mark.parametrize(
    "field",
    ["bowl.material", "bowl.thickness_m", "contact.limit_force", "materials.steel.poissons_ratio"],
)
def test_a_field_without_a_number_is_refused(write_run: Writer, field: str) -> None:
    folder = write_run(1.0, **{"materials.steel.poissons_ratio": -0.1})
    with pytest.raises(TableError, match="numbers above 0"):
        read_scaled_runs([folder], field)


def test_a_drag_along_the_motion_is_refused(write_run: Writer) -> None:
    folder = write_run(-1.0, **{DEPTH: 0.01})
    with pytest.raises(TableError, match="along the motion"):
        read_scaled_runs([folder], DEPTH)


def test_the_scalings_of_the_package_are_whole() -> None:
    scalings = read_scalings()
    assert [found.study for found in scalings] == [
        f"drag-{name}" for name in ("depth", "diameter", "speed", "friction")
    ]
    for found in scalings:
        assert found.commands and found.engine and found.started
        assert vars(fit_power_law(found.runs).exponent) == pytest.approx(vars(found.fit.exponent))
        assert list(table(found)[found.field]) == [level.x for level in found.levels]


DEPTHS = (10.0, 20.0, 30.0, 40.0, 50.0)


def rows_of(drag_n: np.ndarray, levels: tuple[float, ...] = DEPTHS) -> list[ScaledRun]:
    """Runs with these drags at levels, from two beds at each."""
    return [
        ScaledRun(
            run=f"{number}", seed=number % 2, level=levels[number // 2], drag_n=drag,
            standard_error_n=0.03 * drag, reliable=True, eta=drag, bed=f"bed {number % 2}",
        )
        for number, drag in enumerate(drag_n.tolist())
    ]  # fmt: skip


def test_without_noise_the_law_is_found() -> None:
    law = fit_power_law(rows_of(3.0 * np.repeat(DEPTHS, 2) ** 1.7))
    assert law.exponent.value == pytest.approx(1.7, abs=1e-9)
    assert law.at(20.0).value == pytest.approx(3.0 * 20.0**1.7)


@pytest.mark.parametrize("bed_fraction", [0.0, 0.6])
def test_the_interval_contains_the_exponent_as_often_as_it_says(bed_fraction: float) -> None:
    """The errors of the means differ by a factor of three between runs."""
    random, held = np.random.default_rng(5), 0
    for _ in range(400):
        bed = random.normal(0.0, 0.06 * np.sqrt(bed_fraction), 2)
        own = random.normal(0.0, 0.06 * np.sqrt(1.0 - bed_fraction), 10)
        errors = random.normal(0.0, 0.03 * random.uniform(0.5, 1.5, 10))
        logarithms = 2.0 * np.log(np.repeat(DEPTHS, 2)) + np.tile(bed, 5) + own + errors
        held += fit_power_law(rows_of(np.exp(logarithms))).exponent.contains(2.0)
    assert stats.binomtest(held, 400, 0.95).pvalue > 0.001, held


def test_too_few_levels_and_runs_are_refused() -> None:
    with pytest.raises(SeriesError, match="2 level"):
        fit_power_law(rows_of(np.ones(4), (1.0, 2.0)))
