"""The profile of a queue and the rules, planned without a queue."""

import re
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

import pytest
import yaml
from paths import ROOT, SMALL_STUDY
from snakemake_calls import copy_of_project, snakemake, succeed

from dragdeck.project import RUNNERS, WINDOWS, Project, run_path
from dragdeck.scenes.lead import windows_of
from dragdeck.scenes.process import PROCESS

pytestmark = pytest.mark.slow

PROFILE: dict[str, Any] = yaml.safe_load((ROOT / "profiles/slurm/config.yaml").read_text())
EVIDENCE = ("--snakefile", "evidence/Snakefile")
BATCHES = {"fit_coefficients", "measure_costs"}
"""Rules that start the engine for many runs."""


def with_windows() -> dict[str, Any]:
    data: dict[str, Any] = yaml.safe_load(SMALL_STUDY.read_text())
    windows = {"tolerance": 0.1, "quantities": ["drag_mean"], "most": 6}
    data["fidelity"] = {"youngs_modulus_scale": 0.01, "ranks": 1, "windows": windows}
    data["motion"]["path"]["revolutions"] = 1
    repose = {"angle_deg": 27, "angle_std_deg": 1, "cylinder_radius_m": 0.025, "count": 400}
    data["calibration"] = {"angles": {"repose": repose}}
    return data


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return copy_of_project(tmp_path_factory.mktemp("cluster"), with_windows())


def waits(project: Path, *arguments: str) -> set[tuple[str, str]]:
    """The rules of a call in pairs: the first waits for the second."""
    dot = succeed(project, *arguments, "--rulegraph").stdout
    names = dict(re.findall(r'(\d+)\[label = "([^"\\]+)', dot))
    edges = re.findall(r"(\d+) -> (\d+)", dot)
    return {(names[then], names[first]) for first, then in edges}


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("all",), {"judge_windows", "write_report"}),
        (("windows", "all"), {"run_windows", "judge_windows", "write_report"}),
        (("calibrate",), {"fit_coefficients"}),
        (("results/compare/small/comparison.html",), {"write_report", "write_comparison"}),
        (("tradeoff", *EVIDENCE), {"run_points", "measure_costs"}),
        (("validate", *EVIDENCE), {"run_points"}),
    ],
)
def test_no_group_waits_for_a_rule_that_waits_for_it(
    project: Path, arguments: tuple[str, ...], expected: set[str]
) -> None:
    if arguments[0] == "windows":  # the first round decides whether there are any
        (case,) = Project(project).cases("small")
        run = PROCESS.run_id(windows_of(case)[0])
        arguments = (f"{run_path('small', WINDOWS, run)}/tables/quantities.json", *arguments[1:])
    pairs = waits(project, *arguments, "--config", "study=small")
    assert expected <= {rule for pair in pairs for rule in pair}
    groups: dict[str, set[str]] = {}
    for rule, other in pairs:
        group, before = (PROFILE["groups"].get(name, name) for name in (rule, other))
        groups.setdefault(group, set()).update({before} - {group})
    TopologicalSorter(groups).prepare()  # fails at a circle


def test_every_rule_that_starts_the_engine_has_time_and_memory() -> None:
    text = "".join(file.read_text() for file in ROOT.glob("*/rules/*.smk"))
    assert all(re.search(rf"^rule {rule}:", text, re.MULTILINE) for rule in BATCHES)
    resources = PROFILE["set-resources"]
    assert {*resources} == BATCHES | {*RUNNERS}
    for rule in RUNNERS:
        of_rule = resources[rule]
        assert {"runtime", "mem_mb", "mpi", "tasks", "cpus_per_task"} == {*of_rule}
        assert "attempt" in of_rule["mem_mb"]
    assert all(resources[rule]["runtime"] > 60 for rule in BATCHES)


def test_a_study_may_be_named_like_a_number(tmp_path: Path) -> None:
    folder = copy_of_project(tmp_path, with_windows(), "2024_05")
    assert "2024_05" in succeed(folder, "all", "-n", "--config", "study=2024_05").stdout


def test_a_path_too_short_for_windows_is_an_error_of_the_study(tmp_path: Path) -> None:
    data = with_windows()
    data["motion"]["path"]["revolutions"] = 0.1
    refused = snakemake(copy_of_project(tmp_path, data), "all", "-n", "--config", "study=small")
    told = refused.stdout + refused.stderr
    assert refused.returncode == 1 and "the path is too short for 2 windows" in told
    assert "WorkflowError" in told and "InputError" not in told
