"""Where the tests find the project."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data"
SMALL_STUDY = DATA / "small_study.yaml"
SNAKEFILES = (ROOT / "workflow/Snakefile", ROOT / "evidence/Snakefile")
"""The workflow of studies, and that behind the evidence."""
PROJECT = (
    *("analysis", "config", "evidence", "meshes", "profiles", "templates", "workflow", "Snakefile"),
)
"""What a copy of the project needs beside its studies."""
