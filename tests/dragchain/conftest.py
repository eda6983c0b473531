"""Fixtures: writers of raw outputs and documents."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from made_run import Raw


@pytest.fixture
def raw() -> type[Raw]:
    """Writers of single frames and files."""
    return Raw


@pytest.fixture
def edit_json() -> Callable[[Path, Callable[[dict[str, Any]], object]], None]:
    """Change a JSON file in place with a function of its content."""

    def edit(file: Path, change: Callable[[dict[str, Any]], object]) -> None:
        content = json.loads(file.read_text())
        change(content)
        file.write_text(json.dumps(content))

    return edit
