"""What is drawn over a picture of the contact network, on axes in mm."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke

from dragchain.arrays import Floats
from dragchain.figures.network_picture import Scene, View
from dragchain.figures.rendering import Image
from dragchain.figures.style import COLOURS, force_map


def show_network(axes: Axes, shown: Scene, view: View, image: Image, extent: Floats) -> None:
    """Set a rendered view on axes in mm, with the dominant path and the motion marked.

    Parameters
    ----------
    image, extent : array
        What `network_picture.render` returned.
    """
    axes.imshow(image, extent=tuple(extent.tolist()), interpolation="antialiased")
    axes.grid(False)
    axes.set(xlabel="x (mm)", ylabel=f"{view[1]} (mm)", xlim=extent[:2], ylim=extent[2:])
    _mark_chain(axes, shown, [0, 1] if view == "xy" else [0, 2])
    _mark_motion(axes, shown, view)


def force_bar(figure: Figure, panel: Axes, largest_n: float) -> None:
    """Put the colours of the normal force beside a panel."""
    scale = ScalarMappable(Normalize(0.0, largest_n), force_map())
    label = "normal force per contact (N);\ncylinder radius proportional"
    figure.colorbar(scale, ax=panel, shrink=0.8, pad=0.02, aspect=28, label=label)


def _mark_chain(axes: Axes, shown: Scene, pick: Sequence[int]) -> None:
    """Outline the dominant path on axes in mm; `pick` names the two coordinates."""
    if shown.dominant is None:
        return
    frame, path = shown.frame, shown.dominant
    ends = frame.point[[path.contacts[0], path.contacts[-1]]]
    centres, radii = frame.centre[list(path.particles)], frame.radius[list(path.particles)] * 1e3
    line = np.vstack([ends[:1], centres, ends[1:]])[:, pick] * 1e3
    for colour, thick in (("white", 3.0), (COLOURS["dominant_path"], 1.6)):
        axes.plot(*line.T, color=colour, linewidth=thick)
        for centre, radius in zip(line[1:-1], radii, strict=True):
            axes.add_patch(Circle(centre, radius, fill=False, edgecolor=colour, linewidth=thick))


def _mark_motion(axes: Axes, shown: Scene, view: View) -> None:
    """Draw the direction of motion where it hides little.

    Behind the workpiece, or above the bed.
    """
    heading = shown.frame.direction_rad
    ahead, left = np.array(
        [[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]]
    )
    workpiece = shown.workpiece_m[:2] * 1e3
    if view == "xy":
        start, end = workpiece - 17.6 * ahead, workpiece - 6.6 * ahead
        away = left * (-12.0 if left @ workpiece > 0.0 else 12.0)  # towards the middle of the bowl
    else:
        start = np.array([workpiece[0], axes.get_ylim()[1] - 3.0])
        end, away = start + np.array([11.0 * ahead[0], 0.0]), np.array([0.0, -11.0])
        if abs(ahead[0]) < 1.0 / 11.0:
            return
    arrow = {"arrowstyle": "-|>", "color": "black", "linewidth": 2.0, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=arrow)
    label = axes.annotate("motion", tuple(start), tuple(away), textcoords="offset points")
    side = "center" if abs(away[0]) < 6.0 else "left" if away[0] > 0.0 else "right"
    label.set(ha=side, va="center", weight="bold")
    label.set_path_effects([withStroke(linewidth=3, foreground="white")])
