"""The figures of a validation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.drag.force import read_counted
from dragchain.drag.peaks import find_drag_peaks, peak_separation_s
from dragchain.figures.bars import bars_of, depth_bars
from dragchain.figures.style import BLUE, GREEN, GREY, ORANGE, RED, legend_below, new_figure
from dragchain.run.kinematics import drag_start_s
from dragchain.statistics.estimate import Estimate
from dragchain.validation.around_workpiece import Statements
from dragchain.validation.corridor import Network
from dragchain.validation.effects import Effect
from dragchain.validation.force import Compared, Force, Spectrum
from dragchain.validation.runs_by_bed import Point

_COLOURS = {"experiment": GREEN, "simulation": ORANGE}


def traces(packings: Sequence[Point], compared: Sequence[Compared]) -> Figure:
    """The drag of every packing over process time, its peaks marked, over the source's band."""
    figure = new_figure(0.7 + 1.35 * len(packings))
    panels = np.atleast_1d(figure.subplots(len(packings), 1, sharex=True, sharey=True))
    for axes, point in zip(panels, packings, strict=True):
        samples = read_counted(point.folder, ("time_s", "drag_n"))
        time_s = samples["time_s"].to_numpy(np.float64)
        drag = samples["drag_n"].to_numpy(np.float64)
        peaks = find_drag_peaks(time_s, drag, min_separation_s=peak_separation_s(point.case))
        zero = drag_start_s(point.case)
        _bands(axes, compared)
        axes.plot(time_s - zero, drag, color=BLUE, linewidth=0.5)
        axes.plot(peaks.time_s - zero, peaks.drag_n, "v", color=RED, markersize=3.5, label="peak")
        axes.axhline(float(drag.mean()), color="black", linewidth=1.0, label="mean of the packing")
        axes.set_title(
            f"packing {point.seed}: {drag.mean():.2f} ± {drag.std(ddof=1):.2f} N, "
            f"{len(peaks.index)} peaks"
        )
        axes.set_ylabel("drag force (N)")
    panels[-1].set(xlabel="process time (s)")
    legend_below(figure, panels[0], columns=4)
    return figure


def _bands(axes: Axes, compared: Sequence[Compared]) -> None:
    for row in compared:
        colour = _COLOURS[row.label]
        axes.axhline(row.mean_n, color=colour, linestyle="--", label=f"{row.label} mean")
        if row.std_n and row.label == "experiment":
            low, high = row.mean_n - row.std_n, row.mean_n + row.std_n
            label = "experiment, ± one standard deviation"
            axes.axhspan(low, high, color=colour, alpha=0.12, linewidth=0, label=label)


_Row = tuple[str, Estimate, str]
"""Name, value and colour of a row of `_rows`."""


def comparison(force: Force, compared: Sequence[Compared], effects: Sequence[Effect]) -> Figure:
    """Mean drags: the source's, each packing's with its own interval, and all together."""
    together = force.together["drag_n"].mean
    rows: list[_Row] = [
        (row.label, Estimate.around(row.mean_n, 0.0), _COLOURS[row.label]) for row in compared
    ]
    for packing in force.packings:
        own = packing.drag_n
        estimate = Estimate(own.mean, own.ci95_low, own.ci95_high)
        rows.append((f"packing {packing.seed}", estimate, BLUE))
    rows.append(("all packings", together, "black"))
    for one in effects:
        if one.quantity == "drag_mean" and not one.field:
            changes = (one.change, one.ci95_low, one.ci95_high)
            changed = Estimate(*(together.value * (1.0 + change) for change in changes))
            rows.append((_fidelity(one), changed, GREY))
    return _rows(rows, "mean drag (N); bars: 95 % CI")


def _fidelity(row: Effect) -> str:
    name = f"E x {row.youngs_modulus_scale:g}, {100 * row.timestep_fraction:g} %"
    return name if row.speed_factor == 1.0 else f"{name}, speed x {row.speed_factor:g}"


def assumed(effects: Sequence[Effect]) -> Figure:
    """What each assumed input does to the mean drag."""
    rows: list[_Row] = []
    for one in effects:
        if one.quantity == "drag_mean" and one.field:
            name = f"{one.field} = {_value(one.value)} (assumed: {_value(one.reference_value)})"
            change = Estimate(100 * one.change, 100 * one.ci95_low, 100 * one.ci95_high)
            rows.append((name, change, BLUE))
    figure = _rows(rows, "change of the mean drag (%); bars: 95 % CI")
    figure.axes[0].axvline(0.0, color="black", linewidth=0.8)
    return figure


