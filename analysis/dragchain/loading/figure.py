"""The picture of a workpiece: where particles press and slide on it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from dragchain.arrays import Floats
from dragchain.figures.panels import depth_bars, head, new_panels
from dragchain.figures.rendering import Camera, Image, check_rendering, new_plotter, photograph
from dragchain.figures.style import ABOVE_SCALE, GREY, WIDTH_IN, force_map, top_of_scale
from dragchain.loading.document import Loading, Profile
from dragchain.loading.samples import as_polydata, patches
from dragchain.run.kinematics import motion_of, needed
from dragchain.run.workpiece import Surface
from dragdeck.records.case import CaseOfRun

_QUANTITY = "force_slide_pa"
_LABEL = "normal force times sliding distance, per area of the workpiece\nand path length (N/m²)"


_VIEWS = {
    "front": ((1.0, 0.0), "⊙ motion"),
    "left": ((0.0, 1.0), "← motion"),
    "rear": ((-1.0, 0.0), "⊗ motion"),
    "right": ((0.0, -1.0), "motion →"),
}
"""Sides of the workpiece: where the eye is in its frame (x, y), and where it then moves to."""

_PIXELS = 900
_BESIDE_IN, _AROUND_IN, _TALLEST_IN = 1.3, 2.3, 3.5
"""What labels take of the width and height of the figure, and how high its panels are at most."""


def workpiece_figure(
    case: CaseOfRun, surface: Surface, facets: pd.DataFrame, loading: Loading
) -> Figure:
    """The four sides of the workpiece by force times sliding distance, beside its depth profile.

    The load is averaged over areas of a particle's size.

    Raises
    ------
    RenderError
        If pictures cannot be rendered here.
    """
    load, title = averaged_load(surface, facets, case), _title(loading, case)
    return _sides(case, surface, load, _LABEL, title, loading.by_depth)


def surface_figure(
    case: CaseOfRun, surface: Surface, values: Floats, label: str, title: str
) -> Figure:
    """The workpiece from its four sides by a value of each facet, (M,).

    Raises
    ------
    RenderError
        If pictures cannot be rendered here.
    """
    return _sides(case, surface, values, label, title)


def _sides(
    case: CaseOfRun, surface: Surface, values: Floats, label: str, title: str,
    profile: Profile | None = None,
) -> Figure:  # fmt: skip
    check_rendering()
    mesh = as_polydata(surface)
    mesh.cell_data[_QUANTITY] = values
    scale = Normalize(0.0, top_of_scale(values, surface.areas))
    widths = [1.0] * len(_VIEWS) + [1.4] * (profile is not None)
    height = _height_in(case, widths[0] / sum(widths))
    figure, panels = new_panels(height, len(widths), sharey=True, width_ratios=widths)
    for axes, name in zip(panels, _VIEWS, strict=False):
        _view(axes, mesh, name, scale, case)
    if profile is not None:
        _profile(panels[-1], profile)
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
    when = motion if _keeps_direction(case) else "(at the start)"
    axes.set(xlabel="width (mm)", title=f"{name}\n{when}")


def _keeps_direction(case: CaseOfRun) -> bool:
    """Whether the workpiece's motion has one direction in its own frame."""
    return motion_of(case).keeps_direction


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


def _profile(axes: Axes, profile: Profile) -> None:
    """Draw force times sliding distance against depth with its interval."""
    depth_bars(axes, profile.edges_m, profile.force_slide, 1e-3)
    axes.set(xlim=(0.0, None), title="by depth, incl. end face\n(bars: 95 % CI)")
    axes.set_xlabel("force times sliding\ndistance per path and\ndepth (N m/(m mm))")


def _title(loading: Loading, case: CaseOfRun) -> str:
    """Say what the picture is of; fractions are unknown where nothing slides."""
    work_j_m = loading.totals["friction_work_j"] / loading.path_m
    front = loading.front_fraction["force_slide_n_m"]
    fraction = loading.friction_fraction_of_work.value
    return (
        f"{case.case or case.run}: sliding load on the workpiece, "
        f"{loading.path_m * 1e3:.0f} mm of path in {loading.time_s:.1f} s\n"
        f"friction work {work_j_m:.3g} J/m, {100 * fraction:.1f} % of the work of the workpiece\n"
        f"front half: {100 * front.value:.0f} % of force times sliding distance"
        f" (95 % CI {100 * front.ci95_low:.0f} to {100 * front.ci95_high:.0f})"
    )
