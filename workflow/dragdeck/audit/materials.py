"""The materials of a script: masses, and constants of contacts by type."""

from collections.abc import Sequence
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


def types_of(frame: Frame) -> Ints:
    """Type of each particle from 0, (N,); 0 for all where the dump has none."""
    kinds = frame.columns.get("type")
    return np.zeros(frame.rows, np.int64) if kinds is None else np.asarray(kinds, np.int64) - 1


def radii_of(frame: Frame) -> Floats:
    """Radii of the particles, (N,), m."""
    diameter = "diameter" in frame.columns and "radius" not in frame.columns
    return frame.vectors("diameter")[:, 0] / 2 if diameter else frame.vectors("radius")[:, 0]


class ScriptMaterials:
    """What a script says of its materials.

    Attributes
    ----------
    constants : list of lists of ContactConstants
        Of the contacts of each pair of types; empty if the script does not say them.
    densities : dict of int to float
        Of each type from 0 of which templates or data files say a single one, kg/m3.
    """

    def __init__(self, facts: Facts) -> None:
        moduli, ratios = facts.values("youngsModulus"), facts.values("poissonsRatio")
        count, tables = len(moduli), [facts.matrix("coefficientRestitution")]
        smooth = not facts.properties("coefficientFriction")
        tables.append([[0.0] * count] * count if smooth else facts.matrix("coefficientFriction"))
        sizes, laws = {len(ratios), *map(len, tables)}, (*facts.laws, *facts.walls)
        sound = all(moduli) and all(-1 < ratio < 1 for ratio in ratios)
        sound &= all(0 < value <= 1 for row in tables[0] for value in row)
        self.constants: list[list[ContactConstants]] = []
        if sound and sizes == {count} and {law.word("model") for law in laws} == {"hertz"}:
            solids = [_Elastic(*constants) for constants in zip(moduli, ratios, strict=True)]
            self.constants = [
                [ContactConstants(effective_modulus(a, b), effective_shear(a, b), e, mu)
                 for b, e, mu in zip(solids, *rows, strict=True)]
                for a, *rows in zip(solids, *tables, strict=True)
            ]  # fmt: skip
        kinds: dict[int, set[float | None]] = {}
        for kind, density in _densities(facts):
            kinds.setdefault(int(as_number(kind) or 0) - 1, set()).add(as_number(density))
        known = {kind: max(values, key=str) for kind, values in kinds.items() if len(values) == 1}
        self.densities = {kind: value for kind, value in known.items() if value is not None}

    def masses(self, frame: Frame) -> Floats | None:
        """Masses of the particles, (N,), kg, from the dump or the script; None if not known."""
        if "mass" in frame.columns:
            return frame.vectors("mass")[:, 0]
        if "density" in frame.columns:
            density = frame.vectors("density")[:, 0]
        else:
            kinds, place = np.unique(types_of(frame), return_inverse=True)
            if not {*kinds.tolist()} <= self.densities.keys():
                return None
            density = np.array([self.densities[kind] for kind in kinds.tolist()])[place]
        mass: Floats = sphere_mass(radii_of(frame), density)
        return mass

    def has(self, types: Ints) -> bool:
        """Whether the constants of all these types are known."""
        return bool(self.constants) and bool(np.isin(types, range(len(self.constants))).all())


def _densities(facts: Facts) -> list[Sequence[str]]:
    """Types and densities in templates, and in the section Atoms of data files of spheres."""
    pairs: list[Sequence[str]] = []
    for fix in facts.styled("particletemplate/"):
        form, value = [*fix.after("density", 2), "", ""][:2]
        pairs.append((fix.word("atom_type") or "1", value if form == "constant" else ""))
    for command in facts.named("read_data"):
        file = Path(command.file).parent / "".join(command.words[1:2])
        text = text_of(file.read_bytes()) if file.is_file() else ""
        rows = text.partition("\nAtoms")[2].partition("\nVelocities")[0].split("\n")[1:]
        words = [row.split()[:4] for row in rows if row.strip()[:1].isdigit()]
        pairs += {(row[1], row[3]) for row in words if len(row) == 4}
    return pairs
