"""A search for a setting on the real engine, in which a run fails."""

from pathlib import Path

import pytest
from snakemake_calls import copy_of_project, jobs, succeed, tiny_study

from dragdeck.study.search import SearchRecord, SearchRound

pytestmark = [pytest.mark.engine, pytest.mark.slow, pytest.mark.long]

ENGINE = """#!/bin/sh
case "$PWD $*" in
*process*-in*) ! mkdir "{marker}" 2>/dev/null || {{ echo "ERROR: the first run fails"; exit 1; }} ;;
esac
exec liggghts "$@"
"""


def test_a_search_goes_on_without_the_runs_that_fail(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = tiny_study()
    data["fidelities"]["stiff"] = data["fidelities"]["quick"] | {"youngs_modulus_scale": 2e-3}
    search = {"vary": {"motion.speed_m_s": [0.01, 0.03]}, "objective": {"quantity": "drag_mean"}}
    data |= {"sweep": {"seed": [1, 2]}}
    data["search"] = {**search, "runs": 4, "start": 3, "confirm": "stiff"}
    engine = tmp_path / "engine"
    engine.write_text(ENGINE.format(marker=tmp_path / "failed"))
    engine.chmod(0o755)
    monkeypatch.setenv("DRAGDECK_ENGINE", str(engine))
    (tmp_path / "project").mkdir()
    folder = copy_of_project(tmp_path / "project", data)
    call = ("searched", "--config", "study=small")
    succeed(folder, *call)
    out = folder / "results/small/search"
    rounds = [SearchRound.read(file) for file in sorted(out.glob("round-*.json"))]
    assert [part.last for part in rounds] == [False] * (len(rounds) - 1) + [True]
    points = SearchRecord.read(out / "points.json").points
    assert [point.ran for point in points].count(True) == 1
    assert {point.purpose for point in points} == {"start", "model", "confirmation"}
    assert (out / "search.html").is_file()
    assert jobs(folder, *call) == set()
