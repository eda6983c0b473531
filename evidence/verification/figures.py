"""One figure a test: the engine's points over the references."""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.arrays import Floats
from dragchain.figures.panels import legend_below, new_panels
from dragchain.figures.style import BLUE, GREY, MARKERS, ORANGE, SERIES
from evidence.contact_law.impact import (
    elastic_time,
    hertz_force,
    hertz_overlap,
    largest_overlap,
    limited_restitution,
)
from evidence.verification.published import published
from evidence.verification.quantities import (
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
from evidence.verification.recording import Recording

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
    draw_on, count = _FIGURES[test]
    figure, panels = new_panels(3.7, count, 3.7 * max(count, 2))
    draw_on(runs, *panels)
    return legend_below(figure)


def _styled(runs: Sequence[Recording]) -> Iterator[tuple[Recording, str, str]]:
    """Runs with colour and marker."""
    return zip(runs, SERIES, MARKERS, strict=False)


def _elastic(runs: Sequence[Recording], left: Axes, right: Axes) -> None:
    for run, colour, _ in _styled(runs):
        impact, contact = run.contact, run.contact.constants
        overlap, force_kn = impact.overlap_m, np.abs(run.force_n[:, impact.at, 2]) / 1e3
        inside = np.flatnonzero(overlap > 0)
        some = inside[:: max(1, len(inside) // 30)]
        line = np.linspace(0, largest_overlap(contact, impact.before.normal_m_s), 100)
        exact = np.asarray(hertz_force(contact, line)) / 1e3
        label = f"{series_name(run)}: LIGGGHTS"
        left.plot(line * 1e6, exact, color=colour)
        left.plot(overlap[some] * 1e6, force_kn[some], "o", color=colour, ms=3, label=label)
        time = (run.time_s - run.time_s[inside[0]]) * 1e6
        right.plot(time[some], force_kn[some], "o", color=colour, ms=3)
        end = elastic_time(contact, impact.before.normal_m_s) * 1e6
        right.axvline(end, color=colour, lw=0.8, ls="--")
        right.plot(end / 2, exact[-1], "+", color="black", ms=9)
    left.set(xlabel="overlap (µm)", ylabel="normal force (kN)")
    left.set_title("line: Hertz (Johnson 1985, eq. 4.23)")
    right.set(xlabel="time since first contact (µs)")
    right.set_title("+: maximum force, dashed: contact time (Hertz)")


def _restitution(runs: Sequence[Recording], left: Axes, right: Axes) -> None:
    line = np.linspace(0.055, 1, 200)
    exact = [limited_restitution(value) for value in line]
    left.plot(line, line, color="black", lw=0.9, label="input value")
    left.plot(line, exact, color=GREY, label="exp(-x (π - 2 arctan x)), x = -ln(e)/π")
    for run, colour, marker in _styled(runs):
        value = [impact.constants.restitution for impact in run.contacts]
        ratio = [impact.rebound for impact in run.contacts]
        error = [1e3 * (impact.rebound - impact.constants.rebound) for impact in run.contacts]
        left.plot(value, ratio, marker, color=colour, mfc="none", label=series_name(run))
        right.plot(value, error, marker + "-", color=colour, lw=0.8)
    left.set(xlabel="input restitution", ylabel="rebound velocity ratio, out / in")
    right.set(xlabel="input restitution", ylabel="LIGGGHTS minus exact ($10^{-3}$)")


def _impacts(runs: Sequence[Recording], *panels: Axes) -> None:
    test = runs[0].case.test
    for axes, quantity in zip(panels, QUANTITIES[test], strict=True):
        for run, colour, marker in _styled(runs):
            x, engine, law, rigid = _curves(run, quantity)
            label = f"{series_name(run)}: LIGGGHTS"
            axes.plot(x, engine, marker, color=colour, ms=5, mfc="none", label=label)
            axes.plot(x, law, "-", color=colour, lw=0.9, label=_REFERENCES[0])
            if not np.isnan(rigid).all():
                axes.plot(x, rigid, "--", color="black", lw=0.9, label=_REFERENCES[1])
        _published(axes, test, runs, quantity)
        axes.set(xlabel=_ABSCISSAE.get(quantity) or _ABSCISSAE[test], ylabel=_LABELS[quantity])
        if quantity == "patch_restitution":
            axes.set_xscale("log")
        if test == "oblique_tangential":
            axes.set_xlim(-0.3, 14)


def _curves(run: Recording, quantity: str) -> Floats:
    """Abscissa, and a quantity of the engine, the integrated law and rigid bodies, (4, M)."""
    derive = QUANTITIES[run.case.test][quantity]
    rows = []
    for impact in run.contacts:
        ends = (impact.after, impact.integrated, impact.slid)
        known = (impact.constants, impact.before)
        values = (np.nan if after is None else derive(*known, after) for after in ends)
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


def _time_step(runs: Sequence[Recording], left: Axes, right: Axes) -> None:
    ordered = sorted(runs, key=lambda run: run.case.steps_per_contact)
    for limit, rows in convergence(runs).items():
        own = [run.case for run in ordered if run.case.limit_force == limit]
        steps, error = np.array(rows, dtype=np.float64).T
        fraction = [100 * case.timestep_s / case.rayleigh_time_s for case in own]
        colour = BLUE if limit else ORANGE
        name = f"limitForce {'on' if limit else 'off'}, order {fitted_order(rows):.2f}"
        left.loglog(steps, error, "o-", color=colour, label=name)
        left.loglog(steps, 1 / steps, ":", color=GREY, label="tolerance")
        right.loglog(fraction, error, "o-", color=colour)
    left.set(xlabel="time steps per contact", ylabel="error of the rebound velocity ratio")
    right.set(xlabel="time step (% of Rayleigh time)")


def _bounce(runs: Sequence[Recording], axes: Axes) -> None:
    for run, colour, _ in _styled(runs):
        impacts, energy = flight_energy(run)
        name = f"{run.case.steps_per_contact} steps per contact"
        axes.plot(impacts, (energy - 1) * 1e6, ".", ms=2, color=colour, label=name)
    axes.set(xlabel="impacts", ylabel="change of the kinetic energy (ppm)")


def _momentum(runs: Sequence[Recording], *panels: Axes) -> None:
    (run,) = runs
    for at, (axes, what) in enumerate(zip(panels, ("linear", "angular"), strict=True)):
        for contact, colour in zip(run.contacts, SERIES, strict=False):
            change = np.linalg.norm(momentum_changes(contact)[at], axis=1).clip(1e-18)
            label = f"collision {contact.value}"
            axes.semilogy(run.time_s * 1e6, change, color=colour, label=label)
        axes.set(xlabel="time (µs)", ylabel=f"relative change of {what} momentum")
        axes.set_ylim(1e-18, 1e-8)


def _column(runs: Sequence[Recording], left: Axes, right: Axes) -> None:
    (run,) = runs
    loads = column_loads(run)
    floor = run.wall_force_n["plane"][:, 0, 2]
    left.plot(run.time_s * 1e3, floor / loads[0][1], color=BLUE, lw=0.8)
    left.axhline(1.0, color="black", lw=0.8)
    left.set(xlabel="time (ms)", ylabel="floor force / weight")
    height = np.arange(1, len(loads) + 1)
    exact = [1e9 * float(hertz_overlap(contact, weight)) for contact, weight, _ in loads]
    overlap = [1e9 * row[2] for row in loads]
    right.plot(exact, height, "k+", ms=10, label="Hertz, weight above the contact")
    right.plot(overlap, height, "o", color=BLUE, mfc="none", ms=6, label="LIGGGHTS")
    right.set(xlabel="overlap (nm)", ylabel="contact number, from the floor", yticks=height)


def _incline(runs: Sequence[Recording], *panels: Axes) -> None:
    contacts = runs[0].contacts
    x = [contact.value for contact in contacts]
    labels = ("acceleration down the slope (m/s²)", "angular acceleration (rad/s²)")
    for at, (axes, label) in enumerate(zip(panels, labels, strict=True)):
        reference = [incline_reference(contact)[at] for contact in contacts]
        engine = [incline_slopes(contact)[at] for contact in contacts]
        axes.plot(x, reference, "-", color="black", lw=0.9, label="exact: rolling, slipping")
        axes.plot(x, engine, "o", color=BLUE, mfc="none", ms=6, label="LIGGGHTS")
        axes.axvline(1.0, color=GREY, lw=0.8, ls=":")
        axes.set(xlabel="tan(angle) / (7/2 friction)", ylabel=label, xscale="log")


_FIGURES: Mapping[str, tuple[Callable[..., None], int]] = {
    "elastic_pair": (_elastic, 2),
    "elastic_plane": (_elastic, 2),
    "restitution": (_restitution, 2),
    **{test: (_impacts, len(quantities)) for test, quantities in QUANTITIES.items()},
    "time_step": (_time_step, 2),
    "bounce": (_bounce, 1),
    "momentum": (_momentum, 2),
    "column": (_column, 2),
    "incline": (_incline, 2),
}
"""What draws a test, and on how many panels."""
