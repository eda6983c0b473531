"""Figures of a stability map."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from dragchain.arrays import Floats
from dragchain.figures.style import BLUE, GREEN, GREY, ORANGE, RED, WIDTH_IN
from dragchain.stability.classes import (
    CLASSES,
    ENERGY,
    INACCURATE,
    LOST,
    OVERLAP,
    REFUSED,
    STABLE,
    TOLERANCE,
)
from dragchain.stability.document import RestitutionErrors
from dragchain.stability.safe_steps import REGIMES, RULE, head_on_impacts

_COLOURS = {
    STABLE: GREEN,
    INACCURATE: "#F0E442",
    OVERLAP: "#56B4E9",
    ENERGY: ORANGE,
    LOST: RED,
    REFUSED: "#8a929b",
}
"""After Okabe and Ito (2008): told apart with any kind of colour vision."""

_INK = "#1d2733"
_LETTERS = {STABLE: "", INACCURATE: "i", OVERLAP: "o", ENERGY: "e", LOST: "L", REFUSED: "x"}
_TITLES = {
    "impact": "Single impacts ({} per run, at different phases within a time step)",
    "settle": "Settling of {} particles in a bowl",
    "column": "At rest under load: settled packing or column of particles in a tube",
    "drag": "Slow drag: workpiece plunges in and is dragged through the packing",
}


def draw(
    points: pd.DataFrame,
    conditions: pd.DataFrame,
    errors: RestitutionErrors,
    sizes: Mapping[str, int],
) -> dict[str, Figure]:
    """All figures by name.

    Parameters
    ----------
    points, conditions : DataFrame
        One row per point, and per condition.
    errors : RestitutionErrors
    sizes : mapping of str to int
        Impacts or particles of a run, by regime.
    """
    tested = points[~points["reference"]]
    figures = {
        f"map_{regime}": _map(
            tested[tested["regime"] == regime],
            conditions[conditions["regime"] == regime],
            _TITLES[regime].format(sizes.get(regime)),
        )
        for regime in REGIMES
        if (points["regime"] == regime).any()
    }
    if errors.steps_per_contact:
        figures["restitution_error"] = _errors(head_on_impacts(points), errors)
    figures["fraction_of_critical"] = _fractions(points)
    return figures


def _map(points: pd.DataFrame, conditions: pd.DataFrame, title: str) -> Figure:
    """Conditions down, steps across, a colour and a letter per class."""
    steps = np.sort(points["fraction"].unique())
    figure = Figure(figsize=(WIDTH_IN, 1.5 + 0.24 * len(conditions)), layout="constrained")
    axes = figure.add_subplot()
    lines = conditions["condition"].tolist()
    for point in points.to_dict("records"):
        column = int(np.searchsorted(steps, point["fraction"]))
        _cell(axes, column, lines.index(point["condition"]), point["class"])
    for line, condition in enumerate(conditions.to_dict("records")):
        for fraction, style in ((1.0, "-"), (condition["damped_fraction"], ":")):
            at = condition["critical_over_rayleigh"] * fraction
            _mark(axes, line, at, steps, style)
    axes.set_xlim(-0.5, len(steps) - 0.5)
    axes.set_ylim(len(conditions) - 0.5, -0.5)
    axes.set_xticks(range(len(steps)), [f"{100 * step:g}" for step in steps])
    axes.set_yticks(range(len(conditions)), conditions["label"].tolist(), fontsize=7.5)
    axes.set_xlabel("time step (% of Rayleigh time of the smallest particle)")
    figure.suptitle(title, x=0.01, ha="left", fontsize=9.5)
    axes.grid(False)
    axes.tick_params(length=0)
    handles: list[Patch | Line2D] = [
        Patch(facecolor=_COLOURS[kind], label=f"{_LETTERS[kind]} {kind}".strip())
        for kind in _classes_of(points)
    ]
    handles += [
        Line2D([], [], color=_INK, lw=1.6, label="critical step of the contact network"),
        Line2D([], [], color=_INK, lw=1.6, ls=":", label="critical step, damped"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=8)
    return figure


def _classes_of(points: pd.DataFrame) -> list[str]:
    return [kind for kind in CLASSES if (points["class"] == kind).any()]


def _cell(axes: Axes, column: int, line: int, kind: str) -> None:
    corner = (column - 0.48, line - 0.44)
    axes.add_patch(Rectangle(corner, 0.96, 0.88, facecolor=_COLOURS[kind], lw=0))
    axes.text(column, line, _LETTERS[kind], ha="center", va="center", fontsize=7, color=_INK)


def _mark(axes: Axes, line: int, at: float, steps: Floats, style: str) -> None:
    """Mark a step, over the Rayleigh time, in the line of a condition."""
    if math.isfinite(at) and steps[0] <= at <= steps[-1]:
        x = float(np.interp(math.log(at), np.log(steps), np.arange(len(steps))))
        axes.plot([x, x], [line - 0.44, line + 0.44], style, color=_INK, lw=1.6)


def _errors(impacts: pd.DataFrame, table: RestitutionErrors) -> Figure:
    figure = Figure(figsize=(WIDTH_IN, 3.6), layout="constrained")
    axes = figure.add_subplot()
    own = impacts[impacts["restitution_error"].notna()]
    shades = axes.scatter(
        own["steps_per_contact"],
        own["restitution_error"].abs().clip(lower=1e-6),
        c=own["setting_restitution"],
        cmap="viridis",
        s=16,
        vmin=0.0,
        vmax=1.0,
    )
    steps = table.steps_per_contact
    axes.plot(steps, table.worst, color=RED, label="largest, any restitution")
    axes.plot(steps, table.ordinary_worst, color=BLUE, label="largest, e ≥ 0.5")
    axes.plot(steps, table.median, color=_INK, label="median")
    axes.axhline(TOLERANCE, color=GREY, ls="--", lw=1, label="tolerance")
    axes.set(xscale="log", yscale="log", ylim=(5e-6, 10))
    axes.set_xlabel("time steps per contact (elastic Hertz contact time / time step)")
    axes.set_ylabel("largest error of restitution per run")
    axes.set_title("Single impacts: error of restitution relative to the reference step")
    axes.legend(loc="upper right")
    figure.colorbar(shades, label="input restitution")
    return figure


def _fractions(points: pd.DataFrame) -> Figure:
    """Every point over its step as a fraction of the Rayleigh time and of the critical step."""
    figure = Figure(figsize=(WIDTH_IN, 4.2), layout="constrained")
    panels: Sequence[tuple[str, str, float, Sequence[str]]] = (
        ("fraction", "time step / Rayleigh time", RULE, REGIMES),
        ("fraction_of_critical", "time step / critical step", 1.0, ()),
    )
    for place, (column, label, limit, names) in enumerate(panels, start=1):
        axes = figure.add_subplot(1, 2, place)
        for line, regime in enumerate(REGIMES):
            own = points[(points["regime"] == regime) & ~points["reference"]]
            own = own[np.isfinite(own[column])]
            if not own.empty:
                colours = own["class"].map(_COLOURS).tolist()
                axes.scatter(own[column], line + _offsets(own), c=colours, s=9, lw=0)
        axes.axvline(limit, color=_INK, ls="--", lw=1)
        axes.set(xscale="log", xlabel=label, yticks=range(len(REGIMES)), ylim=(3.5, -0.5))
        axes.set_yticklabels(names)
    kinds = _classes_of(points)
    handles = [Patch(facecolor=_COLOURS[kind], label=kind) for kind in kinds]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(kinds), fontsize=8)
    return figure


def _offsets(points: pd.DataFrame) -> Floats:
    """Place of each point's condition within the line of its regime, (N,)."""
    codes, names = pd.factorize(points["condition"])
    spread = np.linspace(-0.36, 0.36, len(names)) if len(names) > 1 else np.zeros(1)
    return np.asarray(spread[codes])
