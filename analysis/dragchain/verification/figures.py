"""One figure a test: the engine's points over the references."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.arrays import Floats
from dragchain.contact_law.impact import (
    elastic_time,
    hertz_force,
    hertz_overlap,
    largest_overlap,
    limited_restitution,
)
from dragchain.figures.style import BLUE, GREEN, GREY, ORANGE, RED
from dragchain.verification.published import published
from dragchain.verification.quantities import (
    QUANTITIES,
    abscissa,
    column_loads,
    convergence,
    fitted_order,
    flight_energy,
    incline_reference,
    incline_slopes,
    momentum_changes,
    series_name,
)
from dragchain.verification.recording import Recording

_COLOURS = (BLUE, ORANGE, GREEN, RED, "#7a4fa3", "#5b8a99")
_MARKERS = "os^vDP"

_LABELS = {
    "angle_deg": "angle of incidence from the normal (°)",
    "tangential_restitution": "tangential velocity ratio, out / in",
    "spin_rad_s": "spin after impact (rad/s)",
    "rebound_angle_deg": "rebound angle of the\ncontact patch (°)",
    "scaled_patch": "patch velocity out /\n(friction x normal speed out)",
    "scaled_spin": "surface speed by spin out /\n(friction x normal speed in)",
    "patch_restitution": "-(patch velocity out / in)",
    "recoil_tangent": "tangent of the recoil angle",
    "tangential_m_s": "relative tangential velocity\nof the centres after impact (m/s)",
}
_ABSCISSAE = {
    "oblique_angle": _LABELS["angle_deg"],
    "oblique_study": _LABELS["angle_deg"],
    "oblique_tangential": "patch velocity in / (friction x normal speed in)",
    "patch_restitution": "7/2 friction (1 + e) x normal speed\n/ patch velocity in",
    "recoil_tangent": "tangent of the angle of incidence",
    "spin_pair": "spin before impact (rad/s)",
    "spin_pair_same": "spin before impact (rad/s)",
}
_REFERENCES = ("line: contact law integrated by scipy", "rigid-body sliding with Coulomb friction")
_OTHERS: Mapping[str, tuple[str, ...]] = {
    "oblique_angle": ("experiment (Kharaz et al. 2001)",),
    "oblique_tangential": ("finite elements (Wu)",),
}
"""Series that the paper draws and nobody here models."""


def draw(test: str, runs: Sequence[Recording]) -> Figure:
    """The figure of a test from all its runs."""
    return _DRAW[test](runs)


def _figure(panels: int, height_in: float = 3.4) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(3.7 * max(panels, 2), height_in), layout="constrained")
    return figure, list(np.atleast_1d(figure.subplots(1, panels)))


def _legend(figure: Figure, axes: Axes, columns: int = 2) -> Figure:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=columns)
    return figure


def _elastic(runs: Sequence[Recording]) -> Figure:
    figure, (left, right) = _figure(2)
    for run, colour in zip(runs, _COLOURS, strict=False):
        impact, contact = run.contact, run.contact.constants
        overlap, force = impact.overlap_m, np.abs(run.force_n[:, impact.at, 2])
        inside = np.flatnonzero(overlap > 0)
        some = inside[:: max(1, len(inside) // 30)]
        line = np.linspace(0, largest_overlap(contact, impact.before.normal_m_s), 100)
        left.plot(line * 1e6, hertz_force(contact, line) / 1e3, color=colour)
        left.plot(overlap[some] * 1e6, force[some] / 1e3, "o", color=colour, ms=3,
                  label=f"{series_name(run)}: LIGGGHTS")  # fmt: skip
        time = (run.time_s - run.time_s[inside[0]]) * 1e6
        right.plot(time[some], force[some] / 1e3, "o", color=colour, ms=3)
        end = elastic_time(contact, impact.before.normal_m_s) * 1e6
        right.axvline(end, color=colour, lw=0.8, ls="--")
        peak = float(hertz_force(contact, line[-1])) / 1e3
        right.plot([end / 2], [peak], "+", color="black", ms=9)
    left.set(xlabel="overlap (µm)", ylabel="normal force (kN)")
    left.set_title("line: Hertz (Johnson 1985, eq. 4.23)", fontsize=8.5)
    right.set(xlabel="time since first contact (µs)")
    right.set_title("+: maximum force, dashed: contact time (Hertz)", fontsize=8.5)
    return _legend(figure, left, 3)


def _restitution(runs: Sequence[Recording]) -> Figure:
    figure, (left, right) = _figure(2)
    line = np.linspace(0.055, 1, 200)
    exact = np.array([limited_restitution(value) for value in line])
    left.plot(line, line, color="black", lw=0.9, label="input value")
    left.plot(line, exact, color=GREY, label="exp(-x (π - 2 arctan x)), x = -ln(e)/π")
    for run, colour, marker in zip(runs, _COLOURS, _MARKERS, strict=False):
        value = [impact.constants.restitution for impact in run.contacts]
        ratio = [impact.rebound for impact in run.contacts]
        error = [impact.rebound - impact.constants.rebound for impact in run.contacts]
        left.plot(value, ratio, marker, color=colour, ms=4, mfc="none", label=series_name(run))
        right.plot(value, np.array(error) * 1e3, marker + "-", color=colour, ms=4, lw=0.8)
    left.set(xlabel="input restitution", ylabel="rebound velocity ratio, out / in")
    right.set(xlabel="input restitution", ylabel="LIGGGHTS minus exact ($10^{-3}$)")
    return _legend(figure, left)


def _impacts(runs: Sequence[Recording]) -> Figure:
    test = runs[0].case.test
    quantities = QUANTITIES[test]
    figure, panels = _figure(len(quantities), 3.9)
    for axes, quantity in zip(panels, quantities, strict=True):
        names: tuple[str | None, str | None] = _REFERENCES
        for run, colour, marker in zip(runs, _COLOURS, _MARKERS, strict=False):
            x, engine, law, rigid = _curves(run, quantity)
            label = f"{series_name(run)}: LIGGGHTS"
            axes.plot(x, engine, marker, color=colour, ms=5, mfc="none", label=label)
            axes.plot(x, law, "-", color=colour, lw=0.9, label=names[0])
            if not np.isnan(rigid).all():
                axes.plot(x, rigid, "--", color="black", lw=0.9, label=names[1])
            names = (None, None)
        _published(axes, test, runs, quantity)
        axes.set(xlabel=_ABSCISSAE.get(quantity) or _ABSCISSAE[test], ylabel=_LABELS[quantity])
        if quantity == "patch_restitution":
            axes.set_xscale("log")
        if test == "oblique_tangential":
            axes.set_xlim(-0.3, 14)
    return _legend(figure, panels[0], len(panels))


def _curves(run: Recording, quantity: str) -> Floats:
    """Abscissa, and a quantity of the engine, the integrated law and rigid bodies, (4, M)."""
    derive = QUANTITIES[run.case.test][quantity]
    rows = []
    for impact in run.contacts:
        ends = (impact.after, impact.integrated, impact.slid)
        values = [
            np.nan if after is None else derive(impact.constants, impact.before, after)
            for after in ends
        ]
        rows.append((abscissa(impact, quantity), *values))
    return np.array(sorted(rows), dtype=np.float64).T


def _published(axes: Axes, test: str, runs: Sequence[Recording], quantity: str) -> None:
    others = _OTHERS.get(test, ())
    series = dict.fromkeys(run.case.series for run in runs)
    for name, marker in zip((*series, *others), "xx+", strict=False):
        curve = published(test, name, quantity)
        if len(curve.x):
            shade = "black" if name in others else GREY
            label = f"published: {name}".replace("_", " ")
            axes.plot(curve.x, curve.y, marker, color=shade, ms=5, mew=0.9, label=label)


def _time_step(runs: Sequence[Recording]) -> Figure:
    figure, (left, right) = _figure(2)
    for limit, rows in convergence(runs).items():
        colour = BLUE if limit else ORANGE
        steps, error = np.array(rows, dtype=np.float64).T
        name = f"limitForce {'on' if limit else 'off'}, order {fitted_order(rows):.2f}"
        left.loglog(steps, error, "o-", color=colour, ms=4, label=name)
        left.loglog(steps, 1 / steps, ":", color=GREY, label="tolerance" if limit else None)
        fraction = [
            100 * run.case.timestep_s / run.case.rayleigh_time_s
            for run in sorted(runs, key=lambda run: run.case.steps_per_contact)
            if run.case.limit_force == limit
        ]
        right.loglog(fraction, error, "o-", color=colour, ms=4)
    left.set(xlabel="time steps per contact", ylabel="error of the rebound velocity ratio")
    right.set(xlabel="time step (% of Rayleigh time)")
    return _legend(figure, left, 3)


def _bounce(runs: Sequence[Recording]) -> Figure:
    figure, (axes,) = _figure(1)
    for run, colour in zip(runs, _COLOURS, strict=False):
        impacts, energy = flight_energy(run)
        name = f"{run.case.steps_per_contact} steps per contact"
        axes.plot(impacts, (energy - 1) * 1e6, ".", ms=2, color=colour, label=name)
    axes.set(xlabel="impacts", ylabel="change of the kinetic energy (ppm)")
    return _legend(figure, axes)


def _momentum(runs: Sequence[Recording]) -> Figure:
    figure, panels = _figure(2)
    (run,) = runs
    for axes, at, what in zip(panels, (0, 1), ("linear", "angular"), strict=True):
        for contact, colour in zip(run.contacts, _COLOURS, strict=False):
            change = np.linalg.norm(momentum_changes(contact)[at], axis=1)
            label = f"collision {contact.value}"
            axes.semilogy(run.time_s * 1e6, np.maximum(change, 1e-18), color=colour, label=label)
        axes.set(xlabel="time (µs)", ylabel=f"relative change of {what} momentum")
        axes.set_ylim(1e-18, 1e-8)
    return _legend(figure, panels[0], 3)


def _column(runs: Sequence[Recording]) -> Figure:
    figure, (left, right) = _figure(2)
    (run,) = runs
    loads = column_loads(run)
    floor = run.wall_force_n["plane"][:, 0, 2]
    left.plot(run.time_s * 1e3, floor / loads[0][1], color=BLUE, lw=0.8)
    left.axhline(1.0, color="black", lw=0.8)
    left.set(xlabel="time (ms)", ylabel="floor force / weight")
    height = np.arange(1, len(loads) + 1)
    exact = np.array([hertz_overlap(contact, weight) for contact, weight, _ in loads])
    right.plot(exact * 1e9, height, "k+", ms=10, label="Hertz, weight above the contact")
    overlap = np.array([row[2] for row in loads])
    right.plot(overlap * 1e9, height, "o", color=BLUE, mfc="none", label="LIGGGHTS")
    right.set(xlabel="overlap (nm)", ylabel="contact number, from the floor", yticks=height)
    return _legend(figure, right)


def _incline(runs: Sequence[Recording]) -> Figure:
    figure, (left, right) = _figure(2)
    (run,) = runs
    x = [contact.value for contact in run.contacts]
    for axes, at, label in (
        (left, 0, "acceleration down the slope (m/s²)"),
        (right, 1, "angular acceleration (rad/s²)"),
    ):
        reference = [incline_reference(contact)[at] for contact in run.contacts]
        engine = [incline_slopes(contact)[at] for contact in run.contacts]
        axes.plot(x, reference, "-", color="black", lw=0.9, label="exact: rolling, slipping")
        axes.plot(x, engine, "o", color=BLUE, mfc="none", label="LIGGGHTS")
        axes.axvline(1.0, color=GREY, lw=0.8, ls=":")
        axes.set(xlabel="tan(angle) / (7/2 friction)", ylabel=label, xscale="log")
    return _legend(figure, left)


_DRAW: Mapping[str, Callable[[Sequence[Recording]], Figure]] = {
    "elastic_pair": _elastic,
    "elastic_plane": _elastic,
    "restitution": _restitution,
    **dict.fromkeys(QUANTITIES, _impacts),
    "time_step": _time_step,
    "bounce": _bounce,
    "momentum": _momentum,
    "column": _column,
    "incline": _incline,
}
