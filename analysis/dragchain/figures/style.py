"""Colours and style of all figures, and how they become PNG files."""

import json
import re
from collections.abc import Mapping
from contextlib import AbstractContextManager
from functools import cache
from importlib import resources
from io import BytesIO
from typing import Any

import matplotlib
import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Colormap, LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.typing import RcKeyType
from PIL import Image

from dragchain.arrays import Floats

COLOURS: Mapping[str, str] = json.loads(
    resources.files("dragdeck").joinpath("data/colours.json").read_text(encoding="utf-8")
)
"""A few by name, then one for each thing, in all figures and pages."""

BLUE, ORANGE, GREEN, RED = (COLOURS[name] for name in ("blue", "orange", "green", "red"))
"""After Okabe and Ito (2008): told apart with any kind of colour vision."""

GREY, INK, LIGHT = COLOURS["grey"], COLOURS["ink"], COLOURS["light"]

MARKERS = "os^vDPX*<p>d"
"""Marks of series that stand side by side."""

STYLE: dict[RcKeyType, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "grid.color": "#e3e6ea",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "lines.linewidth": 1.2,
    "lines.markersize": 4,
    "figure.titlesize": 9.5,
    "legend.frameon": False,
    "legend.fontsize": 8,
}
WIDTH_IN = 7.6
NARROW_IN, HALF_IN, WIDE_IN = 4.0, 5.6, 9.5
"""Widths of figures: `NARROW_IN` on a phone, `HALF_IN` where two stand side by side on a page."""

_DPI = 150


@cache
def force_map() -> Colormap:
    """The colour map of forces and loads, from light to dark, told apart with any colour vision.

    It ends before black, in which a cylinder shows neither its shape nor what is drawn on it.
    """
    part = matplotlib.colormaps["magma_r"](np.linspace(0.0, 0.8, 256))
    return LinearSegmentedColormap.from_list("forces", part)


def top_of_scale(values: Floats, areas: Floats) -> float:
    """Where the colour scale of a load map ends: what 95 % of the loaded area stays below.

    Single facets, small or needle-like, do not set the colours of all others.

    Parameters
    ----------
    values, areas : (N,) array
        Load of each facet, and its area.
    """
    loaded = values > 0.0
    if not loaded.any():
        return 1.0
    weights = areas[loaded]
    return float(np.quantile(values[loaded], 0.95, weights=weights, method="inverted_cdf"))


ABOVE_SCALE = "last colour: larger values, on at most 5 % of the loaded area"


def drawing() -> AbstractContextManager[None]:
    """A block in which figures are drawn and saved in the style of all figures."""
    return matplotlib.rc_context(STYLE)


_HYPHEN = re.compile(r"(?<![\w.\-])-(?=[\d.])")


def true_minus(drawn: Artist) -> None:
    """Write the hyphens before numbers in all texts of a figure or of axes as minus signs."""
    for text in drawn.findobj(Text):
        text.set_text(_HYPHEN.sub("\N{MINUS SIGN}", text.get_text()))


def png(figure: Figure) -> bytes:
    """A figure as PNG without transparency."""
    true_minus(figure)
    figure.set_dpi(_DPI)
    canvas: Any = FigureCanvasAgg(figure)
    canvas.draw()
    picture = BytesIO()
    Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB").save(picture, format="png")
    return picture.getvalue()
