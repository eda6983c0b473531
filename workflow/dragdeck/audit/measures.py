"""What the frames of dumps say of a run, together with its script."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from dragdeck.arrays import Floats, Ints
from dragdeck.audit.materials import constants_of, masses_of, radii_of, types_of
from dragdeck.audit.walls import contacts_with, speeds, walls_of
from dragdeck.dumps.frame import Frame
from dragdeck.physics.contact_mechanics import fall_speed, network_number
from dragdeck.physics.coulomb import within_friction
from dragdeck.script.facts import Facts
from dragdeck.script.findings import Finding, NotApplied

_MOST_OVERLAP = 0.1
_REBOUND = 2.0
"""Speed of a particle over that of the wall that hits it, at most."""

_FRAMES = 20
"""Frames whose stability number is evaluated, as in the acceptance check of the time step."""

_AT_REST = 1e-3
"""Mean kinetic energy of a bed at rest, over m g d, or without gravity over the largest one."""

_SPINS = 0.1
"""Energy of rotation over m g d from which a particle of a bed at rest spins."""

_DRIFT = 2.0
"""Ratio of the kinetic energies of two thirds of a run that is no longer steady."""

_CUT = 0.05
"""Part of the tangential forces above Coulomb's limit, and error of the sums of forces."""

_ROUNDING = 0.01
"""Part of a tangential force that may be due to the digits of positions in a dump."""

_DRIVES = ("move", "insert/", "cfd", "addforce", "adapt", "setforce", "freeze")
Result = Iterator[Finding | NotApplied]


class Extreme(NamedTuple):
    """A largest value, where it is, and the step."""

    value: float = 0.0
    what: str = ""
    step: int = 0


NOTHING = Extreme()


class Energy(NamedTuple):
    """Of a frame: step, mean kinetic energy, and m g d or 0, per mass, J/kg."""

    step: int
    mean: float
    unit: float


