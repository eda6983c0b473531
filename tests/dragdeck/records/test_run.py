"""How a run ended, and whether it counts."""

from pathlib import Path
from typing import Any

import pytest

from dragdeck.errors import DocumentError, RejectedRunError
from dragdeck.records.run import AcceptanceCheck, RunPart, RunRecord, read_accepted

KEPT = AcceptanceCheck(
    code="particles_kept", name="no particle lost", passed=True, seen="4", limit="4"
)


def write(folder: Path, **changes: Any) -> Path:
    """A ``run.json`` of dragdeck in a folder."""
    parts = [
        RunPart(part=1, checkpoint=None, from_step=0, to_step=40),
        RunPart(part=2, checkpoint="restart.40", from_step=40, to_step=90),
    ]
    content: dict[str, Any] = {
        "state": "complete", "inputs": "0f", "started": "2026-01-01T00:00:00", "ranks": 2,
        "engine_version": "3.8.0", "parts": parts, "checks": [KEPT], "steps": 90,
        "wall_time_s": 3.0, **changes,
    }  # fmt: skip
    RunRecord(**content).write(folder / "run.json")
    return folder


def test_a_complete_run_counts(tmp_path: Path) -> None:
    record = read_accepted(write(tmp_path))
    assert [part.checkpoint for part in record.parts] == [None, "restart.40"]
    assert (record.last_step, record.steps, record.steps_per_s) == (90, 90, None)


@pytest.mark.parametrize(("cpu_time_s", "known"), [(5.5, 5.5), (0.0, 6.0)])
def test_unknown_processor_time_is_the_wall_time_of_all_ranks(
    tmp_path: Path, cpu_time_s: float, known: float
) -> None:
    assert read_accepted(write(tmp_path, cpu_time_s=cpu_time_s)).processor_time_s == known


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"state": "stopped"}, "state is 'stopped'"),
        ({"checks": []}, "no acceptance checks"),
        (
            {"checks": [KEPT.model_copy(update={"passed": False, "seen": "3"})]},
            "no particle lost .saw 3, limit 4",
        ),
    ],
)
def test_other_runs_are_refused(tmp_path: Path, changes: dict[str, Any], reason: str) -> None:
    with pytest.raises(RejectedRunError, match=reason):
        read_accepted(write(tmp_path, **changes))


def test_a_run_without_record_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RejectedRunError, match=r"run\.json"):
        read_accepted(tmp_path)


def test_a_check_without_code_is_named(tmp_path: Path) -> None:
    file = write(tmp_path) / "run.json"
    file.write_text(file.read_text().replace('"code"', '"kode"'))
    with pytest.raises(DocumentError, match=r"checks\[0\]\.code: a required key is missing"):
        RunRecord.read(file)
