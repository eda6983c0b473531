"""The picture of a workpiece: where particles press and slide on it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from dragchain.arrays import Floats
from dragchain.drag import AZIMUTH_BINS, circumference, parts
from dragchain.figures.panels import depth_bars, head, new_panels
from dragchain.figures.rendering import Camera, Image, check_rendering, new_plotter, photograph
from dragchain.figures.style import ABOVE_SCALE, GREY, WIDTH_IN, force_map, top_of_scale
from dragchain.loading.document import Loading, Profile
from dragchain.loading.samples import Sampled, as_polydata, patches
from dragchain.loading.summary import LOAD_DEPTH_BINS
from dragchain.run.kinematics import motion_of, needed, spins
from dragchain.run.workpiece import Surface
from dragdeck.records.case import CaseOfRun

_QUANTITY = "force_slide_pa"
_LABEL = "sliding load, per area of the workpiece and path length (N/m²)"


_VIEWS = {
    "front": ((1.0, 0.0), "⊙ motion"),
    "left": ((0.0, 1.0), "← motion"),
    "rear": ((-1.0, 0.0), "⊗ motion"),
    "right": ((0.0, -1.0), "motion →"),
}
"""Sides of the workpiece: where the eye is in its frame (x, y), and where it then moves to."""

_PIXELS = 900
_FACETS_PER_BIN = 6
"""Facets around a cylinder per bin, so that it looks round."""
_BESIDE_IN, _AROUND_IN, _TALLEST_IN = 1.3, 2.3, 3.5
"""What labels take of the width and height of the figure, and how high its panels are at most."""


def workpiece_figure(
    case: CaseOfRun, sampled: Sampled, surface: Surface, facets: pd.DataFrame, loading: Loading
) -> Figure:
    """The workpiece by sliding load, averaged over areas of a particle's size.

    A cylinder is shown from ahead, from behind and unrolled; any other workpiece
    from its four sides. Beside it stands the profile over depth.

    Raises
    ------
    RenderError
        If pictures cannot be rendered here.
    """
    check_rendering()
    cylinder = needed(case.workpiece, "workpiece").kind == "cylinder"
    names = ("front", "rear") if cylinder else tuple(_VIEWS)
    widths = [1.0, 1.0, 2.8, 2.4] if cylinder else [1.0] * 4 + [1.4]
    bins = _unrolled_bins(sampled, case) if cylinder else None
    if bins is not None and not spins(case):
        load, mesh = bins.load_pa.ravel(), _rolled(bins, case)
        largest = top_of_scale(load, np.ones_like(load))
    else:
        shown = averaged_load(surface, facets, case)
        largest, mesh = top_of_scale(shown, surface.areas), as_polydata(surface)
        mesh.cell_data[_QUANTITY] = shown
    scale = Normalize(0.0, largest)
    height = _height_in(case, widths[0] / sum(widths))
    figure, panels = new_panels(height, len(widths), sharey=True, width_ratios=widths)
    for axes, name in zip(panels, names, strict=False):
        _view(axes, mesh, name, scale, case)
    if bins is not None:
        _unrolled(panels[2], bins, scale, case)
    _profile(panels[-1], loading.by_depth)
    panels[0].set(ylabel="depth (mm)", ylim=_depths(case)[::-1])
    _bar(figure, panels, scale, _LABEL)
    head(figure, _title(loading, case))
    return figure


def surface_figure(
    case: CaseOfRun, surface: Surface, values: Floats, label: str, title: str
) -> Figure:
    """The workpiece from its four sides by a value of each facet, (M,).

    Raises
    ------
    RenderError
        If pictures cannot be rendered here.
    """
    check_rendering()
    mesh = as_polydata(surface)
    mesh.cell_data[_QUANTITY] = values
    scale = Normalize(0.0, top_of_scale(values, surface.areas))
    figure, panels = new_panels(_height_in(case, 1 / len(_VIEWS)), len(_VIEWS), sharey=True)
    for axes, name in zip(panels, _VIEWS, strict=True):
        _view(axes, mesh, name, scale, case)
    panels[0].set(ylabel="depth (mm)", ylim=_depths(case)[::-1])
    _bar(figure, panels, scale, label)
    head(figure, title)
    return figure


def _bar(figure: Figure, panels: Sequence[Axes], scale: Normalize, label: str) -> None:
    """Draw the colour scale below the panels."""
    colours = ScalarMappable(scale, force_map())
    style: dict[str, Any] = {"location": "bottom", "extend": "max", "shrink": 0.6, "aspect": 40}
    figure.colorbar(colours, ax=panels, label=f"{label}\n{ABOVE_SCALE}", **style)


def _height_in(case: CaseOfRun, fraction: float) -> float:
    """The figure's height, that a view of this fraction of the width has a workpiece fill it."""
    high, low = _depths(case)
    view_in = fraction * (WIDTH_IN - _BESIDE_IN)
    fits = view_in * (low - high) / (2e3 * _half_width(case))
    return _AROUND_IN + min(_TALLEST_IN, fits)


