"""Loop variables are the singular of their collection, results are named after what they are."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
FOLDERS = ("analysis", "benchmarks", "docs/tools", "evidence", "workflow")
LIMIT = 1
"""It only falls."""


def test_names_that_say_nothing_become_fewer() -> None:
    files = [file for folder in FOLDERS for file in (ROOT / folder).rglob("*.py")]
    nodes = [node for file in files for node in ast.walk(ast.parse(file.read_text()))]
    names = [node.id for node in nodes if isinstance(node, ast.Name)]
    names += [node.arg for node in nodes if isinstance(node, ast.arg)]
    count = sum(name in ("one", "found", "own") for name in names)
    assert count <= LIMIT
