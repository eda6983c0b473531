"""The figures that the rules expect of a run are those that are drawn."""

import pytest

from dragchain.report.findings import FIGURES
from dragdeck.scenes.process import SCENES


@pytest.mark.parametrize("scene", sorted(SCENES))
def test_the_rules_expect_the_figures_of_the_scene(scene: str) -> None:
    assert set(SCENES[scene].figures) == set(FIGURES[scene])
