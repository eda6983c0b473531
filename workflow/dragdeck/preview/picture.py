"""The picture of a layout."""

import io
import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dragdeck.preview.layout import COLOURS, CaseLayout, Floats, Projection, views
from dragdeck.preview.swept import below_and_above, drawn

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from trimesh import Trimesh


_DASHES = {"plunge": (0, (1, 1.2)), "approach": (0, (4, 1.5)), "drag": "solid"}

_WORDS = {"bed": "expected bed surface", "swept": "swept in the drag", "workpiece": "workpiece"}

_LIGHT = np.array([0.35, -0.5, 0.79])


class _Layer(NamedTuple):
    """A surface to paint: what it is, and how opaque it is."""

    mesh: "Trimesh"
    name: str
    opacity: float


def picture(layout: CaseLayout, swept: Sequence["Trimesh"], title: str) -> bytes:
    """Draw a layout and the volumes that its workpieces sweep, as PNG; the title is plain text."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 10), dpi=110, layout="constrained")
    figure.suptitle(title, fontsize=12, color=COLOURS["ink"], parse_math=False)
    layers = list(_layers(layout, swept))
    for axes, view in zip(figure.subplots(2, 2).flat, _views(layout), strict=True):
        _draw(axes, view, layout, layers)
    handles, names = figure.axes[0].get_legend_handles_labels()
    known = dict(zip(names, handles, strict=True))
    figure.legend(known.values(), known, loc="outside lower center", ncols=7, frameon=False)
    return _png(figure)


def small_picture(layout: CaseLayout, swept: Sequence["Trimesh"]) -> bytes:
    """Draw a layout obliquely from above, without words, as PNG: for the report on its runs."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.2, 2.9), dpi=150)
    _draw(
        figure.add_axes((0.0, 0.0, 1.0, 1.0)),
        _views(layout)[-1],
        layout,
        list(_layers(layout, swept)),
    )
    return _png(figure)


def _views(layout: CaseLayout) -> list[Projection]:
    return views(layout.workpieces[0].direction_rad)


def _png(figure: "Figure") -> bytes:
    content = io.BytesIO()
    figure.savefig(content, format="png")
    return content.getvalue()


def _layers(layout: CaseLayout, swept: Sequence["Trimesh"]) -> Iterator[_Layer]:
    """Surfaces in the order of painting: below the surface of the bed, the surface, and above."""
    bodies = [_Layer(volume, "swept", 0.7) for volume in swept]
    bodies += [_Layer(drawn(body.at_start), "workpiece", 1.0) for body in layout.workpieces]
    parts = [below_and_above(body.mesh, layout.surface_m) for body in bodies]
    yield _Layer(layout.bowl, "bowl", 0.7)
    yield from (body._replace(mesh=below) for body, (below, _) in zip(bodies, parts, strict=True))
    yield _Layer(layout.bed, "bed", 0.6)
    yield from (body._replace(mesh=above) for body, (_, above) in zip(bodies, parts, strict=True))


def _draw(axes: "Axes", view: Projection, layout: CaseLayout, layers: Sequence[_Layer]) -> None:
    for layer in layers:
        _paint(axes, view, layer)
    for name in _WORDS:
        axes.fill([], [], color=COLOURS[name], label=_WORDS[name])
    for line in layout.lines:
        _line(axes, view, line, _darker("bowl"), lw=1.2)
    for body in layout.workpieces:
        for stage in body.stages:
            style = {"ls": _DASHES.get(stage.name, "solid"), "label": stage.name}
            _line(axes, view, stage.poses[:, :3, 3], COLOURS[stage.name], lw=1.8, **style)
        start, ahead = body.drag.poses[0, :3, 3], body.direction_rad
        along = np.array([math.cos(ahead), math.sin(ahead), 0.0])
        _arrow(axes, view, start, 0.3 * layout.bowl_reach_m * along)
        _turn(axes, view, start, 1.3 * body.radius_m, body.spin)
    rim = np.array([0.0, 0.0, layout.bowl_height_m])
    _turn(axes, view, rim, 1.08 * layout.bowl_reach_m, layout.bowl_turn)
    axes.set(title=view.title, xlabel=view.across, ylabel=view.along, aspect="equal")
    axes.autoscale_view()
    if not view.across:
        axes.set_axis_off()


def _paint(axes: "Axes", view: Projection, layer: _Layer) -> None:
    """Paint the triangles that face the viewer, all of them together as transparent as asked."""
    from matplotlib.collections import PolyCollection
    from matplotlib.colors import to_rgb

    mesh = layer.mesh
    placed = 1e3 * mesh.triangles @ view.basis.T
    order = np.argsort(placed[:, :, 2].mean(axis=1))
    order = order[mesh.face_normals[order] @ view.basis[2] > 0.02]
    light = 0.65 + 0.35 * np.clip(mesh.face_normals[order] @ _LIGHT, 0.0, 1.0)
    colours = light[:, None] * to_rgb(COLOURS[layer.name])
    triangles = PolyCollection(
        placed[order, :, :2], facecolors=colours, edgecolors="face", lw=0.5, antialiased=False
    )
    if layer.opacity < 1:
        triangles.set_agg_filter(partial(_faded, layer.opacity))
    axes.add_collection(triangles)


def _faded(opacity: float, image: Any, _dpi: float) -> tuple[Any, float, float]:
    """A drawn layer, (H, W, 4), as one transparent sheet."""
    return image * np.array([1.0, 1.0, 1.0, opacity]), 0, 0


def _arrow(axes: "Axes", view: Projection, start_m: Floats, along_m: Floats) -> None:
    points = 1e3 * view.basis[:2] @ np.array([start_m, along_m]).T
    (x, across), (y, along) = points
    scale: Any = {"angles": "xy", "scale_units": "xy", "scale": 1}
    axes.quiver(x, y, across, along, color=COLOURS["drag"], width=0.008, zorder=3, **scale)


def _turn(axes: "Axes", view: Projection, centre_m: Floats, radius_m: float, sense: int) -> None:
    """A third of a circle with an arrowhead where something turns, as seen by this view."""
    if not sense:
        return
    angle = math.pi * (0.75 + sense * np.linspace(-1 / 3, 1 / 3, 40))
    ring = radius_m * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    _line(axes, view, centre_m + ring, COLOURS["drag"], lw=1.8)
    ahead = sense * np.array([-ring[-1, 1], ring[-1, 0], 0.0])
    _arrow(axes, view, centre_m + ring[-1], 0.3 * ahead)


def _line(axes: "Axes", view: Projection, points: Floats, colour: Any, **style: Any) -> None:
    across, along, _ = 1e3 * view.basis @ points.T
    axes.plot(across, along, color=colour, **style)


def _darker(name: str) -> Floats:
    from matplotlib.colors import to_rgb

    return 0.6 * np.array(to_rgb(COLOURS[name]))
