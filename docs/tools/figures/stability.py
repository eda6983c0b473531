"""Stable and unstable time steps of single impacts and of packings at rest, by condition."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from tables import table

from dragchain.figures.style import INK
from evidence.stability.report import COLOURS

TITLES = {"impact": "Single impacts", "column": "Packing at rest under a load"}


def draw() -> Figure:
    """Draw one panel per regime, one row per condition, one column per time step."""
    points = table("stability/points")
    points = points[~points["reference"].astype(bool)].rename(columns={"class": "kind"})
    figure = Figure(figsize=(9.2, 6.2), layout="constrained")
    panels = figure.subplots(1, len(TITLES))
    rows = points.groupby("regime")["condition"].nunique()[list(TITLES)].max()
    for axes, (regime, title) in zip(panels, TITLES.items(), strict=True):
        _panel(axes, points[points["regime"] == regime])
        axes.set(title=title, ylim=(rows - 0.5, -0.5))
    handles = [
        Patch(color=colour, label=name.replace("engine", "LIGGGHTS"))
        for name, colour in COLOURS.items()
    ]
    handles.append(Patch(fill=False, ec=INK, label="line: critical time step of the contacts"))
    panels[-1].legend(handles=handles, loc="lower left")
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
    axes.set_xticks(range(len(steps)), [f"{100 * step:g}" for step in steps], fontsize=7)
    axes.set_xlabel("time step (% of the Rayleigh time)")
    axes.grid(visible=False)
