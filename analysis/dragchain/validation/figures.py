"""The figures of a validation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.drag.force import read_counted
from dragchain.drag.peaks import find_drag_peaks, peak_separation_s
from dragchain.figures.style import BLUE, GREEN, GREY, ORANGE, RED, WIDTH_IN
from dragchain.run.kinematics import drag_start_s
from dragchain.validation.runs_by_bed import Point

Found = Mapping[str, Any]

COLOURS = {"measured": GREEN, "published": ORANGE}


def traces(packings: Sequence[Point], comparison: Sequence[Found]) -> Figure:
    """The drag of every fill over process time, its peaks marked, over the source's band."""
    figure = Figure(figsize=(WIDTH_IN, 0.7 + 1.35 * len(packings)), layout="constrained")
    panels = np.atleast_1d(figure.subplots(len(packings), 1, sharex=True, sharey=True))
    for axes, point in zip(panels, packings, strict=True):
        samples = read_counted(point.folder, ("time_s", "drag_n"))
        time_s = samples["time_s"].to_numpy(np.float64)
        drag = samples["drag_n"].to_numpy(np.float64)
        peaks = find_drag_peaks(time_s, drag, min_separation_s=peak_separation_s(point.case))
        zero = drag_start_s(point.case)
        _bands(axes, comparison)
        axes.plot(time_s - zero, drag, color=BLUE, linewidth=0.5)
        axes.plot(peaks.time_s - zero, peaks.drag_n, "v", color=RED, markersize=3.5, label="peak")
        axes.axhline(float(drag.mean()), color="black", linewidth=1.0, label="mean of the fill")
        axes.set_title(
            f"fill {point.seed}: {drag.mean():.2f} ± {drag.std(ddof=1):.2f} N, "
            f"{len(peaks.index)} peaks"
        )
        axes.set_ylabel("drag in N")
    panels[-1].set(xlabel="process time in s")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=4)
    return figure


def _bands(axes: Axes, comparison: Sequence[Found]) -> None:
    for row in comparison:
        colour = COLOURS.get(row["label"], GREY)
        axes.axhline(row["mean_n"], color=colour, linestyle="--", label=f"{row['label']} mean")
        if row["std_n"] and row["label"] == "measured":
            low, high = row["mean_n"] - row["std_n"], row["mean_n"] + row["std_n"]
            label = "measured, one standard deviation"
            axes.axhspan(low, high, color=colour, alpha=0.12, linewidth=0, label=label)


def comparison(force: Found, compared: Sequence[Found], effects: pd.DataFrame) -> Figure:
    """Mean drags: the source's, each fill's with its own interval, and all fills together."""
    together = force["together"]["drag_n"]["mean"]
    rows: list[tuple[str, float, float, float, str]] = []
    for row in compared:
        rows.append((row["label"], *(row["mean_n"],) * 3, COLOURS.get(row["label"], GREY)))
    for row in force["packings"]:
        own = row["drag_n"]
        rows.append((f"fill {row['seed']}", own["mean"], own["ci95_low"], own["ci95_high"], BLUE))
    rows.append(
        ("fills together", *(together[k] for k in ("value", "ci95_low", "ci95_high")), "black")
    )
    means = effects[(effects["quantity"] == "drag_mean") & (effects["field"] == "")]
    for one in means.to_dict("records"):
        value, low, high = (
            together["value"] * (1.0 + one[k]) for k in ("change", "ci95_low", "ci95_high")
        )
        rows.append((setting_name({str(k): v for k, v in one.items()}), value, low, high, GREY))
    figure = Figure(figsize=(WIDTH_IN, 0.9 + 0.27 * len(rows)), layout="constrained")
    axes = figure.subplots()
    for place, (_, value, low, high, colour) in enumerate(rows):
        axes.plot([low, high], [place, place], color=colour, linewidth=2.0, alpha=0.6)
        axes.plot(value, place, "o", color=colour, markersize=5)
    axes.set_yticks(range(len(rows)), [name for name, *_ in rows])
    axes.invert_yaxis()
    axes.set(xlabel="mean drag in N; bars: 95 % interval")
    return figure


def setting_name(row: Found) -> str:
    """Name of a fidelity."""
    name = f"E x {row['youngs_modulus_scale']:g}, {100 * row['timestep_fraction']:g} %"
    return name if row["speed_factor"] == 1.0 else f"{name}, speed x {row['speed_factor']:g}"


