"""Snakemake started on a copy of the project."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import yaml
from paths import DATA, PROJECT, ROOT
from preloaded import environment, plain_environment


def copy_of_project(folder: Path, study: dict[str, Any] | None = None, name: str = "small") -> Path:
    """A project in a folder with one study: this content, or that of the tests' of this name."""
    for part in PROJECT:
        (folder / part).symlink_to(ROOT / part)
    file = folder / "studies" / name / "study.yaml"
    file.parent.mkdir(parents=True)
    text = (DATA / f"{name}_study.yaml").read_text() if study is None else yaml.safe_dump(study)
    file.write_text(text)
    return folder


def tiny_study() -> dict[str, Any]:
    """The tiny study with time steps as long as other studies have, which nobody needs to kill."""
    data: dict[str, Any] = yaml.safe_load((DATA / "tiny_study.yaml").read_text())
    data["fidelities"]["quick"] |= {"timestep_fraction": 0.4, "filling_timestep_fraction": 0.2}
    return data


def snakemake(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Call Snakemake, preloaded with its commands unless a queue is to start them."""
    queued = "profiles/slurm" in arguments
    words = [sys.executable, "-m", "snakemake"] if queued else ["snakemake"]
    words += ["--cores", "2", *arguments]
    seen = plain_environment() if queued else environment()
    return subprocess.run(words, cwd=folder, env=seen, capture_output=True, text=True)


def succeed(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Call Snakemake, which must succeed."""
    done = snakemake(folder, *arguments)
    assert done.returncode == 0, done.stdout + done.stderr
    return done


def jobs(folder: Path, *arguments: str) -> set[str]:
    """Names of the rules that would run."""
    table = succeed(folder, "--dry-run", *arguments).stdout
    if "Job stats:" not in table:
        return set()
    rows = table.split("Job stats:")[1].split("total")[0].splitlines()[3:]
    return {row.split()[0] for row in rows if row.strip()} - {"all"}