@dataclass
class Measures:
    """Measures of the frames so far.

    Attributes
    ----------
    facts : Facts
    source : str
        Name of the dumps.
    overlap : Extreme
        Largest overlap, over the smaller radius.
    speed : Extreme
        Largest speed, m/s.
    energies : list of Energy
    ids, last_ids : set of int
        Of particles in any frame, and in the last one.
    """

    facts: Facts
    source: str
    overlap: Extreme = NOTHING
    speed: Extreme = NOTHING
    energies: list[Energy] = field(default_factory=list)
    ids: set[int] = field(default_factory=set)
    last_ids: set[int] = field(default_factory=set)
    bounds: Floats = field(default_factory=lambda: np.array([[np.inf] * 3, [-np.inf] * 3]))
    first_speed: float = math.nan
    not_finite: int = 0
    last: Frame | None = None
    frames: int = 0
    kept: list[Frame] = field(default_factory=list)
    every: int = 1

    @cached_property
    def walls(self) -> tuple[list, list[str]]:  # type: ignore[type-arg]
        """Walls, and names of those that are not known."""
        return walls_of(self.facts)

    @property
    def scope(self) -> str:
        """Which contacts the measures know."""
        known, unknown = self.walls
        if unknown:
            return f"without {', '.join(unknown)}: a lower bound"
        return "particles and walls" if known else "particles only: a lower bound"

    def add(self, frame: Frame) -> None:
        """Measure a frame."""
        names = [name for name in ("x", "y", "z", "radius", "diameter", "vx", "vy", "vz")
                 if name in frame.columns]  # fmt: skip
        finite = np.isfinite(frame.vectors(*names)).all(axis=1)
        self.not_finite += int((~finite).sum())
        frame = frame.take(np.flatnonzero(finite))
        self.frames += 1
        self.last_ids = set(frame.columns["id"].astype(int).tolist())
        self.ids |= self.last_ids
        self.last = frame
        if not frame.rows:
            return
        centre, radius = frame.vectors("x", "y", "z"), radii_of(frame)
        self.bounds = np.stack([np.minimum(self.bounds[0], centre.min(axis=0)),
                                np.maximum(self.bounds[1], centre.max(axis=0))])  # fmt: skip
        self._add_overlap(frame, centre, radius)
        if "vx" in frame.columns:
            self._add_speed(frame, radius)
        if (self.frames - 1) % self.every == 0:
            self.kept.append(frame)
            if len(self.kept) > 2 * _FRAMES:
                self.kept, self.every = self.kept[::2], 2 * self.every

    def _add_overlap(self, frame: Frame, centre: Floats, radius: Floats) -> None:
        bodies, _, overlap = contacts_with(centre, radius, self.walls[0], frame.step)
        if overlap.size:
            others = np.append(radius, np.full(len(self.walls[0]), np.inf))
            share = overlap / np.minimum(radius[bodies[0]], others[bodies[1]])
            at = int(share.argmax())
            if share[at] > self.overlap.value:
                ids = [*frame.columns["id"].astype(int).tolist(), *["a wall"] * len(self.walls[0])]
                first, second = ids[bodies[0, at]], ids[bodies[1, at]]
                pair = f"particle {first} with {second}"
                self.overlap = Extreme(float(share[at]), pair, frame.step)

    def _add_speed(self, frame: Frame, radius: Floats) -> None:
        speed = np.linalg.norm(frame.vectors("vx", "vy", "vz"), axis=1)
        fastest = int(speed.argmax())
        if math.isnan(self.first_speed):
            self.first_speed = float(speed[fastest])
        if speed[fastest] > self.speed.value:
            number = int(frame.columns["id"][fastest])
            self.speed = Extreme(float(speed[fastest]), f"particle {number}", frame.step)
        weight = radius**3 / (radius**3).sum()
        energy = 0.5 * speed**2 + _of_spin(frame, radius)
        gravity = np.linalg.norm(self.facts.gravity or [0.0])
        unit = float((weight * gravity * 2 * radius).sum())
        self.energies.append(Energy(frame.step, float((weight * energy).sum()), unit))

    def results(self) -> Result:
        """What DK201 to DK206 say of the frames."""
        clumped = bool(self.facts.styled("multisphere", "particletemplate/multisphere"))
        if clumped:
            yield NotApplied("DK201", "particles are clumps, whose spheres overlap")
        elif self.overlap.value > _MOST_OVERLAP:
            message = f"overlap of {100 * self.overlap.value:.1f} % of the radius: "
            message += f"{self.overlap.what}, step {self.overlap.step}"
            yield self._finding("DK201", message, overlap=self.overlap.value)
        yield from self._speeds()
        yield from self._balance()
        yield from [NotApplied("DK204", "particles are clumps")] if clumped else self._stability()
        yield from self._spin()
        yield from self._rest()

    def _finding(self, rule: str, message: str, **values: float) -> Finding:
        return Finding(rule, message, self.source, values=values)

    @cached_property
    def speed_limit(self) -> float | None:
        """Speed above every known cause, m/s; None if a cause is not known."""
        gravity = self.facts.gravity
        extent = self.bounds[1] - self.bounds[0]
        box = self.facts.box
        if box is not None:
            extent = np.maximum(extent, [high - low for low, high in box])
        causes = [self.first_speed, *speeds(self.facts, self.bounds)]
        if gravity is None or any(map(math.isnan, causes)):
            return None
        size = float(np.linalg.norm(gravity))
        height = float(np.abs(np.array(gravity) / size) @ extent) if size else 0.0
        return (fall_speed(height, size) + _REBOUND * max(causes)) or None

    def _speeds(self) -> Result:
        limit = self.speed_limit
        if limit is None:
            yield NotApplied("DK202", "velocities, or a cause of speed, are not known")
        elif self.speed.value > limit:
            message = f"{self.speed.what} at {self.speed.value:.3g} m/s, step {self.speed.step}; "
            message += f"every known cause gives at most {limit:.3g} m/s"
            yield self._finding("DK202", message, speed_m_s=self.speed.value, limit_m_s=limit)

    def _balance(self) -> Result:
        if self.not_finite:
            message = f"{self.not_finite} rows have a position that is no number"
            yield self._finding("DK203", message, rows=self.not_finite)
        missing = self.ids - self.last_ids
        if missing and (why := removal(self.facts)):
            yield NotApplied("DK203", why)
        elif missing:
            message = f"{len(missing)} of {len(self.ids)} particles are missing in the last frame"
            yield self._finding("DK203", message, missing=len(missing))

    @cached_property
    def stability(self) -> float | None:
        """Median stability number of frames of the second half; None if constants are not known."""
        constants, step_s = constants_of(self.facts), self.facts.timestep_s
        frames = self.kept[len(self.kept) // 2 :]
        masses = [masses_of(frame, self.facts) for frame in frames]
        if constants is None or step_s is None or not masses:
            return None
        numbers = []
        for frame, mass in zip(frames, masses, strict=True):
            if mass is None:
                return None
            centre, radius = frame.vectors("x", "y", "z"), radii_of(frame)
            contacts = contacts_with(centre, radius, self.walls[0], frame.step)
            classes = np.append(types_of(frame), [wall.type for wall in self.walls[0]]).astype(int)
            density = mass / (4 / 3 * math.pi * radius**3)
            number = network_number(centre, radius, density, contacts, constants, step_s, classes)
            numbers.append(number)
        return float(np.median(numbers))

    def _stability(self) -> Result:
        number = self.stability
        if number is None:
            yield NotApplied("DK204", "density, hertz constants or time step are not known")
        elif number > 1:
            message = f"stability number {number:.3g} ({self.scope}), limit 1"
            yield self._finding("DK204", message, stability_number=number)

    @property
    def rests(self) -> bool:
        """Whether the bed is at rest in the last frame."""
        last = self.energies[-1]
        return last.mean <= _AT_REST * (last.unit or max(energy.mean for energy in self.energies))

    def _spin(self) -> Result:
        if not self.energies or self.last is None or "omegax" not in self.last.columns:
            yield NotApplied("DK205", "no velocities and spins in the last frame")
            return
        gravity = float(np.linalg.norm(self.facts.gravity or [0.0]))
        if not gravity:
            yield NotApplied("DK205", "no gravity, with which the energy of a spin is compared")
            return
        radius = radii_of(self.last)
        moving = 0.5 * (self.last.vectors("vx", "vy", "vz") ** 2).sum(axis=1)
        unit = 2 * gravity * radius
        spins = (_of_spin(self.last, radius) > _SPINS * unit) & (moving < _AT_REST * unit)
        slow = np.median(moving) <= _AT_REST * np.median(unit)
        if slow and spins.any():
            rate = np.linalg.norm(self.last.vectors("omegax", "omegay", "omegaz"), axis=1)
            at = int(np.where(spins, rate, 0).argmax())
            message = f"particle {int(self.last.columns['id'][at])} spins at {rate[at]:.3g} rad/s "
            message += f"at rest; {int(spins.sum())} such particles"
            yield self._finding(
                "DK205", message, spin_rad_s=float(rate[at]), count=int(spins.sum())
            )

    def _rest(self) -> Result:
        if not self.energies or self.rests:
            return
        last, third = self.energies[-1], len(self.energies) // 3
        driven = is_driven(self.facts)
        if not driven:
            unit = f"{last.mean / last.unit:.2g} m g d" if last.unit else f"{last.mean:.2g} J/kg"
            message = f"the mean kinetic energy of a particle is {unit} in the last frame"
            yield self._finding("DK206", message, energy_j_kg=last.mean)
        elif third < 2:
            yield NotApplied("DK206", "too few frames of a driven bed")
        else:
            means = [float(np.mean([e.mean for e in part])) for part in
                     (self.energies[-2 * third : -third], self.energies[-third:])]  # fmt: skip
            ratio = means[1] / means[0] if means[0] else math.inf
            if not 1 / _DRIFT <= ratio <= _DRIFT:
                message = f"the mean kinetic energy changes by a factor of {ratio:.2g}"
                yield self._finding("DK206", f"{message} in the last two thirds", ratio=ratio)


def removal(facts: Facts) -> str:
    """Why particles may leave a run, or its dumps, on purpose; empty if they may not."""
    deleting = [fix.id for fix in facts.styled("massflow/mesh") if "delete_atom" in fix.words]
    deleting += [fix.id for fix in facts.styled("remove", "evaporate")]
    deleting += [command.words[0] for command in facts.named("delete_atoms")]
    return f"{', '.join(deleting)} removes particles" if deleting else ""


def is_driven(facts: Facts) -> bool:
    """Whether something moves the bed in the last run."""
    places = [at for at, command in enumerate(facts.script.commands) if command.words[0] == "run"]
    last = places[-1] if places else math.inf
    for fix in facts.fixes:
        turns = {"surface_vel", "surface_ang_vel", "shear"} & set(fix.words)
        once = "once" in fix.after("insert_every")
        if fix.begin < last <= fix.end and not once and (fix.words[0].startswith(_DRIVES) or turns):
            return True
    return False


def _of_spin(frame: Frame, radius: Floats) -> Floats:
    """Energy of rotation over mass, (N,), J/kg; 0 without spins."""
    if "omegax" not in frame.columns:
        return np.zeros(frame.rows)
    spin: Floats = frame.vectors("omegax", "omegay", "omegaz")
    energy: Floats = 0.2 * radius**2 * (spin**2).sum(axis=1)
    return energy


@dataclass
class ContactSums:
    """Coulomb's limit and force closure of the frames so far.

    Attributes
    ----------
    contacts, beyond : int
        Contacts, and those above Coulomb's limit.
    tangential_n, removed_n : float
        Sum of tangential forces, and what is above the limit.
    force_n, error_n : float
        Sums over particles without a wall of the forces of contacts, and of the difference from the
        force in the dump.
    """

    contacts: int = 0
    beyond: int = 0
    tangential_n: float = 0.0
    removed_n: float = 0.0
    force_n: float = 0.0
    error_n: float = 0.0

    def add(
        self, frame: Frame, ids: Sequence[str], forces: Sequence[str], run: Measures, at: Frame
    ) -> None:
        """Add the contacts of a frame between particles of the frame `at`."""
        frame_ids = at.columns["id"].astype(np.int64)
        order = np.argsort(frame_ids)
        pair = frame.vectors(*ids).astype(np.int64).T
        rows = order[np.searchsorted(frame_ids, pair, sorter=order).clip(max=len(order) - 1)]
        there = (frame_ids[rows] == pair).all(axis=0)
        rows, force = rows[:, there], frame.vectors(*forces)[there]
        centre, radius = at.vectors("x", "y", "z"), radii_of(at)
        line = centre[rows[0]] - centre[rows[1]]
        distance = np.linalg.norm(line, axis=1)
        near = distance < 1.5 * radius[rows].sum(axis=0)
        rows, force, normal = rows[:, near], force[near], line[near] / distance[near, None]
        constants = constants_of(run.facts)
        kinds = types_of(at)[rows]
        friction = np.array([[pair.friction for pair in row] for row in constants or [[]]])
        self.contacts += len(force)
        if constants and not any(law.has("cohesion") for law in run.facts.laws):
            along = np.einsum("ij,ij->i", force, normal)
            sizes = np.linalg.norm(force - along[:, None] * normal, axis=1)
            _, removed = within_friction(force, normal, friction[kinds[0], kinds[1]])
            self.beyond += int((removed > _ROUNDING * sizes).sum())
            self.tangential_n += float(sizes.sum())
            self.removed_n += float(removed.sum())
        mass, gravity = masses_of(at, run.facts), run.facts.gravity
        weight = None if mass is None or gravity is None else mass[:, None] * np.array(gravity)
        if weight is not None and "fx" in at.columns and not run.walls[1]:
            self._add_closure(rows, force, weight, run, at)

    def _add_closure(
        self, rows: Ints, force: Floats, weight: Floats, run: Measures, at: Frame
    ) -> None:
        total = np.zeros((at.rows, 3))
        np.add.at(total, rows[0], force)
        np.add.at(total, rows[1], -force)
        bodies, _, _ = contacts_with(at.vectors("x", "y", "z"), radii_of(at), run.walls[0], at.step)
        inside = np.ones(at.rows, dtype=bool)
        inside[bodies[0, bodies[1] >= at.rows]] = False
        error = total + weight - at.vectors("fx", "fy", "fz")
        self.error_n += float(np.linalg.norm(error[inside], axis=1).sum())
        magnitude = np.zeros(at.rows)
        np.add.at(magnitude, rows.ravel(), np.tile(np.linalg.norm(force, axis=1), 2))
        self.force_n += float(magnitude[inside].sum())

    def results(self, source: str) -> Result:
        """What DK207 says."""
        cut = self.removed_n / self.tangential_n if self.tangential_n else 0.0
        error = self.error_n / self.force_n if self.force_n else 0.0
        if cut > _CUT:
            message = f"{100 * cut:.1f} % of the tangential forces are above Coulomb's limit, in "
            message += f"{self.beyond} of {self.contacts} contacts"
            yield Finding("DK207", message, source, values={"above": cut})
        if error > _CUT:
            message = f"the contact forces on a particle miss its force by {100 * error:.1f} %"
            yield Finding("DK207", message, source, values={"error": error})


def matched(
    particles: Iterable[Frame], contacts: Iterable[Frame]
) -> Iterator[tuple[Frame, Frame | None]]:
    """Frames of particles, each with the contacts of its step, if there are any."""
    rest = iter(contacts)
    waiting = next(rest, None)
    for frame in particles:
        while waiting is not None and waiting.step < frame.step:
            waiting = next(rest, None)
        yield frame, waiting if waiting is not None and waiting.step == frame.step else None
