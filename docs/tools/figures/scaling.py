"""Mean drag over depth, diameter, friction and speed, with the power laws fitted to it."""

from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter
from tables import STORE

from dragchain.figures.panels import log_ticks
from dragchain.figures.style import COLOURS, GREY, LIGHT

LABELS = {
    "drag-depth": ("immersion depth (mm)", 1e3),
    "drag-diameter": ("diameter of the workpiece (mm)", 1e3),
    "drag-friction": ("friction of particle on workpiece", 1.0),
    "drag-speed": ("speed of the workpiece (mm/s)", 1e3),
}


def draw() -> Figure:
    """Draw it: one panel per study, both axes logarithmic."""
    figure = Figure(figsize=(7.6, 5.4), layout="constrained")
    for axes, (name, (label, factor)) in zip(
        figure.subplots(2, 2).flat, LABELS.items(), strict=True
    ):
        found = STORE.record(f"scaling/{name}")
        factor = 2 * factor if found["field"].endswith("radius_m") else factor
        curve = found["fit"]["curve"]
        x = [factor * point["x"] for point in curve]
        axes.fill_between(
            x, [p["ci95_low"] for p in curve], [p["ci95_high"] for p in curve], color=LIGHT, lw=0
        )
        axes.plot(x, [point["value"] for point in curve], color=GREY)
        runs = found["runs"]
        axes.plot(
            [factor * run["level"] for run in runs],
            [abs(run["drag_n"]) for run in runs],
            "o",
            color=COLOURS["drag"],
        )
        exponent = found["fit"]["exponent"]
        value, low, high = (exponent[key] for key in ("value", "ci95_low", "ci95_high"))
        words = f"exponent {value:.2f} ({low:.2f} to {high:.2f})"
        axes.set(xscale="log", yscale="log", xlabel=label, ylabel="mean drag (N)", title=words)
        for axis in (axes.xaxis, axes.yaxis):
            log_ticks(axis, steps=(1.0, 1.5, 2.0, 3.0, 5.0, 7.0))
            axis.set_minor_formatter(NullFormatter())
    return figure
