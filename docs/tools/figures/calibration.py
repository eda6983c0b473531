"""Effective against entered restitution, by fidelity and limitForce."""

from matplotlib.figure import Figure
from tables import table

from dragchain.figures.style import BLUE, GREY, ORANGE


def draw() -> Figure:
    """Draw the difference from the entered value, and the range of single impacts."""
    rows = table("calibration/bias")
    figure = Figure(figsize=(7.6, 3.1), layout="constrained")
    for axes, limited in zip(figure.subplots(1, 2, sharey=True), (True, False), strict=True):
        own = rows[rows["limit_force"] == limited]
        for name, purpose, colour in (
            ("standard", "production", BLUE),
            ("draft", "production", ORANGE),
            ("standard", "reference", GREY),
        ):
            part = own[(own["fidelity"] == name) & (own["purpose"] == purpose)].sort_values(
                "restitution_entered"
            )
            entered = part["restitution_entered"]
            sides = [
                part["restitution_effective"] - part["lowest"],
                part["highest"] - part["restitution_effective"],
            ]
            label = "physical modulus, small step" if purpose == "reference" else name
            axes.errorbar(
                entered,
                part["restitution_effective"] - entered,
                sides,
                fmt="o-",
                color=colour,
                lw=1,
                ms=3,
                capsize=2,
                label=label,
            )
        axes.axhline(0, color="black", lw=0.7)
        axes.set(xlabel="entered restitution", title=f"limitForce {'on' if limited else 'off'}")
    figure.axes[0].set_ylabel("effective minus entered restitution")
    figure.axes[0].legend()
    return figure
