"""The logger plugin on records as Snakemake makes them, without a workflow."""

import io
import logging
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from paths import ROOT
from preloaded import plain_environment
from rich.console import Console
from snakemake.logging import DefaultFormatter
from snakemake_interface_logger_plugins.common import LogEvent
from snakemake_interface_logger_plugins.registry import LoggerPluginRegistry

from dragdeck.engine.status import RunStatus
from dragdeck.outlook.explain import Cost
from dragdeck.outlook.runs import StudyRun
from dragdeck.records.run import RunPart, RunRecord
from snakemake_logger_plugin_dragdeck import LogHandler, LogHandlerSettings, _Job

FLAGS = ("stdout", "nocolor", "dryrun", "printshellcmds", "verbose", "debug_dag")
RUN = "results/small/process/a[bold]b-12345678"


class Shown:
    """The plugin with a console of its own."""

    def __init__(self, terminal: bool = False, **flags: bool) -> None:
        common = SimpleNamespace(**{name: flags.get(name, False) for name in FLAGS})
        self.handler = LogHandler(common, LogHandlerSettings(every_s=1000.0))  # type: ignore[arg-type]
        self.handler.setFormatter(DefaultFormatter())
        self.stream = io.StringIO()
        self.handler._console = Console(
            file=self.stream, force_terminal=terminal, width=80, markup=False, highlight=False
        )

    def log(self, text: str, level: int = logging.INFO, **values: Any) -> None:
        record = logging.LogRecord("snakemake", level, "", 0, text, None, None)
        vars(record).update(values)
        self.handler.emit(record)

    def start(self, number: int, rule: str, output: str, **resources: int) -> None:
        self.log(
            f"Rule: {rule}", event=LogEvent.JOB_INFO, jobid=number, rule_name=rule, rule_msg="",
            output=[output], shellcmd="", local=False, is_checkpoint=False, input=[], log=[],
            benchmark=None, reason="", wildcards={}, priority=0, threads=1, resources=resources,
        )  # fmt: skip

    @property
    def text(self) -> str:
        return self.stream.getvalue()


def test_snakemake_finds_the_plugin() -> None:
    assert "dragdeck" in LoggerPluginRegistry().plugins


def test_control_characters_and_markup_stay_text() -> None:
    shown = Shown(terminal=True)
    shown.log("a \x1b[2Jtitle [bold]of[/bold] \x07[link=x]", level=logging.WARNING)
    assert shown.text == "a [2Jtitle [bold]of[/bold] [link=x]\n"
    shown.start(1, "run_process", f"{RUN}/run.json", engine=1)
    shown.log("", event=LogEvent.JOB_FINISHED, job_id=1)
    shown.handler.close()
    assert "process a[bold]b-12345678: waiting" in shown.text


def test_messages_are_shown_if_nothing_is_run() -> None:
    shown = Shown()
    shown.log("Building DAG of jobs...")
    shown.log("Nothing to be done")
    assert shown.text == ""
    shown.handler.close()
    assert shown.text.splitlines() == ["Building DAG of jobs...", "Nothing to be done"]


def test_messages_of_a_workflow_that_runs_are_left_to_the_log() -> None:
    shown = Shown()
    shown.log("Building DAG of jobs...")
    shown.log("Job stats", event=LogEvent.RUN_INFO, stats={})
    shown.log("Select jobs to execute...")
    shown.start(1, "draw_process", "results/forces.png")
    shown.log("an error", level=logging.ERROR)
    shown.log("Complete log(s): here")
    shown.handler.close()
    assert shown.text.splitlines() == ["an error", "Complete log(s): here"]


@pytest.mark.parametrize("flag", ["dryrun", "printshellcmds", "verbose", "debug_dag"])
def test_whoever_asks_for_more_gets_everything(flag: str) -> None:
    shown = Shown(**{flag: True})
    shown.log("Building DAG of jobs...")
    shown.start(1, "run_process", f"{RUN}/run.json", engine=1)
    assert "Building DAG" in shown.text and "rule run_process:" in shown.text
    assert ": started" not in shown.text


def test_live_lines_stop_while_a_job_prints_itself() -> None:
    shown = Shown(terminal=True)
    shown.start(1, "draw_process", "results/forces.png")
    assert shown.handler._live is not None
    shown.start(2, "sweep_drops", "results/drops.json", prints=1)
    assert shown.handler._live is None
    shown.log("", event=LogEvent.JOB_FINISHED, job_id=2)
    assert shown.handler._live is not None
    shown.log("", event=LogEvent.JOB_FINISHED, job_id=1)
    assert shown.handler._live is None


def test_the_plan_is_what_the_whole_is_measured_by() -> None:
    shown = Shown()
    cost = Cost(1000, 60.0, "assumed")
    runs = [StudyRun("process", Path(f"/none/process/{name}"), None, 1, cost, 1e6) for name in "ab"]
    shown.log("small: 2 runs", shown=True, plan=runs, cores=2)
    shown.log("", event=LogEvent.PROGRESS, done=3, total=9)
    assert shown.text == "small: 2 runs\n"
    assert shown.handler._overall([]) == "runs 0 %, about 1 min 00 s left; 3 of 9 jobs done"


