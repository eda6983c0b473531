"""Fixtures: writers of raw outputs, and a run small enough to check by hand."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from made_run import Raw
from tiny_run_files import write_tiny_run


@pytest.fixture
def raw() -> type[Raw]:
    """Writers of single frames and files."""
    return Raw


@pytest.fixture
def tiny_run(tmp_path: Path) -> Path:
    """Folder of a process run with four particles, without its tables.

    The workpiece, a cylinder of 5 mm, moves along +x from the bowl's axis at 0.1 mm/s
    from step 20 to 100, a step being 1 ms. Particle 1 touches it, particle 2 touches
    particle 1 and the bowl's side: a straight chain at z = 30 mm whose three
    contacts share the overlap ``40 um + workpiece_x`` equally and carry 100 N/mm of
    it: (4 N + 1e5 N/m workpiece_x) / 3. The workpiece holds particle 1 up, the side particle 2.
    Particle 4 lies on particle 3 and that on the floor. Nothing touches the workpiece at
    step 0; the forces in ``workpiece_contacts`` are 5 % above the applied ones.
    Samples count from step 40 on.
    """
    return write_tiny_run(tmp_path / "tiny")


@pytest.fixture
def edit_json() -> Callable[[Path, Callable[[dict[str, Any]], object]], None]:
    """Change a JSON file in place with a function of its content."""

    def edit(file: Path, change: Callable[[dict[str, Any]], object]) -> None:
        content = json.loads(file.read_text())
        change(content)
        file.write_text(json.dumps(content))

    return edit
