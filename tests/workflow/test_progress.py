"""What `./run` shows of a workflow, on the real engine: piped, on a terminal, and of a failure."""

import os
import pty
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml
from preloaded import environment
from snakemake_calls import copy_of_project, snakemake, succeed, tiny_study

from dragdeck.cli import main

pytestmark = [pytest.mark.engine, pytest.mark.slow]

SHOWN = ("--logger", "dragdeck", "--show-failed-logs")
STUDY = ("--config", "study=tiny")
CHATTER = ("rule run_", "Select jobs", "Building DAG", "Job stats", "jobid", "Finished job")
REJECTED = """{% extends "base/process.in.j2" %}
{% block run %}{% if '0.005' in deck.run %}print "ERROR: on purpose"
{% endif %}{{ super() }}{% endblock %}
"""
"""One of the cases does not pass its acceptance checks."""


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copy_of_project(tmp_path_factory.mktemp("project"), tiny_study(), "tiny")


@pytest.fixture(scope="module")
def piped(project: Path) -> str:
    """What a call without a terminal says."""
    return succeed(project, *SHOWN, "--logger-dragdeck-every-s", "0.1", "all", *STUDY).stderr


@pytest.fixture
def inside(project: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.chdir(project)
    yield


def test_a_call_says_first_what_it_will_do(piped: str) -> None:
    lines = [line for line in piped.splitlines() if line.startswith(("tiny: ", "  "))]
    assert re.fullmatch(
        r"tiny: 3 runs, about .* on 2 cores, .* \(estimates; speed assumed\); .* free", lines[0]
    )
    scenes = {line.split(":")[0].strip() for line in lines[1:4]}
    assert scenes == {"drop_test", "filling", "process"}
    assert re.fullmatch(r"  \d\d other jobs \(their time is not estimated\)", lines[4])
    assert piped.index(lines[0]) < piped.index(": started")


def test_each_run_has_plain_lines_with_percent_and_speed(piped: str) -> None:
    for pattern in (
        r"^filling 140-particles-\w+: running, ~\d+ %, .* steps/s, energy \S+ [<>] 1e-05",
        r"^process quick-\w+: running, \d+ %, [\d,]+ steps/s, about \S+ s left$",
        r"^runs \d+ %, about .* left; \d+ of \d+ jobs done",
        r"^process quick-\w+: complete, [\d,]+ steps/s, ",
    ):
        assert re.search(pattern, piped, re.MULTILINE), pattern
    assert "\x1b" not in piped


def test_snakemakes_own_messages_are_in_its_log_alone(project: Path, piped: str) -> None:
    assert [words for words in CHATTER if words in piped] == []
    (log,) = re.findall(r"^Complete log\(s\): (.*)$", piped, re.MULTILINE)
    assert "rule run_process:" in Path(log).read_text()


def test_a_call_ends_with_the_report_and_the_main_numbers(piped: str) -> None:
    *_, report, numbers, _ = piped.splitlines()
    assert report == "report: results/tiny/report/report.html"
    assert re.fullmatch(
        r"  quick: mean drag \S+ N.*; contacts on the workpiece at a time.*", numbers
    )


def test_the_numbers_are_those_of_the_summary(project: Path, piped: str) -> None:
    row = pd.read_csv(project / "results/tiny/report/summary.csv").iloc[0]
    assert f"  {row['headline']}\n" in piped


def on_a_terminal(project: Path, *arguments: str) -> tuple[int, str]:
    """Status of a call whose output is a terminal, and all that it wrote to that."""
    ours, its = pty.openpty()
    words = ["snakemake", "--cores", "2", *arguments]
    seen = environment() | {"TERM": "xterm", "COLUMNS": "100", "LINES": "24"}
    with subprocess.Popen(words, cwd=project, env=seen, stdout=its, stderr=its) as process:
        os.close(its)
        found = b""
        while True:
            try:
                found += os.read(ours, 4096)
            except OSError:  # Linux: no process has the other end any more
                break
    os.close(ours)
    return process.returncode, found.decode()


def test_a_terminal_has_live_lines_and_nothing_is_left_of_them(project: Path, piped: str) -> None:
    forced = ("--forcerun", "run_filling", "render_filling")
    shutil.rmtree(project / "results/tiny/filling")
    status, said = on_a_terminal(project, *SHOWN, "filling", *STUDY, *forced)
    assert status == 0, said
    assert "\x1b[?25l" in said and said.rindex("\x1b[?25h") > said.rindex("\x1b[?25l")
    live = re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", "", said).replace("\r", "\n")
    assert re.search(r"runs \d+ %.*; \d+ of \d+ jobs done", live)
    assert re.search(r"^filling 140-particles-\w+: complete", live, re.MULTILINE)
    assert [words for words in CHATTER if words in live] == []


FAKE_ENGINE = """#!/bin/sh
case $1 in -h) echo 'LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, compiled)'; exit;; esac
echo 'ERROR on proc 0: Cannot do this on purpose (fake.cpp:1)'
exit 1
"""


def test_of_an_engine_that_fails_only_its_error_is_shown(
    project: Path, piped: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    engine = project / "fake"
    engine.write_text(FAKE_ENGINE)
    engine.chmod(0o755)
    monkeypatch.setenv("DRAGDECK_ENGINE", str(engine))
    (run,) = (project / "results/tiny/drop_test").iterdir()
    kept = run.rename(project / "kept")
    done = snakemake(project, *SHOWN, "drop_test", *STUDY)
    shutil.rmtree(run)
    kept.rename(run)
    assert done.returncode != 0
    _, *said, job, log = done.stderr[done.stderr.index(": failed") :].splitlines()
    assert [line.split(":")[0] for line in said] == ["dragdeck", "  check", "  log"]
    assert "ERROR on proc 0: Cannot do this on purpose" in said[1]
    assert job.startswith("  log of the job: ") and log.startswith("Complete log")


def test_a_failed_run_is_told_in_full_and_has_a_status(
    project: Path, piped: str, inside: None, capsys: pytest.CaptureFixture[str]
) -> None:
    file = project / "studies/tiny/study.yaml"
    data: dict[str, Any] = yaml.safe_load(file.read_text())
    data["sweep"] = {"motion.immersion_depth_m": [0.005, 0.006]}
    file.write_text(yaml.safe_dump(data))
    (file.parent / "templates").mkdir()
    (file.parent / "templates/process.in.j2").write_text(REJECTED)
    done = snakemake(project, *SHOWN, "all", *STUDY)
    assert done.returncode != 0
    assert "Error in rule" not in done.stderr and "CalledProcessError" not in done.stderr
    assert "check:  no LIGGGHTS error: ERROR: on purpose (limit: none)" in done.stderr
    assert "report: results/tiny/report/report.html" in done.stderr
    assert main(["status", "tiny"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("process quick_immersion_depth_m-0.005-")
    assert "  check:  no LIGGGHTS error: ERROR: on purpose (limit: none)" in said
    assert "% done: 1 failed, 3 complete" in said
