"""A study of a user's own part: unit, axis, bowl and path follow from the size of its file."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dragdeck.mesh.checks import Surroundings, check, findings
from dragdeck.mesh.files import STEP, UNITS, read
from dragdeck.mesh.step_mesher import FACET_AREA
from dragdeck.mesh.surface import facing_out, place, points_below, upright, volume_below
from dragdeck.physics.rounding import rounded

if TYPE_CHECKING:
    from trimesh import Trimesh

_USUAL_M = 5e-3, 0.5
"""Lengths of usual workpieces, by which the unit of a file without one is guessed."""

_GUESSES = ("mm", "m", "in", "um")
"""Units in the order in which they are tried; cm fits whatever in fits."""

_ROUND, _NOT_ROUND = 0.93, 0.88
"""Area of a section divided by that of the circle around it: of a round one, and of another."""

_END = 0.1
"""Distance of the sections that are compared from both ends, divided by the length."""

_DIAMETER_M, _IN_DEPTH = 6.54e-3, 4.0
"""Of the particles of uhlmann2015; and the fewest diameters in the immersion depth."""

_IMMERSED, _DEEPEST_M = 2 / 3, 0.055
"""Immersion depth divided by the length; and the largest one: a deeper bed has a higher pressure,
at which particles of `draft` need a smaller time step."""

_BESIDE, _INSIDE, _BELOW, _PATH, _SPREAD = 3.0, 2.0, 4.0, 6.5, 0.046
"""In diameters: gaps to the wall, the bowl's axis and the floor, length of the path; and relative
standard deviation of the radius, as in uhlmann2015."""

_SOLID, _MOST_PARTICLES = 0.6, 3500
_FACETS_PER_DIAMETER, _MOST_FACETS = 5, 5000
_TRIES = 4

_STUDY = Path(__file__).with_name("study_of_part.yaml")
"""Text of a study of a part, which extends uhlmann2015."""


@dataclass(frozen=True)
class _Scene:
    """What is chosen for a part, m."""

    diameter: float
    depth: float
    reach: float

    @property
    def path(self) -> float:
        """Radius of the circle."""
        return rounded(self.reach + _INSIDE * self.diameter, up=True)

    @property
    def bowl(self) -> float:
        """Its radius."""
        return rounded(self.path + self.reach + _BESIDE * self.diameter, up=True)

    @property
    def fill(self) -> float:
        """Height of the bed."""
        return rounded(self.depth + _BELOW * self.diameter, up=True)

    @property
    def particles(self) -> float:
        """About how many particles fill the bowl."""
        return 6 * _SOLID * self.bowl**2 * self.fill / self.diameter**3


def study_of_part(part: Path) -> str:
    """The text of a study beside which the part is.

    Raises
    ------
    InputError
        The part cannot be read, or has defects that no facet size mends: all are named.
    """
    step = part.suffix.lower() in STEP
    given = read(part, None, 1e3) if step else read(part, "m")
    if not given.is_watertight:
        check(given, file=part)
    given = facing_out(given) or given
    unit = None if step else _unit(given)
    scale = 1.0 if unit is None else UNITS[unit]
    axis, axis_why = _axis(given)
    body = upright(given, axis)
    long = scale * float(body.extents[2])
    scene = _scene(body, scale, rounded(min(_IMMERSED * long, _DEEPEST_M), up=False))
    size, facets = _facets(part, unit, axis, scene)
    lengths = " x ".join(f"{length:.4g}" for length in given.extents / (1e-3 if step else 1.0))
    return _STUDY.read_text().format(
        source=part.name,
        size=lengths + (" mm" if step else ""),
        unit_why="as the file states"
        if unit is None
        else f"read as {unit}: the part is then {1e3 * long:.4g} mm long",
        title=json.dumps(f"{part.stem} in a bowl of its size"),
        fill=scene.fill,
        radius=scene.diameter / 2,
        std=rounded(_SPREAD * scene.diameter / 2, up=False),
        media_why=f"about {scene.particles:,.2g} particles",
        bowl=scene.bowl,
        height=rounded(scene.fill + long + scene.diameter, up=True),
        beside=_BESIDE,
        file=json.dumps(part.name),
        unit=f"unit: {unit}              # guessed from the size" if unit else "# unit: as stated",
        axis=axis,
        axis_why=axis_why,
        facets=f"facet_size_m: {size:g}  # {facets}" if size else f"# facet_size_m: {facets}",
        path=scene.path,
        revolutions=rounded(_PATH * scene.diameter / (math.tau * scene.path), up=True),
        length=1e3 * _PATH * scene.diameter,
        depth=scene.depth,
        long=1e3 * long,
        transient=scene.diameter,
    )


def _unit(mesh: Trimesh) -> str:
    """The unit in which a part has a usual length."""
    longest, (least, most) = float(mesh.extents.max()), _USUAL_M
    usual = [unit for unit in _GUESSES if least <= UNITS[unit] * longest <= most]
    return usual[0] if usual else "mm"


def _axis(mesh: Trimesh) -> tuple[str, str]:
    """Direction from tip to clamp, along the longest extent, and why."""
    letter = "xyz"[int(np.argmax(mesh.extents))]
    body = place(upright(mesh, f"+{letter}"))
    height = float(body.bounds[1, 2])
    lower, upper = (_roundness(body, part * height) for part in (_END, 1 - _END))
    half = volume_below(body, height / 2) / (volume_below(body, 2 * height) or 1.0)
    up, why = abs(half) <= 0.5, "the heavier end"
    if max(lower, upper) >= _ROUND and min(lower, upper) <= _NOT_ROUND:
        up, why = upper > lower, "the round end"
    sign, other = "+-" if up else "-+"
    return f"{sign}{letter}", f"from the tip to the clamp, {why}; else {other}{letter}"


def _roundness(body: Trimesh, height: float) -> float:
    """Area of a section divided by that of the circle around it."""
    begin, end = body.vertices[body.edges_unique].transpose(1, 0, 2) - [0.0, 0.0, height]
    crossing = (begin[:, 2] < 0) != (end[:, 2] < 0)
    first, other = begin[crossing], end[crossing]
    if not len(first):
        return 0.0
    part = (first[:, 2] / (first[:, 2] - other[:, 2]))[:, None]
    section = (first + part * (other - first))[:, :2]
    middle = (section.min(axis=0) + section.max(axis=0)) / 2
    radius = float(np.hypot(*(section - middle).T).max())
    thin = 1e-4 * float(body.extents[2])
    slab = volume_below(body, height + thin) - volume_below(body, height - thin)
    return abs(slab) / (2 * thin) / (math.pi * radius**2)


def _scene(body: Trimesh, scale: float, depth: float) -> _Scene:
    """A bed as deep as the part needs, with no more particles than a quick run has."""
    placed = place(body)
    reach = scale * float(np.hypot(*points_below(placed, depth / scale)[:, :2].T).max())
    diameter = min(_DIAMETER_M, depth / _IN_DEPTH)
    while (scene := _Scene(diameter, depth, reach)).particles > _MOST_PARTICLES:
        diameter *= 1.1
    return _Scene(rounded(scene.diameter / 2, up=True) * 2, depth, reach)


def _facets(part: Path, unit: str | None, axis: str, scene: _Scene) -> tuple[float | None, str]:
    """Facet size where the facets of the file do not do, and why; or what would be one."""
    around = Surroundings(scene.bowl, scene.diameter / 2, scene.depth)
    size = rounded(scene.diameter / _FACETS_PER_DIAMETER, up=False)
    if unit is not None:
        mesh = upright(read(part, unit), axis)
        problems = findings(mesh, surroundings=around)
        size = max(size, rounded(math.sqrt(mesh.area / (FACET_AREA * _MOST_FACETS)), up=True))
        if not any("facet_size_m" in problem.remedy for problem in problems):
            check(mesh, file=part, surroundings=around)
            if len(mesh.faces) <= 2 * _MOST_FACETS:
                return None, f"{size:g}  # would mesh the surface anew"
    meshed = cache(partial(read, part, unit))  # making one takes seconds
    many = len(meshed(size).faces) / _MOST_FACETS
    if many > 1:  # not all facets scale alike
        size *= 1.1 * math.sqrt(many)
    for tried in (size / 1.5**number for number in range(_TRIES)):
        tried = rounded(tried, up=False)
        mesh = upright(meshed(tried), axis)
        problems = findings(mesh, surroundings=around)
        mended = not any("facet_size_m" in problem.remedy for problem in problems)
        if mended and all(problem.severity == "warning" for problem in problems):
            break  # a mesher may fold a thin edge at one size, and not at another
    else:
        check(upright(read(part, unit), axis) if unit else mesh, file=part, surroundings=around)
    check(mesh, file=part, surroundings=around)
    return tried, "of the mesh of the part" if unit is None else "its facets are meshed anew"