def _value(value: object) -> str:
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def _rows(rows: Sequence[_Row], label: str) -> Figure:
    """Values with their intervals, one below the other."""
    figure = new_figure(0.9 + 0.27 * len(rows))
    axes = figure.subplots()
    for place, (_, one, colour) in enumerate(rows):
        span = [one.ci95_low, one.ci95_high]
        axes.plot(span, [place, place], color=colour, linewidth=2.0, alpha=0.6)
        axes.plot(one.value, place, "o", color=colour, markersize=5)
    axes.set_yticks(range(len(rows)), [name for name, *_ in rows])
    axes.invert_yaxis()
    axes.set(xlabel=label)
    return figure


def spectrum(found: Spectrum) -> Figure:
    """Power spectrum of the drag along the path."""
    figure = new_figure(3.2)
    axes = figure.subplots()
    waves, density, half = found.waves_per_diameter, found.density, found.half_wave.value
    axes.fill_between(
        waves, density.ci95_low, density.ci95_high, color=BLUE, alpha=0.2, linewidth=0
    )
    axes.loglog(waves, density.mean, color=BLUE, label="mean over packings; band: their range")
    label = f"half of the variance to the left (wavelength > {half:.1f} particle diameters)"
    axes.axvline(1.0 / half, color=RED, linestyle="--", label=label)
    axes.set(
        xlabel="wavenumber (1 / particle diameter)", ylabel="power density (N² particle diameters)"
    )
    axes.legend(loc="upper right")
    return figure


def around(found: Statements) -> Figure:
    """Normal force on the workpiece by azimuth, and that of a contact by depth."""
    figure = new_figure(3.9)
    left: Any = figure.add_subplot(1, 2, 1, projection="polar")
    right = figure.add_subplot(1, 2, 2)
    edges = np.array(found.azimuth.edges)
    middle, bars = (edges[1:] + edges[:-1]) / 2, bars_of(found.azimuth.columns, 100.0)
    colours = np.where(np.abs(middle) < np.pi / 2, BLUE, ORANGE)
    left.set_theta_zero_location("N")
    left.bar(middle, bars.value, width=np.diff(edges), color=colours, edgecolor="white")
    reach = [np.minimum(bars.below, bars.value), bars.above]
    left.errorbar(middle, bars.value, reach, fmt="none", ecolor="black", elinewidth=0.8)
    left.set_thetagrids(np.arange(0, 360, 45), ["ahead", "", "left", "", "behind", "", "right", ""])
    left.set_rlabel_position(157.5)
    left.set_rmin(0.0)
    left.set_title(f"normal force\n(% per {np.degrees(edges[1] - edges[0]):.0f}°)")
    depth_bars(right, found.depth.edges, bars_of(found.depth.columns), BLUE)
    right.invert_yaxis()
    right.set(xlabel="mean normal force per contact (N)", ylabel="depth (mm)")
    right.set_title("bars: 95 % CI over packings")
    return figure


def corridor(network: Network) -> Figure:
    """Mean contact force of the network ahead of the workpiece and behind it."""
    figure = new_figure(3.2)
    axes = figure.subplots()
    edges = np.array(network.edges_diameters)
    middle = (edges[1:] + edges[:-1]) / 2
    sides = (("ahead", network.ahead_n, BLUE), ("behind", network.behind_n, ORANGE))
    for name, side, colour in sides:
        axes.fill_between(
            middle, side.ci95_low, side.ci95_high, color=colour, alpha=0.2, linewidth=0
        )
        axes.plot(middle, side.value, "o-", color=colour, markersize=4, label=name)
    far = network.far_n.value
    axes.axhline(far, color="black", linestyle="--", label="far field")
    wall = network.wall_diameters
    axes.axvline(wall, color=GREY, linewidth=2.0)
    axes.text(wall, 0.0, " bowl wall", color=GREY, va="bottom")
    axes.set(xlabel="distance from the workpiece's surface (particle diameters)", ylim=(0, None),
             ylabel="mean normal force\nper contact (N)", xlim=(0, wall + 0.5))  # fmt: skip
    axes.legend()
    return figure
