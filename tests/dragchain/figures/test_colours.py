"""One dictionary of colours: what does not import the figures has a copy of it."""

import json

import pytest
from paths import ROOT

from dragchain.figures.style import COLOURS


def test_the_copy_is_the_dictionary_of_the_figures(request: pytest.FixtureRequest) -> None:
    """`pytest tests/dragchain/figures --update` writes it anew."""
    file = ROOT / "workflow/dragdeck/data/colours.json"
    text = json.dumps(COLOURS, indent=1) + "\n"
    if request.config.getoption("--update"):
        file.write_text(text)
    assert file.read_text() == text
