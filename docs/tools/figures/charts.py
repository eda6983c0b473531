"""Figures of numbers: each is a function that draws it from records."""

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from records import chosen, record_table

from dragchain.figures.panels import interval_rows, key, log_ticks, new_panels, row_mark, row_names
from dragchain.figures.style import (
    ABOVE_SCALE,
    BLUE,
    COLOURS,
    GREEN,
    GREY,
    INK,
    LIGHT,
    MARKERS,
    ORANGE,
    RED,
    force_map,
    top_of_scale,
)
from dragchain.scaling.document import read_scalings
from dragchain.scaling.fit import draw_scalings
from dragchain.statistics.estimate import Estimate
from evidence.stability.report import draw_regime
from evidence.validation.report import MEAN_DRAG, effect_bar


def _draw_calibration() -> Figure:
    """Effective minus entered restitution by fidelity and limitForce; range of single impacts."""
    kinds = {
        "standard": ("production", "standard", BLUE),
        "draft": ("production", "draft", ORANGE),
        "physical modulus, small step": ("reference", "standard", GREY),
    }
    figure, panels = new_panels(3.1, 2, sharey=True)
    for axes, limited in zip(panels, (True, False), strict=True):
        for label, (purpose, fidelity, colour) in kinds.items():
            rows = f"limit_force == {limited} and purpose == {purpose!r} and fidelity == "
            part = chosen("calibration/bias", f"{rows}{fidelity!r}")
            part = part.sort_values("restitution_entered")
            entered, effective = part["restitution_entered"], part["restitution_effective"]
            sides = [effective - part["lowest"], part["highest"] - effective]
            axes.errorbar(
                entered, effective - entered, sides,
                fmt="o-", color=colour, lw=1, ms=3, capsize=2, label=label,
            )  # fmt: skip
        axes.axhline(0, color="black", lw=0.7)
        axes.set(xlabel="entered restitution", title=f"limitForce {'on' if limited else 'off'}")
    panels[0].set_ylabel("effective minus entered restitution")
    panels[0].legend()
    return figure


def _draw_forces() -> Figure:
    """Force on the workpiece over one revolution, with the experiment as a band."""
    force, run = record_table("validation/run_force"), record_table("validation/run").iloc[0]
    paper, colour = record_table("study/uhlmann2015").iloc[0], COLOURS["experiment"]
    mean, std = paper["reference_experiment_drag_mean_n"], paper["reference_experiment_drag_std_n"]
    figure, (axes,) = new_panels(3.2)
    label = "experiment, mean ± standard deviation"
    axes.axhspan(mean - std, mean + std, color=colour, alpha=0.15, lw=0, label=label)
    axes.axhline(mean, color=colour, ls="--", lw=1.6, zorder=3)
    label = "simulation of Uhlmann et al. (2015), mean"
    published = paper["reference_simulation_drag_mean_n"]
    axes.axhline(published, color=COLOURS["simulation"], ls=":", label=label)
    for name, width, label in (
        ("lateral", 0.7, "lateral force"),
        ("drag", 0.8, "drag force, 20 ms means"),
    ):
        axes.plot(force["time_s"], force[f"{name}_n"], color=COLOURS[name], lw=width, label=label)
    axes.axhline(run["drag_mean_n"], color=COLOURS["drag"], lw=1.2)
    axes.set(
        xlabel="time since the start of the drag (s)",
        ylabel="force on the workpiece (N)",
        xlim=(0, force["time_s"].max()),
    )
    figure.legend(loc="outside lower left", ncols=2)
    return figure


