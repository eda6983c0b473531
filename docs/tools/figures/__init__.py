"""The figures of the documentation, drawn from records: python docs/tools --figures."""

from io import StringIO
from pathlib import Path

import matplotlib
from matplotlib.text import Text

from dragchain.figures.narrow import narrow
from dragchain.figures.style import drawing, true_minus
from figures.charts import CHARTS
from figures.drawings import draw_geometry

IMAGES = Path(__file__).resolve().parents[2] / "images"

FIGURES = {**CHARTS, "geometry": draw_geometry}
"""What draws a figure, by the name of its file."""


_SHOWN_PX, _PHONE_PX, _LEAST_PX = 709, 358, 9
"""Width of a figure on a page in a window of 1366 and of 390 pixels; the smallest text there."""


def svg(name: str, phone: bool = False) -> str:
    """A figure as SVG, perhaps for a phone; the same figure gives the same text."""
    with drawing(), matplotlib.rc_context({"svg.hashsalt": "dragdeck", "svg.fonttype": "path"}):
        figure = narrow(FIGURES[name]()) if phone else FIGURES[name]()
        true_minus(figure)
        shown = min((_PHONE_PX if phone else _SHOWN_PX) / (96 * figure.get_tightbbox().width), 1.0)
        for label in figure.findobj(Text):
            label.set_fontsize(max(label.get_fontsize(), _LEAST_PX * 72 / 96 / shown))
        text = StringIO()
        figure.savefig(
            text, format="svg", bbox_inches="tight", metadata={"Date": None, "Creator": None}
        )
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines()) + "\n"


def draw_all() -> None:
    """Draw all figures into docs/images."""
    for name in FIGURES:
        (IMAGES / f"{name}.svg").write_text(svg(name), encoding="utf-8")
