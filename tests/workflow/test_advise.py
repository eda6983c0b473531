"""The workflow of a study that asks for a tolerance, on a trade-off with made-up numbers."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from made_tradeoff import made_tradeoff
from paths import PROJECT, ROOT, SMALL_STUDY

pytestmark = pytest.mark.slow


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A copy of the project whose package holds a trade-off."""
    for name in set(PROJECT) - {"workflow"}:
        (tmp_path / name).symlink_to(ROOT / name)
    shutil.copytree(ROOT / "workflow", tmp_path / "workflow")
    (tmp_path / "studies/small").mkdir(parents=True)
    study = tmp_path / "studies/small/study.yaml"
    study.write_text(SMALL_STUDY.read_text())
    tradeoff = tmp_path / "workflow/dragdeck/data/tradeoff.json"
    made_tradeoff().write(tradeoff)
    return tmp_path


def planned(folder: Path, fidelity: Any) -> list[str]:
    """Names of the rules of the jobs for the whole study, in the order of a run of one by one."""
    file = folder / "studies/small/study.yaml"
    file.write_text(
        yaml.safe_dump(yaml.safe_load(SMALL_STUDY.read_text()) | {"fidelity": fidelity})
    )
    paths = os.pathsep.join([str(folder / "workflow"), str(ROOT / "analysis"), str(ROOT)])
    words = [sys.executable, "-m", "snakemake", "--dry-run", "--cores", "1", "all", "--config"]
    shown = subprocess.run(
        [*words, "study=small", "plan=long"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    assert shown.returncode == 0, shown.stdout + shown.stderr
    lines = (shown.stdout + shown.stderr).splitlines()
    return [
        line.split()[-1].rstrip(":") for line in lines if line.startswith(("rule ", "localrule"))
    ]


def test_advice_comes_before_the_runs_of_a_study_that_asks(folder: Path) -> None:
    rules = planned(folder, {"tolerance": 0.05})
    assert rules.count("advise") == 1
    assert rules.index("advise") < min(rules.index("run_filling"), rules.index("run_process"))


def test_no_advice_where_nothing_is_asked(folder: Path) -> None:
    rules = planned(folder, "quick")
    assert "advise" not in rules and "write_report" in rules