def _draw_load_map() -> Figure:
    """Sliding load per area and path length on the unrolled lateral surface."""
    facets, study = record_table("validation/run_facets"), record_table("study/uhlmann2015").iloc[0]
    side = facets[facets["centre_z_m"] > 1e-6]
    depth_m = study["motion_immersion_depth_m"]
    turn = np.degrees(np.arctan2(side["centre_y_m"], side["centre_x_m"]))
    edges = (np.linspace(-180, 180, 22), np.arange(-0.02, depth_m + 1e-9, 0.01))
    load, area = (
        np.histogram2d(turn, depth_m - side["centre_z_m"], edges, weights=weights)[0]
        for weights in (side["force_slide_pa"] * side["area_m2"], side["area_m2"])
    )
    figure, (axes,) = new_panels(3.4)
    values = np.divide(load, area, out=np.zeros_like(load), where=area > 0)
    top = top_of_scale(values, area)
    shown = axes.pcolormesh(edges[0], 1e3 * edges[1], values.T, cmap=force_map(), vmin=0, vmax=top)
    axes.axhline(0, color="black", lw=0.8, ls="--")
    axes.text(-176, -1, "bed surface", fontsize=8, va="bottom")
    axes.set(
        xlabel="azimuth from the direction of motion, counter-clockwise (degrees)",
        ylabel="depth (mm)",
        xticks=range(-180, 181, 45),
    )
    axes.invert_yaxis()
    axes.grid(visible=False)
    label = f"sliding load per area\nand path length (N/m²)\n{ABOVE_SCALE}"
    figure.colorbar(shown, label=label.replace(", on", "\non"), extend="max")
    return figure


def _draw_scaling() -> Figure:
    """Mean drag over depth, diameter, friction and speed, with the fitted power laws."""
    return draw_scalings(read_scalings())


def _draw_machine_speed() -> Figure:
    """Mean drag, and number of contacts, over the speed of the workpiece."""
    rows = record_table("scaling/machine_speed")
    figure, (drags, contacts) = new_panels(2.8, 2)
    for axes, name in ((drags, "drag_n"), (contacts, "contacts")):
        value, low, high = (rows[f"{name}{end}"].abs() for end in ("", *_ENDS))
        sides = value - np.minimum(low, high), np.maximum(low, high) - value
        axes.errorbar(rows["speed_m_s"], value, sides, fmt="o", color=COLOURS["drag"], capsize=3)
        axes.set(xlabel="speed (m/s)", xlim=(0, None), ylim=(0, None))
    law = record_table("scaling/machine_speed_law").set_index("name")["value"]
    at_rest, rise = law["at_rest_n"], law["rise_n_s2_m2"]
    speeds = np.linspace(0, rows["speed_m_s"].max(), 50)
    drags.plot(speeds, at_rest + rise * speeds**2, color=GREY, lw=1,
               label=f"{at_rest:.2f} N + {rise:.2f} N s²/m² · v²")  # fmt: skip
    drags.set_ylabel("mean drag (N)")
    drags.legend()
    contacts.set_ylabel("contacts on the workpiece at a time")
    return figure


_ENDS = ("_ci95_low", "_ci95_high")


def _draw_simplifications() -> Figure:
    """Confidence intervals of the change of the mean drag in simpler scenes."""
    rows = []
    for row in record_table("scenes/simplifications").to_dict("records"):
        change = Estimate(*(100 * row[f"drag_mean_{end}"] for end in ("value", *_CI)))
        rows.append((row["change"], change, COLOURS["drag"]))
    return interval_rows(rows, {}, "change of the mean drag (%), 95 % CI", zero=True)


def _draw_spin() -> Figure:
    """Mean drag and torque over the spin ratio, with 95 % confidence intervals."""
    rows = record_table("motion/spin")
    figure, panels = new_panels(2.8, 2)
    shown = (
        ("drag_n", "drag_half_n", "mean drag (N)", COLOURS["drag"]),
        ("torque_mn_m", "torque_half_mn_m", "mean torque (mN m)", GREEN),
    )
    for axes, (name, half, label, colour) in zip(panels, shown, strict=True):
        axes.errorbar(rows["spin_ratio"], rows[name], rows[half], fmt="o-", color=colour, capsize=3)
        axes.set(xlabel="surface speed of the spin / speed along the path", ylabel=label)
        axes.set_xscale("symlog", linthresh=1)
        axes.set_xticks(rows["spin_ratio"], [f"{ratio:g}" for ratio in rows["spin_ratio"]])
        axes.axhline(0, color="black", lw=0.6)
    return figure


def _draw_stability_impact() -> Figure:
    """Classes of single impacts by condition and time step."""
    return _regime("impact", "Single impacts")


def _draw_stability_column() -> Figure:
    """Classes of packings at rest by condition and time step."""
    return _regime("column", "Packing at rest under a load")


def _regime(regime: str, title: str) -> Figure:
    points = chosen("stability/points", f"not reference and regime == {regime!r}")
    points["critical_over_rayleigh"] = points["critical_step_s"] / points["rayleigh_time_s"]
    return draw_regime(points, points.drop_duplicates("condition"), title)