def assumed(effects: pd.DataFrame) -> Figure:
    """What each assumed input does to the mean drag."""
    rows = effects[(effects["quantity"] == "drag_mean") & (effects["field"] != "")]
    figure = Figure(figsize=(WIDTH_IN, 0.9 + 0.3 * len(rows)), layout="constrained")
    axes = figure.subplots()
    axes.axvline(0.0, color="black", linewidth=0.8)
    names = []
    for place, row in enumerate(rows.to_dict("records")):
        names.append(f"{row['field']} = {row['value']:g} (is {row['reference_value']:g})")
        axes.plot(
            [100 * row["ci95_low"], 100 * row["ci95_high"]], [place, place], color=BLUE, linewidth=2
        )
        axes.plot(100 * row["change"], place, "o", color=BLUE)
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set(xlabel="change of the mean drag in %; bars: 95 % interval")
    return figure


def spectrum(found: Found) -> Figure:
    """Power spectrum of the drag along the path."""
    figure = Figure(figsize=(WIDTH_IN, 3.2), layout="constrained")
    axes = figure.subplots()
    waves = np.array(found["waves_per_diameter"])
    density = {name: np.array(values) for name, values in found["density"].items()}
    axes.fill_between(
        waves, density["ci95_low"], density["ci95_high"], color=BLUE, alpha=0.2, linewidth=0
    )
    axes.loglog(waves, density["mean"], color=BLUE, label="mean of the fills; band: all of them")
    half = found["half_wave"]["value"]
    label = f"half of the variance lies to the left: waves over {half:.1f} particle diameters"
    axes.axvline(1.0 / half, color=RED, linestyle="--", label=label)
    axes.set(xlabel="waves in a particle diameter of path", ylabel="power in N² particle diameters")
    axes.legend(loc="upper right")
    return figure


def around(found: Found) -> Figure:
    """Normal force on the workpiece by azimuth, and that of a contact by depth."""
    figure = Figure(figsize=(WIDTH_IN, 3.9), layout="constrained")
    left: Any = figure.add_subplot(1, 2, 1, projection="polar")
    right = figure.add_subplot(1, 2, 2)
    azimuth = found["azimuth"]
    edges = np.array(azimuth["edges"])
    middle, value, low, high = _bars(azimuth)
    colours = np.where(np.abs(middle) < np.pi / 2, BLUE, ORANGE)
    left.set_theta_zero_location("N")
    left.bar(middle, 100 * value, width=np.diff(edges), color=colours, edgecolor="white")
    reach = np.array([value - np.maximum(low, 0.0), high - value])
    left.errorbar(middle, 100 * value, 100 * reach, fmt="none", ecolor="black", elinewidth=0.8)
    left.set_thetagrids(np.arange(0, 360, 45), ["ahead", "", "left", "", "behind", "", "right", ""])
    left.set_rlabel_position(157.5)
    left.set_rmin(0.0)
    left.set_title(f"share of the normal force\nin % per {np.degrees(edges[1] - edges[0]):.0f}°")
    depth = found["depth"]
    middle, value, low, high = _bars(depth)
    right.barh(1e3 * middle, value, height=0.9e3 * np.diff(depth["edges"]), color=BLUE, alpha=0.75)
    right.errorbar(value, 1e3 * middle, xerr=[value - low, high - value], fmt="none",
                   ecolor="black", elinewidth=0.9)  # fmt: skip
    right.invert_yaxis()
    right.set(xlabel="mean normal force of a contact in N", ylabel="depth in mm")
    right.set_title("bars: 95 % interval over fills")
    return figure


def _bars(columns: Found) -> tuple[np.ndarray[Any, Any], ...]:
    edges = np.array(columns["edges"])
    value, low, high = (np.array(columns[name]) for name in ("value", "ci95_low", "ci95_high"))
    return (edges[1:] + edges[:-1]) / 2, value, np.minimum(low, value), np.maximum(high, value)


def corridor(network: Found) -> Figure:
    """Mean contact force of the network ahead of the workpiece and behind it."""
    figure = Figure(figsize=(WIDTH_IN, 3.2), layout="constrained")
    axes = figure.subplots()
    edges = np.array(network["edges_diameters"])
    middle = (edges[1:] + edges[:-1]) / 2
    for name, colour in (("ahead", BLUE), ("behind", ORANGE)):
        value, low, high = (
            np.array(network[f"{name}_n"][k]) for k in ("value", "ci95_low", "ci95_high")
        )
        axes.fill_between(middle, low, high, color=colour, alpha=0.2, linewidth=0)
        axes.plot(middle, value, "o-", color=colour, markersize=4, label=name)
    axes.axhline(
        network["far_n"]["value"], color="black", linestyle="--", label="far from the workpiece"
    )
    wall = network["wall_diameters"]
    axes.axvline(wall, color=GREY, linewidth=2.0)
    axes.text(wall, 0.0, " bowl", color=GREY, va="bottom")
    axes.set(xlabel="distance from the workpiece's surface in particle diameters", ylim=(0, None),
             ylabel="mean normal force\nof a contact in N", xlim=(0, wall + 0.5))  # fmt: skip
    axes.legend()
    return figure
