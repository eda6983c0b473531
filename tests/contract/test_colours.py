"""One dictionary of colours: what no import reaches has a copy of it."""

import json
from pathlib import Path

import pytest
from paths import ROOT

from dragchain.figures.style import COLOURS


@pytest.mark.parametrize("copy", ["workflow/dragdeck/data/colours.json", "web/src/colours.json"])
def test_a_copy_is_the_dictionary_of_the_figures(copy: str, request: pytest.FixtureRequest) -> None:
    """`pytest tests/contract --update` writes it anew."""
    file: Path = ROOT / copy
    text = json.dumps(COLOURS, indent=1) + "\n"
    if request.config.getoption("--update"):
        file.write_text(text)
    assert file.read_text() == text
