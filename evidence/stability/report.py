"""The report on a stability map: figures and page."""

import math
from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.arrays import Floats
from dragchain.figures.panels import head, key, legend_below, new_panels, row_names
from dragchain.figures.style import GREEN, GREY, INK, ORANGE, RED
from dragchain.report.campaign import write_report
from dragdeck.cases.ranks import cores_here
from evidence.stability.judge import (
    CLASSES,
    ENERGY,
    INACCURATE,
    LOST,
    OVERLAP,
    REFUSED,
    STABLE,
    STOPPED,
    judge_points,
)
from evidence.stability.measures import PointRun
from evidence.stability.points import REGIMES
from evidence.stability.runs import run_map
from evidence.stability.safe_steps import RULE, conditions, summarise_map
from evidence.stability.scenes import PHASES


def map_stability(out_dir: Path, points: Path, cores: int | None) -> None:
    """Run the points of a map and write tables, figures and page.

    Parameters
    ----------
    out_dir : Path
        Gets a folder for each regime with its runs, ``points.csv``, ``points.parquet``,
        ``conditions.csv``, ``conditions.parquet``, ``stability.json``, ``figures/*.png`` and
        ``report.html``.
    points : Path
        The map.
    cores : int
        Runs at the same time.

    Errors are those of `run_map`.
    """
    write_stability(out_dir, run_map(points, out_dir, cores or cores_here()))


def write_stability(out_dir: Path, runs: Sequence[PointRun]) -> None:
    """Write tables, figures and page of a map whose points were run."""
    points = judge_points(runs)
    found_conditions = conditions(points)
    summary = summarise_map(points, found_conditions, runs)
    tested = points[~points["reference"]]
    axes = points.groupby(["regime", "axis"], sort=False)["label"]
    write_report(
        out_dir,
        "stability/stability.html.j2",
        draw=lambda: draw_map(points, found_conditions),
        tables={"points": points, "conditions": found_conditions},
        documents={"stability": summary},
        package="evidence",
        summary=summary,
        phases=PHASES,
        class_names=CLASSES,
        classes=[
            {"regime": regime, **Counter(dict.fromkeys(CLASSES, 0)), **Counter(group["class"])}
            for regime, group in tested.groupby("regime", sort=False)
        ],
        axes=[
            {
                **dict(zip(("regime", "axis"), names, strict=True)),
                "conditions": group.nunique(),
                "runs": len(group),
                "values": "" if names[1] == "more" else "; ".join(dict.fromkeys(group)),
            }
            for names, group in axes
        ],
        errors=pd.DataFrame(dict(summary.restitution_error)).to_dict("records"),
        conditions=[_with_reference(row) for row in found_conditions.to_dict("records")],
        refusals=list(dict.fromkeys(points.loc[points["class"] == REFUSED, "why"])),
        past_limits=int(points["why"].str.startswith(STOPPED).sum()),
        rule=RULE,
    )


def _with_reference(row: Mapping[Hashable, object]) -> dict[Hashable, object]:
    """A condition with its reference in words: its class, and why if it is not stable."""
    why = "" if row["usable"] else f": {row['reference_why']}"
    return {**row, "reference": f"{row['reference_class']}{why}"}


# --- figures -----------------------------------------------------------------------------------

COLOURS = {
    STABLE: GREEN,
    INACCURATE: "#F0E442",
    OVERLAP: "#56B4E9",
    ENERGY: ORANGE,
    LOST: RED,
    REFUSED: GREY,
}
"""Of the classes."""

_LETTERS = {STABLE: "", INACCURATE: "i", OVERLAP: "o", ENERGY: "e", LOST: "L", REFUSED: "x"}
_CRITICAL = {"-": "critical step of the contact network", ":": "critical step, damped"}
"""Lines of the maps."""

_TITLES = {
    "impact": f"Single impacts ({PHASES} per run, at different phases within a time step)",
    "settle": "Settling of particles in a bowl",
    "column": "At rest under load: settled packing or column of particles in a tube",
    "drag": "Slow drag: workpiece plunges in and is dragged through the packing",
}


def draw_map(points: pd.DataFrame, conditions: pd.DataFrame) -> dict[str, Figure]:
    """The map of each regime by name; a row per point, and per condition."""
    tested = points[~points["reference"]]
    drawn = {}
    for regime in (name for name in REGIMES if (points["regime"] == name).any()):
        finished, rows = (table[table["regime"] == regime] for table in (tested, conditions))
        drawn[f"map_{regime}"] = draw_regime(finished, rows, _TITLES[regime])
    return drawn


def draw_regime(points: pd.DataFrame, conditions: pd.DataFrame, title: str) -> Figure:
    """Conditions down, steps across, a colour and a letter per class."""
    steps = np.sort(points["fraction"].unique())
    figure, (axes,) = new_panels(1.5 + 0.24 * len(conditions))
    lines = conditions["condition"].tolist()
    for point in points.to_dict("records"):
        column = int(np.searchsorted(steps, point["fraction"]))
        _cell(axes, column, lines.index(point["condition"]), point["class"])
    for line, condition in enumerate(conditions.to_dict("records")):
        fractions = 1.0, condition["damped_fraction"]
        for fraction, style in zip(fractions, _CRITICAL, strict=True):
            _mark(axes, line, condition["critical_over_rayleigh"] * fraction, steps, style)
    axes.set(xlim=(-0.5, len(steps) - 0.5))
    axes.set_xticks(range(len(steps)), [f"{100 * step:g}" for step in steps])
    row_names(axes, conditions["label"].tolist())
    axes.set_xlabel("time step (% of Rayleigh time of the smallest particle)")
    head(figure, title)
    axes.grid(False)
    axes.tick_params(length=0)
    axes.tick_params("y", labelsize=7.5)
    _class_keys(axes, points)
    for style, name in _CRITICAL.items():
        key(axes, name, marker="", ls=style, color=INK, lw=1.6)
    return legend_below(figure)


def _class_keys(axes: Axes, points: pd.DataFrame) -> None:
    """Name the colours of the classes that occur."""
    present = set(points["class"])
    for kind in filter(present.__contains__, CLASSES):
        name = f"{_LETTERS[kind]} {kind}".strip()
        key(axes, name, color=COLOURS[kind], marker="s", ms=8)


def _cell(axes: Axes, column: int, line: int, kind: str) -> None:
    axes.barh(line, 0.96, 0.88, column - 0.48, color=COLOURS[kind])
    axes.text(column, line, _LETTERS[kind], ha="center", va="center", fontsize=7, color=INK)


def _mark(axes: Axes, line: int, at: float, steps: Floats, style: str) -> None:
    """Mark a step, over the Rayleigh time, in the line of a condition."""
    if math.isfinite(at) and steps[0] <= at <= steps[-1]:
        x = float(np.interp(math.log(at), np.log(steps), np.arange(len(steps))))
        axes.plot([x, x], [line - 0.44, line + 0.44], style, color=INK, lw=1.6)
