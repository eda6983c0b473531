"""The figures of a process run."""

from __future__ import annotations

from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from dragchain.figures import network_picture
from dragchain.figures.bars import bars_of, depth_bars
from dragchain.figures.network_overlay import show_network
from dragchain.figures.style import BLUE, GREEN, GREY, ORANGE, RED, head, legend_below, new_figure
from dragchain.report.findings import Comparison, ProcessFindings
from dragchain.report.run_data import RunData
from dragchain.run.kinematics import drag_start_s
from dragchain.statistics.correlated import MeanEstimate
from dragchain.statistics.estimate import Estimate

_RUN_IN = "#d9dde2"
_REFERENCES = (RED, GREEN, GREY)


def forces(run: RunData, found: ProcessFindings) -> Figure:
    """Drag and lateral force over process time, as Fig. 4a of Uhlmann et al. (2015)."""
    trace, ours = run.drag, found.forces["drag_n"]
    time_s = trace.process_time_s
    start, end = float(time_s[trace.counted][0]), float(time_s[-1])
    figure = new_figure(3.6)
    axes = figure.subplots()
    axes.plot(time_s, trace.lateral_n, color=ORANGE, lw=0.7, label="lateral force (left of motion)")
    axes.plot(time_s, trace.drag_n, color=BLUE, lw=0.8, label="drag force (along motion)")
    axes.axvspan(float(time_s[0]), start, color=_RUN_IN, alpha=0.6, linewidth=0, label="transient")
    axes.fill_between([start, end], ours.ci95_low, ours.ci95_high, color="black", alpha=0.15, lw=0)
    interval = f"{ours.ci95_low:.2f} to {ours.ci95_high:.2f}"
    label = f"mean drag {ours.mean:.2f} N (95 % CI {interval} N)"
    axes.plot([start, end], [ours.mean] * 2, color="black", label=label)
    for row, colour in zip(found.comparison, cycle(_REFERENCES), strict=False):
        label = f"{row.label} mean {row.mean_n:.2f} N" + _spread(row)
        axes.plot([start, end], [row.mean_n] * 2, linestyle="--", color=colour, label=label)
    axes.set(xlabel="process time (s)", ylabel="force on the workpiece (N)", xlim=(0, time_s[-1]))
    axes.set_title(_reliability(ours))
    legend_below(figure, axes)
    return figure


def _spread(row: Comparison) -> str:
    source = f" ({row.source})" if row.source else ""
    return source if row.std_n is None else f" ± {row.std_n:.2f} N{source}"


def _reliability(ours: MeanEstimate) -> str:
    text = f"drag {ours.mean:.2f} ± {ours.std:.2f} N (± standard deviation)"
    doubt = "" if ours.reliable else " (too few for a reliable CI)"
    return f"{text}, {ours.effective_samples:.0f} effective samples{doubt}"


def force_around_workpiece(run: RunData, found: ProcessFindings) -> Figure:
    """Mean normal force by azimuth, ahead up."""
    edges, bars = np.array(found.azimuth.edges_rad), bars_of(found.azimuth.force_n)
    figure = new_figure(4.6, 5.4)
    axes: Any = figure.add_subplot(projection="polar")
    axes.set_theta_zero_location("N")
    middle = (edges[:-1] + edges[1:]) / 2
    colours = np.where(np.abs(middle) < np.pi / 2, BLUE, ORANGE)
    axes.bar(middle, bars.value, np.diff(edges), color=colours, edgecolor="white", linewidth=0.6)
    reach = [bars.below, bars.above]
    axes.errorbar(middle, bars.value, reach, fmt="none", ecolor="black", elinewidth=0.8)
    names = ["ahead", "45°", "left", "135°", "behind", "-135°", "right", "-45°"]
    axes.set_thetagrids(np.arange(0, 360, 45), names)
    axes.set_rlabel_position(157.5)
    sums = found.ahead_behind
    head(
        figure,
        "normal force on the workpiece by azimuth from the direction of motion,\n"
        f"mean over frames (N per {np.degrees(edges[1] - edges[0]):.0f}°); bars: 95 % CI\n"
        f"ahead {sums.ahead_n.value:.2f} N, behind {sums.behind_n.value:.2f} N, "
        + _ratio(sums.ratio),
        size=9,
    )
    return figure


def _ratio(ratio: Estimate) -> str:
    if not np.isfinite(ratio.value):
        return "no contact behind"
    high = f"{ratio.ci95_high:.1f}" if np.isfinite(ratio.ci95_high) else "unbounded"
    return f"ratio {ratio.value:.1f} (95 % CI {ratio.ci95_low:.1f} to {high})"


