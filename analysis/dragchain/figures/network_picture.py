"""Pictures of the interaction network, as in Fig. 4b and 4c of Uhlmann et al. (2015).

One cylinder a contact: from centre to centre of two particles, or from a particle's centre to its
contact point with workpiece or bowl. Its colour runs from light (no force) to dark (the frame's
largest normal force), its radius is proportional to the normal force and reaches the mean particle
radius at the largest.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from dragchain.arrays import Floats
from dragchain.errors import TableError
from dragchain.figures.rendering import Camera, Image, new_plotter, photograph
from dragchain.figures.style import COLOURS, force_map
from dragchain.network.chains import WidestPath, dominant_path, widest_paths
from dragchain.network.frame import NetworkFrame, network_frames
from dragchain.run.kinematics import needed, process_time
from dragchain.run.workpiece import placed, read_workpiece_mesh
from dragchain.tables.by_step import read_table
from dragchain.tables.run_folder import workpiece_places
from dragdeck.records.case import CaseOfRun
from dragdeck.study.rotations import Orientations

View = Literal["xy", "xz"]

_PIXELS_PER_MM = 10
_SIDES = 18
_MARGIN_M = 0.004

WINDOW_DIAMETERS = 12.0
"""Mean particle diameters to either side of the workpiece that a picture of a wider bowl shows."""

DEPTH_DIAMETERS = 6.0
"""Mean particle diameters before and behind the workpiece whose contacts are then seen from the
side."""

_MOST_PIXELS = 1400
"""Most pixels along an edge of a picture: a bowl of 140 mm at full resolution."""


@dataclass(frozen=True)
class NetworkScene:
    """What one picture shows; lengths in m, forces in N.

    Attributes
    ----------
    frame : NetworkFrame
        The network frame.
    workpiece_m : (3,) float
        Centre of the workpiece's bottom face at the frame.
    rotation : Orientations
        Orientation of the workpiece, which looks along +x in its STL file.
    dominant : WidestPath or None
        The frame's dominant workpiece path.
    process_time_s : float
        Process time since the drag began.
    """

    frame: NetworkFrame
    workpiece_m: Floats
    rotation: Orientations
    dominant: WidestPath | None
    process_time_s: float


def segments(frame: NetworkFrame) -> Floats:
    """The axis of each contact's cylinder, (M, 2, 3) in m."""
    end = frame.point.copy()
    inner = frame.between_particles()
    end[inner] = frame.centre[frame.b[inner]]
    return np.stack([frame.centre[frame.a], end], axis=1)


def cylinder_radii(normal_force_n: Floats, radius_mean_m: float) -> Floats:
    """Radii proportional to the force, (M,) in m: the mean particle radius at the largest."""
    largest = normal_force_n.max(initial=0.0)
    if largest <= 0.0:
        return np.zeros_like(normal_force_n)
    return np.asarray(np.clip(normal_force_n, 0.0, None) / largest * radius_mean_m)


def load_scene(run_dir: Path, case: CaseOfRun) -> NetworkScene:
    """Read what the picture of a process run shows: the last network frame in its statistics.

    Raises
    ------
    TableError
        If a table is missing or holds no counted network frame.
    """
    step = int(read_table(run_dir / "tables" / "network.parquet", ["step"])["step"].iloc[-1])
    frame = next(network_frames(run_dir, (step, step)), None)
    if frame is None:
        raise TableError(f"particles.parquet lacks step {step}, which network.parquet has")
    path = dominant_path(frame, widest_paths(frame))
    moment = float(process_time(np.array(frame.time_s), case))
    return NetworkScene(frame, *workpiece_places(run_dir, case)(frame.step), path, moment)


@dataclass(frozen=True)
class Window:
    """The part of the bowl that a picture shows.

    Attributes
    ----------
    low, high : (2,) float
        Corners in m along the axes of the view.
    contacts : (M,) bool or None
        The contacts of the frame that are drawn; None: all.
    """

    low: Floats
    high: Floats
    contacts: NDArray[np.bool_] | None = None


def window(case: CaseOfRun, scene: NetworkScene, view: View) -> Window:
    """The whole bowl, or the workpiece's surroundings if the bowl is much wider than they are.

    Only contacts whose point lies in the surroundings are then drawn: `WINDOW_DIAMETERS` to
    either side of the workpiece and, seen from the side, `DEPTH_DIAMETERS` before and behind it.
    """
    bowl_m = np.array(case.bowl.half_widths_m) + _MARGIN_M
    floor = (-_MARGIN_M, 1.25 * needed(case.surface_m, "surface_m"))
    diameter, whole = 2.0 * case.media.radius_mean_m, _shows_all(case)
    middle = np.zeros(2) if whole else scene.workpiece_m[:2]
    half = np.inf if whole else WINDOW_DIAMETERS * diameter
    low, high = np.maximum(middle - half, -bowl_m), np.minimum(middle + half, bowl_m)
    point = scene.frame.point[:, :2]
    near = np.asarray(np.logical_and(point >= low, point <= high).all(axis=1))
    if view == "xz":
        near = near & (np.abs(point[:, 1] - middle[1]) <= DEPTH_DIAMETERS * diameter)
        low, high = (
            np.array([end[0], level]) for end, level in zip((low, high), floor, strict=True)
        )
    return Window(low, high, None if whole else near)


