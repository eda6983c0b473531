"""Plots of a run, on given axes or on those of a new figure.

The report contains the same panels. Each function returns its axes and takes a run of
`dragchain.load`. Fonts and sizes follow the settings of Matplotlib. A missing table raises
`TableError`, which names the command that makes it.
"""

from typing import Any

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.transforms import ScaledTranslation

from dragchain.errors import UnknownNameError
from dragchain.figures.panels import as_compass, compass_bars
from dragchain.figures.style import COLOURS, true_minus
from dragchain.report import run_figures
from dragchain.results import FinishedRun

_BIN = 0.25
"""Width of the bins of contact forces, in mean forces."""


def drag(run: FinishedRun, ax: Axes | None = None, *, peaks: bool = True) -> Axes:
    """Plot drag and lateral force (N) against process time (s), with mean and published means.

    Parameters
    ----------
    run : FinishedRun
        A process run.
    ax : Axes, optional
        Axes to draw on.
    peaks : bool
        Whether to mark the peaks of the drag.

    Returns
    -------
    Axes
    """
    findings, ax = run.findings, _axes(ax)
    run_figures.forces_panel(ax, run, findings)
    if peaks:
        times_s, label = findings.peaks.process_time_s, f"{findings.peaks.count} peaks"
        ax.plot(times_s, findings.peaks.drag_n, "v", color=COLOURS["peak"], label=label)
    below = ScaledTranslation(0.0, -3.4 * rcParams["font.size"] / 72, ax.figure.dpi_scale_trans)
    ax.legend(
        loc="upper left",
        bbox_to_anchor=(0.0, 0.0),
        bbox_transform=ax.transAxes + below,
        borderaxespad=0.0,
        frameon=False,
        fontsize="small",
    )
    true_minus(ax)
    return ax


def bottleneck(run: FinishedRun, ax: Axes | None = None, *, peaks: bool = True) -> Axes:
    """Plot the bottleneck force (N) of the dominant path against process time (s).

    The dominant path of a frame is the path from workpiece to bowl with the largest bottleneck.

    Parameters
    ----------
    run : FinishedRun
        A process run.
    ax : Axes, optional
        Axes to draw on.
    peaks : bool
        Whether to draw a line at the time of each peak of the drag.

    Returns
    -------
    Axes
    """
    findings, ax = run.findings, _axes(ax)
    run_figures.bottlenecks_panel(ax, run, findings)
    if peaks:
        run_figures.peak_times(ax, findings)
    return ax


def force_around(run: FinishedRun, ax: Any = None) -> Any:
    """Plot the mean normal force (N per bin) around the workpiece; the direction of motion is up.

    Bars show the 95 % confidence intervals.

    Parameters
    ----------
    run : FinishedRun
        A process run.
    ax : PolarAxes, optional
        Made by ``plt.subplots(subplot_kw={"projection": "polar"})``.

    Returns
    -------
    PolarAxes

    Raises
    ------
    ValueError
        If `ax` is not polar.
    """
    around, ax = run.findings.azimuth, _axes(ax, projection="polar")
    if ax.name != "polar":
        raise ValueError("force_around requires polar axes: subplot_kw={'projection': 'polar'}")
    compass_bars(as_compass(ax), around.edges_rad, around.force_n)
    return ax


def force_over_depth(run: FinishedRun, ax: Axes | None = None, *, total: bool = False) -> Axes:
    """Plot the mean normal force per contact (N) against depth (mm), with 95 % CIs.

    Parameters
    ----------
    run : FinishedRun
        A process run.
    ax : Axes, optional
        Axes to draw on.
    total : bool
        Whether to plot the sum of the normal forces per depth (N/mm) instead.

    Returns
    -------
    Axes
    """
    findings, ax = run.findings, _axes(ax)
    draw = run_figures.load_depth_panel if total else run_figures.force_depth_panel
    draw(ax, findings)
    return ax


def chain_lengths(run: FinishedRun, ax: Axes | None = None) -> Axes:
    """Plot the fraction of force chains by number of particles, for both definitions.

    Widest paths are included if they reach the bowl.

    Parameters
    ----------
    run : FinishedRun
        A process run.
    ax : Axes, optional

    Returns
    -------
    Axes
    """
    chains = run.table("chains", ["definition", "n_particles", "reaches_bowl"])
    ax = _axes(ax)
    for name, colour in (("peters", COLOURS["chain"]), ("widest_path", COLOURS["dominant_path"])):
        of_name = chains[chains["definition"] == name]
        whole = of_name[of_name["reaches_bowl"]] if name == "widest_path" else of_name
        counts = whole["n_particles"].value_counts(normalize=True).sort_index()
        label = f"{name} (mean {whole['n_particles'].mean():.1f})"
        ax.plot(counts.index, counts, "o-", color=colour, label=label)
    ax.locator_params(axis="x", integer=True)
    ax.set(xlabel="particles per chain", ylabel="fraction of the chains", yscale="log")
    ax.legend()
    return ax


def contact_forces(run: FinishedRun, ax: Axes | None = None, *, kind: str | None = None) -> Axes:
    """Plot the probability density of the normal contact forces relative to their mean.

    Parameters
    ----------
    run : FinishedRun
        A process run; the network frames in its statistics are used.
    ax : Axes, optional
        Axes to draw on.
    kind : str, optional
        Kind of contact, such as ``particle-workpiece``; all contacts by default.

    Returns
    -------
    Axes

    Raises
    ------
    UnknownNameError
        If there are no contacts of this kind.
    """
    contacts = run.table("contacts", ["step", "kind", "normal_force_n"])
    contacts = contacts[contacts["step"].isin(run.network["step"])]
    if kind is not None:
        known = sorted(contacts["kind"].unique())
        contacts = contacts[contacts["kind"] == kind]
        if contacts.empty:
            raise UnknownNameError(f"there are no contacts of kind {kind!r}", kind, known)
    force = contacts["normal_force_n"].to_numpy(np.float64)
    edges = np.arange(0.0, force.max() / force.mean() + _BIN, _BIN)
    density, _ = np.histogram(force / force.mean(), edges, density=True)
    label = f"{kind or 'all contacts'} (mean {force.mean():.3g} N)"
    ax = _axes(ax)
    ax.stairs(density, edges, baseline=None, label=label)
    ax.set(xlabel="normal force / mean normal force", ylabel="probability density", yscale="log")
    ax.legend()
    return ax


def _axes(ax: Any, **options: Any) -> Any:
    """The axes, or those of a new figure."""
    if ax is not None:
        return ax
    from matplotlib import pyplot

    return pyplot.subplots(layout="constrained", subplot_kw=options)[1]
