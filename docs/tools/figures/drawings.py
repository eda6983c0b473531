"""A figure without numbers: the geometry of the paper's study."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Rectangle
from records import record_table

from dragchain.figures.style import BLUE, COLOURS, GREEN, GREY, INK, RED

BED, STEEL, DRAG, LATERAL = (COLOURS[name] for name in ("bed", "workpiece", "drag", "lateral"))
BED_HEIGHT = 70.0
"""mm, drawn; the paper fills to this height."""


def draw_geometry() -> Figure:
    """Bowl, bed, workpiece and path, with the frames of the results: side and top view in mm."""
    study = record_table("study/uhlmann2015").iloc[0]
    sizes = {
        "bowl": 1e3 * study["bowl_radius_m"],
        "height": 1e3 * study["bowl_height_m"],
        "rod": 1e3 * study["workpiece_shape_radius_m"],
        "path": 1e3 * study["motion_path_radius_m"],
        "depth": 1e3 * study["motion_immersion_depth_m"],
    }
    figure = Figure(figsize=(9.0, 4.9), layout="constrained")
    for axes, draw in zip(figure.subplots(1, 2), (_side, _top), strict=True):
        axes.set_aspect("equal")
        axes.axis("off")
        draw(axes, **sizes)
    return figure


Point = tuple[float, float]


def _arrow(axes: Axes, start: Any, end: Any, colour: str, text: str, at: Point, **how: Any) -> None:
    """An arrow whose label stands beside its head."""
    look = {"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0, "color": colour, "lw": 1.6}
    axes.annotate("", tuple(end), tuple(start), arrowprops=look)
    _label(axes, (end[0] + at[0], end[1] + at[1]), text, colour, fontsize=9, **how)


def _label(axes: Axes, place: Point, text: str, colour: str = GREY, **how: Any) -> None:
    look = {"color": colour, "fontsize": 8, "ha": "left", "va": "center", **how}
    axes.text(*place, text, **look)


def _size(axes: Axes, start: Point, end: Point, text: str, place: Point, turn: float = 0) -> None:
    """A dimension line with its label."""
    axes.annotate("", end, start, arrowprops={"arrowstyle": "<->", "color": GREY, "lw": 0.9})
    _label(axes, place, text, ha="center", rotation=turn)


def _side(axes: Axes, bowl: float, height: float, rod: float, path: float, depth: float) -> None:
    tip, above = BED_HEIGHT - depth, height + 12
    axes.add_patch(Rectangle((-bowl, 0), 2 * bowl, BED_HEIGHT, color=BED, alpha=0.3))
    axes.plot([-bowl, -bowl, bowl, bowl], [height, 0, 0, height], color=INK, lw=2)
    long = height + 8 - tip
    axes.add_patch(Rectangle((path - rod, tip), 2 * rod, long, color=STEEL, alpha=0.5))
    axes.add_patch(Rectangle((-rod, tip), 2 * rod, long, fill=False, ls=":", ec=GREY))
    axes.plot([-bowl, bowl], [BED_HEIGHT, BED_HEIGHT], color=BED, lw=1)
    _label(axes, (-bowl + 2, BED_HEIGHT + 2.5), "bed surface", va="baseline")
    _label(axes, (0, above), "1 plunge", ha="center", va="baseline")
    _label(axes, (path, above), "3 drag", INK, ha="center", va="baseline")
    look = {"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0, "color": GREY, "lw": 1}
    axes.annotate("", (path - rod, 92), (rod, 92), arrowprops=look)
    _label(axes, (path / 2, 96), "2 approach", ha="center", va="baseline")
    beside = path + 2 * rod
    middle = (beside + 3, tip + depth / 2)
    _size(axes, (beside, tip), (beside, BED_HEIGHT), "immersion depth", middle, 90)
    _size(axes, (0, -7), (bowl, -7), "bowl radius", (bowl / 2, -11))
    _arrow(axes, (0, 0), (0, 24), RED, "z", (2, 0))
    _arrow(axes, (0, 0), (24, 0), RED, "x", (0, 4), ha="center")
    axes.plot(path, tip, "o", color=GREEN, ms=5)
    _label(axes, (path - rod - 1, tip - 5), "reference point", GREEN, ha="center", va="baseline")
    _arrow(axes, (path, tip), (path, tip + 24), BLUE, "vertical", (-1.5, 2), ha="right")
    axes.set(xlim=(-bowl - 4, bowl + 6), ylim=(-15, height + 18), title="Side view")


def _top(axes: Axes, bowl: float, height: float, rod: float, path: float, depth: float) -> None:
    axes.add_patch(Circle((0, 0), bowl, fc=(BED, 0.3), ec=INK, lw=2))
    axes.add_patch(Circle((0, 0), path, fill=False, ls="--", ec=GREY, lw=1))
    turn, angle = np.radians(35.0), 0.9
    here = path * np.array([np.cos(turn), np.sin(turn)])
    ahead = np.array([-np.sin(turn), np.cos(turn)])
    left = np.array([-ahead[1], ahead[0]])
    axes.add_patch(Circle(tuple(here), rod, color=STEEL, alpha=0.5))
    motion = "direction of\nmotion"
    _arrow(axes, here, here + 19 * ahead, BLUE, motion, (-1, 2.5), ha="right")
    _arrow(axes, here, here + 13 * left, LATERAL, "lateral", (-1, -1), ha="right")
    _arrow(axes, here, here - 16 * ahead, DRAG, "drag < 0", (0.5, -2.5), ha="center")
    spot = here + rod * (np.cos(angle) * ahead - np.sin(angle) * left)
    axes.plot(*spot, "o", color=RED, ms=4)
    start = np.degrees(np.arctan2(ahead[1], ahead[0]))
    ends = {"theta1": start - np.degrees(angle), "theta2": start}
    axes.add_patch(Arc(tuple(here), 22, 22, **ends, color=RED))
    _label(axes, tuple(here + 13 * ahead - 6 * left), "polar angle\nof a contact", RED)
    _arrow(axes, (0, 0), (15, 0), RED, "x", (-1, -3))
    _arrow(axes, (0, 0), (0, 18), RED, "y", (1.5, 0))
    end = (path * np.cos(-2.2), path * np.sin(-2.2))
    _size(axes, (0, 0), end, "path radius", (-15, -5), 54)
    _label(axes, (0, -bowl + 5), "bed", ha="center", va="baseline")
    axes.set(xlim=(-bowl - 3, bowl + 3), ylim=(-bowl - 3, bowl + 3), title="Top view")
