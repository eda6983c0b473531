"""Promises on other scenes: known errors, known scatter."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from paths import ROOT
from tradeoff_files import measures, write

from dragchain.errors import TableError
from dragchain.tradeoff.compare import Error
from dragchain.tradeoff.measures import Measures
from dragchain.tradeoff.promises import check_promises, failures, verdict, write_promises

FULL, SOFT = (1.0, 0.64, 1.0), (0.01, 0.64, 1.0)
LOST = {
    "code": "within_limits", "name": "energy and speed within limits", "passed": False,
    "seen": "1 particle", "limit": "2",
}  # fmt: skip
ASKED = {"tolerance": 0.1, "quantity": "drag_mean"}


def scene(depth: float, ratio: float, rng: np.random.Generator, runs: int = 6) -> list[Any]:
    """Runs of a scene: full stiffness, and a promise that errs by a known ratio."""
    inputs = {"motion.immersion_depth_m": depth}
    full = [measures(FULL, seed, rng, inputs=inputs) for seed in range(1, runs + 1)]
    soft = [
        measures(SOFT, seed, rng, inputs=inputs, effects={"drag_mean": ratio})
        for seed in range(1, runs + 1)
    ]
    return [{**run, "asked": None} for run in full] + [{**run, "asked": ASKED} for run in soft]


def read(folder: Path, contents: list[Any]) -> list[Measures]:
    """The measures of runs as they are read from their files."""
    return [Measures.read(file) for file in write(folder, contents)]


def test_promises_are_kept_and_broken_by_their_errors(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    runs = read(tmp_path, [*scene(0.05, 1.02, rng), *scene(0.03, 1.3, rng)])
    kept, broken = check_promises(runs)
    assert (kept.verdict, broken.verdict) == ("confirmed", "contradicted")
    assert kept.error.ci95_low < 0.02 < kept.error.ci95_high
    assert broken.error.ci95_low < 0.3 < broken.error.ci95_high
    assert dict(broken.scene) == {"motion.immersion_depth_m": "0.03"}
    assert (kept.runs, kept.failed, kept.reference_runs) == (6, 0, 6) and kept.met


def test_a_promise_kept_by_the_skin_of_its_teeth_is_not_met(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    asked = {**ASKED, "tolerance": 0.2, "held_to": 0.1}
    found = [{**run, "asked": run["asked"] and asked} for run in scene(0.05, 1.12, rng)]
    (check,) = check_promises(read(tmp_path, found))
    assert check.verdict == "confirmed" and not check.met


def test_the_scatter_of_a_quantity_is_its_own(tmp_path: Path) -> None:
    """Contacts without scatter leave that of the drag as it is."""
    rng = np.random.default_rng(5)
    runs = scene(0.05, 1.0, rng)
    contacts = {**ASKED, "quantity": "workpiece_contacts"}
    still = [
        measures(SOFT, seed, rng, inputs={"motion.immersion_depth_m": 0.05}, noise=0.0)
        for seed in range(1, 7)
    ]
    (alone,) = check_promises(read(tmp_path / "alone", runs))
    more = [*runs, *({**run, "asked": contacts} for run in still)]
    drag, _ = check_promises(read(tmp_path / "both", more))
    assert drag.error == alone.error


def test_few_runs_leave_a_promise_open(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    runs = read(tmp_path, scene(0.05, 1.1, rng, runs=2))
    (check,) = check_promises(runs)
    assert check.verdict == "not confirmed"


def test_the_interval_holds_the_error_as_often_as_it_says(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    held = 0
    for trial in range(120):
        (check,) = check_promises(read(tmp_path / str(trial), scene(0.05, 1.1, rng, runs=2)))
        held += check.error.ci95_low <= 0.1 <= check.error.ci95_high
    assert 107 <= held <= 119  # 114 expected, standard deviation 2.4


def test_a_failed_run_does_not_count(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    failed = measures(SOFT, 7, rng, failure=[LOST])
    inputs = {**failed["inputs"], "motion.immersion_depth_m": 0.05}
    runs = read(tmp_path, [*scene(0.05, 1.0, rng), {**failed, "inputs": inputs, "asked": ASKED}])
    (check,) = check_promises(runs)
    assert (check.runs, check.failed, check.verdict) == (6, 1, "confirmed") and not check.met
    (lost,) = failures(runs)
    assert lost.asked and lost.seen == "1 particle"


def test_without_full_stiffness_there_is_nothing_to_compare_with(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    runs = read(tmp_path, [run for run in scene(0.05, 1.0, rng) if run["asked"]])
    with pytest.raises(TableError, match="no run with the physical Young's modulus"):
        check_promises(runs)


def test_what_is_written_can_be_read(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    files = write(tmp_path, scene(0.05, 1.0, rng))
    write_promises(tmp_path / "out", files, ROOT / "workflow/dragdeck/data/stiffness.json")
    (row,) = json.loads((tmp_path / "out" / "promises.json").read_text())["promises"]
    assert row["verdict"] == "confirmed" and row["numbers"]["particles"] == 1422
    assert (tmp_path / "out" / "promises.csv").read_text().startswith("scene,")


@pytest.mark.parametrize(
    ("low", "high", "expected"),
    [
        (-0.09, 0.09, "confirmed"),
        (-0.11, 0.02, "not confirmed"),
        (0.11, 0.2, "contradicted"),
        (-0.3, -0.2, "contradicted"),
    ],
)
def test_verdicts(low: float, high: float, expected: str) -> None:
    assert verdict(Error(0.0, 0.0, low, high, 0.0, False), 0.1) == expected
