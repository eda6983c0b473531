"""The registry of figures of runs."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from dragdeck.files import table_rows


class FigureOfRun(NamedTuple):
    """A figure of a run, ``figures/<name>.png``.

    Attributes
    ----------
    scene : str
        Whose runs have it; that of the loading of the workpiece is drawn apart.
    caption : str
    seen : str
        What is seen in it, for those who do not see it.
    """

    scene: str
    caption: str
    seen: str


FIGURES: Mapping[str, FigureOfRun] = {
    row.pop("name"): FigureOfRun(**row)
    for row in table_rows(Path(__file__).with_name("figures.csv"))
}
"""The registry of figures by name, in the order of the report."""


def figures_of(scene: str) -> Sequence[str]:
    """Names of the figures of a scene's runs."""
    return [name for name, figure in FIGURES.items() if figure.scene == scene]