def _half_width(case: CaseOfRun) -> float:
    """Return half of the width that is shown, m."""
    return 1.15 * needed(case.workpiece, "workpiece").radius_m


def _depths(case: CaseOfRun) -> tuple[float, float]:
    """The shallowest and the deepest depth that is shown, mm."""
    deepest = needed(case.workpiece, "workpiece").immersion_depth_m * 1e3
    return -0.25 * deepest, 1.06 * deepest


def _view(axes: Axes, mesh: Any, name: str, scale: Normalize, case: CaseOfRun) -> None:
    """Set a rendered side of the workpiece on axes of width and depth (mm)."""
    eye, motion = _VIEWS[name]
    image, half = _render(mesh, eye, scale, case), 1e3 * _half_width(case)
    high, low = _depths(case)
    axes.imshow(image, extent=(-half, half, low, high), interpolation="antialiased")
    axes.set_aspect("equal", adjustable="datalim")
    axes.axhline(0.0, color=GREY, linewidth=0.8, linestyle="--")
    axes.grid(False)
    axes.xaxis.set_major_locator(MaxNLocator(2, integer=True))
    when = motion if motion_of(case).keeps_direction else "(at the start)"
    axes.set(xlabel="width (mm)", title=f"{name}\n{when}")


def _render(mesh: Any, eye: tuple[float, float], scale: Normalize, case: CaseOfRun) -> Image:
    """A side of the workpiece in parallel projection."""
    high, low = _depths(case)
    height = (low - high) * 1e-3
    plotter = new_plotter(max(8, round(_PIXELS * 2 * _half_width(case) / height)), _PIXELS)
    colours = {"scalars": _QUANTITY, "cmap": force_map(), "clim": (scale.vmin, scale.vmax)}
    plotter.add_mesh(mesh, **colours, lighting=False, show_scalar_bar=False)
    middle = needed(case.workpiece, "workpiece").immersion_depth_m - 0.5e-3 * (high + low)
    return photograph(plotter, Camera((*eye, middle), (0.0, 0.0, middle)), height)


def averaged_load(surface: Surface, facets: pd.DataFrame, case: CaseOfRun) -> Floats:
    """Load of each facet, (N,) in Pa: the mean over the area of those that lie beside it.

    They are those of a patch of the size of a particle's radius.
    """
    group = patches(surface, case.media.radius_mean_m)
    area = facets["area_m2"].to_numpy(np.float64)
    load = np.bincount(group, facets[_QUANTITY].to_numpy(np.float64) * area)
    mean: Floats = load[group] / np.bincount(group, area)[group]
    return mean


@dataclass(frozen=True)
class _Bins:
    """The lateral surface of a cylinder: edges of azimuth and depth, and the load, (D, A) in Pa.

    Azimuths are from the direction of motion.
    """

    azimuth_rad: Floats
    depth_m: Floats
    load_pa: Floats


