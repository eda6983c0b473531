"""The figure of the report on a trade-off."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import cycle
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.arrays import Floats
from dragchain.figures.panels import key, legend_below, log_ticks, new_panels
from dragchain.figures.style import INK, LIGHT, MARKERS, WIDE_IN
from dragchain.quantities.registry import MAIN
from dragchain.tradeoff.compare import Setting
from dragchain.tradeoff.outcome import TOLERANCES, Tradeoff
from dragdeck.records.tradeoff import ErrorEntry

FLOOR = 1e-3
"""Errors below this are drawn here."""

_TITLES = {
    "drag_std": "standard deviation of drag",
    "contact_force_mean": "mean contact force on the workpiece",
    "contact_force_p90": "90th percentile of contact forces",
}
"""Of panels whose label leans on the one before or is too long."""


def draw_pareto(tradeoff: Tradeoff) -> Figure:
    """Error against cost of every setting, a panel for each main quantity."""
    names = [name for name in MAIN if name in tradeoff.comparisons]
    every = tradeoff.settings()
    settings = [setting for setting in every if not setting.other and setting != tradeoff.reference]
    moduli = sorted({setting.youngs_modulus_scale for setting in every}, reverse=True)
    viridis = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.92, max(len(moduli), 2)))
    shades = dict(zip(moduli, viridis, strict=False))
    fractions = sorted({setting.timestep_fraction for setting in settings})
    marks = dict(zip(fractions, cycle(MARKERS), strict=False))
    height = 2.6 * -(-len(names) // 3) + 0.9
    figure, panels = new_panels(height, len(names), WIDE_IN, 3, sharex=True, sharey=True)
    for axes, name in zip(panels, names, strict=True):
        comparison = tradeoff.comparisons[name]
        measured = [setting for setting in settings if setting in comparison.errors]
        errors = {setting: comparison.errors[setting] for setting in measured}
        _pareto_panel(axes, tradeoff, errors, shades, marks)
        axes.set_title(_TITLES.get(name, comparison.quantity.label))
    for axes in panels[-3:]:
        axes.set_xlabel("cost / reference cost")
        axes.tick_params(labelbottom=True)
    for axes in panels[::3]:
        axes.set_ylabel("absolute error (%)")
    panels[0].set_ylim(bottom=0.8 * FLOOR)
    drawn = {setting.youngs_modulus_scale for setting in settings}
    _pareto_keys(panels[0], {level: shades[level] for level in shades if level in drawn}, marks)
    return legend_below(figure)


def _pareto_panel(
    axes: Axes,
    tradeoff: Tradeoff,
    errors: Mapping[Setting, ErrorEntry],
    shades: Mapping[float, Any],
    marks: Mapping[float, str],
) -> None:
    axes.set(xscale="log", yscale="log")
    log_ticks(axes.xaxis, steps=(1.0, 2.0, 5.0))
    log_ticks(axes.yaxis, 100.0)
    for tolerance in TOLERANCES:
        axes.axhline(tolerance, color=LIGHT, lw=0.8, ls="--", zorder=0)
    axes.margins(x=0.12)
    bounds = []
    for setting, error in errors.items():
        cost, shade = tradeoff.cost(setting), shades[setting.youngs_modulus_scale]
        low, size, high, bound = _sizes(error)
        inside = shade if error.significant else "white"
        mark = marks[setting.timestep_fraction]
        axes.plot([cost, cost], [low, high], color=shade, lw=1.1, alpha=0.75)
        axes.plot(cost, size, mark, color=shade, mfc=inside, ms=5.5)
        axes.plot(cost, bound, "_", color=INK, ms=7)
        if setting.speed_factor != tradeoff.reference.speed_factor:
            words, above = f"v x {setting.speed_factor:g}", (cost, 1.06 * bound)
            axes.text(*above, words, fontsize=6.5, ha="center", va="bottom")
        bounds.append((cost, bound))
    front = np.array(list(_front(bounds))).reshape(-1, 2)
    axes.step(*front.T, where="post", color=INK, lw=0.9, alpha=0.7, zorder=1)


def _sizes(error: ErrorEntry) -> Floats:
    """Lower end, value, upper end and bound of the error's size, not below `FLOOR`, (4,)."""
    low, high = sorted((abs(error.ci95_low), abs(error.ci95_high)))
    low = low if error.significant else FLOOR
    return np.maximum([low, abs(error.value), high, error.bound], FLOOR)


def _front(points: Sequence[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    """The points that no other undercuts in cost and bound, the cheapest first."""
    lowest = np.inf
    for cost, bound in sorted(points):
        if bound < lowest:
            lowest = bound
            yield cost, bound


def _pareto_keys(axes: Axes, shades: Mapping[float, Any], marks: Mapping[float, str]) -> None:
    for level, shade in shades.items():
        key(axes, f"E x {level:g}", color=shade)
    for step, mark in marks.items():
        key(axes, f"step {100 * step:g} % of Rayleigh", marker=mark)
    key(axes, "not significant", mfc="white")
    key(axes, "upper bound (95 %)", marker="_", color=INK, ms=8)
    key(axes, "Pareto front", marker="", ls="-", color=INK, lw=0.9)
