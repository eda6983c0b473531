"""A run small enough to check by hand."""

from pathlib import Path

import pytest
from tiny_run_files import write_tiny_run


@pytest.fixture
def tiny_run(tmp_path: Path) -> Path:
    """Folder of a process run with four particles, without its tables; see tests/dragchain."""
    return write_tiny_run(tmp_path / "tiny")
