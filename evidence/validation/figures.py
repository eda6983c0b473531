"""The figures of a validation."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.drag.force import read_counted
from dragchain.drag.peaks import drag_peaks
from dragchain.figures.panels import (
    band,
    compass,
    compass_bars,
    depth_bars,
    legend_below,
    new_figure,
    new_panels,
    row,
    row_names,
)
from dragchain.figures.style import BLUE, COLOURS, GREY, RED
from dragchain.run.kinematics import drag_start_s
from dragchain.statistics.estimate import Estimate
from evidence.validation.around_workpiece import Statements
from evidence.validation.corridor import Network
from evidence.validation.effects import Effect
from evidence.validation.force import Compared, Force, Spectrum
from evidence.validation.runs_by_bed import Point


def traces(packings: Sequence[Point], compared: Sequence[Compared]) -> Figure:
    """The drag of every packing over process time, its peaks marked, over the source's band."""
    height = 0.7 + 1.35 * len(packings)
    figure, panels = new_panels(height, len(packings), columns=1, sharex=True, sharey=True)
    for axes, point in zip(panels, packings, strict=True):
        _bands(axes, compared)
        _trace(axes, point)
        axes.set_ylabel("drag force (N)")
    panels[-1].set_xlabel("process time (s)")
    return legend_below(figure)


def _trace(axes: Axes, point: Point) -> None:
    samples = read_counted(point.folder, ("time_s", "drag_n"))
    time_s, drag = samples["time_s"].to_numpy(np.float64), samples["drag_n"].to_numpy(np.float64)
    peaks = drag_peaks(samples, point.case)
    zero = drag_start_s(point.case)
    axes.plot(time_s - zero, drag, color=COLOURS["drag"], linewidth=0.5)
    axes.plot(peaks.time_s - zero, peaks.drag_n, "v", color=COLOURS["peak"], label="peak")
    axes.axhline(float(drag.mean()), color="black", linewidth=1.0, label="mean of the packing")
    force = f"{drag.mean():.2f} ± {drag.std(ddof=1):.2f} N"
    axes.set_title(f"packing {point.seed}: {force}, {len(peaks.index)} peaks")


def _bands(axes: Axes, compared: Sequence[Compared]) -> None:
    for one in compared:
        colour = COLOURS[one.label]
        axes.axhline(one.mean_n, color=colour, linestyle="--", label=f"{one.label} mean")
        if one.std_n and one.label == "experiment":
            low, high = one.mean_n - one.std_n, one.mean_n + one.std_n
            label = "experiment, ± one standard deviation"
            axes.axhspan(low, high, color=colour, alpha=0.12, linewidth=0, label=label)


_Row = tuple[str, Estimate, str]
"""Name, value and colour of a row of `_rows`."""


def comparison(force: Force, compared: Sequence[Compared], effects: Sequence[Effect]) -> Figure:
    """Mean drags: the source's, each packing's with its own interval, and all together."""
    together = force.together["drag_n"].mean
    rows: list[_Row] = [
        (one.label, Estimate.around(one.mean_n, 0.0), COLOURS[one.label]) for one in compared
    ]
    for packing in force.packings:
        own = packing.drag_n
        estimate = Estimate(own.mean, own.ci95_low, own.ci95_high)
        rows.append((f"packing {packing.seed}", estimate, BLUE))
    rows.append(("all packings", together, "black"))
    for one in effects:
        if one.quantity == "drag_mean" and not one.field:
            changed = _change(one).mapped(lambda change: together.value * (1.0 + change))
            rows.append((_fidelity(one), changed, GREY))
    return _rows(rows, "mean drag (N); bars: 95 % CI")


def _change(effect: Effect) -> Estimate:
    return Estimate(effect.change, effect.ci95_low, effect.ci95_high)


def _fidelity(effect: Effect) -> str:
    name = f"E x {effect.youngs_modulus_scale:g}, {100 * effect.timestep_fraction:g} %"
    return name if effect.speed_factor == 1.0 else f"{name}, speed x {effect.speed_factor:g}"


def assumed(effects: Sequence[Effect]) -> Figure:
    """What each assumed input does to the mean drag."""
    rows: list[_Row] = []
    for one in effects:
        if one.quantity == "drag_mean" and one.field:
            name = f"{one.field} = {_value(one.value)} (assumed: {_value(one.reference_value)})"
            rows.append((name, _change(one).over(0.01), BLUE))
    figure = _rows(rows, "change of the mean drag (%); bars: 95 % CI")
    figure.axes[0].axvline(0.0, color="black", linewidth=0.8)
    return figure


def _value(value: object) -> str:
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def _rows(rows: Sequence[_Row], label: str) -> Figure:
    """Values with their intervals, one below the other."""
    figure, (axes,) = new_panels(0.9 + 0.27 * len(rows))
    for place, (_, one, colour) in enumerate(rows):
        row(axes, place, one.value, one, colour)
    row_names(axes, [name for name, *_ in rows])
    axes.set(xlabel=label)
    return figure


def spectrum(found: Spectrum) -> Figure:
    """Power spectrum of the drag along the path."""
    figure, (axes,) = new_panels(3.2)
    waves, density, half = found.waves_per_diameter, found.density, found.half_wave.value
    band(axes, waves, density, BLUE)
    axes.loglog(waves, density.mean, color=BLUE, label="mean over packings; band: their range")
    label = f"half of the variance to the left (wavelength > {half:.1f} particle diameters)"
    axes.axvline(1.0 / half, color=RED, linestyle="--", label=label)
    axes.set_xlabel("wavenumber (1 / particle diameter)")
    axes.set_ylabel("power density (N² particle diameters)")
    axes.legend(loc="upper right")
    return figure


def around(found: Statements) -> Figure:
    """Normal force on the workpiece by azimuth, and that of a contact by depth."""
    figure = new_figure(3.9)
    left, right = compass(figure, 1, 2, 1), figure.add_subplot(1, 2, 2)
    edges = found.azimuth.edges
    compass_bars(left, edges, found.azimuth.columns, 100.0, "%")
    depth_bars(right, found.depth.edges, found.depth.columns)
    right.set(xlabel="mean normal force per contact (N)", ylabel="depth (mm)")
    right.set_title("bars: 95 % CI over packings")
    return figure


def corridor(network: Network) -> Figure:
    """Mean contact force of the network ahead of the workpiece and behind it."""
    figure, (axes,) = new_panels(3.2)
    edges = np.array(network.edges_diameters)
    middle = (edges[1:] + edges[:-1]) / 2
    sides = (("ahead", network.ahead_n), ("behind", network.behind_n))
    for name, side in sides:
        colour = COLOURS[name]
        band(axes, middle, side, colour)
        axes.plot(middle, side.value, "o-", color=colour, label=name)
    wall = network.wall_diameters
    axes.axhline(network.far_n.value, color="black", linestyle="--", label="far field")
    axes.axvline(wall, color=GREY, linewidth=2.0)
    axes.text(wall, 0.0, " bowl wall", color=GREY, va="bottom")
    axes.set(ylabel="mean normal force\nper contact (N)", xlim=(0, wall + 0.5), ylim=(0, None))
    axes.set_xlabel("distance from the workpiece's surface (particle diameters)")
    axes.legend()
    return figure
