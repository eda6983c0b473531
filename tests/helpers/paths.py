"""Where the tests find the project."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data"
SMALL_STUDY = DATA / "small_study.yaml"
PROJECT = ("workflow", "analysis", "evidence", "meshes", "profiles", "templates", "Snakefile")
"""What a copy of the project needs beside its studies."""
