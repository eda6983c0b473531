"""Chains that cause peaks, and chains that do not; circular shifts of events against series."""

import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from chain_runs import FRAMES, INTERVAL_S, found_of, wander
from figure_files import workpiece_force_table, write_process_run
from made_run import save
from networks import R, make_frame, row
from scipy.stats import binom, false_discovery_control

from dragchain.drag import find_drag_peaks
from dragchain.errors import TableError
from dragchain.network.frame import FLOOR, SIDE, WORKPIECE, NetworkFrame
from dragchain.report.page import page_environment
from evidence.validation.peaks import (
    PeakFindings,
    PeakTest,
    chain_numbers,
    draw_shifts,
    holm,
    joint,
    judge_statement,
    near_any,
    of_runs,
    read_run,
    shift_test,
    shifted_means,
    standardised,
)


def verdicts(found: PeakFindings) -> dict[str, str]:
    return {row.statement: row.verdict for row in found.statements}


def supported(found: PeakFindings) -> set[str]:
    return {row.statement for row in found.statements if row.supported}


def test_chains_that_make_the_peaks_are_found() -> None:
    found = found_of(11, 3.0)
    assert verdicts(found)["presence"] == verdicts(found)["dominance"] == "confirmed"
    assert supported(found) == {"presence", "dominance", "coverage", "reverse"}


def test_chains_that_have_nothing_to_do_with_the_peaks_are_not_found() -> None:
    found = found_of(12, 0.0)
    assert not supported(found) and "confirmed" not in verdicts(found).values()


def test_chains_that_weaken_at_peaks_contradict_their_presence() -> None:
    assert verdicts(found_of(13, -3.0))["presence"] == "contradicted"


def test_one_packing_has_no_interval_and_confirms_nothing() -> None:
    found = found_of(15, 3.0, runs=1)
    assert all(math.isnan(test.ci95_low) for test in found.tests)
    assert "confirmed" not in verdicts(found).values() and "presence" in supported(found)
    again = PeakFindings.model_validate_json(found.as_text(), strict=True)
    assert again.as_text() == found.as_text()


def test_a_conservative_test_supports_but_does_not_contradict() -> None:
    def judged(ratio: tuple[float, float], drag: tuple[float, float]) -> tuple[str, bool]:
        tests = [
            PeakTest(
                test=name, statement="dominance", at_peaks=1.0, expected=1.0, effect=effect,
                ci95_low=effect - 0.1, ci95_high=effect + 0.1, p=p, p_holm=p,
            )
            for name, (effect, p) in (
                ("strength_over_surroundings", ratio), ("strength_over_drag", drag)
            )
        ]  # fmt: skip
        row = judge_statement("dominance", tests)
        return row.verdict, row.supported

    assert judged((0.0, 0.5), (-1.0, 0.99)) == ("contradicted", False)
    assert judged((0.15, 0.5), (-1.0, 0.99)) == ("not confirmed", False)
    assert judged((0.0, 0.5), (1.0, 1e-3)) == ("not confirmed", True)
    assert judged((1.0, 1e-3), (-1.0, 0.99)) == ("confirmed", True)


def test_near_any_includes_its_reach() -> None:
    times = np.array([0.0, 0.25, 0.5, 1.0])
    assert near_any(times, np.array([0.25, 0.9]), 0.25).tolist() == [True, True, True, True]
    assert near_any(times, np.array([1.0]), 0.25).tolist() == [False, False, False, True]
    assert near_any(times, np.array([]), 1.0).tolist() == [False] * 4


# --- the chains of a run ---------------------------------------------------------------------


def straight_chain(first: float = 4.0) -> NetworkFrame:
    """Return a chain along x from the workpiece to the side, and weak contacts."""
    contacts = [(1, WORKPIECE, first), (1, 2, 3.0), (2, 3, 5.0), (3, SIDE, 6.0)]
    weak = [(particle, FLOOR, 0.01) for particle in (8, 9)]
    return make_frame(row(3) | {8: (0.5, 0.5, R), 9: (0.5, 0.6, R)}, [*contacts, *weak])


def test_numbers_of_a_straight_chain() -> None:
    found = chain_numbers(straight_chain())
    assert found["strength"] == pytest.approx(3.0 / (14.02 / 5))
    assert found["strength_over_surroundings"] == pytest.approx(1.0)
    assert found["strength_over_drag"] == pytest.approx(0.75)


def test_the_force_on_the_workpiece_plays_no_part_in_the_strength() -> None:
    weak, strong = chain_numbers(straight_chain(2.0)), chain_numbers(straight_chain(40.0))
    assert weak["strength"] == strong["strength"]
    assert weak["strength_over_surroundings"] == strong["strength_over_surroundings"]


