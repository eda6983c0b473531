"""The materials of a script: masses, and constants of contacts by type."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from dragdeck.arrays import Floats, Ints
from dragdeck.dumps.frame import Frame
from dragdeck.physics.contact_mechanics import (
    ContactConstants,
    effective_modulus,
    effective_shear,
    sphere_mass,
)
from dragdeck.script.facts import Facts, number


class _Elastic(NamedTuple):
    youngs_modulus_pa: float
    poissons_ratio: float
    density_kg_m3: float = 0.0


def constants_of(facts: Facts) -> list[list[ContactConstants]] | None:
    """Constants of the contacts of each pair of types; None if the script does not say them."""
    moduli, ratios = facts.values("youngsModulus"), facts.values("poissonsRatio")
    types = len(moduli)
    laws = {law.normal for law in facts.laws}
    if not types or len(ratios) != types or laws != {"hertz"}:
        return None
    rows = []
    for a in range(types):
        row = []
        for b in range(types):
            restitution = facts.of_pair("coefficientRestitution", a + 1, b + 1)
            friction = facts.of_pair("coefficientFriction", a + 1, b + 1) or 0.0
            if not restitution:
                return None
            first, second = _Elastic(moduli[a], ratios[a]), _Elastic(moduli[b], ratios[b])
            shears = effective_modulus(first, second), effective_shear(first, second)
            row.append(ContactConstants(*shears, restitution, friction))
        rows.append(row)
    return rows


def types_of(frame: Frame) -> Ints:
    """Type of each particle from 0, (N,); 0 for all where the dump has none."""
    kinds = frame.columns.get("type")
    return np.zeros(frame.rows, np.int64) if kinds is None else np.asarray(kinds, np.int64) - 1


def radii_of(frame: Frame) -> Floats:
    """Radii of the particles, (N,), m."""
    diameter = "diameter" in frame.columns and "radius" not in frame.columns
    return frame.vectors("diameter")[:, 0] / 2 if diameter else frame.vectors("radius")[:, 0]


def masses_of(frame: Frame, facts: Facts) -> Floats | None:
    """Masses of the particles, (N,), kg, from the dump or the templates; None if not known."""
    if "mass" in frame.columns:
        return frame.vectors("mass")[:, 0]
    if "density" in frame.columns:
        density: Floats = frame.vectors("density")[:, 0]
    else:
        known, kinds = facts_of_density(facts), types_of(frame)
        if any(known.get(kind) is None for kind in np.unique(kinds).tolist()):
            return None
        density = np.array([known[kind] for kind in kinds.tolist()], dtype=np.float64)
    mass: Floats = sphere_mass(radii_of(frame), density)
    return mass


def facts_of_density(facts: Facts) -> dict[int, float]:
    """Density of each type from 0 of which templates or data files say a single one, kg/m3."""
    by_type: dict[int, set[float | None]] = {}
    for fix in facts.styled("particletemplate/"):
        words = fix.after("density", 2)
        kind = number("".join(fix.after("atom_type"))) or 1
        value = number(words[1]) if words[:1] == ["constant"] else None
        by_type.setdefault(int(kind) - 1, set()).add(value)
    for command in facts.named("read_data"):
        file = Path(command.file).parent / command.words[1]
        for kind, value in _densities(file):
            by_type.setdefault(kind - 1, set()).add(value)
    single = {kind: next(iter(values)) for kind, values in by_type.items() if len(values) == 1}
    return {kind: value for kind, value in single.items() if value is not None}


def _densities(file: Path) -> set[tuple[int, float]]:
    """Types and densities in the section Atoms of a data file of spheres."""
    text = file.read_text(encoding="utf-8", errors="replace") if file.is_file() else ""
    rows = text.partition("\nAtoms")[2].partition("\nVelocities")[0].splitlines()[1:]
    words = [row.split()[:4] for row in rows if row.strip()[:1].isdigit()]
    return {(int(row[1]), float(row[3])) for row in words if len(row) == 4}
