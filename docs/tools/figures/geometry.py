"""Bowl, bed, workpiece and path of the paper's study, with the frames of the results."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle, Rectangle
from tables import table

from dragchain.figures.style import BLUE, COLOURS, GREEN, GREY, INK, LIGHT, RED

ARROW = {"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0}
BED, STEEL, DRAG, LATERAL = (COLOURS[name] for name in ("bed", "workpiece", "drag", "lateral"))
BED_HEIGHT = 70.0
"""mm, drawn; the paper fills to this height."""


def draw() -> Figure:
    """Draw it: side view and top view, in mm."""
    study = table("study/uhlmann2015").iloc[0]
    sizes = {
        "bowl": 1e3 * study["bowl_radius_m"],
        "height": 1e3 * study["bowl_height_m"],
        "rod": 1e3 * study["workpiece_shape_radius_m"],
        "path": 1e3 * study["motion_path_radius_m"],
        "depth": 1e3 * study["motion_immersion_depth_m"],
    }
    figure = Figure(figsize=(9.0, 4.9), layout="constrained")
    side, top = figure.subplots(1, 2)
    for axes in (side, top):
        axes.set_aspect("equal")
        axes.axis("off")
    _side(side, **sizes)
    _top(top, **sizes)
    return figure


def _arrow(
    axes: Axes,
    start: tuple[float, float],
    end: tuple[float, float],
    colour: str,
    text: str = "",
    at: tuple[float, float] = (2, 0),
    **options: str,
) -> None:
    """An arrow whose label stands beside its head."""
    axes.annotate("", end, start, arrowprops={**ARROW, "color": colour, "lw": 1.6})
    place = {"color": colour, "fontsize": 9, "ha": "left", "va": "center", **options}
    axes.text(end[0] + at[0], end[1] + at[1], text, **place)


def _size(
    axes: Axes, start: tuple[float, float], end: tuple[float, float], text: str, **at: float
) -> None:
    """A dimension line with its label."""
    axes.annotate("", end, start, arrowprops={"arrowstyle": "<->", "color": GREY, "lw": 0.9})
    axes.text(
        at["x"],
        at["y"],
        text,
        color=GREY,
        fontsize=8,
        ha="center",
        va="center",
        rotation=at.get("turn", 0),
    )


def _side(axes: Axes, bowl: float, height: float, rod: float, path: float, depth: float) -> None:
    tip = BED_HEIGHT - depth
    axes.add_patch(Rectangle((-bowl, 0), 2 * bowl, BED_HEIGHT, color=BED, alpha=0.3))
    axes.plot([-bowl, -bowl, bowl, bowl], [height, 0, 0, height], color=INK, lw=2)
    axes.add_patch(Rectangle((path - rod, tip), 2 * rod, height + 8 - tip, color=STEEL, alpha=0.5))
    axes.add_patch(Rectangle((-rod, tip), 2 * rod, height + 8 - tip, fill=False, ls=":", ec=GREY))
    axes.plot([-bowl, bowl], [BED_HEIGHT, BED_HEIGHT], color=BED, lw=1)
    axes.text(-bowl + 2, BED_HEIGHT + 2.5, "bed surface", fontsize=8, color=GREY)
    axes.text(0, height + 12, "1 plunge", fontsize=8, color=GREY, ha="center")
    axes.text(path, height + 12, "3 drag", fontsize=8, color=INK, ha="center")
    axes.annotate("", (path - rod, 92), (rod, 92), arrowprops={**ARROW, "color": GREY, "lw": 1})
    axes.text(path / 2, 96, "2 approach", fontsize=8, color=GREY, ha="center")
    _size(
        axes,
        (path + 2 * rod, tip),
        (path + 2 * rod, BED_HEIGHT),
        "immersion depth",
        x=path + 2 * rod + 3,
        y=tip + depth / 2,
        turn=90,
    )
    _size(axes, (0, -7), (bowl, -7), "bowl radius", x=bowl / 2, y=-11)
    _arrow(axes, (0, 0), (0, 24), RED, "z", (2, 0))
    _arrow(axes, (0, 0), (24, 0), RED, "x", (0, 4), ha="center")
    axes.plot(path, tip, "o", color=GREEN, ms=5)
    axes.text(path - rod - 1, tip - 5, "reference point", fontsize=8, color=GREEN, ha="center")
    _arrow(axes, (path, tip), (path, tip + 24), BLUE, "vertical", (-1.5, 2), ha="right")
    axes.set(xlim=(-bowl - 4, bowl + 6), ylim=(-15, height + 18), title="Side view")


def _top(axes: Axes, bowl: float, height: float, rod: float, path: float, depth: float) -> None:
    axes.add_patch(Circle((0, 0), bowl, fc=(BED, 0.3), ec=INK, lw=2))
    axes.add_patch(Circle((0, 0), path, fill=False, ls="--", ec=GREY, lw=1))
    turn = np.radians(35.0)
    x, y = path * np.cos(turn), path * np.sin(turn)
    axes.add_patch(Circle((x, y), rod, color=STEEL, alpha=0.5))
    ahead = np.array([-np.sin(turn), np.cos(turn)])
    left = np.array([-ahead[1], ahead[0]])
    here = np.array([x, y])
    _arrow(
        axes,
        tuple(here),
        tuple(here + 19 * ahead),
        BLUE,
        "direction of\nmotion",
        (-1, 2.5),
        ha="right",
    )
    _arrow(
        axes,
        tuple(here),
        tuple(here + 13 * left),
        COLOURS["lateral"],
        "lateral",
        (-1, -1),
        ha="right",
    )
    _arrow(
        axes,
        tuple(here),
        tuple(here - 16 * ahead),
        COLOURS["drag"],
        "drag < 0",
        (0.5, -2.5),
        ha="center",
    )
    spot = here + rod * (np.cos(0.9) * ahead - np.sin(0.9) * left)
    axes.plot(*spot, "o", color=RED, ms=4)
    start = np.degrees(np.arctan2(ahead[1], ahead[0]))
    axes.add_patch(
        Arc(tuple(here), 22, 22, theta1=start - np.degrees(0.9), theta2=start, color=RED)
    )
    axes.text(
        *(here + 13 * ahead - 6 * left),
        "polar angle\nof a contact",
        color=RED,
        fontsize=8,
        ha="left",
        va="center",
    )
    _arrow(axes, (0, 0), (15, 0), RED, "x", (-1, -3))
    _arrow(axes, (0, 0), (0, 18), RED, "y", (1.5, 0))
    _size(
        axes,
        (0, 0),
        (path * np.cos(-2.2), path * np.sin(-2.2)),
        "path radius",
        x=-15,
        y=-5,
        turn=54,
    )
    axes.text(0, -bowl + 5, "bed", fontsize=8, color=GREY, ha="center")
    axes.set(xlim=(-bowl - 3, bowl + 3), ylim=(-bowl - 3, bowl + 3), title="Top view")
    axes.plot([], [], color=LIGHT)