def test_a_frame_without_a_path_has_no_numbers() -> None:
    frame = make_frame(row(2), [(1, WORKPIECE, 4.0), (1, 2, 3.0)])
    assert all(math.isnan(value) for value in chain_numbers(frame).values())


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a made process run with one peak, with tables and chains."""
    return write_process_run(tmp_path_factory.mktemp("made"))


def test_a_run_is_read_with_its_peaks(made: Path) -> None:
    found = of_runs([made])
    assert [run.peaks for run in found.runs] == [1]
    assert found.table()["test"].tolist() == [test.test for test in found.tests]


def test_a_drag_without_a_peak_is_refused(made: Path, tmp_path: Path) -> None:
    for name in ("case.json", "columns.json"):
        (tmp_path / name).write_bytes((made / name).read_bytes())
    for name in ("contacts", "particles", "network"):
        save(pd.read_parquet(made / "tables" / f"{name}.parquet"), tmp_path, name)
    save(workpiece_force_table().assign(drag_n=-2.0), tmp_path, "workpiece_force")
    with pytest.raises(TableError, match="no peak"):
        read_run(tmp_path)


@pytest.mark.parametrize(("seed", "pull", "answer"), [(11, 3.0, "yes"), (12, 0.0, "no")])
def test_the_section_answers_by_the_verdicts(seed: int, pull: float, answer: str) -> None:
    found = found_of(seed, pull)
    template = page_environment(package="evidence").get_template("validation/peaks.html.j2")
    page = template.render(found=json.loads(found.as_text()))
    assert f'data-answer="{answer}"' in page and "None" not in page


# --- tests by circular shifts ------------------------------------------------------------------


def test_shifted_means_are_means_around_moved_events() -> None:
    rng = np.random.default_rng(3)
    series = rng.normal(size=50)
    series[[3, 4, 20]] = np.nan
    events = np.array([0, 10, 48])
    found = shifted_means(series, events, 2)
    for shift in range(50):
        near = (events[:, None] + shift + np.arange(-2, 3)).ravel() % 50
        assert found[shift] == pytest.approx(np.nanmean(series[near]))


def test_a_frame_without_a_value_counts_in_no_mean() -> None:
    series = np.array([np.nan, 2.0, np.nan, 4.0])
    found = shifted_means(series, np.array([0]), 0)
    assert np.isnan(found[[0, 2]]).all()
    assert found[[1, 3]].tolist() == pytest.approx([2.0, 4.0])


def test_shifts_of_one_run_give_the_exact_p_value() -> None:
    series = np.zeros(100)
    series[[7, 40]] = [1.0, 2.0]
    by_shift = [shifted_means(series, np.array([7]), 0)]
    every = np.arange(100)[:, None]
    found = shift_test(by_shift, every)
    # two shifts of a hundred reach the value, and the true position counts once more
    assert found.value == pytest.approx(1.0)
    assert found.p_greater == pytest.approx(3 / 101)


def test_runs_are_shifted_independently_and_averaged() -> None:
    first, second = np.arange(4.0), np.array([10.0, 20.0])
    found = joint([first, second], np.array([[0, 0], [3, 1], [1, 2]]))
    assert found.tolist() == [5.0, 11.5, 5.5]
    shifts = draw_shifts([4, 2], 500)
    assert shifts.max(axis=0).tolist() == [3, 1]
    assert abs(np.corrcoef(shifts.T)[0, 1]) < 0.15


def test_a_run_without_a_value_is_left_out() -> None:
    found = joint([np.array([np.nan, 1.0]), np.array([2.0, 4.0])], np.array([[0, 0], [1, 1]]))
    assert found.tolist() == [2.0, 2.5]


def test_a_constant_series_has_no_standardised_mean() -> None:
    assert np.isnan(standardised(np.ones(5), np.ones(5))).all()


def test_holm_steps_down() -> None:
    found = holm([0.01, 0.04, 0.03, np.nan, 0.5])
    assert found[[0, 1, 2, 4]].tolist() == pytest.approx([0.04, 0.09, 0.09, 0.5])
    assert np.isnan(found[3])
    # never below the adjustment of Benjamini and Hochberg, which controls less
    values = np.array([0.001, 0.2, 0.03, 0.012])
    assert (holm(values) >= false_discovery_control(values)).all()


def test_false_positives_are_as_many_as_the_level_says() -> None:
    sets, level = 200, 0.05
    hits, p_values = 0, []
    for seed in range(sets):
        rng = np.random.default_rng(1000 + seed)
        by_shift = []
        for _ in range(2):
            series, drag = wander(rng), wander(rng)
            events = find_drag_peaks(np.arange(FRAMES) * INTERVAL_S, drag, min_separation_s=0.1)
            means = shifted_means(series, events.index, 2)
            by_shift.append(standardised(series, means))
        p_values.append(shift_test(by_shift, draw_shifts([FRAMES] * 2, 999)).p_greater)
        hits += p_values[-1] < level
    assert binom.ppf(0.005, sets, level) <= hits <= binom.ppf(0.995, sets, level)
    assert np.mean(p_values) == pytest.approx(0.5, abs=2.6 / math.sqrt(12 * sets))