def _draw_tradeoff(tolerance: float = 0.1) -> Figure:
    """Signed error of the mean drag against CPU time; Pareto-optimal settings are numbered."""
    rows = chosen("tradeoff/settings/errors", "name == 'drag_mean' and not breaks")
    rows = rows[(rows["failed"] == 0) & (rows["runs"] > 1)].sort_values("relative_cost")
    figure, (axes,) = new_panels(4.2, 1, 7.2)
    axes.axhspan(-100 * tolerance, 100 * tolerance, color=LIGHT, alpha=0.35, lw=0)
    axes.axhline(0, color="black", lw=0.7)
    levels = sorted(rows["youngs_modulus_scale"].unique(), reverse=True)
    shades = matplotlib.colormaps["viridis"](np.linspace(0, 0.85, len(levels)))
    for level, shade, mark in zip(levels, shades, MARKERS, strict=False):
        settings = rows[rows["youngs_modulus_scale"] == level]
        error, low, high = 100 * settings[["value", *_CI]].to_numpy().T
        axes.errorbar(
            1 / settings["relative_cost"], error, [error - low, high - error],
            fmt=mark, color=shade, capsize=2, lw=1, label=f"Young's modulus \u00d7 {level:g}",
        )  # fmt: skip
    best = rows[rows["bound"] < rows["bound"].cummin().shift(fill_value=np.inf)]
    words = ["Pareto-optimal by cost and\n95 % bound of the error:"]
    for count, row in enumerate(best.itertuples(), start=1):
        speed = f", speed \u00d7 {row.speed_factor:g}" if row.speed_factor != 1 else ""
        step = f"{100 * row.timestep_fraction:.0f} %{speed}"
        words.append(f"{count}  E \u00d7 {row.youngs_modulus_scale:g}, {step}")
        axes.annotate(
            str(count), (1 / row.relative_cost, 100 * row.ci95_high), (0, 3),
            textcoords="offset points", fontsize=8.5, weight="bold", color=INK, ha="center",
        )  # fmt: skip
    figure.text(1.0, 0.93, "\n".join(words), fontsize=8, va="top", color=INK)
    axes.text(
        0.01, 100 * tolerance - 0.4, "within 10 %",
        fontsize=8, color=GREY, va="top", transform=axes.get_yaxis_transform(),
    )  # fmt: skip
    axes.set(
        xscale="log",
        xlabel="CPU time of the reference / CPU time of the setting",
        ylabel="error of the mean drag (%), 95 % CI",
        ylim=(-17, 22),
    )
    log_ticks(axes.xaxis, steps=(1.0, 3.0))
    axes.legend(loc="lower left", ncols=3)
    return figure


def _draw_validation() -> Figure:
    """Mean drag by packing, setting and changed input, beside measured and published values."""
    means = record_table("validation/force").set_index("name").loc["drag_n"]
    drag = Estimate(*means[["mean_value", "mean_ci95_low", "mean_ci95_high"]])
    bars = [("all packings, physical E", drag, COLOURS["drag"])]
    for row in record_table("validation/packings").itertuples():
        packing = Estimate(row.drag_n_mean, row.drag_n_ci95_low, row.drag_n_ci95_high)
        bars.append((f"packing {row.seed}", packing, BLUE))
    effects = chosen("validation/effects", "quantity == 'drag_mean'").fillna({"field": ""})
    bars += [effect_bar(drag.value, effect) for effect in effects.itertuples()]
    published = record_table("validation/comparison").itertuples()
    lines = {f"{row.label} (published)": row.mean_n for row in published}
    return interval_rows(bars, lines, MEAN_DRAG)


def _draw_published() -> Figure:
    """Predictions over published values, and those of which the sign was published."""
    rows = record_table("published/comparison").dropna(subset=["predicted", "published"])
    figure, panels = new_panels(2.6, 3, 8.6)
    shown = (
        ("kind == 'value'", "predicted / published", 1.0),
        ("kind == 'sign' and result == 'lift'", "lift (N)", 0.0),
        ("kind == 'sign' and result == 'spin'", "difference of the reduction", 0.0),
    )
    for axes, (chosen_rows, label, null) in zip(panels, shown, strict=True):
        part = rows.query(chosen_rows)
        for place, row in enumerate(part.itertuples()):
            known = Estimate(row.predicted, row.low, row.high)
            row_mark(axes, place, known.over(row.published if null else 1.0), BLUE)
        row_names(axes, [f"{row.no}: {row.short}" for row in part.itertuples()])
        axes.axvline(null, color=RED, ls="--")
        axes.set_xlabel(label)
    return figure


