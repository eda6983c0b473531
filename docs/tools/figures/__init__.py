"""The figures of the documentation, drawn from records: python docs/tools --figures.

A figure is a module with a function ``draw`` that returns it; `FIGURES` names it.
"""

from importlib import import_module
from io import StringIO
from pathlib import Path

import matplotlib

from dragchain.figures.style import drawing, true_minus

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


def draw_all(names: tuple[str, ...] = FIGURES) -> None:
    """Draw figures into docs/images."""
    for name in names:
        (IMAGES / f"{name}.svg").write_text(svg(name), encoding="utf-8")
