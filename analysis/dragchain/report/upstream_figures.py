"""The figures of a filling and of a drop test."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from dragchain.arrays import Floats
from dragchain.dumps.run_parts import iter_prints
from dragchain.figures.panels import head, new_panels
from dragchain.figures.style import BLUE, RED
from dragchain.report.findings import DropFindings, DropImpacts, FillingFindings
from dragchain.report.run_data import RunData
from dragchain.run.case import Case, load_outputs


def energy_ratio(energy_j: Floats, particles: Floats, case: Case) -> Floats:
    """The mean energy of a particle over m g d, (N,): what the mean particle gains falling by d.

    Parameters
    ----------
    energy_j : (N,) array
        Kinetic energy of all particles in J, spin included.
    particles : (N,) array
        Number of particles.
    case : Case
        The filling; mass and diameter are those of its mean particle.
    """
    radius = case.media.radius_mean_m
    mass = case.media.density_kg_m3 * 4.0 / 3.0 * np.pi * radius**3
    return np.asarray(energy_j / particles / (mass * case.gravity_m_s2 * 2.0 * radius))


def filling(run: RunData, found: FillingFindings) -> Figure | None:
    """Energy ratio over time, with the level below which the bed is at rest; needs thermo."""
    if not (run.folder / "tables" / "thermo.parquet").is_file():
        return None
    table = run.table("thermo")
    table = table[table["n_particles"] > 0]
    energy = (table["kinetic_energy_j"] + table["rotational_energy_j"]).to_numpy(np.float64)
    ratio = energy_ratio(energy, table["n_particles"].to_numpy(np.float64), run.case)
    figure, (axes,) = new_panels(3.2)
    axes.semilogy(table["time_s"], ratio, color=BLUE)
    rest, bed = found.rest_energy_ratio, found.bed
    if rest is not None:
        axes.axhline(rest, color=RED, linestyle="--", label=f"settling criterion: {rest:g}")
        axes.legend(loc="upper right")
    axes.set(xlabel="simulated time (s)", ylabel="mean kinetic energy per particle\n/ (m g d)")
    axes.set_title(
        f"{bed['n_particles']} particles, bed height {bed['bed_height_m'] * 1e3:.1f} mm, "
        f"solid fraction {bed['solid_fraction']:.3f}"
    )
    return figure


def drop_test(run: RunData, found: DropFindings) -> Figure:
    """Force and speed over time of each impact."""
    blocks = list(iter_prints(run.folder, load_outputs(run.folder)["impacts"]))
    time_s, speed_m_s, force_n = (
        np.concatenate([np.asarray(block[name], dtype=np.float64) for block in blocks])
        for name in ("time_s", "vz_m_s", "force_n")
    )
    impacts, ratio = found.impacts, found.restitution
    figure, panels = new_panels(3.2, len(impacts.start_time_s), sharey=True)
    limit = 1.1 * float(np.abs(speed_m_s).max())
    for number, axes in enumerate(panels):
        start, duration = impacts.start_time_s[number], impacts.duration_s[number]
        near = (time_s >= start - 0.3 * duration) & (time_s <= start + 1.3 * duration)
        time_us = (time_s[near] - start) * 1e6
        axes.plot(time_us, force_n[near], color=BLUE)
        axes.set(xlabel="time (µs)", title=_impact_words(number, impacts))
        right = _speed_axes(axes, limit)
        right.plot(time_us, speed_m_s[near], color=RED, linewidth=1.0)
        right.tick_params(labelright=axes is panels[-1], colors=RED)
    right.set_ylabel("upward velocity (m/s)", color=RED)
    panels[0].set_ylabel("force on the particle (N)", color=BLUE)
    head(
        figure,
        f"effective coefficient of restitution {ratio.mean:.3f} "
        f"(range {ratio.lowest:.3f} to {ratio.highest:.3f}); input value {ratio.input:.3f}",
    )
    return figure


def _impact_words(number: int, impacts: DropImpacts) -> str:
    return (
        f"impact {number + 1}: peak {impacts.peak_force_n[number]:.2f} N\n"
        f"{impacts.time_since_first_s[number] * 1e3:.1f} ms after the first, "
        f"e = {impacts.restitution[number]:.3f}"
    )


def _speed_axes(axes: Axes, limit_m_s: float) -> Axes:
    """A second vertical axis, for speeds, at the right."""
    right = axes.twinx()
    right.grid(False)
    right.spines["right"].set_visible(True)
    right.set_ylim(-limit_m_s, limit_m_s)
    return right
