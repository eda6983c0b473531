"""What is drawn over a picture of the contact network, on axes in mm."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke

from dragchain.arrays import Floats
from dragchain.figures.network_picture import Scene, View
from dragchain.figures.rendering import Image
from dragchain.figures.style import CHAIN


def show_network(
    axes: Axes,
    shown: Scene,
    view: View,
    image: Image,
    extent: Floats,
    width: float = 1.6,
    halo: float = 3.0,
) -> None:
    """Set a rendered view on axes in mm, with the dominant path and the motion marked.

    Parameters
    ----------
    image, extent : array
        What `network_picture.render` returned.
    width, halo : float
        Line width of the path and of the white line below it.
    """
    axes.imshow(image, extent=tuple(extent.tolist()), interpolation="antialiased")
    axes.grid(False)
    axes.set(xlabel="x (mm)", ylabel=f"{view[1]} (mm)", xlim=extent[:2], ylim=extent[2:])
    _mark_chain(axes, shown, [0, 1] if view == "xy" else [0, 2], width, halo)
    _mark_motion(axes, shown, view)


def _mark_chain(
    axes: Axes, shown: Scene, pick: Sequence[int], width: float = 1.6, halo: float = 3.0
) -> None:
    """Outline the dominant path on axes in mm; `pick` names the two coordinates."""
    if shown.dominant is None:
        return
    frame, path = shown.frame, shown.dominant
    particles = list(path.particles)
    ends = frame.point[[path.contacts[0], path.contacts[-1]]]
    line = np.vstack([ends[:1], frame.centre[particles], ends[1:]])[:, pick] * 1e3
    axes.plot(*line.T, color="white", linewidth=halo, alpha=0.9)
    axes.plot(*line.T, color=CHAIN, linewidth=width)
    for centre, radius in zip(
        frame.centre[particles][:, pick], frame.radius[particles], strict=True
    ):
        for colour, thick in (("white", halo), (CHAIN, width)):
            axes.add_patch(
                Circle(centre * 1e3, radius * 1e3, fill=False, edgecolor=colour, linewidth=thick)
            )


def _mark_motion(axes: Axes, shown: Scene, view: View) -> None:
    """Draw the direction of motion where it hides little.

    Behind the workpiece, or above the bed.
    """
    heading = shown.frame.direction_rad
    direction = np.array([np.cos(heading), np.sin(heading)]) * 11.0
    workpiece = shown.workpiece_m[:2] * 1e3
    if view == "xy":
        start, end = workpiece - 1.6 * direction, workpiece - 0.6 * direction
        away = 12.0 * np.array([-np.sin(heading), np.cos(heading)])
        away *= -1.0 if away @ workpiece > 0.0 else 1.0  # towards the middle of the bowl
    else:
        away = np.array([0.0, -11.0])
        level = axes.get_ylim()[1] - 3.0
        start, end = np.array([workpiece[0], level]), np.array([workpiece[0] + direction[0], level])
        if abs(direction[0]) < 1.0:
            return
    arrow = {"arrowstyle": "-|>", "color": "black", "linewidth": 2.0, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=arrow)
    side = "center" if abs(away[0]) < 6.0 else "left" if away[0] > 0.0 else "right"
    label = axes.annotate(
        "motion", tuple(start), tuple(away), textcoords="offset points", ha=side, va="center",
        weight="bold",
    )  # fmt: skip
    label.set_path_effects([withStroke(linewidth=3, foreground="white")])
