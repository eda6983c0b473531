"""The figures of the report on a trade-off."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import cycle
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.arrays import Floats
from dragchain.figures.panels import key, legend_below, log_ticks, new_panels
from dragchain.figures.style import BLUE, INK, LIGHT, MARKERS, SERIES, WIDE_IN
from dragchain.tradeoff.changes import differing, hub, modulus_levels
from dragchain.tradeoff.compare import Error, PlanRun, Setting
from dragchain.tradeoff.drops import ComparedDrop
from dragchain.tradeoff.measure_run import FORCE_BINS
from dragchain.tradeoff.measures import MAIN
from dragchain.tradeoff.outcome import TOLERANCES, Tradeoff
from dragchain.tradeoff.path_length import Reach

FLOOR = 1e-3
"""Errors below this are drawn here."""

_LEAST_FRACTION = 1e-4
_TITLES = {
    "drag_std": "standard deviation of drag",
    "contact_force_mean": "mean contact force on the workpiece",
    "contact_force_p90": "90th percentile of contact forces",
}
"""Of panels and lines, where the label leans on the one before or is too long."""

_SHOWN_REACHES = (
    *("drag_mean", "drag_std", "workpiece_contacts", "contact_force_mean", "contact_force_p90"),
    *("coordination_number", "chain_count", "path_bottleneck"),
)


def draw_tradeoff(
    tradeoff: Tradeoff, reaches: Sequence[Reach], drops: Sequence[ComparedDrop]
) -> dict[str, Figure]:
    """All figures by name."""
    drawn: dict[str, Figure] = {}
    if any(name in tradeoff.comparisons for name in MAIN):
        drawn["pareto"] = _pareto(tradeoff)
    if runs := _force_runs(tradeoff):
        drawn["contact_forces"] = _forces(runs)
    if reaches:
        drawn["path"] = _path(reaches)
    if own := [drop for drop in drops[1:] if not drop.other]:
        drawn["drop_test"] = _drop(own)
    return drawn


def _colours(levels: Iterable[float]) -> dict[float, Any]:
    """A colour a modulus, dark for stiff and light for soft."""
    ordered = sorted(set(levels), reverse=True)
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.92, max(len(ordered), 2)))
    return dict(zip(ordered, shades, strict=False))


def _log_log(axes: Axes, **options: Any) -> None:
    """Logarithmic axes in plain numbers, the vertical one in percent."""
    axes.set(xscale="log", yscale="log", **options)
    log_ticks(axes.xaxis, steps=(1.0, 2.0, 5.0))
    log_ticks(axes.yaxis, 100.0)


def _tolerances(axes: Axes) -> None:
    for tolerance in TOLERANCES:
        axes.axhline(tolerance, color=LIGHT, lw=0.8, ls="--", zorder=0)


# --- Pareto fronts -------------------------------------------------------------------------------


def _pareto(tradeoff: Tradeoff) -> Figure:
    names = [name for name in MAIN if name in tradeoff.comparisons]
    settings = [one for one in tradeoff.settings() if not one.other and one != tradeoff.reference]
    shades = _colours(one.youngs_modulus_scale for one in tradeoff.settings())
    marks = dict(
        zip(sorted({one.timestep_fraction for one in settings}), cycle(MARKERS), strict=False)
    )
    height = 2.6 * -(-len(names) // 3) + 0.9
    figure, panels = new_panels(height, len(names), WIDE_IN, 3, sharex=True, sharey=True)
    for axes, name in zip(panels, names, strict=True):
        comparison = tradeoff.comparisons[name]
        errors = {one: comparison.errors[one] for one in settings if one in comparison.errors}
        _pareto_panel(axes, tradeoff, errors, shades, marks)
        axes.set_title(_TITLES.get(name, comparison.quantity.label))
    for axes in panels[-3:]:
        axes.set_xlabel("cost / reference cost")
        axes.tick_params(labelbottom=True)
    for axes in panels[::3]:
        axes.set_ylabel("absolute error (%)")
    panels[0].set_ylim(bottom=0.8 * FLOOR)
    own = {one.youngs_modulus_scale for one in settings}
    _pareto_keys(panels[0], {level: shades[level] for level in shades if level in own}, marks)
    return legend_below(figure)


def _pareto_panel(
    axes: Axes,
    tradeoff: Tradeoff,
    errors: Mapping[Setting, Error],
    shades: Mapping[float, Any],
    marks: Mapping[float, str],
) -> None:
    _log_log(axes)
    _tolerances(axes)
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


def _sizes(error: Error) -> Floats:
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


# --- contact forces ------------------------------------------------------------------------------


def exceedance(counts: Sequence[int]) -> tuple[Floats, Floats, float]:
    """Share of contacts with a force above each bin's lower edge.

    Parameters
    ----------
    counts : (70,) array_like
        Contacts between `FORCE_BINS`.

    Returns
    -------
    force : (70,) ndarray
        Lower edges, N.
    share : (70,) ndarray
    mean : float
        Mean force, N, each contact at the geometric middle of its bin.
    """
    number = np.asarray(counts, dtype=np.float64)
    fraction = np.cumsum(number[::-1])[::-1] / number.sum()
    middle = np.sqrt(FORCE_BINS[:-1] * FORCE_BINS[1:])
    return FORCE_BINS[:-1], fraction, float(number @ middle / number.sum())


def _force_runs(tradeoff: Tradeoff) -> dict[float, list[PlanRun]]:
    """Runs whose contact forces are shown, for each modulus: all else as alike as was run."""
    found: dict[float, list[PlanRun]] = {}
    for level in (tradeoff.reference.youngs_modulus_scale, *modulus_levels(tradeoff)):
        centre = replace(hub(tradeoff), youngs_modulus_scale=level)
        settings = [one for one in tradeoff.settings() if not one.other]
        own = [one for one in settings if one.youngs_modulus_scale == level]
        for setting in sorted(own, key=lambda one: len(differing(one, centre))):
            runs = [run for run in tradeoff.of(setting) if run.complete]
            runs = [run for run in runs if sum(run.measures.force_histogram) > 0]
            if runs:
                found.setdefault(level, runs)
    return found


def _forces(shown: Mapping[float, Sequence[PlanRun]]) -> Figure:
    shades = _colours(shown)
    figure, panels = new_panels(3.9, 2, WIDE_IN, sharey=True)
    for level, runs in shown.items():
        counts = [run.measures.force_histogram for run in runs]
        for own in counts:
            _exceedance(panels, own, color=shades[level], lw=0.6, alpha=0.8)
        pooled = np.sum(counts, axis=0).tolist()
        _exceedance(panels, pooled, color=shades[level], lw=1.7, label=f"{runs[0].setting}")
    left, right = panels
    left.set(xscale="log", yscale="log", ylabel="fraction of contacts above", title="absolute")
    left.set(xlabel="normal force of a contact on the workpiece (N)", xlim=(1e-3, None))
    right.set(xlabel="normal force / mean normal force", title="relative to the mean")
    right.set(xscale="log", xlim=(1e-2, None), ylim=(_LEAST_FRACTION, 1.3))
    return legend_below(figure)


def _exceedance(panels: Sequence[Axes], counts: Sequence[int], **style: Any) -> None:
    """Draw the forces of one or more runs in newtons and over their mean."""
    force, fraction, mean = exceedance(counts)
    there = fraction >= _LEAST_FRACTION
    for axes, unit in zip(panels, (1.0, mean), strict=True):
        axes.plot(force[there] / unit, fraction[there], **style)


# --- path and drop -------------------------------------------------------------------------------


def _path(reaches: Sequence[Reach]) -> Figure:
    figure, (axes,) = new_panels(3.6, width_in=WIDE_IN)
    arc = reaches[0].arc_m
    paths: Floats = np.geomspace(arc / 4.0, arc * 16.0, 50)
    shown = [reach for reach in reaches if reach.quantity.name in _SHOWN_REACHES]
    shown.sort(key=lambda one: -one.halfwidth)
    for reach, line, shade in zip(
        shown, cycle(("-", "--", ":", "-.")), cycle(SERIES), strict=False
    ):
        label = _TITLES.get(reach.quantity.name, reach.quantity.label)
        halfwidth = [reach.at(float(path)) for path in paths]
        axes.plot(1e3 * paths, halfwidth, line, color=shade, label=label)
    _tolerances(axes)
    axes.axvline(1e3 * arc, color=INK, lw=0.8, ls=":")
    _log_log(axes, xlabel="path length of one run (mm); dotted: length compared here")
    axes.set_ylabel("half-width of the 95 % CI (%)")
    figure.legend(loc="outside right center")
    return figure


def _drop(drops: Sequence[ComparedDrop]) -> Figure:
    figure, (axes,) = new_panels(2.6, width_in=WIDE_IN)
    step = [100.0 * drop.timestep_fraction for drop in drops]
    mean, largest = np.maximum([(abs(drop.error), drop.bound) for drop in drops], 1e-6).T
    axes.plot(step, mean, "o-", color=BLUE, label="mean")
    axes.plot(step, largest, "_--", color=INK, label="largest error")
    _log_log(axes, xlabel="time step (% of Rayleigh time)", ylabel="error of restitution (%)")
    axes.legend()
    return figure