def force_depth(run: RunData, found: ProcessFindings) -> Figure:
    """The normal force of a contact, and of all contacts together, against depth."""
    depth, slope = found.depth, found.depth.slope_n_per_m
    figure = new_figure(3.9)
    left, right = figure.subplots(1, 2, sharey=True)
    depth_bars(left, depth.edges_m, bars_of(depth.contact_n), BLUE)
    left.set(xlabel="mean normal force per contact (N)", ylabel="depth below the surface (mm)")
    left.set_title(
        f"slope {slope.value * 1e-3:.4f} N/mm\n"
        f"(95 % CI {slope.ci95_low * 1e-3:.4f} to {slope.ci95_high * 1e-3:.4f})"
    )
    depth_bars(right, depth.edges_m, bars_of(depth.line_load_n_per_m, 1e-3), GREEN)
    right.set(xlabel="total normal force per depth (N/mm)")
    right.set_title("deepest bin includes the contacts\non edge and end face")
    left.invert_yaxis()
    return figure


def chains_peaks(run: RunData, found: ProcessFindings) -> Figure:
    """Resistance with its peaks over the bottleneck of the dominant workpiece path."""
    trace, peaks = run.drag, found.peaks
    figure = new_figure(4.4)
    upper, lower = figure.subplots(2, 1, sharex=True)
    shown = trace.process_time_s[trace.counted], -trace.drag_n[trace.counted]
    upper.plot(*shown, color=BLUE, linewidth=0.8)
    upper.plot(peaks.process_time_s, [-force for force in peaks.drag_n], "v", color=RED)
    upper.set(ylabel="drag force\n(magnitude, N)")
    upper.set_title(f"{peaks.count} peaks (marked), at least {peaks.separation_s:.2f} s apart")
    frame_s = run.network["time_s"].to_numpy(np.float64) - drag_start_s(run.case)
    lower.plot(frame_s, run.bottlenecks_n, ".-", color=GREEN, markersize=4)
    for moment in peaks.process_time_s:
        lower.axvline(moment, color=RED, linewidth=0.7, linestyle=":")
        upper.axvline(moment, color=RED, linewidth=0.7, linestyle=":")
    lower.set(xlabel="process time (s)", ylabel="bottleneck force of the\ndominant path (N)")
    lower.set_ylim(bottom=0)
    return figure


def network_xy(run: RunData, found: ProcessFindings) -> Figure:
    """The contact network from above."""
    return _network(run, "xy", "from above")


def network_xz(run: RunData, found: ProcessFindings) -> Figure:
    """The contact network from the side."""
    return _network(run, "xz", "from the side")


def _network(run: RunData, view: network_picture.View, side: str) -> Figure:
    """A rendered view on axes in mm, with what it shows named."""
    shown = run.scene
    image, extent = network_picture.render(run.folder, run.case, shown, view)
    figure = new_figure(5.6 * (extent[3] - extent[2]) / (extent[1] - extent[0]) + 0.9, 6.9)
    axes = figure.subplots()
    show_network(axes, shown, view, image, extent)
    largest = float(shown.frame.normal_force.max(initial=0.0))
    scale = ScalarMappable(Normalize(0.0, largest), network_picture.colour_map())
    bar = figure.colorbar(scale, ax=axes, shrink=0.8, pad=0.02)
    bar.set_label("normal force per contact (N); cylinder radius proportional")
    cut = network_picture.cut_words(run.case, view)
    axes.set_title(
        f"contact network {side}, process time {shown.process_time_s:.2f} s; "
        f"largest normal force {largest:.2f} N\n"
        + "\n".join(filter(None, (_path_words(shown), cut)))
    )
    return figure


def _path_words(shown: network_picture.Scene) -> str:
    if shown.dominant is None:
        return "no path of strong contacts from workpiece to bowl"
    forces = shown.frame.normal_force[list(shown.dominant.contacts)]
    return (
        "outlined: dominant path from workpiece to bowl, "
        f"{len(shown.dominant.particles)} particles, bottleneck {forces.min():.2f} N"
    )


def drag_of_cases(
    names: list[str], forces: list[MeanEstimate], references: list[tuple[str, float]]
) -> Figure:
    """The mean drag of each case with its interval, beside reference means.

    Parameters
    ----------
    names, forces : list
        Name and mean drag of each case.
    references : list of (str, float)
        Label and mean in N of each figure to compare with.
    """
    figure = new_figure(1.2 + 0.32 * len(names))
    axes = figure.subplots()
    place = np.arange(len(names))
    mean, low, high = (
        np.array([getattr(force, key) for force in forces])
        for key in ("mean", "ci95_low", "ci95_high")
    )
    axes.errorbar(mean, place, xerr=[mean - low, high - mean], fmt="o", color=BLUE, capsize=3)
    for (label, value), colour in zip(references, cycle(_REFERENCES), strict=False):
        axes.axvline(value, color=colour, linestyle="--", label=f"{label} {value:.2f} N")
    axes.set_yticks(place, names)
    axes.set(xlabel="mean drag (N); bars: 95 % confidence interval", ylim=(len(names) - 0.5, -0.5))
    if references:
        legend_below(figure, axes)
    return figure
