"""Commands that would leave the engine or the run's folder, as LIGGGHTS 3.8.0 takes them."""

from typing import Any

import pytest
from audit_decks import cases

from dragdeck.script.commands import leaving_folder


@pytest.mark.parametrize("case", cases("commands"), ids=lambda case: case["text"])
def test_ways_out_of_the_folder(case: dict[str, Any]) -> None:
    ways = list(leaving_folder(case["text"], "../../filling/bed/packing.restart"))
    assert bool(ways) == case["leaves"]
