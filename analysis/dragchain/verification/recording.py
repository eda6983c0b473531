"""A run of the `collide` scene as arrays, with its contacts as the references see them."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from dragchain.arrays import Floats
from dragchain.contact_law.hertz import Elastic, effective_modulus, effective_shear
from dragchain.contact_law.impact import Contact, Motion, Particle
from dragchain.dumps.run_parts import iter_frames
from dragchain.errors import DocumentError, TableError
from dragchain.run.case import load_outputs
from dragchain.run.completeness import read_accepted

_VECTORS = {
    "position_m": ("x_m", "y_m", "z_m"),
    "velocity_m_s": ("vx_m_s", "vy_m_s", "vz_m_s"),
    "spin_rad_s": ("wx_rad_s", "wy_rad_s", "wz_rad_s"),
    "force_n": ("force_x_n", "force_y_n", "force_z_n"),
}


@dataclass(frozen=True)
class Recording:
    """What a run did.

    Attributes
    ----------
    case : mapping
        Content of ``case.json``.
    time_s : (T,) ndarray
    position_m, velocity_m_s, spin_rad_s, force_n : (T, N, 3) ndarray
        Of N particles in the order of their ids; the force includes gravity.
    wall_force_n : mapping of str to (T, N, 3) ndarray
        Of each wall on each particle.
    """

    case: Mapping[str, Any]
    time_s: Floats
    position_m: Floats
    velocity_m_s: Floats
    spin_rad_s: Floats
    force_n: Floats
    wall_force_n: Mapping[str, Floats]

    @property
    def steps_per_contact(self) -> int:
        """Time steps in the shortest contact of the run."""
        return int(self.case["steps_per_contact"])

    def particle(self, number: int) -> Particle:
        """Mass and radius of a particle by its id."""
        body = self.case["bodies"][number - 1]
        density = self.case["types"][body["type"] - 1]["density_kg_m3"]
        radius = float(body["radius_m"])
        return Particle(4 / 3 * math.pi * radius**3 * density, radius)

    def contact(self, entry: Mapping[str, Any]) -> Contact:
        """The constants of a contact, from those of its two materials."""
        kinds = [self._type(entry["particle"]), self._type(entry["partner"])]
        own, other = (self._elastic(kind) for kind in kinds)
        wall = isinstance(entry["partner"], str)
        pair = self._pair(sorted(kinds))
        return Contact(
            particle=self.particle(entry["particle"]),
            partner=None if wall else self.particle(entry["partner"]),
            modulus_pa=effective_modulus(own, other),
            shear_pa=effective_shear(own, other),
            restitution=float(pair["restitution"]),
            friction=float(pair["friction"]),
            limit_force=bool(self.case["limit_force"]),
        )

    def _elastic(self, kind: int) -> Elastic:
        material = self.case["types"][kind - 1]
        return Elastic(material["youngs_modulus_pa"], material["poissons_ratio"])

    def _type(self, name: int | str) -> int:
        if isinstance(name, int):
            return int(self.case["bodies"][name - 1]["type"])
        return int(next(wall["type"] for wall in self.case["walls"] if wall["name"] == name))

    def _pair(self, kinds: list[int]) -> Mapping[str, Any]:
        return next(pair for pair in self.case["pairs"] if pair["types"] == kinds)

    def overlap_m(self, entry: Mapping[str, Any]) -> Floats:
        """Overlap of a contact, negative where there is a gap, shape (T,), m."""
        particle, partner = entry["particle"] - 1, entry["partner"]
        radius = self.case["bodies"][particle]["radius_m"]
        if isinstance(partner, str):
            return np.asarray(radius - self.position_m[:, particle, 2])
        apart = self.position_m[:, particle] - self.position_m[:, partner - 1]
        radii = radius + self.case["bodies"][partner - 1]["radius_m"]
        return np.asarray(radii - np.linalg.norm(apart, axis=1))

    def motion(self, entry: Mapping[str, Any], at: int) -> Motion:
        """Relative motion of a contact along z at a frame; normal: the speed of approach."""
        particle, partner = entry["particle"] - 1, entry["partner"]
        velocity, spin = self.velocity_m_s[at, particle], -self.spin_rad_s[at, particle, 1]
        if isinstance(partner, str):
            return Motion(-float(velocity[2]), float(velocity[0]), float(spin))
        relative = velocity - self.velocity_m_s[at, partner - 1]
        second = -self.spin_rad_s[at, partner - 1, 1]
        return Motion(-float(relative[2]), float(relative[0]), float(spin), float(second))

    def impact(self, entry: Mapping[str, Any]) -> tuple[Motion, Motion]:
        """Motion before and after an impact; normal: approach, then separation.

        Raises
        ------
        TableError
            If the surfaces touch in the first or the last frame, or never.
        """
        overlap = self.overlap_m(entry)
        if overlap[0] >= 0 or overlap[-1] >= 0 or not (overlap > 0).any():
            raise TableError(
                f"{self.case['run']}: the impact of particle {entry['particle']} is not whole in it"
            )
        before, after = self.motion(entry, 0), self.motion(entry, -1)
        return before, Motion(
            -after.normal_m_s, after.tangential_m_s, after.spin_rad_s, after.partner_spin_rad_s
        )

    def duration_s(self, entry: Mapping[str, Any]) -> float:
        """Time with an overlap, by linear interpolation between frames, s."""
        overlap = self.overlap_m(entry)
        inside = np.flatnonzero(overlap > 0)
        first, last = int(inside[0]), int(inside[-1])
        return self._crossing(overlap, last) - self._crossing(overlap, first - 1)

    def _crossing(self, overlap: Floats, at: int) -> float:
        fraction = overlap[at] / (overlap[at] - overlap[at + 1])
        return float(self.time_s[at] + fraction * (self.time_s[at + 1] - self.time_s[at]))


def read_recording(run_dir: Path) -> Recording:
    """Read a complete run.

    Raises
    ------
    RejectedRunError
        The run is not complete, or an acceptance check of it failed.
    DocumentError, DumpError
        A file of it cannot be used.
    """
    read_accepted(run_dir)
    case = _json(run_dir / "case.json")
    if case.get("scene") != "collide":
        raise DocumentError(run_dir / "case.json", "scene", "is not 'collide'")
    frames = [
        (frame.step, frame.columns, np.argsort(frame.columns["particle_id"]))
        for frame in iter_frames(run_dir, load_outputs(run_dir)["bodies"])
    ]

    def stacked(names: tuple[str, ...]) -> Floats:
        return np.array(
            [np.column_stack([columns[name][order] for name in names])
             for _, columns, order in frames],
            dtype=np.float64,
        )  # fmt: skip

    walls = {
        wall["name"]: stacked(tuple(f"{wall['name']}_force_{axis}_n" for axis in "xyz"))
        for wall in case["walls"]
    }
    return Recording(
        case=case,
        time_s=np.array([step for step, _, _ in frames]) * case["timestep_s"],
        wall_force_n=walls,
        **{name: stacked(columns) for name, columns in _VECTORS.items()},
    )


def _json(file: Path) -> dict[str, Any]:
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise DocumentError(
            file, None, "there is no such file", remedy="run the suite first"
        ) from None
    return dict(content)
