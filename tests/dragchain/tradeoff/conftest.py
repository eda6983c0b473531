"""The trade-off that most tests look at."""

from pathlib import Path

import pytest
from tradeoff_files import contents, made

from dragchain.tradeoff.outcome import Tradeoff


@pytest.fixture
def tradeoff(tmp_path: Path) -> Tradeoff:
    return made(tmp_path, contents())
