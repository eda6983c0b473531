"""The figures of the documentation, drawn from the records: python docs/tools --figures."""

from collections.abc import Callable
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from dragchain.figures.style import BLUE, ORANGE, drawing, png
from dragchain.statistics.estimate import student_quantile

DOCS = Path(__file__).resolve().parents[1]
PACKINGS = 3
"""Of each level of the spin."""


def spin() -> Figure:
    """Mean drag and torque over the spin ratio, with 95 % confidence intervals."""
    rows = pd.read_csv(DOCS / "data/motion/spin.csv")
    times = student_quantile(PACKINGS - 1)
    figure = Figure(figsize=(7.6, 2.8), layout="constrained")
    panels = (
        ("drag_n", "drag_se_n", "mean drag (N)", BLUE),
        ("torque_mn_m", "torque_se_mn_m", "mean torque (mN m)", ORANGE),
    )
    for axes, (name, error, label, colour) in zip(figure.subplots(1, 2), panels, strict=True):
        axes.errorbar(
            rows["spin_ratio"], rows[name], times * rows[error], fmt="o-", color=colour, capsize=3
        )
        axes.set(xlabel="surface speed of the spin / speed along the path", ylabel=label)
        axes.set_xscale("symlog", linthresh=1)
        axes.set_xticks(rows["spin_ratio"], [f"{ratio:g}" for ratio in rows["spin_ratio"]])
        axes.axhline(0, color="black", lw=0.6)
    return figure


FIGURES: dict[str, Callable[[], Figure]] = {"spin": spin}


def draw_all() -> None:
    """Draw all figures into docs/images."""
    with drawing():
        for name, draw in FIGURES.items():
            (DOCS / "images" / f"{name}.png").write_bytes(png(draw()))

