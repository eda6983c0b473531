"""The figures of the documentation: python docs/tools --figures.

A figure is a module with a function ``draw`` that returns it from records; `FIGURES` names it.
`pictures` has those that show a run.
"""

from importlib import import_module
from io import StringIO
from pathlib import Path

import matplotlib

from dragchain.figures.style import drawing, true_minus
from dragdeck.errors import DragdeckError
from figures.pictures import PICTURES, picture, run_of_study

IMAGES = Path(__file__).resolve().parents[2] / "images"

FIGURES = (
    "architecture",
    "calibration",
    "forces",
    "geometry",
    "load_map",
    "scaling",
    "spin",
    "stability",
    "tradeoff",
    "validation",
    "verification",
    "workflow",
)
"""Names of modules, which are also those of the files."""


def svg(name: str) -> str:
    """A figure as SVG; the same figure gives the same text."""
    with drawing(), matplotlib.rc_context({"svg.hashsalt": "dragdeck", "svg.fonttype": "path"}):
        figure = import_module(f"figures.{name}").draw()
        true_minus(figure)
        text = StringIO()
        figure.savefig(
            text, format="svg", bbox_inches="tight", metadata={"Date": None, "Creator": None}
        )
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"


def draw_all() -> None:
    """Draw all figures into docs/images; say which pictures cannot be drawn here, and why."""
    for name in FIGURES:
        (IMAGES / f"{name}.svg").write_text(svg(name), encoding="utf-8")
    for name in PICTURES:
        try:
            (IMAGES / f"{name}.png").write_bytes(picture(name, run_of_study()))
        except DragdeckError as error:
            print(f"{name}.png was not drawn: {error}")
