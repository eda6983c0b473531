"""A run of the `collide` scene as arrays, with its contacts as the references see them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from dragchain.arrays import Floats
from dragchain.errors import TableError
from dragchain.run.run_parts import iter_frames
from dragdeck.decks.outputs import load_outputs
from dragdeck.physics.contact_mechanics import effective_modulus, effective_shear, particle_mass
from dragdeck.records.run import read_accepted
from evidence.verification.experiment import CollideCase, ContactFacts
from evidence.verification.law import (
    ContactPair,
    Particle,
    RelativeMotion,
    integrated_impacts,
    sliding_impact,
)

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
    case : CollideCase
    time_s : (T,) ndarray
    position_m, velocity_m_s, spin_rad_s, force_n : (T, N, 3) ndarray
        Of N particles in the order of their ids; the force includes gravity.
    wall_force_n : mapping of str to (T, N, 3) ndarray
        Of each wall on each particle.
    """

    case: CollideCase
    time_s: Floats
    position_m: Floats
    velocity_m_s: Floats
    spin_rad_s: Floats
    force_n: Floats
    wall_force_n: Mapping[str, Floats]

    def particle(self, number: int) -> Particle:
        """Mass and radius of a particle by its id."""
        body = self.case.bodies[number - 1]
        material = self.case.types[body.type - 1]
        return Particle(particle_mass(material, body.radius_m), body.radius_m)

    @cached_property
    def contacts(self) -> "tuple[RecordedContact, ...]":
        """The contacts of the run."""
        return tuple(RecordedContact(self, meeting) for meeting in self.case.contacts)

    @cached_property
    def integrated(self) -> Sequence[RelativeMotion]:
        """Motions after the impacts by the integrated law."""
        impacts = self.contacts
        return integrated_impacts(
            [impact.constants for impact in impacts], [impact.before for impact in impacts]
        )

    @property
    def contact(self) -> "RecordedContact":
        """The only contact of the run."""
        (contact,) = self.contacts
        return contact


@dataclass(frozen=True)
class RecordedContact:
    """A contact of a run: a particle, and the particle or the plane that it meets.

    Raises
    ------
    TableError
        From `before`, `after` and what is made of them: the surfaces touch in the first or the
        last frame, or never.
    """

    run: Recording
    meeting: ContactFacts

    @property
    def value(self) -> float:
        """The value that differs from contact to contact."""
        return self.meeting.value

    @property
    def at(self) -> int:
        """Row of the particle."""
        return self.meeting.particle - 1

    @property
    def partner_at(self) -> int | None:
        """Row of the partner; None for a plane."""
        partner = self.meeting.partner
        return None if isinstance(partner, str) else partner - 1

    @cached_property
    def constants(self) -> ContactPair:
        """What the law knows of the contact, from its two materials."""
        case, partner = self.run.case, self.partner_at
        kinds = [case.type_of(body) for body in (self.meeting.particle, self.meeting.partner)]
        kind_of_body, other = (case.types[kind - 1] for kind in kinds)
        pair = next(pair for pair in case.pairs if list(pair.types) == sorted(kinds))
        return ContactPair(
            particle=self.run.particle(self.meeting.particle),
            partner=None if partner is None else self.run.particle(partner + 1),
            modulus_pa=effective_modulus(kind_of_body, other),
            shear_pa=effective_shear(kind_of_body, other),
            restitution=pair.restitution,
            friction=pair.friction,
            limit_force=case.limit_force,
        )

    @cached_property
    def overlap_m(self) -> Floats:
        """Overlap, negative where there is a gap, shape (T,), m."""
        run, partner = self.run, self.partner_at
        radius = run.case.bodies[self.at].radius_m
        if partner is None:
            return np.asarray(radius - run.position_m[:, self.at, 2])
        apart = run.position_m[:, self.at] - run.position_m[:, partner]
        radii = radius + run.case.bodies[partner].radius_m
        return np.asarray(radii - np.linalg.norm(apart, axis=1))

    def motion(self, frame: int) -> RelativeMotion:
        """Relative motion along z at a frame; normal: the speed of approach."""
        run, partner = self.run, self.partner_at
        velocity, spin = run.velocity_m_s[frame, self.at], -run.spin_rad_s[frame, self.at, 1]
        second = 0.0
        if partner is not None:
            velocity = velocity - run.velocity_m_s[frame, partner]
            second = -run.spin_rad_s[frame, partner, 1]
        return RelativeMotion(-float(velocity[2]), float(velocity[0]), float(spin), float(second))

    @cached_property
    def _motions(self) -> tuple[RelativeMotion, RelativeMotion]:
        overlap = self.overlap_m
        if overlap[0] >= 0 or overlap[-1] >= 0 or not (overlap > 0).any():
            name, particle = self.run.case.run, self.meeting.particle
            raise TableError(f"{name}: the impact of particle {particle} is not whole in it")
        end = self.motion(-1)
        spins = end.spin_rad_s, end.partner_spin_rad_s
        return self.motion(0), RelativeMotion(-end.normal_m_s, end.tangential_m_s, *spins)

    @property
    def before(self) -> RelativeMotion:
        """Motion before the impact."""
        return self._motions[0]

    @property
    def after(self) -> RelativeMotion:
        """Motion after the impact; normal: the speed of separation."""
        return self._motions[1]

    @property
    def rebound(self) -> float:
        """Normal speed after the impact over that before."""
        return self.after.normal_m_s / self.before.normal_m_s

    @property
    def integrated(self) -> RelativeMotion:
        """Motion after the impact by the integrated law."""
        return self.run.integrated[self.run.case.contacts.index(self.meeting)]

    @property
    def slid(self) -> RelativeMotion | None:
        """Motion after the impact of rigid bodies that slide; None where they would not."""
        return sliding_impact(self.constants, self.before)

    @property
    def duration_s(self) -> float:
        """Time with an overlap, by linear interpolation between frames, s."""
        inside = np.flatnonzero(self.overlap_m > 0)
        return self._crossing_s(int(inside[-1])) - self._crossing_s(int(inside[0]) - 1)

    def _crossing_s(self, frame: int) -> float:
        overlap, time = self.overlap_m, self.run.time_s
        fraction = overlap[frame] / (overlap[frame] - overlap[frame + 1])
        return float(time[frame] + fraction * (time[frame + 1] - time[frame]))


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
    case = CollideCase.read(run_dir / "case.json")
    outputs = load_outputs(run_dir)["bodies"]
    frames = [frame.by_particle() for frame in iter_frames(run_dir, outputs)]

    def stacked(names: Sequence[str]) -> Floats:
        return np.array([frame.vectors(*names) for frame in frames])

    return Recording(
        case=case,
        time_s=np.array([frame.step for frame in frames]) * case.timestep_s,
        wall_force_n={
            wall.name: stacked([f"{wall.name}_force_{axis}_n" for axis in "xyz"])
            for wall in case.walls
        },
        **{name: stacked(columns) for name, columns in _VECTORS.items()},
    )
