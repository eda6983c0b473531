"""Error of the mean drag against CPU time, for every setting of the record."""

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from tables import table

from dragchain.figures.panels import log_ticks
from dragchain.figures.style import GREY, INK, LIGHT, MARKERS

TOLERANCE = 0.1


def draw() -> Figure:
    """Draw it: signed error with its interval; Pareto-optimal settings are labelled."""
    rows = table("tradeoff/errors")
    rows = rows[(rows["quantity"] == "drag_mean") & ~rows["breaks"]]
    rows = rows[(rows["failed"] == 0) & (rows["runs"] > 1)].sort_values("relative_cost")
    figure = Figure(figsize=(7.2, 4.2), layout="constrained")
    axes = figure.subplots()
    axes.axhspan(-100 * TOLERANCE, 100 * TOLERANCE, color=LIGHT, alpha=0.35, lw=0)
    axes.axhline(0, color="black", lw=0.7)
    levels = sorted(rows["youngs_modulus_scale"].unique(), reverse=True)
    shades = matplotlib.colormaps["viridis"](np.linspace(0, 0.85, len(levels)))
    for level, shade, mark in zip(levels, shades, MARKERS, strict=False):
        own = rows[rows["youngs_modulus_scale"] == level]
        value = 100 * own["value"]
        sides = [value - 100 * own["ci95_low"], 100 * own["ci95_high"] - value]
        axes.errorbar(
            1 / own["relative_cost"],
            value,
            sides,
            fmt=mark,
            color=shade,
            capsize=2,
            lw=1,
            label=f"Young's modulus x {level:g}",
        )
    best, words = np.inf, []
    for row in rows.itertuples():
        if row.bound >= best:
            continue
        best = row.bound
        speed = f", speed x {row.speed_factor:g}" if row.speed_factor != 1 else ""
        words.append(
            f"{len(words) + 1}  E x {row.youngs_modulus_scale:g}, "
            f"{row.timestep_fraction:.0%}{speed}"
        )
        place = (1 / row.relative_cost, 100 * row.ci95_high)
        axes.annotate(
            str(len(words)),
            place,
            (0, 3),
            textcoords="offset points",
            fontsize=8.5,
            weight="bold",
            color=INK,
            ha="center",
        )
    words.insert(0, "Pareto-optimal by cost and\n95 % bound of the error:")
    figure.text(1.0, 0.93, "\n".join(words), fontsize=8, va="top", color=INK)
    axes.text(
        0.01,
        100 * TOLERANCE - 0.4,
        "within 10 %",
        fontsize=8,
        color=GREY,
        va="top",
        transform=axes.get_yaxis_transform(),
    )
    axes.set(
        xscale="log",
        xlabel="CPU time of the reference / CPU time of the setting",
        ylabel="error of the mean drag (%), 95 % CI",
        ylim=(-17, 22),
    )
    log_ticks(axes.xaxis, steps=(1.0, 3.0))
    axes.legend(loc="lower left", ncols=3)
    return figure
