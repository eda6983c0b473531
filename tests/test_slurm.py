"""The small study through a real queue: a Slurm of one node that the test starts.

On demand: ./run test --slurm
"""

import json
import math
import re
import subprocess
from collections.abc import Iterator
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml
from made_study import put
from paths import ROOT
from snakemake_calls import copy_of_project, snakemake
from soft_study import study_with_windows

from dragchain.quantities.document import Extrapolated

pytestmark = pytest.mark.slurm

SCRIPT = ROOT / "tests/slurm/cluster"
STUDY = ("--config", "study=small")
QUEUE = (
    *("--workflow-profile", "profiles/slurm", "--slurm-no-account"),
    *("--slurm-status-command", "squeue"),  # this Slurm keeps no accounts that sacct could read
    *("--slurm-init-seconds-before-status-checks", "2"),
)
PMIX = "usr/lib/*/pmix2/lib/libpmix.so"  # Debian's libpmix-dev; its Slurm looks for this name


_COLUMNS = ("JobId", "JobState", "SubmitTime", "StartTime", "EndTime")


class Cluster:
    """The running Slurm, by the record that it keeps of its jobs."""

    def __init__(self, folder: Path) -> None:
        self.file = folder / "jobs.txt"

    def jobs(self) -> pd.DataFrame:
        """A row a job that ended."""
        lines = self.file.read_text().splitlines() if self.file.is_file() else []
        rows = [dict(re.findall(r"(\w+)=(\S*)", line)) for line in lines]
        table = pd.DataFrame(rows, columns=None if rows else [*_COLUMNS])
        for name in ("SubmitTime", "StartTime", "EndTime"):
            table[name] = pd.to_datetime(table[name])
        return table.set_index("JobId")


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    folder = tmp_path_factory.mktemp("slurm") / "cluster"
    subprocess.run([SCRIPT, "start", folder], check=True)
    yield Cluster(folder)
    subprocess.run([SCRIPT, "stop", folder], check=True)
    assert not folder.exists()


def edit(folder: Path, **values: Any) -> None:
    """Set values of the study, by their path in it."""
    file = folder / "studies/small/study.yaml"
    data = yaml.safe_load(file.read_text())
    put(data, {path.replace("__", "."): value for path, value in values.items()})
    file.write_text(yaml.safe_dump(data, sort_keys=False))


def succeed(folder: Path, *arguments: str) -> str:
    begun = datetime.now()
    done = snakemake(folder, *arguments)
    told = done.stdout + done.stderr
    assert done.returncode == 0, told
    print(f"{' '.join(arguments)}: {(datetime.now() - begun).total_seconds():.0f} s")
    return told