def _draw_verification(smallest: float = 1e-12) -> Figure:
    """Largest error relative to its tolerance, where that is a number."""
    rows = record_table("verification/results")
    rows = rows.assign(tolerance=pd.to_numeric(rows["tolerance"], errors="coerce"))
    rows = rows.dropna(subset=["tolerance"])
    ratio = (rows["largest_error"] / rows["tolerance"]).clip(lower=smallest)
    names = [f"{row.test} {row.subject}: {row.quantity}" for row in rows.itertuples()]
    figure, (axes,) = new_panels(0.21 * len(rows) + 0.9, 1, 8.6)
    places = range(len(rows), 0, -1)
    axes.hlines(places, smallest, ratio, color=BLUE, lw=1)
    axes.plot(ratio, places, "o", color=BLUE)
    axes.axvline(1.0, color=RED, ls="--")
    axes.set_yticks(list(places), names, fontsize=7.5)
    axes.set(xscale="log", xlabel="largest error / tolerance", xlim=(0.5 * smallest, 10))
    axes.grid(axis="y", visible=False)
    return figure


def _draw_windows() -> Figure:
    """Soft run and windows in the scene of the paper, relative to a run with the physical E."""
    rows = record_table("windows/paper").dropna(subset=["stiff"]).reset_index()
    figure, (axes,) = new_panels(3.0)
    widths = 100 * rows["stiff_half_width"]
    axes.barh(rows.index, 2 * widths, left=-widths, color=LIGHT, label="reference, 95 % CI")
    ratios = rows[["soft", "value", *_CI]].div(rows["stiff"], axis=0).sub(1).mul(100)
    axes.plot(ratios["soft"], rows.index, "s", color=ORANGE, label="soft run")
    for place, (_, *windows) in enumerate(ratios.to_numpy()):
        row_mark(axes, place, Estimate(*windows), BLUE)
    key(axes, "windows, 95 % CI", color=BLUE)
    axes.axvline(0, color="black", lw=0.7)
    row_names(axes, record_table("quantities").set_index("name")["label"][rows["quantity"]])
    axes.set_xlabel("difference from the reference (%)")
    figure.legend(loc="outside upper center", ncols=3)
    axes.grid(axis="y", visible=False)
    return figure


_CI = ("ci95_low", "ci95_high")


def _draw_ways() -> Figure:
    """Half-width to be expected against CPU time, of the ways to drag and to contacts."""
    figure, panels = new_panels(3.2, 2, sharey=True)
    table = record_table("ways")
    titles = {"drag_mean": "mean drag", "workpiece_contacts": "contacts on the workpiece"}
    for axes, (asked, title) in zip(panels, titles.items(), strict=True):
        ways = table[table["asked"] == asked]
        windows, others = ways[ways["windows"] > 0], ways[ways["windows"] == 0]
        axes.plot(windows["relative_cost"], windows["half_width"], "o-", color=BLUE, ms=3,
                  label=f"3 to {windows['windows'].max()} windows")  # fmt: skip
        for way, marker, colour in zip(others.itertuples(), "sD", (ORANGE, GREEN), strict=True):
            if np.isfinite(way.half_width):
                axes.plot(way.relative_cost, way.half_width, marker, color=colour, label=way.way)
        axes.axhline(0.1, color=GREY, lw=0.7, ls=":")
        axes.set(xlabel="CPU time / plain run", title=title, xlim=(0, None), ylim=(0, None))
        axes.yaxis.set_major_formatter(matplotlib.ticker.PercentFormatter(1.0, decimals=0))
    panels[0].set_ylabel("expected half-width of the 95 % CI")
    panels[0].legend()
    return figure


CHARTS = {
    name.removeprefix("_draw_"): draw
    for name, draw in list(globals().items())
    if name.startswith("_draw_")
}
"""What draws a chart, by the name of its file."""
