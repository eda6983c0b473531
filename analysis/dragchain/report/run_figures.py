"""The figures of a run, as PNG files.

The panels of a process run's figures are functions of their own, each drawn on given axes.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.arrays import Floats
from dragchain.figures import network_picture
from dragchain.figures.narrow import save
from dragchain.figures.network_picture import force_bar, show_network
from dragchain.figures.panels import (
    compass,
    compass_bars,
    depth_bars,
    head,
    legend_below,
    new_figure,
    new_panels,
)
from dragchain.figures.style import BLUE, COLOURS, HALF_IN, RED, drawing
from dragchain.report.findings import DropFindings, FillingFindings, ProcessFindings
from dragchain.report.run_data import RunData, write_findings
from dragchain.run.kinematics import process_time
from dragchain.run.reference import ReferenceDrag, reference_drags
from dragchain.statistics.estimate import Estimate
from dragdeck.records.case import CaseOfRun
from dragdeck.records.figures import figures_of

# --- panels --------------------------------------------------------------------------------------


_DEPTH = "depth below the surface (mm)"


def forces_panel(axes: Axes, run: RunData, findings: ProcessFindings) -> None:
    """Drag and lateral force over process time with the mean drag, as Uhlmann et al. (2015)."""
    trace, mean = run.drag, run.quantities["drag_mean"]
    time_s = trace.process_time_s
    span = [float(time_s[trace.counted][0]), float(time_s[-1])]
    drag, lateral, transient = (COLOURS[name] for name in ("drag", "lateral", "transient"))
    axes.plot(
        time_s, trace.lateral_n, color=lateral, lw=0.7, label="lateral force (left of motion)"
    )
    axes.plot(time_s, trace.drag_n, color=drag, lw=0.8, label="drag force (along motion)")
    axes.axvspan(float(time_s[0]), span[0], color=transient, alpha=0.6, lw=0, label="transient")
    axes.fill_between(span, mean.ci95_low, mean.ci95_high, color="black", alpha=0.15, lw=0)
    interval = f"{mean.ci95_low:.2f} to {mean.ci95_high:.2f}"
    label = f"mean drag {mean.value:.2f} N (95 % CI {interval} N)"
    axes.plot(span, [mean.value] * 2, color="black", label=label)
    for published in reference_drags(run.study.reference):
        published_mean(axes, published)
    axes.set(xlabel="process time (s)", ylabel="force on the workpiece (N)", xlim=(0, time_s[-1]))


def published_mean(axes: Axes, published: ReferenceDrag) -> None:
    """A published mean, dashed over what was drawn before it, with its standard deviation."""
    colour, text = COLOURS[published.label], f"{published.label} mean {published.mean_n:.2f} N"
    if published.std_n is not None:
        text += f" ± {published.std_n:.2f} N"
        ends = published.mean_n - published.std_n, published.mean_n + published.std_n
        axes.axhspan(*ends, color=colour, alpha=0.12, lw=0, zorder=0.5)
    text += f" ({published.source})" if published.source else ""
    axes.axhline(published.mean_n, ls="--", lw=1.8, color=colour, label=text)


def peaks_panel(axes: Axes, run: RunData, findings: ProcessFindings) -> None:
    """Magnitude of the drag over process time with its peaks."""
    trace, peaks, counted = run.drag, findings.peaks, run.drag.counted
    axes.plot(
        trace.process_time_s[counted], -trace.drag_n[counted], color=COLOURS["drag"], linewidth=0.8
    )
    axes.plot(peaks.process_time_s, -np.array(peaks.drag_n), "v", color=COLOURS["peak"], ms=6)
    axes.set(ylabel="drag force\n(magnitude, N)")


def bottlenecks_panel(axes: Axes, run: RunData, findings: ProcessFindings) -> None:
    """Bottleneck of the dominant workpiece path over process time."""
    frame_s = process_time(run.network["time_s"].to_numpy(np.float64), run.case)
    axes.plot(frame_s, run.bottlenecks_n, ".-", color=COLOURS["dominant_path"])
    axes.set(xlabel="process time (s)", ylabel="bottleneck force of the\ndominant path (N)")
    axes.set_ylim(bottom=0)


def peak_times(axes: Axes, findings: ProcessFindings) -> None:
    """A line at the time of each peak of the drag."""
    for moment in findings.peaks.process_time_s:
        axes.axvline(moment, color=COLOURS["peak"], linewidth=0.7, linestyle=":")


def force_depth_panel(axes: Axes, findings: ProcessFindings) -> None:
    """Mean normal force of a contact in bins of depth."""
    depth_bars(axes, findings.depth.edges_m, findings.depth.contact_n)
    axes.set(xlabel="mean normal force per contact (N)", ylabel=_DEPTH)


def load_depth_panel(axes: Axes, findings: ProcessFindings) -> None:
    """Sum of the normal forces per depth in bins of depth."""
    depth_bars(axes, findings.depth.edges_m, findings.depth.line_load_n_per_m, 1e-3)
    axes.set(xlabel="total normal force per depth (N/mm)", ylabel=_DEPTH)


# --- process -------------------------------------------------------------------------------------


def forces(run: RunData, findings: ProcessFindings) -> Figure:
    """Drag and lateral force over process time, as Fig. 4a of Uhlmann et al. (2015)."""
    figure, (axes,) = new_panels(3.6)
    forces_panel(axes, run, findings)
    mean, std = (run.quantities[f"drag_{name}"] for name in ("mean", "std"))
    doubt = "" if mean.reliable else ": too short for a reliable interval"
    axes.set_title(f"drag {mean.value:.2f} ± {std.value:.2f} N (± standard deviation){doubt}")
    return legend_below(figure)


def _doubt(estimate: Estimate) -> str:
    return "" if estimate.reliable else " (too few)"


def force_around_workpiece(run: RunData, findings: ProcessFindings) -> Figure:
    """Mean normal force by azimuth, ahead up."""
    edges, sums = findings.azimuth.edges_rad, findings.ahead_behind
    figure = new_figure(4.6, HALF_IN)
    compass_bars(compass(figure), edges, findings.azimuth.force_n)
    head(
        figure,
        "normal force on the workpiece by azimuth from the direction of\n"
        "motion, mean over frames; bars: 95 % CI\n"
        f"ahead {sums.ahead_n.value:.2f} N, behind {sums.behind_n.value:.2f} N, "
        + _ratio(run.quantities.get("ahead_behind")),
    )
    return figure


def _ratio(ratio: Estimate | None) -> str:
    if ratio is None:
        return "no contact behind"
    if not ratio.known:
        return f"ratio {ratio.value:.1f} (no interval)"
    ends = f"{ratio.ci95_low:.1f} to {ratio.ci95_high:.1f}"
    return f"ratio {ratio.value:.1f} (95 % CI {ends}){_doubt(ratio)}"


def force_depth(run: RunData, findings: ProcessFindings) -> Figure:
    """The normal force of a contact, and of all contacts together, against depth."""
    slope = findings.depth.slope_n_per_m.over(1e3)
    figure, (left, right) = new_panels(3.3, 2, HALF_IN, sharey=True)
    force_depth_panel(left, findings)
    interval = f"95 % CI {slope.ci95_low:.4f} to {slope.ci95_high:.4f}"
    left.set_title(f"slope {slope.value:.4f} N/mm\n({interval}){_doubt(slope)}")
    load_depth_panel(right, findings)
    right.set(ylabel="", title="deepest bin includes the contacts\non edge and end face")
    return figure


def chains_peaks(run: RunData, findings: ProcessFindings) -> Figure:
    """Resistance with its peaks over the bottleneck of the dominant workpiece path."""
    peaks = findings.peaks
    figure, (upper, lower) = new_panels(3.8, 2, HALF_IN, 1, sharex=True)
    peaks_panel(upper, run, findings)
    upper.set_title(f"{peaks.count} peaks (marked), at least {peaks.separation_s:.2f} s apart")
    bottlenecks_panel(lower, run, findings)
    for axes in (upper, lower):
        peak_times(axes, findings)
    return figure


def network_xy(run: RunData, findings: ProcessFindings) -> Figure:
    """The contact network from above."""
    return _network(run, "xy", "from above")


def network_xz(run: RunData, findings: ProcessFindings) -> Figure:
    """The contact network from the side."""
    return _network(run, "xz", "from the side")


def _network(run: RunData, view: network_picture.View, side: str) -> Figure:
    """A rendered view on axes in mm, with what it shows named."""
    shown = run.scene
    image, extent = network_picture.render_view(run.folder, run.case, shown, view)
    height = 4.3 * (extent[3] - extent[2]) / (extent[1] - extent[0]) + 0.9
    figure, (axes,) = new_panels(height, width_in=HALF_IN)
    show_network(axes, shown, view, image, extent)
    largest = float(shown.frame.normal_force.max(initial=0.0))
    force_bar(figure, axes, largest)
    title = (
        f"contact network {side}, process time {shown.process_time_s:.2f} s\n"
        f"largest normal force {largest:.2f} N"
    )
    cut = network_picture.cut_words(run.case, view)
    axes.set_title("\n".join(filter(None, (title, _path_words(shown), cut))))
    return figure


def _path_words(shown: network_picture.NetworkScene) -> str:
    if shown.dominant is None:
        return "no path of strong contacts from workpiece to bowl"
    forces = shown.frame.normal_force[list(shown.dominant.contacts)]
    return (
        "blue: dominant path from workpiece to bowl, "
        f"{len(shown.dominant.particles)} particles, bottleneck {forces.min():.2f} N"
    )


# --- filling and drop test -----------------------------------------------------------------------


def energy_ratio(energy_j: Floats, particles: Floats, case: CaseOfRun) -> Floats:
    """The mean energy of a particle over m g d, (N,): what the mean particle gains falling by d.

    Parameters
    ----------
    energy_j : (N,) array
        Kinetic energy of all particles in J, spin included.
    particles : (N,) array
        Number of particles.
    case : CaseOfRun
        The filling; mass and diameter are those of its mean particle.
    """
    radius = case.media.radius_mean_m
    mass = case.media.weight_kg_m3 * 4.0 / 3.0 * np.pi * radius**3
    return np.asarray(energy_j / particles / (mass * case.gravity_m_s2 * 2.0 * radius))


def filling(run: RunData, findings: FillingFindings) -> Figure | None:
    """Energy ratio over time, with the level below which the bed is at rest; needs thermo."""
    if not (run.folder / "tables" / "thermo.parquet").is_file():
        return None
    table = run.table("thermo")
    table = table[table["n_particles"] > 0]
    energy = (table["kinetic_energy_j"] + table["rotational_energy_j"]).to_numpy(np.float64)
    ratio = energy_ratio(energy, table["n_particles"].to_numpy(np.float64), run.case)
    figure, (axes,) = new_panels(3.2, width_in=HALF_IN)
    axes.semilogy(table["time_s"], ratio, color=BLUE)
    rest, bed = findings.rest_energy_ratio, findings.bed
    if rest is not None:
        axes.axhline(rest, color=RED, linestyle="--", label=f"settling criterion: {rest:g}")
        axes.legend(loc="upper right")
    axes.set(xlabel="simulated time (s)", ylabel="mean kinetic energy per particle\n/ (m g d)")
    axes.set_title(
        f"{bed['n_particles']} particles, bed height {bed['bed_height_m'] * 1e3:.1f} mm, "
        f"solid fraction {bed['solid_fraction']:.3f}"
    )
    return figure


def drop_test(run: RunData, findings: DropFindings) -> Figure:
    """Force and speed over time of each impact."""
    blocks = list(run.prints("impacts"))
    time_s, speed_m_s, force_n = (
        np.concatenate([np.asarray(block[name], dtype=np.float64) for block in blocks])
        for name in ("time_s", "vz_m_s", "force_n")
    )
    impacts, ratio = run.table("impacts"), findings.restitution
    figure, panels = new_panels(3.2, len(impacts), HALF_IN, sharey=True)
    limit = 1.1 * float(np.abs(speed_m_s).max())
    for axes, impact in zip(panels, impacts.to_dict("records"), strict=True):
        start, duration = impact["start_time_s"], impact["duration_s"]
        near = (time_s >= start - 0.3 * duration) & (time_s <= start + 1.3 * duration)
        time_us = (time_s[near] - start) * 1e6
        axes.plot(time_us, force_n[near], color=BLUE)
        axes.set(xlabel="time (µs)", title=_impact_words(impact))
        right = _speed_axes(axes, limit)
        right.plot(time_us, speed_m_s[near], color=RED, linewidth=1.0)
        right.tick_params(labelright=axes is panels[-1], colors=RED)
    right.set_ylabel("upward velocity (m/s)", color=RED)
    panels[0].set_ylabel("force on the particle (N)", color=BLUE)
    head(
        figure,
        f"effective coefficient of restitution {ratio.mean:.3f} "
        f"(range {ratio.lowest:.3f} to {ratio.highest:.3f});\ninput value {ratio.input:.3f}",
    )
    return figure


def _impact_words(impact: Mapping[Any, Any]) -> str:
    return (
        f"impact {impact['impact']}, e = {impact['restitution']:.3f}\n"
        f"peak {impact['peak_force_n']:.2f} N\nafter {impact['time_since_first_s'] * 1e3:.1f} ms"
    )


def _speed_axes(axes: Axes, limit_m_s: float) -> Axes:
    """A second vertical axis, for speeds, at the right."""
    right = axes.twinx()
    right.grid(False)
    right.spines["right"].set_visible(True)
    right.set_ylim(-limit_m_s, limit_m_s)
    return right


# --- all figures ---------------------------------------------------------------------------------

_Draw = Callable[[RunData, Any], Figure | None]
"""Draws a figure of a run with its findings; None: it lacks an optional table."""


DRAW_PROCESS = (forces, network_xy, network_xz, force_around_workpiece, force_depth, chains_peaks)
_DRAW: Mapping[str, _Draw] = {draw.__name__: draw for draw in (*DRAW_PROCESS, filling, drop_test)}


def write_figures(run_dir: Path) -> list[Path]:
    """Draw the figures of a run into ``figures/`` and their numbers into ``tables/findings.json``.

    Parameters
    ----------
    run_dir : Path
        The folder of a run of any scene, with its tables made; for a process, chains too.

    Returns
    -------
    list of Path
        The pictures, ``figures/<name>.png`` for each of the figures of its scene; a filling
        without a thermo table has none.

    Raises
    ------
    DragdeckError
        If a table is missing, a series is too short, or pictures cannot be rendered here.
    """
    run = RunData.open(run_dir)
    findings = write_findings(run)
    written = []
    with drawing():
        for name in figures_of(run.case.scene):
            if (figure := _DRAW[name](run, findings)) is not None:
                written.append(save(figure, run_dir / "figures" / f"{name}.png"))
    return written
