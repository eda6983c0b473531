"""What a scaling says, in sentences for a page."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from dragchain.scaling.figures import axis_name

SIGNIFICANT = 0.05
"""A lack of fit less probable than this is taken for real."""

CHANGED = 1.5
"""A figure of the scene that varies by this factor over the levels is worth a word."""

Found = Mapping[str, Any]


def remarks(found: Found) -> list[str]:
    """Where the power law holds, what other form fits, and what else changes with the level.

    Parameters
    ----------
    found : mapping
        Content of ``scaling.json``.
    """
    words = [_fit(found), _local(found)]
    if found["expected"]["exponent"] == 0.0:
        words.append(_change(found))
    return [*words, *_forms(found), *_scene(found)]


def interval(estimate: Mapping[str, float], factor: float = 1.0, digits: int = 2) -> str:
    """Format a value with its interval, ``1.53 (1.32 to 1.74)``."""
    value, low, high = (
        round(factor * estimate[name], digits) + 0.0 for name in ("value", "ci95_low", "ci95_high")
    )
    return f"{value:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def percent(estimate: Mapping[str, float]) -> str:
    """Format a relative change with its interval in percent, signs included."""
    value, low, high = (100.0 * estimate[name] for name in ("value", "ci95_low", "ci95_high"))
    return f"{value:+.0f} % ({low:+.0f} to {high:+.0f})"


def level(found: Found, x: float) -> str:
    """Format a level in the unit of its axis."""
    _, unit, factor = axis_name(found["field"])
    return f"{factor * x:g} {unit}".strip()


def _fit(found: Found) -> str:
    lack = found["fit"]["lack_of_fit"]
    if lack is None:
        return "There are too few runs of one level to test whether a power law fits."
    if lack >= SIGNIFICANT:
        return f"Over all levels a power law is not contradicted (lack of fit: p = {lack:.2f})."
    off = [
        f"{level(found, one['x'])} by {percent(one['deviation'])}"
        for one in found["levels"]
        if one["deviation"]
        and not one["deviation"]["ci95_low"] <= 0.0 <= one["deviation"]["ci95_high"]
    ]
    where = f"; off the law of the other levels: {', '.join(off)}" if off else ""
    return f"Over all levels a power law does not hold (lack of fit: p = {lack:.2g}){where}."


def _local(found: Found) -> str:
    levels = [one["x"] for one in found["levels"]]
    steps = [
        f"{interval(local)} from {level(found, low)} to {level(found, high)}"
        for local, low, high in zip(found["local_exponents"], levels[:-1], levels[1:], strict=True)
    ]
    return f"Exponent between neighbouring levels: {', '.join(steps)}."


def _change(found: Found) -> str:
    judged = found["fit_within"] or found["fit"]
    where = f" from {level(found, judged['from'])} to {level(found, judged['to'])}"
    words = f"Ten times the level changes the drag by {percent(judged['change_per_decade'])}{where}"
    if found["fit_within"]:
        words += f", and by {percent(found['fit']['change_per_decade'])} over all levels"
    return words + "."


def _forms(found: Found) -> Iterator[str]:
    if not found["shifted"]:
        return
    label, unit, factor = axis_name(found["field"])
    offset, power = found["shifted"]["offset"], found["shifted"]["power"]
    if offset and unit == "mm":
        particles = interval(offset, 1.0 / found["scene"]["particle_diameter_m"], 1)
        yield (
            f"With the expected exponent {power:g} the drag follows the {label} plus an offset "
            f"of {interval(offset, factor, 1)} {unit}, {particles} particle diameters"
            f"{_probability(found['shifted'])}."
        )
    terms = found["two_terms"]
    yield (
        f"As a sum of the powers {power:g} and {power - 1.0:g}, the lower one makes "
        f"{interval(terms['lower_fraction'], 100.0, 0)} % of the drag at the highest level"
        f"{_probability(terms)}."
    )


def _probability(form: Mapping[str, Any]) -> str:
    lack = form["lack_of_fit"]
    return "" if lack is None else f" (lack of fit: p = {lack:.2g})"


def _scene(found: Found) -> Iterator[str]:
    names = {
        "inertial_number": "The inertial number",
        "floor_particles": "The gap between tip and floor, in particle diameters,",
    }
    for key, name in names.items():
        first, last = (found["levels"][end][key] for end in (0, -1))
        if first and last and not 1.0 / CHANGED < last / first < CHANGED:
            yield f"{name} goes from {first:.2g} at the lowest level to {last:.2g} at the highest."
    gaps = [one["gap_particles"] for one in found["levels"]]
    if None not in gaps and gaps[0] != gaps[-1]:
        yield (
            f"The gap between workpiece and bowl goes from {gaps[0]:.1f} to "
            f"{gaps[-1]:.1f} diameters."
        )
    beds = len({run["bed"] for run in found["runs"]})
    if beds == 1:
        yield "All runs start from one bed: what another would change is not in the intervals."
