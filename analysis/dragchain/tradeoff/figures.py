"""The figures of the report on a trade."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import cycle

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from dragchain.arrays import Floats
from dragchain.figures.style import BLUE, GREY, ORANGE, RED, WIDTH_IN
from dragchain.tradeoff.changes import differing, hub, modulus_levels
from dragchain.tradeoff.compare import Comparison, Error
from dragchain.tradeoff.drops import Drop
from dragchain.tradeoff.outcome import TOLERANCES, Tradeoff
from dragchain.tradeoff.path_blocks import FORCE_BINS
from dragchain.tradeoff.path_length import Reach
from dragchain.tradeoff.quantities import MAIN
from dragchain.tradeoff.runs import Run, Setting

FLOOR = 1e-3
"""Errors below this are drawn here."""

_INK = "#1d2733"
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*", "<", "p", ">", "d")
_COLUMNS = 3
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


def draw(tradeoff: Tradeoff, reaches: Sequence[Reach], drops: Sequence[Drop]) -> dict[str, Figure]:
    """All figures by name."""
    drawn: dict[str, Figure] = {}
    if any(name in tradeoff.comparisons for name in MAIN):
        drawn["pareto"] = _pareto(tradeoff)
    if _force_runs(tradeoff):
        drawn["contact_forces"] = _forces(tradeoff)
    if reaches:
        drawn["path"] = _path(reaches)
    if any(not drop.other for drop in drops[1:]):
        drawn["drop_test"] = _drop(drops)
    return drawn


def _colours(levels: Sequence[float]) -> dict[float, str]:
    """A colour a modulus, dark for stiff and light for soft."""
    shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.92, max(len(levels), 2)))
    ordered = sorted(levels, reverse=True)
    return {
        level: matplotlib.colors.to_hex(shade)
        for level, shade in zip(ordered, shades, strict=False)
    }


def _percents(axis_value: float, _: object = None) -> str:
    return f"{100.0 * axis_value:g}"


def _percent_axis(axes: Axes) -> None:
    axes.yaxis.set_major_formatter(FuncFormatter(_percents))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.yaxis.set_major_locator(LogLocator(10.0, numticks=12))


def _plain_axis(axes: Axes) -> None:
    axes.xaxis.set_major_locator(LogLocator(10.0, subs=(1.0, 2.0, 5.0), numticks=12))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())


# --- Pareto fronts -------------------------------------------------------------------------------


def _fidelity_settings(tradeoff: Tradeoff) -> list[Setting]:
    return [one for one in tradeoff.settings() if not one.other and one != tradeoff.reference]


def _pareto(tradeoff: Tradeoff) -> Figure:
    names = [name for name in MAIN if name in tradeoff.comparisons]
    settings = _fidelity_settings(tradeoff)
    colours = _colours([one.youngs_modulus_scale for one in tradeoff.settings()])
    steps = sorted({one.timestep_fraction for one in settings})
    markers = dict(zip(steps, cycle(_MARKERS), strict=False))
    rows = math.ceil(len(names) / _COLUMNS)
    figure = Figure(figsize=(1.25 * WIDTH_IN, 2.6 * rows + 0.9), layout="constrained")
    panels = figure.subplots(rows, _COLUMNS, sharex=True, sharey=True, squeeze=False)
    for axes, name in zip(panels.flat, names, strict=False):
        _pareto_panel(axes, tradeoff, tradeoff.comparisons[name], settings, colours, markers)
    for axes in panels.flat[len(names) :]:
        axes.set_visible(False)
    for number, axes in enumerate(panels.flat[: len(names)]):
        if number + _COLUMNS >= len(names):
            axes.set_xlabel("cost / reference cost")
            axes.tick_params(labelbottom=True)
        if number % _COLUMNS == 0:
            axes.set_ylabel("absolute error (%)")
    _shared_limits(panels.flat[0], tradeoff, settings, names)
    own = {one.youngs_modulus_scale for one in settings}
    _pareto_legend(figure, {level: c for level, c in colours.items() if level in own}, markers)
    return figure


def _pareto_panel(
    axes: Axes,
    tradeoff: Tradeoff,
    comparison: Comparison,
    settings: Sequence[Setting],
    colours: dict[float, str],
    markers: dict[float, str],
) -> None:
    axes.set(xscale="log", yscale="log")
    for tolerance in TOLERANCES:
        axes.axhline(tolerance, color="#c8ced6", lw=0.8, ls="--", zorder=0)
    points = [(one, comparison.errors[one]) for one in settings if one in comparison.errors]
    for setting, error in points:
        cost, colour = tradeoff.cost(setting), colours[setting.youngs_modulus_scale]
        low, high = _sizes(error)
        axes.plot([cost, cost], [low, high], color=colour, lw=1.1, alpha=0.75)
        axes.plot(
            cost,
            max(abs(error.value), FLOOR),
            markers[setting.timestep_fraction],
            color=colour,
            markerfacecolor=colour if error.significant else "white",
            markersize=5.5,
        )
        axes.plot(cost, max(error.bound, FLOOR), "_", color=_INK, markersize=7)
        if setting.speed_factor != tradeoff.reference.speed_factor:
            axes.annotate(
                f"v x {setting.speed_factor:g}",
                (cost, max(error.bound, FLOOR)),
                xytext=(0, 3),
                textcoords="offset points",
                fontsize=6.5,
                ha="center",
            )
    front = list(_front([(tradeoff.cost(one), max(e.bound, FLOOR)) for one, e in points]))
    if front:
        axes.step(*zip(*front, strict=True), where="post", color=_INK, lw=0.9, alpha=0.7, zorder=1)
    axes.set_title(_TITLES.get(comparison.quantity.name, comparison.quantity.label))
    _percent_axis(axes)


def _shared_limits(
    axes: Axes, tradeoff: Tradeoff, settings: Sequence[Setting], names: Sequence[str]
) -> None:
    errors = [
        tradeoff.comparisons[name].errors[one]
        for name in names
        for one in settings
        if one in tradeoff.comparisons[name].errors
    ]
    highest = max((_sizes(error)[1] for error in errors), default=1.0)
    axes.set_ylim(FLOOR * 0.8, 1.4 * max(highest, TOLERANCES[-1]))
    costs = [tradeoff.cost(one) for one in settings] or [1.0]
    axes.set_xlim(0.8 * min(costs), 1.25 * max(costs))
    _plain_axis(axes)


def _sizes(error: Error) -> tuple[float, float]:
    """The interval of the error's size, not below `FLOOR`."""
    high = max(abs(error.ci95_low), abs(error.ci95_high), FLOOR)
    low = min(abs(error.ci95_low), abs(error.ci95_high)) if error.significant else FLOOR
    return max(low, FLOOR), high


