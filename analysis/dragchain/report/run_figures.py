"""The figures of a run, as PNG files."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from dragchain.arrays import Floats
from dragchain.dumps.run_parts import iter_prints
from dragchain.figures import network_picture as scene
from dragchain.figures.style import BLUE, CHAIN, GREEN, GREY, ORANGE, RED, STYLE, WIDTH_IN, png
from dragchain.report.findings import Findings, dominant_bottlenecks, write_findings
from dragchain.run.case import Case, load_case, load_outputs
from dragchain.run.kinematics import drag_start_s
from dragchain.tables.by_step import read_table


def write_figures(run_dir: Path) -> list[Path]:
    """Draw the figures of a run into ``figures/`` and their numbers into ``tables/figures.json``.

    Parameters
    ----------
    run_dir
        The folder of a run of any scene, with its tables made; for a process, chains too.

    Returns
    -------
    list of Path
        The pictures: for a process ``forces.png``, ``network_xy.png``, ``network_xz.png``,
        ``force_around_workpiece.png``, ``force_depth.png`` and ``chains_peaks.png``; for a fill
        ``fill.png`` if it has a thermo table; for a drop ``drop.png``.

    Raises
    ------
    DragchainError
        If a table is missing, a series is too short, or pictures cannot be rendered here.
    """
    case = load_case(run_dir)
    findings = write_findings(run_dir)
    draw = {"process": _draw_process, "filling": _draw_filling, "drop_test": _draw_drop}[case.scene]
    with matplotlib.rc_context(STYLE):
        return draw(run_dir, case, findings)


def _draw_process(run_dir: Path, case: Case, findings: Findings) -> list[Path]:
    written = [
        _save(run_dir, "forces", _forces(run_dir, case, findings)),
        _save(run_dir, "force_around_workpiece", _around_workpiece(findings)),
        _save(run_dir, "force_depth", _depth(findings)),
        _save(run_dir, "chains_peaks", _chains_peaks(run_dir, findings)),
    ]
    scene.check_rendering()
    shown = scene.load_scene(run_dir, case)
    views: tuple[scene.View, ...] = ("xy", "xz")
    for view in views:
        image, extent = scene.render(run_dir, case, shown, view)
        written.append(
            _save(run_dir, f"network_{view}", _network(case, shown, view, image, extent))
        )
    return written


def _draw_filling(run_dir: Path, case: Case, findings: Findings) -> list[Path]:
    if not (run_dir / "tables" / "thermo.parquet").is_file():
        return []
    return [_save(run_dir, "filling", _filling(run_dir, case, findings))]


def _draw_drop(run_dir: Path, case: Case, findings: Findings) -> list[Path]:
    return [_save(run_dir, "drop_test", _drop(run_dir, findings))]


def _save(run_dir: Path, name: str, figure: Figure) -> Path:
    """Write a picture to a temporary file and then put it in its place."""
    path = run_dir / "figures" / f"{name}.png"
    path.parent.mkdir(exist_ok=True)
    draft = path.with_name(f".{path.name}.tmp")
    draft.write_bytes(png(figure))
    draft.replace(path)
    return path


def _figure(height_in: float, width_in: float = WIDTH_IN) -> Figure:
    """A figure without a window: such a figure is drawn by Agg wherever it is saved."""
    return Figure(figsize=(width_in, height_in), layout="constrained")


# --- forces over time ------------------------------------------------------------------------


def _forces(run_dir: Path, case: Case, findings: Findings) -> Figure:
    """Drag and lateral force over process time, as Fig. 4a of Uhlmann et al. (2015)."""
    time_s, drag, lateral, counted = _drag_trace(run_dir, case)
    figure = _figure(3.6)
    axes = figure.subplots()
    axes.plot(time_s, lateral, color=ORANGE, linewidth=0.7, label="lateral (left of motion)")
    axes.plot(time_s, drag, color=BLUE, linewidth=0.8, label="drag (along motion)")
    transient = float(time_s[counted][0])
    axes.axvspan(
        float(time_s[0]), transient, color="#d9dde2", alpha=0.6, linewidth=0, label="run-in"
    )
    ours = findings["forces"]["drag_n"]
    stretch = [transient, float(time_s[-1])]
    axes.fill_between(stretch, ours["ci95_low"], ours["ci95_high"], color="black", alpha=0.15, lw=0)
    label = (
        f"mean drag {ours['mean']:.2f} N, 95 % interval {_span(ours, 'ci95_low', 'ci95_high')} N"
    )
    axes.plot(stretch, [ours["mean"]] * 2, color="black", label=label)
    for row, colour in zip(findings["comparison"], cycle((RED, GREEN, GREY)), strict=False):
        text = f"{row['label']} mean {row['mean_n']:.2f} N" + _spread(row)
        axes.plot(stretch, [row["mean_n"]] * 2, linestyle="--", color=colour, label=text)
    axes.set(xlabel="process time in s", ylabel="force on the workpiece in N", xlim=(0, time_s[-1]))
    axes.set_title(_reliability(ours))
    _legend_below(figure, axes)
    return figure


def _spread(row: Findings) -> str:
    source = f" ({row['source']})" if row["source"] else ""
    return source if row["std_n"] is None else f" ± {row['std_n']:.2f} N{source}"


def _span(row: Findings, low: str = "ci95_low", high: str = "ci95_high") -> str:
    return f"{row[low]:.2f} to {row[high]:.2f}"


def _reliability(ours: Findings) -> str:
    text = f"drag {ours['mean']:.2f} ± {ours['std']:.2f} N (± standard deviation)"
    effective = f"{ours['effective_samples']:.0f} effective samples"
    return f"{text}, {effective}" + (
        "" if ours["reliable"] else ": too few to rely on the interval"
    )


def _legend_below(figure: Figure, axes: Axes, columns: int = 2) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=columns)


def _drag_trace(run_dir: Path, case: Case) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """Return process time, drag, lateral force and what counts, of the drag alone."""
    columns = ["time_s", "phase", "drag_n", "lateral_n", "in_statistics"]
    table = read_table(run_dir / "tables" / "workpiece_force.parquet", columns)
    table = table[table["phase"] == "drag"]
    drag, lateral = (table[name].to_numpy(np.float64) for name in ("drag_n", "lateral_n"))
    time_s = table["time_s"].to_numpy(np.float64) - drag_start_s(case)
    return time_s, drag, lateral, table["in_statistics"].to_numpy(bool)


# --- around the workpiece -------------------------------------------------------------------------


def _around_workpiece(findings: Findings) -> Figure:
    """Mean normal force by azimuth, ahead up."""
    edges = np.asarray(findings["azimuth"]["edges_rad"])
    value, low, high = _bars(findings["azimuth"]["force_n"])
    figure = _figure(4.6, 5.4)
    axes: Any = figure.add_subplot(projection="polar")
    axes.set_theta_zero_location("N")
    middle = (edges[:-1] + edges[1:]) / 2
    colours = np.where(np.abs(middle) < np.pi / 2, BLUE, ORANGE)
    axes.bar(middle, value, width=np.diff(edges), color=colours, edgecolor="white", linewidth=0.6)
    axes.errorbar(
        middle, value, [value - low, high - value], fmt="none", ecolor="black", elinewidth=0.8
    )
    names = ["ahead", "45°", "left", "135°", "behind", "-135°", "right", "-45°"]
    axes.set_thetagrids(np.arange(0, 360, 45), names)
    axes.set_rlabel_position(157.5)
    sums = findings["ahead_behind"]
    figure.suptitle(
        "normal force on the workpiece by azimuth from the direction of motion,\n"
        f"mean of a frame in N per {np.degrees(edges[1] - edges[0]):.0f}° (bars: 95 % interval)\n"
        f"ahead {sums['ahead_n']['value']:.2f} N, behind {sums['behind_n']['value']:.2f} N, "
        + _ratio(sums["ratio"]),
        fontsize=9,
        x=0.02,
        ha="left",
    )
    return figure


def _ratio(ratio: Findings) -> str:
    if ratio["value"] is None:
        return "no contact behind"
    high = "unbounded" if ratio["ci95_high"] is None else f"{ratio['ci95_high']:.1f}"
    return f"ratio {ratio['value']:.1f} (95 %: {ratio['ci95_low']:.1f} to {high})"


def _bars(columns: Findings) -> tuple[Floats, Floats, Floats]:
    value, low, high = (
        np.array(columns[k], dtype=np.float64) for k in ("value", "ci95_low", "ci95_high")
    )
    return value, np.minimum(low, value), np.maximum(high, value)


def _depth(findings: Findings) -> Figure:
    """Draw the normal force of a contact, and of all contacts together, against depth."""
    depth = findings["depth"]
    edges = np.asarray(depth["edges_m"]) * 1e3
    slope = depth["slope_n_per_m"]
    figure = _figure(3.9)
    left, right = figure.subplots(1, 2, sharey=True)
    _depth_panel(left, edges, depth["contact_n"], 1.0, BLUE)
    left.set(xlabel="mean normal force of a contact in N", ylabel="depth below the surface in mm")
    left.set_title(
        f"slope {slope['value'] * 1e-3:.4f} N/mm\n"
        f"(95 %: {slope['ci95_low'] * 1e-3:.4f} to {slope['ci95_high'] * 1e-3:.4f})"
    )
    _depth_panel(right, edges, depth["line_load_n_per_m"], 1e-3, GREEN)
    right.set(xlabel="normal force of all contacts in N per mm of depth")
    right.set_title("the deepest bin holds the contacts\nof the workpiece's edge and end")
    left.invert_yaxis()
    return figure


def _depth_panel(axes: Axes, edges: Floats, columns: Findings, unit: float, colour: str) -> None:
    value, low, high = (numbers * unit for numbers in _bars(columns))
    middle = (edges[:-1] + edges[1:]) / 2
    axes.barh(middle, value, height=0.9 * np.diff(edges), color=colour, alpha=0.75)
    axes.errorbar(
        value, middle, xerr=[value - low, high - value], fmt="none", ecolor="black", elinewidth=0.9
    )


# --- chains against peaks --------------------------------------------------------------------


def _chains_peaks(run_dir: Path, findings: Findings) -> Figure:
    """Resistance with its peaks over the bottleneck of the dominant workpiece path."""
    case = load_case(run_dir)
    time_s, drag, _, counted = _drag_trace(run_dir, case)
    network = read_table(run_dir / "tables" / "network.parquet", ["step", "time_s"])
    chains = read_table(run_dir / "tables" / "chains.parquet", ["step", "dominant", "bottleneck_n"])
    figure = _figure(4.4)
    upper, lower = figure.subplots(2, 1, sharex=True)
    peaks = findings["peaks"]
    upper.plot(time_s[counted], -drag[counted], color=BLUE, linewidth=0.8)
    upper.plot(peaks["process_time_s"], [-force for force in peaks["drag_n"]], "v", color=RED)
    upper.set(ylabel="resistance (minus\nthe drag) in N")
    upper.set_title(
        f"{peaks['count']} peaks (marked), at least {peaks['separation_s']:.2f} s apart"
    )
    frame_s = network["time_s"].to_numpy(np.float64) - drag_start_s(case)
    lower.plot(frame_s, dominant_bottlenecks(network, chains), ".-", color=GREEN, markersize=4)
    for moment in peaks["process_time_s"]:
        lower.axvline(moment, color=RED, linewidth=0.7, linestyle=":")
        upper.axvline(moment, color=RED, linewidth=0.7, linestyle=":")
    lower.set(xlabel="process time in s", ylabel="bottleneck of the\ndominant workpiece path in N")
    lower.set_ylim(bottom=0)
    lower.set_title(_link(findings["association"]))
    return figure


def _link(found: Findings) -> str:
    if found["rank_correlation"] is None:
        return f"{found['frames']} frames, or a constant series: no correlation can be told"
    return (
        f"rank correlation of resistance and bottleneck {found['rank_correlation']:+.2f}, "
        f"p = {found['p_value']:.3f} (circular shifts of {found['frames']} frames)"
    )


# --- the network -----------------------------------------------------------------------------


def _network(
    case: Case, shown: scene.Scene, view: scene.View, image: NDArray[np.uint8], extent: Floats
) -> Figure:
    """Set a rendered view on axes in mm, with what it shows named."""
    height = 5.6 * (extent[3] - extent[2]) / (extent[1] - extent[0]) + 0.9
    figure = _figure(height, 6.9)
    axes = figure.subplots()
    axes.imshow(image, extent=tuple(extent.tolist()), interpolation="antialiased")
    axes.grid(False)
    axes.set(xlabel="x in mm", ylabel=f"{view[1]} in mm", xlim=extent[:2], ylim=extent[2:])
    pick = [0, 1] if view == "xy" else [0, 2]
    mark_chain(axes, shown, pick)
    mark_motion(axes, shown, view)
    largest = float(shown.frame.normal_force.max(initial=0.0))
    scale = ScalarMappable(Normalize(0.0, largest), scene.colour_map())
    bar = figure.colorbar(scale, ax=axes, shrink=0.8, pad=0.02)
    bar.set_label("normal force of a contact in N; cylinder radius in proportion")
    side = "from above" if view == "xy" else "from the side"
    axes.set_title(
        f"contact network {side}, process time {shown.process_time_s:.2f} s; "
        f"largest normal force {largest:.2f} N\n"
        + "\n".join(filter(None, (_chain_text(shown), scene.cut_words(case, view))))
    )
    return figure


def _chain_text(shown: scene.Scene) -> str:
    if shown.dominant is None:
        return "no path of strong contacts from workpiece to bowl"
    forces = shown.frame.normal_force[list(shown.dominant.contacts)]
    return (
        f"outlined: dominant path from workpiece to bowl, {len(shown.dominant.particles)} "
        f"particles, "
        f"weakest contact {forces.min():.2f} N"
    )


def mark_chain(
    axes: Axes, shown: scene.Scene, pick: Sequence[int], width: float = 1.6, halo: float = 3.0
) -> None:
    """Outline the dominant path on axes in mm; `pick` names the two coordinates."""
    if shown.dominant is None:
        return
    frame, path = shown.frame, shown.dominant
    particles = list(path.particles)
    ends = frame.point[[path.contacts[0], path.contacts[-1]]]
    line = np.vstack([ends[:1], frame.centre[particles], ends[1:]])[:, pick] * 1e3
    axes.plot(*line.T, color="white", linewidth=halo, alpha=0.9)
    axes.plot(*line.T, color=CHAIN, linewidth=width)
    for centre, radius in zip(
        frame.centre[particles][:, pick], frame.radius[particles], strict=True
    ):
        for colour, thick in (("white", halo), (CHAIN, width)):
            axes.add_patch(
                Circle(centre * 1e3, radius * 1e3, fill=False, edgecolor=colour, linewidth=thick)
            )


def mark_motion(axes: Axes, shown: scene.Scene, view: scene.View) -> None:
    """Draw the direction of motion where it hides little.

    Behind the workpiece, or above the bed.
    """
    heading = shown.frame.direction_rad
    direction = np.array([np.cos(heading), np.sin(heading)]) * 11.0
    workpiece = shown.workpiece_m[:2] * 1e3
    if view == "xy":
        start, end = workpiece - 1.6 * direction, workpiece - 0.6 * direction
        away = 12.0 * np.array([-np.sin(heading), np.cos(heading)])
        away *= -1.0 if away @ workpiece > 0.0 else 1.0  # towards the middle of the bowl
    else:
        away = np.array([0.0, -11.0])
        level = axes.get_ylim()[1] - 3.0
        start, end = np.array([workpiece[0], level]), np.array([workpiece[0] + direction[0], level])
        if abs(direction[0]) < 1.0:
            return
    arrow = {"arrowstyle": "-|>", "color": "black", "linewidth": 2.0, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=tuple(end), xytext=tuple(start), arrowprops=arrow)
    side = "center" if abs(away[0]) < 6.0 else "left" if away[0] > 0.0 else "right"
    label = axes.annotate(
        "motion", tuple(start), tuple(away), textcoords="offset points", ha=side, va="center",
        weight="bold",
    )  # fmt: skip
    label.set_path_effects([withStroke(linewidth=3, foreground="white")])


# --- fill and drop ---------------------------------------------------------------------------


def energy_ratio(energy_j: Floats, particles: Floats, case: Case) -> Floats:
    """The mean energy of a particle over m g d, (N,): what the mean particle gains falling by d.

    Parameters
    ----------
    energy_j : (N,) array
        Kinetic energy of all particles in J, spin included.
    particles : (N,) array
        Number of particles.
    case : Case
        The fill; mass and diameter are those of its mean particle.
    """
    radius = case.media.radius_mean_m
    mass = case.media.density_kg_m3 * 4.0 / 3.0 * np.pi * radius**3
    return np.asarray(energy_j / particles / (mass * case.gravity_m_s2 * 2.0 * radius))


def _filling(run_dir: Path, case: Case, findings: Findings) -> Figure:
    """Energy ratio over time, with the level below which the bed counts as at rest."""
    table = read_table(run_dir / "tables" / "thermo.parquet")
    table = table[table["n_particles"] > 0]
    energy = (table["kinetic_energy_j"] + table["rotational_energy_j"]).to_numpy(np.float64)
    ratio = energy_ratio(energy, table["n_particles"].to_numpy(np.float64), case)
    bed, rest = findings["bed"], findings["rest_energy_ratio"]
    figure = _figure(3.2)
    axes = figure.subplots()
    axes.semilogy(table["time_s"], ratio, color=BLUE)
    if rest is not None:
        axes.axhline(rest, color=RED, linestyle="--", label=f"at rest below {rest:g}")
        axes.legend(loc="upper right")
    axes.set(xlabel="simulated time in s", ylabel="mean kinetic energy of a particle\nover m g d")
    axes.set_title(
        f"{bed['n_particles']} particles, height {bed['bed_height_m'] * 1e3:.1f} mm, "
        f"solid fraction {bed['solid_fraction']:.3f}"
    )
    return figure


def _drop(run_dir: Path, findings: Findings) -> Figure:
    """Force and speed over time of each impact."""
    output = load_outputs(run_dir)["impacts"]
    blocks = list(iter_prints(run_dir, output))
    time_s, speed_m_s, force_n = (
        np.concatenate([np.asarray(block[name], dtype=np.float64) for block in blocks])
        for name in ("time_s", "vz_m_s", "force_n")
    )
    impacts, ratio = findings["impacts"], findings["restitution"]
    figure = _figure(3.2)
    panels = np.atleast_1d(figure.subplots(1, len(impacts["start_time_s"]), sharey=True))
    for number, axes in enumerate(panels):
        start = impacts["start_time_s"][number]
        duration = impacts["duration_s"][number]
        near = (time_s >= start - 0.3 * duration) & (time_s <= start + 1.3 * duration)
        axes.plot((time_s[near] - start) * 1e6, force_n[near], color=BLUE)
        axes.set_title(
            f"impact {number + 1}: peak {impacts['peak_force_n'][number]:.2f} N\n"
            f"{impacts['time_since_first_s'][number] * 1e3:.1f} ms after the first, "
            f"e = {impacts['restitution'][number]:.3f}",
            fontsize=8,
        )
        axes.set_xlabel("time in µs")
        right = axes.twinx()
        right.plot((time_s[near] - start) * 1e6, speed_m_s[near], color=RED, linewidth=1.0)
        right.grid(False)
        right.spines["right"].set_visible(True)
        limit = 1.1 * float(np.abs(speed_m_s).max())
        right.set_ylim(-limit, limit)
        right.tick_params(labelright=number == len(panels) - 1, colors=RED)
    right.set_ylabel("speed upwards in m/s", color=RED)
    panels[0].set_ylabel("force on the particle in N", color=BLUE)
    figure.suptitle(
        f"restitution {ratio['mean']:.3f} ({ratio['lowest']:.3f} to {ratio['highest']:.3f}) "
        f"with {ratio['input']:.3f} in the deck",
        fontsize=9.5,
        x=0.02,
        ha="left",
    )
    return figure


# --- all cases -------------------------------------------------------------------------------


def drag_of_cases(
    names: Sequence[str], forces: Sequence[Findings], references: Sequence[tuple[str, float]]
) -> Figure:
    """The mean drag of each case with its interval, beside reference means.

    Parameters
    ----------
    names, forces
        Name and ``forces.drag_n`` findings of each case.
    references
        Label and mean in N of each figure to compare with.
    """
    with matplotlib.rc_context(STYLE):
        figure = _figure(1.2 + 0.32 * len(names))
        axes = figure.subplots()
        place = np.arange(len(names))
        mean, low, high = (
            np.array([force[key] for force in forces]) for key in ("mean", "ci95_low", "ci95_high")
        )
        axes.errorbar(mean, place, xerr=[mean - low, high - mean], fmt="o", color=BLUE, capsize=3)
        for (label, value), colour in zip(references, cycle((RED, GREEN, GREY)), strict=False):
            axes.axvline(value, color=colour, linestyle="--", label=f"{label} {value:.2f} N")
        axes.set_yticks(place, names)
        axes.set(xlabel="mean drag in N with its 95 % interval", ylim=(len(names) - 0.5, -0.5))
        if references:
            _legend_below(figure, axes)
    return figure
