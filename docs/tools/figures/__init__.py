"""The figures of the documentation: python docs/tools --figures.

`charts` and `drawings` are drawn from records, the rest of `PICTURES` shows a run.
"""

from io import StringIO
from pathlib import Path

import matplotlib

from dragchain.figures.style import drawing, true_minus
from dragdeck.errors import DragdeckError
from figures.charts import CHARTS
from figures.drawings import draw_geometry
from figures.pictures import PICTURES, drawn_picture, run_of_study

IMAGES = Path(__file__).resolve().parents[2] / "images"

FIGURES = {**CHARTS, "geometry": draw_geometry}
"""What draws a figure, by the name of its file."""


def svg(name: str) -> str:
    """A figure as SVG; the same figure gives the same text."""
    with drawing(), matplotlib.rc_context({"svg.hashsalt": "dragdeck", "svg.fonttype": "path"}):
        figure = FIGURES[name]()
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
            (IMAGES / f"{name}.png").write_bytes(drawn_picture(name, run_of_study()))
        except DragdeckError as error:
            print(f"{name}.png was not drawn: {error}")
