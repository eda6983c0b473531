"""The picture of a layout."""

import io
import math
from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.mesh.surface import surface
from dragdeck.preview.layout import COLOURS, CaseLayout, MovingWorkpiece, Projection, views

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


_MOST_TRIANGLES = 8000
"""Of a surface that is drawn."""

_SWEPT_TRIANGLES, _EVERY = 400, 9
"""Of a workpiece at each of its poses, and every so many of these, as they are drawn together."""


def picture(layout: CaseLayout, title: str) -> bytes:
    """Draw a layout, as PNG; the title is plain text."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 10), dpi=110, layout="constrained")
    figure.suptitle(title, fontsize=12, color=COLOURS["ink"], parse_math=False)
    layers = list(_layers(layout))
    for axes, view in zip(figure.subplots(2, 2).flat, _views(layout), strict=True):
        _draw(axes, view, layout, layers)
    handles, names = figure.axes[0].get_legend_handles_labels()
    known = dict(zip(names, handles, strict=True))
    figure.legend(known.values(), known, loc="outside lower center", ncols=7, frameon=False)
    return _png(figure)


def small_picture(layout: CaseLayout) -> bytes:
    """Draw a layout obliquely from above, without words, as PNG: for the report on its runs."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.2, 2.9), dpi=150)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    _draw(axes, _views(layout)[-1], layout, list(_layers(layout)))
    return _png(figure)


def _views(layout: CaseLayout) -> list[Projection]:
    return views(layout.workpieces[0].direction_rad)


def _png(figure: "Figure") -> bytes:
    content = io.BytesIO()
    figure.savefig(content, format="png")
    return content.getvalue()


def _layers(layout: CaseLayout) -> Iterator[_Layer]:
    """Surfaces in the order of painting: below the surface of the bed, the surface, and above."""
    bodies = [_Layer(swept(body), "swept", 0.7) for body in layout.workpieces]
    bodies += [_Layer(_coarse(body.at_start), "workpiece", 1.0) for body in layout.workpieces]
    below, above = (
        [body._replace(mesh=_cut(body.mesh, normal, layout.surface_m)) for body in bodies]
        for normal in ("z", "-z")
    )
    yield from (_Layer(layout.bowl, "bowl", 0.7), *below, _Layer(layout.bed, "bed", 0.6), *above)


def swept(body: MovingWorkpiece) -> "Trimesh":
    """A workpiece at all poses of its drag: painted as one sheet, the volume that it sweeps."""
    mesh, poses = _coarse(body.mesh, _SWEPT_TRIANGLES), body.drag.poses[::_EVERY]
    points = mesh.vertices @ poses[:, :3, :3].transpose(0, 2, 1) + poses[:, None, :3, 3]
    faces = mesh.faces + len(mesh.vertices) * np.arange(len(poses))[:, None, None]
    return surface(points.reshape(-1, 3), faces.reshape(-1, 3))


def _coarse(mesh: "Trimesh", triangles: int = _MOST_TRIANGLES) -> "Trimesh":
    """A mesh with fewer triangles, if it has more than can be drawn well."""
    if len(mesh.faces) <= triangles:
        return mesh
    return _as_mesh(_as_data(mesh).decimate(1 - triangles / len(mesh.faces)))


def _cut(mesh: "Trimesh", normal: str, height_m: float) -> "Trimesh":
    """The part of a surface below a height, or above it, open where it was cut."""
    return _as_mesh(_as_data(mesh).clip(normal, origin=(0.0, 0.0, height_m)).triangulate())


def _as_data(mesh: "Trimesh") -> Any:
    import pyvista

    return pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces)


def _as_mesh(data: Any) -> "Trimesh":
    return surface(data.points, data.regular_faces)


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