def _front(points: Sequence[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    """The points that no other undercuts in cost and bound, the cheapest first."""
    lowest = math.inf
    for cost, bound in sorted(points):
        if bound < lowest:
            lowest = bound
            yield cost, bound


def _pareto_legend(figure: Figure, colours: dict[float, str], markers: dict[float, str]) -> None:
    handles = [
        Line2D([], [], ls="", marker="o", color=colour, label=f"E x {level:g}")
        for level, colour in colours.items()
    ]
    handles += [
        Line2D([], [], ls="", marker=marker, color=GREY, label=f"step {100 * step:g} % of Rayleigh")
        for step, marker in markers.items()
    ]
    handles += [
        Line2D(
            [], [], ls="", marker="o", color=GREY, markerfacecolor="white", label="not significant"
        ),
        Line2D([], [], ls="", marker="_", color=_INK, markersize=8, label="upper bound (95 %)"),
        Line2D([], [], color=_INK, lw=0.9, label="Pareto front"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=5, fontsize=8)


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


def _force_runs(tradeoff: Tradeoff) -> dict[float, list[Run]]:
    """Runs whose contact forces are shown, for each modulus: all else as alike as was run."""
    found: dict[float, list[Run]] = {}
    levels = [tradeoff.reference.youngs_modulus_scale, *modulus_levels(tradeoff)]
    for level in levels:
        own = [
            setting
            for setting in tradeoff.settings()
            if setting.youngs_modulus_scale == level
            and not setting.other
            and any(map(_has_histogram, tradeoff.of(setting)))
        ]
        if own:
            centre = replace(hub(tradeoff), youngs_modulus_scale=level)
            chosen = min(own, key=lambda one: len(differing(one, centre)))
            found[level] = [run for run in tradeoff.of(chosen) if _has_histogram(run)]
    return found


def _has_histogram(run: Run) -> bool:
    return run.complete and sum(run.measures.force_histogram) > 0


def _forces(tradeoff: Tradeoff) -> Figure:
    shown = _force_runs(tradeoff)
    colours = _colours(list(shown))
    figure = Figure(figsize=(1.25 * WIDTH_IN, 3.9), layout="constrained")
    raw, scaled = figure.subplots(1, 2, sharey=True)
    for level, runs in shown.items():
        counts = [run.measures.force_histogram for run in runs]
        for own in counts:
            _exceedance(raw, scaled, own, color=colours[level], lw=0.6, alpha=0.8)
        pooled = np.sum(counts, axis=0).tolist()
        _exceedance(raw, scaled, pooled, color=colours[level], lw=1.7, label=f"{runs[0].setting}")
    raw.set(
        xlabel="normal force of a contact on the workpiece (N)", ylabel="fraction of contacts above"
    )
    scaled.set(xlabel="normal force / mean normal force")
    raw.set_title("absolute")
    scaled.set_title("relative to the mean")
    for axes in (raw, scaled):
        axes.set(xscale="log", yscale="log", ylim=(1e-4, 1.3))
    _limit(raw, shown_forces=1e-3)
    _limit(scaled, shown_forces=1e-2)
    handles, labels = raw.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, fontsize=8)
    return figure


def _exceedance(
    raw: Axes, scaled: Axes, counts: Sequence[int], *, label: str = "", **style: object
) -> None:
    force, fraction, mean = exceedance(counts)
    there = fraction > 0.0
    for axes, unit in ((raw, 1.0), (scaled, mean)):
        axes.plot(force[there] / unit, fraction[there], label=label, **style)  # type: ignore[arg-type]


def _limit(axes: Axes, shown_forces: float) -> None:
    axes.set_xlim(shown_forces, _largest_above(axes))


def _largest_above(axes: Axes) -> float:
    """The force at which the farthest line leaves the picture at its lower edge."""
    low = axes.get_ylim()[0]
    ends: list[float] = []
    for line in axes.get_lines():
        x, y = (np.asarray(values, dtype=np.float64) for values in line.get_data())
        ends.append(float(x[y >= low].max()))
    return 1.3 * max(ends)


# --- path ----------------------------------------------------------------------------------------


def _path(reaches: Sequence[Reach]) -> Figure:
    figure = Figure(figsize=(1.25 * WIDTH_IN, 3.6), layout="constrained")
    axes = figure.subplots()
    arc = reaches[0].arc_m
    paths: Floats = np.geomspace(arc / 4.0, arc * 16.0, 50)
    shown = [reach for reach in reaches if reach.quantity.name in _SHOWN_REACHES]
    styles = cycle(("-", "--", ":"))
    shades = cycle((BLUE, ORANGE, RED, "#009E73", "#CC79A7", "#56B4E9", _INK, GREY))
    for reach in sorted(shown, key=lambda one: -one.halfwidth):
        label = _TITLES.get(reach.quantity.name, reach.quantity.label)
        halfwidth = [reach.at(float(path)) for path in paths]
        axes.plot(1e3 * paths, halfwidth, next(styles), color=next(shades), label=label)
    for tolerance in TOLERANCES:
        axes.axhline(tolerance, color="#c8ced6", lw=0.8, ls="--", zorder=0)
    axes.axvline(1e3 * arc, color=_INK, lw=0.8, ls=":")
    axes.set(xscale="log", yscale="log")
    axes.set_xlabel("path length of one run (mm); dotted: length compared here")
    axes.set_ylabel("half-width of the 95 % CI (%)")
    _percent_axis(axes)
    _plain_axis(axes)
    figure.legend(loc="outside right center", fontsize=8)
    return figure


# --- drop ----------------------------------------------------------------------------------------


def _drop(drops: Sequence[Drop]) -> Figure:
    figure = Figure(figsize=(1.25 * WIDTH_IN, 2.6), layout="constrained")
    axes = figure.subplots()
    own = [drop for drop in drops[1:] if not drop.other]
    step = [100.0 * drop.timestep_fraction for drop in own]
    axes.plot(step, [max(abs(drop.error), 1e-6) for drop in own], "o-", color=BLUE, label="mean")
    axes.plot(
        step, [max(drop.bound, 1e-6) for drop in own], "_--", color=_INK, label="largest error"
    )
    axes.set(xscale="log", yscale="log", ylabel="error of restitution (%)")
    axes.set_xlabel("time step (% of Rayleigh time)")
    _percent_axis(axes)
    _plain_axis(axes)
    axes.legend()
    return figure
