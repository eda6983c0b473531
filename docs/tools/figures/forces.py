"""Force on the workpiece over one revolution, with the experiment as a band."""

from matplotlib.figure import Figure
from tables import table

from dragchain.figures.style import COLOURS


def draw() -> Figure:
    """Draw means over short blocks, the mean of the run, and those of the paper."""
    force, run = table("validation/run_force"), table("validation/run").iloc[0]
    study = table("study/uhlmann2015").iloc[0]
    mean, std = study["reference_experiment_drag_mean_n"], study["reference_experiment_drag_std_n"]
    drag, lateral = COLOURS["drag"], COLOURS["lateral"]
    figure = Figure(figsize=(7.6, 3.2), layout="constrained")
    axes = figure.subplots()
    axes.axhspan(
        mean - std,
        mean + std,
        color=COLOURS["experiment"],
        alpha=0.15,
        lw=0,
        label="experiment, mean ± standard deviation",
    )
    axes.axhline(mean, color=COLOURS["experiment"], ls="--", lw=1.6, zorder=3)
    axes.axhline(
        study["reference_simulation_drag_mean_n"],
        color=COLOURS["simulation"],
        ls=":",
        label="simulation of Uhlmann et al. (2015), mean",
    )
    axes.plot(force["time_s"], force["lateral_n"], color=lateral, lw=0.7, label="lateral force")
    axes.plot(force["time_s"], force["drag_n"], color=drag, lw=0.8, label="drag force, 20 ms means")
    axes.axhline(run["drag_mean_n"], color=drag, lw=1.2)
    axes.set(
        xlabel="time since the start of the drag (s)",
        ylabel="force on the workpiece (N)",
        xlim=(0, force["time_s"].max()),
    )
    figure.legend(loc="outside lower left", ncols=2)
    return figure