def _unrolled_bins(sampled: Sampled, case: CaseOfRun) -> _Bins:
    workpiece = needed(case.workpiece, "workpiece")
    rows = sampled.rows[sampled.rows["workpiece_z_m"] > 1e-3 * workpiece.length_m]
    azimuths, shallowest = circumference(AZIMUTH_BINS), 1e-3 * _depths(case)[0]
    depths = np.linspace(shallowest, workpiece.immersion_depth_m, LOAD_DEPTH_BINS + 1)
    middles, half = 0.5 * (azimuths[:-1] + azimuths[1:]), 0.5 * rows["force_slide_n_m"]
    sums = np.zeros((LOAD_DEPTH_BINS, AZIMUTH_BINS))
    for part in parts(rows["azimuth_rad"].to_numpy(np.float64), AZIMUTH_BINS):
        grid = [depths, azimuths]
        sums += np.histogram2d(rows["depth_m"], middles[part], grid, weights=half)[0]
    area = workpiece.radius_m * (azimuths[1] - azimuths[0]) * (depths[1] - depths[0])
    return _Bins(azimuths, depths, sums / (area * sampled.path_m))


def _rolled(bins: _Bins, case: CaseOfRun) -> Any:
    """The lateral surface as a mesh in the frame of the workpiece, its tip in the origin."""
    import pyvista as pv

    workpiece = needed(case.workpiece, "workpiece")
    angle = np.linspace(-np.pi, np.pi, _FACETS_PER_BIN * bins.load_pa.shape[1] + 1)
    angle, height = np.meshgrid(angle, workpiece.immersion_depth_m - bins.depth_m, indexing="ij")
    x, y = workpiece.radius_m * np.cos(angle), workpiece.radius_m * np.sin(angle)
    grid = pv.StructuredGrid(x[:, :, None], y[:, :, None], height[:, :, None])
    load = np.repeat(bins.load_pa, _FACETS_PER_BIN, axis=1)
    grid.cell_data[_QUANTITY] = load.ravel()
    return grid.extract_surface(algorithm="dataset_surface")


def _unrolled(axes: Axes, bins: _Bins, scale: Normalize, case: CaseOfRun) -> None:
    """Draw the lateral surface of a cylinder unrolled: azimuth against depth."""
    workpiece = needed(case.workpiece, "workpiece")
    azimuth, depth = np.degrees(bins.azimuth_rad), 1e3 * bins.depth_m
    axes.pcolormesh(azimuth, depth, bins.load_pa, cmap=force_map(), norm=scale)
    axes.axhline(0.0, color=GREY, linewidth=0.8, linestyle="--")
    axes.axhline(workpiece.immersion_depth_m * 1e3, color=GREY, linewidth=0.8)
    axes.set_xticks(np.arange(-180, 181, 90), ["back", "right", "ahead", "left", "back"])
    axes.grid(False)
    axes.set_xlabel("azimuth from direction of motion")
    axes.set_title("lateral surface, unrolled\n(dashed: bed surface at rest)")


def _profile(axes: Axes, profile: Profile) -> None:
    """Draw the sliding load against depth with its interval."""
    depth_bars(axes, profile.edges_m, profile.force_slide, 1e-3)
    axes.set(xlim=(0.0, None), title="by depth, incl. end face\n(bars: 95 % CI)")
    axes.set_xlabel("sliding load per\ndepth (N/mm)")


def _title(loading: Loading, case: CaseOfRun) -> str:
    """Say what the picture is of; fractions are unknown where nothing slides."""
    work_j_m = loading.totals["friction_work_j"] / loading.path_m
    front = loading.front_fraction["force_slide_n_m"]
    fraction = loading.friction_fraction_of_work.value
    return (
        "sliding load (normal force times sliding distance) on the workpiece, "
        f"{loading.path_m * 1e3:.0f} mm of path in {loading.time_s:.1f} s\n"
        f"friction work {work_j_m:.3g} J/m, {100 * fraction:.1f} % of the work of the workpiece\n"
        f"front half: {100 * front.value:.0f} % of the sliding load"
        f" (95 % CI {100 * front.ci95_low:.0f} to {100 * front.ci95_high:.0f})"
    )
