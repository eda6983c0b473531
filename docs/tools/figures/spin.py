"""Mean drag and torque over the spin ratio, with 95 % confidence intervals."""

from matplotlib.figure import Figure
from tables import table

from dragchain.figures.style import COLOURS, GREEN
from dragchain.statistics.estimate import student_quantile

PACKINGS = 3
"""Of each level of the spin."""


def draw() -> Figure:
    """Draw it."""
    rows = table("motion/spin")
    times = student_quantile(PACKINGS - 1)
    figure = Figure(figsize=(7.6, 2.8), layout="constrained")
    panels = (
        ("drag_n", "drag_se_n", "mean drag (N)", COLOURS["drag"]),
        ("torque_mn_m", "torque_se_mn_m", "mean torque (mN m)", GREEN),
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