def _shows_all(case: CaseOfRun) -> bool:
    """Whether pictures of a case show its whole bowl."""
    reach = max(case.bowl.half_widths_m) + _MARGIN_M
    return reach <= WINDOW_DIAMETERS * 2.0 * case.media.radius_mean_m


def cut_words(case: CaseOfRun, view: View) -> str:
    """What a picture leaves out, in words; empty if it shows the whole bowl."""
    if _shows_all(case):
        return ""
    words = f"section: up to {WINDOW_DIAMETERS:g} particle diameters beside the workpiece"
    return words + (f", {DEPTH_DIAMETERS:g} in front of and behind it" if view == "xz" else "")


def render_view(
    run_dir: Path, case: CaseOfRun, scene: NetworkScene, view: View
) -> tuple[Image, Floats]:
    """Render one view in parallel projection.

    The resolution is less where a picture would be larger than VTK renders well.

    Returns
    -------
    image : (H, W, 3) array of uint8
        The picture.
    extent : (4,) array
        Its left, right, lower and upper edge in mm along the axes of `view`.
    """
    part = window(case, scene, view)
    low, high = part.low, part.high
    size_mm = (high - low) * 1e3
    pixels_per_mm = min(_PIXELS_PER_MM, _MOST_PIXELS / float(size_mm.max()))
    plotter = new_plotter(*np.ceil(size_mm * pixels_per_mm).astype(int).tolist())
    plotter.enable_depth_peeling(number_of_peels=8)
    _add_bowl(plotter, case, view)
    workpiece = placed(read_workpiece_mesh(run_dir, case), scene.workpiece_m, scene.rotation)
    plotter.add_mesh(workpiece, color=COLOURS["workpiece"], opacity=0.45)
    _add_contacts(plotter, scene.frame, case.media.radius_mean_m, part.contacts)
    image = photograph(plotter, _camera((low + high) / 2, view, case), float(high[1] - low[1]))
    return image, np.array([low[0], high[0], low[1], high[1]]) * 1e3


def _camera(middle: Floats, view: View, case: CaseOfRun) -> Camera:
    away = max(1.0, 2.0 * case.bowl.reach_m)
    x, other = middle
    if view == "xy":
        return Camera((x, other, away), (x, other, 0.0), (0.0, 1.0, 0.0))
    return Camera((x, -away, other), (x, 0.0, other))


def _add_bowl(plotter: Any, case: CaseOfRun, view: View) -> None:
    import pyvista as pv

    height = 1.2 * needed(case.surface_m, "surface_m")
    if not case.bowl.rim:
        floor = np.insert(case.bowl.sections(0.0)[0][:-1], 2, 0.0, axis=1)
        opacity = 0.06 if view == "xy" else 0.5
        plotter.add_mesh(pv.PolyData(floor).delaunay_2d(), color="#7a8694", opacity=opacity)
    for line in case.bowl.lines(height):
        if view == "xz" and line[:, 1].max() < 0.0:
            continue  # it would hide what is behind it
        plotter.add_mesh(pv.MultipleLines(line).tube(radius=0.0003), color="#4a5561")


def _add_contacts(
    plotter: Any, frame: NetworkFrame, radius_mean_m: float, within: NDArray[np.bool_] | None
) -> None:
    force = frame.normal_force
    radius = cylinder_radii(force, radius_mean_m)
    shown = force > 0.0 if within is None else (force > 0.0) & within
    if not shown.any():
        return
    tubes = _tubes(segments(frame)[shown], force[shown], radius[shown])
    plotter.add_mesh(
        tubes,
        scalars="force",
        cmap=force_map(),
        clim=(0.0, float(force.max(initial=0.0))),
        ambient=0.35,
        diffuse=0.7,
        show_scalar_bar=False,
    )


def _tubes(axis: Floats, force: Floats, radius: Floats) -> Any:
    """Cylinders about axes, (M, 2, 3) in m, with their forces and radii."""
    import pyvista as pv

    lines = np.insert(np.arange(2 * len(axis)).reshape(-1, 2), 0, 2, axis=1)
    mesh = pv.PolyData(axis.reshape(-1, 3), lines=lines.ravel())
    mesh["force"], mesh["radius"] = np.repeat(force, 2), np.repeat(radius, 2)
    return mesh.tube(scalars="radius", absolute=True, n_sides=_SIDES, capping=True)


# --- on axes in mm -------------------------------------------------------------------------------


def show_network(axes: Axes, shown: NetworkScene, view: View, image: Image, extent: Floats) -> None:
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


def _mark_chain(axes: Axes, shown: NetworkScene, pick: Sequence[int]) -> None:
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


def _mark_motion(axes: Axes, shown: NetworkScene, view: View) -> None:
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
