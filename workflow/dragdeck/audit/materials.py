"""The materials of a script: masses, and constants of contacts by type."""

from collections import Counter
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dragdeck.arrays import Floats, Ints
from dragdeck.dumps.frame import Frame
from dragdeck.files import text_of
from dragdeck.physics.contact_mechanics import (
    ContactConstants,
    effective_modulus,
    effective_shear,
    sphere_mass,
)
from dragdeck.script.facts import Facts, as_number


class _Elastic(NamedTuple):
    youngs_modulus_pa: float
    poissons_ratio: float
    density_kg_m3: float = 0.0


def constants_of(facts: Facts) -> list[list[ContactConstants]] | None:
    """Constants of the contacts of each pair of types; None if the script does not say them."""
    moduli, ratios = facts.values("youngsModulus"), facts.values("poissonsRatio")
    types, restitutions = range(len(moduli)), facts.matrix("coefficientRestitution")
    frictions = [[0.0 for _ in types] for _ in types]
    if facts.properties("coefficientFriction"):
        frictions = facts.matrix("coefficientFriction")
    sound = all(moduli) and all(-1 < ratio < 1 for ratio in ratios)
    sound = sound and all(0 < value <= 1 for row in restitutions for value in row)
    sizes = {len(ratios), len(restitutions), len(frictions)}
    laws = {model.normal for model in facts.models}
    if not moduli or not sound or sizes != {len(moduli)} or laws != {"hertz"}:
        return None
    solids = [_Elastic(*constants) for constants in zip(moduli, ratios, strict=True)]

    def constants(a: int, b: int) -> ContactConstants:
        pair = solids[a], solids[b]
        moduli_pa = effective_modulus(*pair), effective_shear(*pair)
        return ContactConstants(*moduli_pa, restitutions[a][b], frictions[a][b])

    return [[constants(a, b) for b in types] for a in types]


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
        known, kinds = _densities(facts), types_of(frame)
        if any(known.get(kind) is None for kind in np.unique(kinds).tolist()):
            return None
        density = np.array([known[kind] for kind in kinds.tolist()], dtype=np.float64)
    mass: Floats = sphere_mass(radii_of(frame), density)
    return mass


@cache
def _densities(facts: Facts) -> dict[int, float]:
    """Density of each type from 0 of which templates or data files say a single one, kg/m3."""
    rows = [(fix.word("atom_type") or "1", fix.after("density", 2))
            for fix in facts.styled("particletemplate/")]  # fmt: skip
    pairs = [(kind, words[1] if words[:1] == ["constant"] else "") for kind, words in
             rows if len(words) == 2]  # fmt: skip
    for command in facts.named("read_data"):
        pairs += _of_data_file(Path(command.file).parent / "".join(command.words[1:2]))
    known = {(as_number(kind), as_number(density)) for kind, density in pairs}
    types = Counter(kind for kind, _ in known)
    return {
        int(kind) - 1: density
        for kind, density in known
        if kind is not None and density is not None and types[kind] == 1
    }


def _of_data_file(file: Path) -> set[tuple[str, str]]:
    """Types and densities in the section Atoms of a data file of spheres."""
    text = text_of(file.read_bytes()) if file.is_file() else ""
    rows = text.partition("\nAtoms")[2].partition("\nVelocities")[0].split("\n")[1:]
    words = [row.split()[:4] for row in rows if row.strip()[:1].isdigit()]
    return {(row[1], row[3]) for row in words if len(row) == 4}
