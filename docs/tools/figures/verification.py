"""Largest error of each test of the contact law, relative to its tolerance."""

import pandas as pd
from matplotlib.figure import Figure
from tables import table

from dragchain.figures.style import BLUE, RED

SMALLEST = 1e-12
"""Smaller ratios are drawn here."""


def draw() -> Figure:
    """Draw one bar per quantity; tests whose tolerance is no number are left out."""
    rows = table("verification/shown")
    rows = rows.assign(tolerance=pd.to_numeric(rows["tolerance"], errors="coerce")).dropna(
        subset=["tolerance"]
    )
    ratio = (rows["largest_error"] / rows["tolerance"]).clip(lower=SMALLEST)
    names = [f"{row.tests} {row.subject}: {row.about}" for row in rows.itertuples()]
    figure = Figure(figsize=(8.6, 0.21 * len(rows) + 0.9), layout="constrained")
    axes = figure.subplots()
    places = range(len(rows), 0, -1)
    axes.hlines(places, SMALLEST, ratio, color=BLUE, lw=1)
    axes.plot(ratio, places, "o", color=BLUE)
    axes.axvline(1.0, color=RED, ls="--")
    axes.set_yticks(list(places), names, fontsize=7.5)
    axes.set(xscale="log", xlabel="largest error / tolerance", xlim=(0.5 * SMALLEST, 10))
    axes.grid(axis="y", visible=False)
    return figure
