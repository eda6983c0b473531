"""Stable and unstable time steps of packings at rest and of slow drags, by condition."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from tables import table

from dragchain.figures.style import GREEN, GREY, INK, ORANGE, RED

COLOURS = {
    "stable": GREEN,
    "inaccurate": "#F0E442",
    "overlap too large": "#56B4E9",
    "energy gained": ORANGE,
    "particles lost": RED,
    "engine refused": GREY,
}
TITLES = {"column": "Packing at rest under a load", "drag": "Slow drag"}


def draw() -> Figure:
    """Draw one panel per regime, one row per condition, one column per time step."""
    points = table("stability/points")
    points = points[~points["reference"].astype(bool)].rename(columns={"class": "kind"})
    figure = Figure(figsize=(9.2, 4.4), layout="constrained")
    panels = figure.subplots(1, len(TITLES))
    for axes, (regime, title) in zip(panels, TITLES.items(), strict=True):
        _panel(axes, points[points["regime"] == regime])
        axes.set_title(title)
    handles = [
        Patch(color=colour, label=name.replace("engine", "LIGGGHTS"))
        for name, colour in COLOURS.items()
    ]
    handles.append(Patch(fill=False, ec=INK, label="critical time step of the contacts (line)"))
    figure.legend(handles=handles, loc="outside lower left", ncols=4)
    return figure


def _panel(axes: Axes, points: pd.DataFrame) -> None:
    steps = np.sort(points["fraction"].unique())
    rows = list(dict.fromkeys(points["condition"]))
    for point in points.itertuples():
        column, row = int(np.searchsorted(steps, point.fraction)), rows.index(point.condition)
        axes.barh(row, 0.94, 0.86, column - 0.47, color=COLOURS[point.kind])
    for row, condition in enumerate(rows):
        own = points[points["condition"] == condition]
        critical = (own["critical_step_s"] / own["rayleigh_time_s"]).median()
        if steps[0] <= critical <= steps[-1]:
            x = np.interp(np.log(critical), np.log(steps), np.arange(len(steps)))
            axes.plot([x, x], [row - 0.45, row + 0.45], color=INK, lw=1.8)
    names = points.drop_duplicates("condition").set_index("condition")["label"]
    axes.set_yticks(range(len(rows)), [names[condition] for condition in rows], fontsize=7.5)
    axes.set_xticks(range(len(steps)), [f"{100 * step:g}" for step in steps])
    axes.set_xlabel("time step (% of the Rayleigh time)")
    axes.invert_yaxis()
    axes.grid(visible=False)
