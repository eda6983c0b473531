"""A figure of a run is one row of the registry, a function that draws it, and two captions."""

import pytest
from paths import ROOT

from dragchain.report import run_figures
from dragdeck.records.figures import FIGURES
from dragdeck.scenes.process import SCENES

REGISTRY = "workflow/dragdeck/records/figures.csv"


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_of_the_registry_is_drawn_and_has_its_captions(name: str) -> None:
    figure, drawn = FIGURES[name], run_figures._DRAW
    assert figure.scene in {*SCENES, "loading"}, f"{name}: {REGISTRY} has another scene"
    assert figure.caption and figure.seen, f"{name}: describe the figure in {REGISTRY}"
    assert (name in drawn) != (figure.scene == "loading"), (
        f"{name}: add a function of this name to DRAW_PROCESS or _DRAW of report/run_figures.py"
    )
    file = ROOT / "workflow/report" / f"{name}.rst"
    assert file.is_file(), f"{name}: write {file}, its caption in the report of Snakemake"


def test_a_figure_that_is_drawn_is_in_the_registry() -> None:
    missing = set(run_figures._DRAW) - set(FIGURES)
    assert not missing, f"add a row for each of {missing} to {REGISTRY}"
