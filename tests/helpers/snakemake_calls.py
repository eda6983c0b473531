"""Snakemake started on a copy of the project."""

import subprocess
from pathlib import Path
from typing import Any

import yaml
from paths import DATA, PROJECT, ROOT
from preloaded import environment


def copy_of_project(folder: Path, study: dict[str, Any] | None = None, name: str = "small") -> Path:
    """A project in a folder with one study: this content, or that of the tests' of this name."""
    for part in PROJECT:
        (folder / part).symlink_to(ROOT / part)
    file = folder / "studies" / name / "study.yaml"
    file.parent.mkdir(parents=True)
    text = (DATA / f"{name}_study.yaml").read_text() if study is None else yaml.safe_dump(study)
    file.write_text(text)
    return folder


def snakemake(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    words = ["snakemake", "--cores", "2", *arguments]
    return subprocess.run(words, cwd=folder, env=environment(), capture_output=True, text=True)


def jobs(folder: Path, *arguments: str) -> set[str]:
    """Names of the rules that would run."""
    shown = snakemake(folder, "--dry-run", *arguments)
    assert shown.returncode == 0, shown.stdout + shown.stderr
    table = shown.stdout
    if "Job stats:" not in table:
        return set()
    rows = table.split("Job stats:")[1].split("total")[0].splitlines()[3:]
    return {row.split()[0] for row in rows if row.strip()} - {"all"}
