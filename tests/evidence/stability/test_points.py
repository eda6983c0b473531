"""Lists of points, and the runs that they name."""

import json
from pathlib import Path
from typing import Any

import pytest

from dragchain.errors import TableError
from dragdeck.errors import InputError
from evidence.stability.points import PointRun, read_points

SETTINGS = {"youngs_modulus_pa": 77e6, "restitution": 0.86, "friction": 0.34}


def listed(root: Path, **changes: Any) -> Path:
    """A list of one point."""
    row = {
        "regime": "settle",
        "axis": "base",
        "condition": "c",
        "settings": SETTINGS,
        "fraction": 0.4,
        "reference": True,
        "folder": "settle/base-c",
        "refused": None,
        "state": "complete",
        **changes,
    }
    file = root / "points" / "settle.json"
    file.parent.mkdir(exist_ok=True)
    file.write_text(json.dumps({"schema": 2, "points": [row]}))
    return file


def ended(run: PointRun, state: str, *failed: str) -> PointRun:
    """The same point, its run ended."""
    checks = [
        {"code": code, "name": code, "passed": False, "seen": "", "limit": ""} for code in failed
    ]
    run.folder.mkdir(parents=True, exist_ok=True)
    (run.folder / "state.json").write_text(
        json.dumps(
            {"schema": 2, "state": state, "started": "2026-11-21", "engine_version": "3.8.0",
             "ranks": 1, "parts": [], "checks": checks}
        )
    )  # fmt: skip
    return PointRun(run.point, run.folder)


def test_a_list_that_cannot_be_used_is_named_with_its_field(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"(?s)settle\.json.*points\.0\.regime"):
        read_points([listed(tmp_path, regime="bounce")])


def test_a_label_names_what_differs_from_the_base_point(tmp_path: Path) -> None:
    (run,) = read_points([listed(tmp_path)])
    assert run.point.label(SETTINGS) == "base point"
    (run,) = read_points([listed(tmp_path, settings={**SETTINGS, "friction": 2.0})])
    assert run.point.label(SETTINGS) == "friction 2"
    (run,) = read_points([listed(tmp_path, axis="restitution")])
    assert run.point.label(SETTINGS) == "e 0.86"


def test_a_run_counts_if_it_ended(tmp_path: Path) -> None:
    (run,) = read_points([listed(tmp_path)])
    assert run.record is None and not run.measurable
    assert ended(run, "complete").measurable
    assert ended(run, "failed", "neighbour_builds").measurable
    assert not ended(run, "failed", "neighbour_builds", "at_rest").measurable
    with pytest.raises(TableError, match="interrupted"):
        _ = ended(run, "stopped").record