@pytest.fixture(scope="module")
def local(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = copy_of_project(tmp_path_factory.mktemp("local"))
    succeed(folder, "all", *STUDY)
    return folder


@pytest.fixture(scope="module")
def queued(tmp_path_factory: pytest.TempPathFactory, cluster: Cluster) -> Path:
    folder = copy_of_project(tmp_path_factory.mktemp("queued"))
    succeed(folder, "all", *STUDY, *QUEUE)
    return folder


def names(folder: Path, pattern: str) -> list[Path]:
    root = folder / "results/small"
    return sorted(file.relative_to(root) for file in root.rglob(pattern))


def test_every_run_and_table_went_through_the_queue(queued: Path, cluster: Cluster) -> None:
    jobs = cluster.jobs()
    assert set(jobs.JobState) == {"COMPLETED"}
    # run_filling, run_process, write_report, and a group each for drop, fill and process
    assert len(jobs) == 6
    ran = (jobs.EndTime - jobs.StartTime).dt.total_seconds()
    waited = (jobs.StartTime - jobs.SubmitTime).dt.total_seconds()
    print(f"in the queue {waited.median():.0f} s, running {ran.median():.0f} s (medians of jobs)")


def test_the_queue_changes_no_table(local: Path, queued: Path) -> None:
    files = names(local, "*.parquet")
    assert len(files) > 8
    assert files == names(queued, "*.parquet")
    for file in files:
        here, there = (
            pd.read_parquet(folder / "results/small" / file) for folder in (local, queued)
        )
        timed = [name for name in here if re.search(r"wall|steps_per_s|cpu", name)]
        pd.testing.assert_frame_equal(
            here.drop(columns=timed), there.drop(columns=timed), check_exact=True
        )


@pytest.mark.parametrize("launcher", ["mpirun", "srun --mpi=pmix"])
def test_a_job_has_a_processor_for_each_rank(
    launcher: str, cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if launcher == "mpirun":
        monkeypatch.delenv("DRAGDECK_LAUNCHER", raising=False)
    elif not list(Path("/").glob(PMIX)):
        pytest.skip("this Slurm has no PMIx: package libpmix-dev")
    else:
        monkeypatch.setenv("DRAGDECK_LAUNCHER", launcher)
    folder = copy_of_project(tmp_path)
    edit(folder, fidelities__quick__ranks=2)
    before = set(cluster.jobs().index)
    succeed(folder, "filling", "--until", "run_filling", *STUDY, *QUEUE)
    (run,) = (folder / "results/small/filling").iterdir()
    assert json.loads((run / "run.json").read_text())["ranks"] == 2
    assert re.search(r"[12] by [12] by [12] MPI processor grid", (run / "screen.1.txt").read_text())
    jobs = cluster.jobs()
    (job,) = set(jobs.index) - before
    assert jobs.ProcCnt[job] == "2"


def test_a_run_that_its_time_limit_ends_goes_on(
    local: Path, queued: Path, cluster: Cluster
) -> None:
    """A process that takes longer than its limit, which Slurm counts in whole minutes.

    A job must have half a minute left for the engine once its Python is up, which takes
    long on a machine that does other things too. The run is ten times as long as the limit
    at the speed of a shorter one before; much of that one's time is its start, and it may have
    been slower for the same reason. It gets as many jobs as it needs.
    """
    jobs = cluster.jobs()
    start_s = (jobs.EndTime - jobs.StartTime).dt.total_seconds().median()
    minutes = math.ceil((start_s + 30) / 60)
    (short,) = (local / "results/small/process").glob("*/run.json")
    longer = 600 * minutes / json.loads(short.read_text())["wall_time_s"]
    edit(queued, motion__path__revolutions=0.1 * longer, outputs__n_checkpoints=400)
    limit = ("--set-resources", f"run_process:runtime={minutes}", "--retries", "99")
    told = succeed(queued, "process", "--until", "run_process", *STUDY, *QUEUE, *limit)
    assert "TIMEOUT" in set(cluster.jobs().JobState)
    assert "status is: 'TIMEOUT'" in told

    (run,) = {file.parent for file in queued.glob("results/small/process/*/run.json")} - {
        queued / short.parent.relative_to(local)
    }
    parts = json.loads((run / "run.json").read_text())["parts"]
    assert len(parts) > 1
    for earlier, later in pairwise(parts):
        assert re.fullmatch(rf"checkpoint\.{later['from_step']}\.\w+\.restart", later["from"])
        assert later["from_step"] > earlier["from_step"]
    for part in parts:
        print(f"part {part['part']}: steps {part['from_step']:,} to {part.get('to_step')}")

    succeed(queued, "process", *STUDY)  # the tables, without the queue
    (output,) = [json.loads((run / "columns.json").read_text())["outputs"]["workpiece_force"]]
    steps = pd.read_parquet(run / "tables/workpiece_force.parquet").step
    wanted = range(output["first_step"], output["last_step"] + 1, output["period_steps"])
    assert steps.tolist() == list(wanted)


def test_a_study_with_a_tolerance_runs_to_its_report(cluster: Cluster, tmp_path: Path) -> None:
    folder = copy_of_project(tmp_path, study_with_windows())
    before = set(cluster.jobs().index)
    succeed(folder, "all", *STUDY, *QUEUE)
    (run,) = (folder / "results/small/process").iterdir()
    assert "not give" in Extrapolated.read(run / "tables/extrapolated.json").said
    assert (folder / "results/small/report/report.html").is_file()
    jobs = cluster.jobs()
    assert {jobs.JobState[job] for job in set(jobs.index) - before} == {"COMPLETED"}
