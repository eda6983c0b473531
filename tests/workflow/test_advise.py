"""The workflow of a study that asks for a tolerance, on a trade-off with made-up numbers."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from made_tradeoff import made_tradeoff
from paths import ROOT, SMALL_STUDY
from snakemake_calls import copy_of_project

pytestmark = pytest.mark.slow


def test_advice_comes_before_the_runs_of_a_study_that_asks(tmp_path: Path) -> None:
    """In a copy of the project whose package holds a trade-off: its own interpreter reads that."""
    data = yaml.safe_load(SMALL_STUDY.read_text()) | {"fidelity": {"tolerance": 0.05}}
    data["bowl"]["radius_m"] = 0.028
    folder = copy_of_project(tmp_path, data)
    (folder / "workflow").unlink()
    shutil.copytree(ROOT / "workflow", folder / "workflow")
    made_tradeoff().write(folder / "workflow/dragdeck/data/tradeoff.json")
    paths = os.pathsep.join([str(folder / "workflow"), str(ROOT / "analysis"), str(ROOT)])
    words = [sys.executable, "-m", "snakemake", "--dry-run", "--cores", "1", "all", "--config"]
    shown = subprocess.run(
        [*words, "study=small", "plan=long"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
    )
    assert shown.returncode == 0, shown.stdout + shown.stderr
    lines = (shown.stdout + shown.stderr).splitlines()
    rules = [line.split()[-1].rstrip(":") for line in lines if line.startswith(("rule ", "local"))]
    assert rules.count("advise") == 1
    assert rules.index("advise") < min(rules.index("run_filling"), rules.index("run_process"))
