"""The panels of a process run's figures, each drawn on given axes."""

import numpy as np
from matplotlib.axes import Axes

from dragchain.figures.marks import depth_bars
from dragchain.figures.style import COLOURS
from dragchain.report.findings import Comparison, ProcessFindings
from dragchain.report.run_data import RunData
from dragchain.run.kinematics import drag_start_s

_DEPTH = "depth below the surface (mm)"


def forces(axes: Axes, run: RunData, found: ProcessFindings) -> None:
    """Drag and lateral force over process time with the mean drag, as Uhlmann et al. (2015)."""
    trace, ours = run.drag, found.forces["drag_n"]
    time_s = trace.process_time_s
    span = [float(time_s[trace.counted][0]), float(time_s[-1])]
    drag, lateral, transient = (COLOURS[name] for name in ("drag", "lateral", "transient"))
    axes.plot(
        time_s, trace.lateral_n, color=lateral, lw=0.7, label="lateral force (left of motion)"
    )
    axes.plot(time_s, trace.drag_n, color=drag, lw=0.8, label="drag force (along motion)")
    axes.axvspan(float(time_s[0]), span[0], color=transient, alpha=0.6, lw=0, label="transient")
    axes.fill_between(span, ours.ci95_low, ours.ci95_high, color="black", alpha=0.15, lw=0)
    interval = f"{ours.ci95_low:.2f} to {ours.ci95_high:.2f}"
    label = f"mean drag {ours.mean:.2f} N (95 % CI {interval} N)"
    axes.plot(span, [ours.mean] * 2, color="black", label=label)
    for one in found.comparison:
        published(axes, one)
    axes.set(xlabel="process time (s)", ylabel="force on the workpiece (N)", xlim=(0, time_s[-1]))


def published(axes: Axes, one: Comparison) -> None:
    """A published mean, dashed over what was drawn before it, with its standard deviation."""
    colour, text = COLOURS[one.label], f"{one.label} mean {one.mean_n:.2f} N"
    if one.std_n is not None:
        text += f" ± {one.std_n:.2f} N"
        ends = one.mean_n - one.std_n, one.mean_n + one.std_n
        axes.axhspan(*ends, color=colour, alpha=0.12, lw=0, zorder=0.5)
    text += f" ({one.source})" if one.source else ""
    axes.axhline(one.mean_n, ls="--", lw=1.8, color=colour, label=text)


def peaks(axes: Axes, run: RunData, found: ProcessFindings) -> None:
    """Magnitude of the drag over process time with its peaks."""
    trace, peaks, counted = run.drag, found.peaks, run.drag.counted
    axes.plot(
        trace.process_time_s[counted], -trace.drag_n[counted], color=COLOURS["drag"], linewidth=0.8
    )
    axes.plot(peaks.process_time_s, -np.array(peaks.drag_n), "v", color=COLOURS["peak"], ms=6)
    axes.set(ylabel="drag force\n(magnitude, N)")


def bottlenecks(axes: Axes, run: RunData, found: ProcessFindings) -> None:
    """Bottleneck of the dominant workpiece path over process time."""
    frame_s = run.network["time_s"].to_numpy(np.float64) - drag_start_s(run.case)
    axes.plot(frame_s, run.bottlenecks_n, ".-", color=COLOURS["dominant_path"])
    axes.set(xlabel="process time (s)", ylabel="bottleneck force of the\ndominant path (N)")
    axes.set_ylim(bottom=0)


def peak_times(axes: Axes, found: ProcessFindings) -> None:
    """A line at the time of each peak of the drag."""
    for moment in found.peaks.process_time_s:
        axes.axvline(moment, color=COLOURS["peak"], linewidth=0.7, linestyle=":")


def force_over_depth(axes: Axes, found: ProcessFindings) -> None:
    """Mean normal force of a contact in bins of depth."""
    depth_bars(axes, found.depth.edges_m, found.depth.contact_n)
    axes.set(xlabel="mean normal force per contact (N)", ylabel=_DEPTH)


def load_over_depth(axes: Axes, found: ProcessFindings) -> None:
    """Sum of the normal forces per depth in bins of depth."""
    depth_bars(axes, found.depth.edges_m, found.depth.line_load_n_per_m, 1e-3)
    axes.set(xlabel="total normal force per depth (N/mm)", ylabel=_DEPTH)
