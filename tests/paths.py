"""Where the tests find the project."""

from pathlib import Path

ROOT = Path(__file__).parents[1]
SMALL_STUDY = Path(__file__).with_name("small_study.yaml")