def test_runs_of_no_study_do_not_end_the_display(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    record = RunRecord(
        state="complete", inputs="", started="", engine_version="3.8.0", ranks=1, steps=100,
        steps_per_s=50.0, parts=[RunPart(part=1, checkpoint=None, from_step=0)],
    )  # fmt: skip
    record.write(tmp_path / "results/verification/collide/single/state.json")
    shown = Shown()
    shown.start(1, "run_verification", "results/verification/collide/single/run.json", engine=1)
    shown.log("", event=LogEvent.JOB_FINISHED, job_id=1)
    assert shown.text.splitlines()[-1] == "collide single: complete, 50 steps/s"
    shown.log("", event=LogEvent.PROGRESS, done=13, total=52)
    assert shown.handler._overall([]) == "13 of 52 jobs done"
    shown.handler._console.print(shown.handler._screen())
    assert shown.text.splitlines()[-1].split() == ["━━━━━", "13", "of", "52", "jobs", "done"]


def test_a_run_far_slower_than_estimated_is_told_on_a_terminal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    status = RunStatus("running", step=40, last=1000, steps_per_s=1.0)
    monkeypatch.setattr("dragdeck.outlook.runs.run_status", lambda folder: status)
    shown = Shown()
    for wall_s in (100.0, 900.0):
        cost = Cost(1000, wall_s, "assumed")
        plan = [StudyRun("process", Path.cwd() / RUN, None, 2, cost, 1e6)]
        shown.log("", shown=True, plan=plan, cores=2)
        shown.handler._jobs = {1: _Job("run_process", Path.cwd() / RUN, prints=False)}
        shown.handler._console.print(shown.handler._screen())
    assert shown.text.count("12345678: 10 times slower than estimated: other") == 1


def test_a_remedy_is_not_cut_off_on_a_narrow_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    status = RunStatus("running", step=40, last=1000, steps_per_s=1.0)
    monkeypatch.setattr("dragdeck.outlook.runs.run_status", lambda folder: status)
    shown = Shown(terminal=True)
    shown.handler._console = Console(
        file=shown.stream, force_terminal=True, width=50, soft_wrap=True
    )
    plan = [StudyRun("process", Path.cwd() / RUN, None, 2, Cost(1000, 100.0, "assumed"), 1e6)]
    shown.log("", shown=True, plan=plan, cores=2)
    shown.start(1, "run_process", f"{RUN}/run.json", engine=1)
    assert shown.handler._live is not None
    shown.handler._live.refresh()
    words = " ".join(re.sub(r"\x1b\[[0-9;?]*[a-zA-Z]", " ", shown.text).split())
    shown.handler.close()
    assert "MPI ranks wait for each other: use fewer fidelity.ranks" in words


SNAKEFILE = """
rule run_process:
    output: "results/s/process/a-12345678/run.json"
    log: "results/s/process/a-12345678/logs/run.log"
    resources: engine=1
    shell: "sh command > {log} 2>&1"
"""
TOLD = """dragdeck: results/a: run rejected
  check:  no LIGGGHTS error: on purpose
  remedy: none"""


@pytest.mark.slow
@pytest.mark.parametrize("interrupted", [False, True])
def test_of_a_failed_job_its_own_message_is_shown(tmp_path: Path, interrupted: bool) -> None:
    """The real Snakemake; what it says of the job itself stays in its log."""
    (tmp_path / "Snakefile").write_text(SNAKEFILE)
    ends = "trap 'said; exit 1' INT; touch begun; sleep 600 & wait" if interrupted else "said"
    command = f"echo process a: part 1\nsaid() {{ cat told; }}\n{ends}\nexit 1\n"
    (tmp_path / "command").write_text(command)
    (tmp_path / "told").write_text(f"{TOLD}\n")
    words = [sys.executable, "-m", "snakemake", "--cores", "1", "--logger", "dragdeck"]
    seen = plain_environment() | {"PYTHONPATH": str(ROOT / "workflow")}
    with subprocess.Popen(
        [*words, "--show-failed-logs", "run_process"], cwd=tmp_path, env=seen, text=True,
        stderr=subprocess.PIPE, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # ignored in background
    ) as process:  # fmt: skip
        if interrupted:
            while not (tmp_path / "begun").exists() and process.poll() is None:
                time.sleep(0.05)
            os.killpg(process.pid, signal.SIGINT)
        _, said = process.communicate()
    assert process.returncode != 0
    *shown, log = said.splitlines()
    job = "results/s/process/a-12345678/logs/run.log"
    assert shown == [
        "process a-12345678: started",
        shown[1],
        *TOLD.splitlines(),
        f"  log of the job: {job}",
    ]
    kept = Path(log.removeprefix("Complete log(s): ")).read_text()
    assert "CalledProcessError" in kept and "Error in rule run_process" in kept


def test_a_record_that_cannot_be_shown_does_not_end_the_display(
    capsys: pytest.CaptureFixture[str],
) -> None:
    shown = Shown()
    shown.log("", event=LogEvent.JOB_FINISHED)
    assert "KeyError" in capsys.readouterr().err
    shown.log("still here", level=logging.WARNING)
    assert shown.text == "still here\n"
