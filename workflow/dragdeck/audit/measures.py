"""What the frames of dumps say of a run, together with its script."""

import math
from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dragdeck.arrays import Floats, Ints
from dragdeck.audit.materials import constants_of, masses_of, radii_of, types_of
from dragdeck.audit.walls import WallAtStep, Walls, speeds
from dragdeck.dumps.frame import Frame
from dragdeck.physics.contact_mechanics import network_number, touching
from dragdeck.physics.coulomb import within_friction
from dragdeck.physics.run_limits import run_limits, thrown_speed
from dragdeck.script.facts import Facts
from dragdeck.script.findings import Finding, NotApplied, Results

_MOST_OVERLAP = 0.1
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
_PLACE, _VELOCITY, _SPIN = ("x", "y", "z"), ("vx", "vy", "vz"), ("omegax", "omegay", "omegaz")
_MEASURED = {"id", "type", *_PLACE, *_VELOCITY, *_SPIN, "fx", "fy", "fz", "radius", "diameter",
             "density", "mass"}  # fmt: skip
_LARGEST, _SMALLEST = 2.0**53, 1e-12
"""Limits of the numbers in a dump, and of radii: what is beyond has diverged."""


class Extreme(NamedTuple):
    """A largest value, where it is, and the step."""

    value: float = 0.0
    what: str = ""
    step: int = 0


class Energy(NamedTuple):
    """Of a frame: mean kinetic energy, and m g d or 0, per mass, J/kg."""

    mean: float
    unit: float


class MeasuredFrame(NamedTuple):
    """A frame with its particles, the walls at its step, and the contacts of all these."""

    frame: Frame
    centre: Floats
    radius: Floats
    walls: list[WallAtStep]
    contacts: tuple[Ints, Floats, Floats]


class Measures:
    """Measures of the frames so far.

    Attributes
    ----------
    frames : int
    overlap : Extreme
        Largest overlap, over the smaller radius.
    speed : Extreme
        Largest speed, m/s.
    energies : list of Energy
    n_contacts, n_beyond : int
        Dumped contacts, and those above Coulomb's limit.
    """

    def __init__(self, facts: Facts, source: str) -> None:
        self.facts, self.source, self.walls = facts, source, Walls(facts)
        self.constants = constants_of(facts)
        self.overlap, self.speed = Extreme(), Extreme()
        self.energies: list[Energy] = []
        self.first_speed = math.nan
        self.ids: set[int] = set()
        self.last_ids: set[int] = set()
        self.through: dict[str, set[int]] = {}
        self.below: dict[str, set[int]] = {}
        self.bounds = np.array([[np.inf] * 3, [-np.inf] * 3])
        self.frames = self.n_unsound = self.n_contacts = self.n_beyond = 0
        self.force_sums = np.zeros(4)
        self.last: MeasuredFrame | None = None
        self.kept: list[MeasuredFrame] = []
        self.every = 1

    @property
    def scope(self) -> str:
        """Which contacts the measures know."""
        if self.walls.unknown:
            return f"without {', '.join(self.walls.unknown)}: a lower bound"
        return "particles and walls" if self.walls.known else "particles only: a lower bound"

    def add(self, frame: Frame) -> None:
        """Measure a frame."""
        sound = _are_numbers(frame, _MEASURED & frame.columns.keys())
        sound &= radii_of(frame) > _SMALLEST
        frame = frame.take(np.flatnonzero(sound))
        self.n_unsound += int((~sound).sum())
        self.frames += 1
        before, self.last_ids, self.last = self.last_ids, set(frame.ids("id").tolist()), None
        self.ids |= self.last_ids
        if not frame.rows:
            return
        centre, radius = frame.vectors(*_PLACE), radii_of(frame)
        walls = self.walls.at(frame.step, float(radius.max()))
        contacts = touching(centre, radius, *([wall] for wall in walls))
        self.last = MeasuredFrame(frame, centre, radius, walls, contacts)
        self.bounds = np.stack([np.minimum(self.bounds[0], centre.min(axis=0)),
                                np.maximum(self.bounds[1], centre.max(axis=0))])  # fmt: skip
        self._add_overlap(self.last)
        self._add_sides(self.last, before)
        if {*_VELOCITY} <= frame.columns.keys():
            self._add_speed(self.last)
        if (self.frames - 1) % self.every == 0:
            self.kept.append(self.last)
            if len(self.kept) > 2 * _FRAMES:
                self.kept, self.every = self.kept[::2], 2 * self.every

    def _add_overlap(self, scene: MeasuredFrame) -> None:
        (first, second), _, overlap = scene.contacts
        radii = np.append(scene.radius, np.full(len(scene.walls), np.inf))
        fractions = overlap / np.minimum(radii[first], radii[second])
        if len(fractions) and fractions.max() > self.overlap.value:
            at = int(fractions.argmax())
            ids = [*scene.frame.ids("id").tolist(), *(f"a wall, {w.name}" for w in scene.walls)]
            pair = f"particle {ids[first[at]]} with {ids[second[at]]}"
            self.overlap = Extreme(float(fractions[at]), pair, scene.frame.step)

    def _add_sides(self, scene: MeasuredFrame, before: set[int]) -> None:
        """Particles that were on the other side of a plane or cylinder in the frame before."""
        ids, below = scene.frame.ids("id"), {}
        for wall in scene.walls if "p" not in "".join(self.facts.last("boundary")) else ():
            below[wall.name] = set(ids[wall.distances(scene.centre)[0] < 0].tolist())
            if wall.name in self.below:
                crossed = (below[wall.name] ^ self.below[wall.name]) & before & self.last_ids
                self.through.setdefault(wall.name, set()).update(crossed)
        self.below = below

    def _add_speed(self, scene: MeasuredFrame) -> None:
        speed = np.linalg.norm(scene.frame.vectors(*_VELOCITY), axis=1)
        fastest = int(speed.argmax())
        if math.isnan(self.first_speed):
            self.first_speed = float(speed[fastest])
        if speed[fastest] > self.speed.value:
            particle = f"particle {scene.frame.ids('id')[fastest]}"
            self.speed = Extreme(float(speed[fastest]), particle, scene.frame.step)
        weight = scene.radius**3 / (scene.radius**3).sum()
        energy = 0.5 * speed**2 + _of_spin(scene)
        gravity = math.hypot(*self.facts.gravity or ())
        unit = float((weight * gravity * 2 * scene.radius).sum())
        self.energies.append(Energy(float((weight * energy).sum()), unit))

    def add_contacts(self, rows: Frame, ids: Sequence[str], forces: Sequence[str]) -> None:
        """Add the dumped contacts between particles of the last frame."""
        if self.last is None:
            return
        frame, centre, radius, *_ = self.last
        rows = rows.take(np.flatnonzero(_are_numbers(rows, {*ids, *forces})))
        order = np.argsort(frame.ids("id"))
        known = frame.ids("id")[order]
        pair = rows.vectors(*ids).astype(np.int64).T
        at = np.searchsorted(known, pair).clip(max=len(known) - 1)
        there = (known[at] == pair).all(axis=0)
        pair, force = order[at[:, there]], rows.vectors(*forces)[there]
        line = centre[pair[0]] - centre[pair[1]]
        distance = np.linalg.norm(line, axis=1)
        near = (distance < 1.5 * radius[pair].sum(axis=0)) & (distance > 0)
        pair, force, normal = pair[:, near], force[near], line[near] / distance[near, None]
        self.n_contacts += len(force)
        kinds, cohesive = types_of(frame)[pair], any(m.has("cohesion") for m in self.facts.models)
        if self.constants and not cohesive and self._has_types(kinds):
            friction = np.array([[each.friction for each in row] for row in self.constants])
            across = force - np.einsum("ij,ij->i", force, normal)[:, None] * normal
            _, removed = within_friction(force, normal, friction[kinds[0], kinds[1]])
            sizes = np.linalg.norm(across, axis=1)
            self.n_beyond += int((removed > _ROUNDING * sizes).sum())
            self.force_sums[:2] += removed.sum(), sizes.sum()
        if {"fx", "fy", "fz"} <= frame.columns.keys() and not self.walls.unknown:
            self._add_closure(self.last, pair, force)

    def _add_closure(self, scene: MeasuredFrame, pair: Ints, force: Floats) -> None:
        """Add forces of particles without a wall: errors of their sums, and magnitudes."""
        mass, gravity = masses_of(scene.frame, self.facts), self.facts.gravity
        if mass is None or gravity is None:
            return
        count, (first, second) = len(mass), scene.contacts[0]
        totals, magnitudes = mass[:, None] * np.array(gravity), np.zeros(count)
        np.add.at(totals, pair[0], force)
        np.add.at(totals, pair[1], -force)
        np.add.at(magnitudes, pair.ravel(), np.tile(np.linalg.norm(force, axis=1), 2))
        inside = np.ones(count, dtype=bool)
        inside[first[second >= count]] = False
        errors = np.linalg.norm(totals - scene.frame.vectors("fx", "fy", "fz"), axis=1)
        self.force_sums[2:] += errors[inside].sum(), magnitudes[inside].sum()

    def results(self, left_out: str = "") -> Results:
        """What DK201 to DK206 say of the frames.

        Parameters
        ----------
        left_out : str
            Why they need not contain all particles.
        """
        clumped = "particles are clumps, whose spheres overlap" if is_clumped(self.facts) else ""
        if clumped:
            yield NotApplied("DK201", clumped)
        elif self.overlap.value > _MOST_OVERLAP:
            message = f"overlap of {100 * self.overlap.value:.1f} % of the radius: "
            message += f"{self.overlap.what}, step {self.overlap.step}"
            yield self._finding("DK201", message, overlap=self.overlap.value)
        yield from self._speeds()
        yield from self._balance(left_out)
        if clumped or self.stability is None:
            why = clumped or "density, hertz constants or time step are not known"
            yield NotApplied("DK204", why)
        elif self.stability > 1:
            message = f"stability number {self.stability:.3g} ({self.scope}), limit 1"
            yield self._finding("DK204", message, stability_number=self.stability)
        yield from self._spin()
        yield from self._rest()

    def _finding(self, rule: str, message: str, **values: float) -> Finding:
        return Finding(rule, message, self.source, values=values)

    def _speeds(self) -> Results:
        gravity, box = self.facts.gravity, self.facts.box
        causes = [self.first_speed, *speeds(self.facts, self.bounds)]
        if gravity is None or any(map(math.isnan, causes)):
            yield NotApplied("DK202", "velocities, or a cause of speed, are not known")
            return
        extent = np.maximum(self.bounds[1] - self.bounds[0],
                            [high - low for low, high in box.bounds] if box else 0.0)  # fmt: skip
        size, speed = math.hypot(*gravity), max(causes)
        height = float(np.abs(gravity) @ extent) / (size or 1.0)
        limit = thrown_speed(size, height, speed)
        energy = run_limits(len(self.ids), 1.0, size, height, speed).mean_kinetic_energy_j
        mean = max(energy.mean for energy in self.energies)
        if self.speed.value > limit > 0:
            message = f"{self.speed.what} at {self.speed.value:.3g} m/s, step {self.speed.step}; "
            message += f"every known cause gives at most {limit:.3g} m/s"
            yield self._finding("DK202", message, speed_m_s=self.speed.value, limit_m_s=limit)
        elif mean > energy > 0:
            message = f"a mean kinetic energy of {mean:.3g} J/kg; every known cause gives at most "
            yield self._finding("DK202", f"{message}{energy:.3g} J/kg", energy_j_kg=mean)

    def _balance(self, left_out: str) -> Results:
        missing = self.ids - self.last_ids
        if self.n_unsound:
            message = f"{self.n_unsound} rows have nan, inf or a number that no particle can have"
            yield self._finding("DK203", message, rows=self.n_unsound)
        for name, ids in self.through.items():
            if ids:
                message = f"{len(ids)} particles went through the wall {name}, such as {min(ids)}"
                yield self._finding("DK203", message, through=len(ids))
        if missing and (why := left_out or removal(self.facts)):
            yield NotApplied("DK203", why)
        elif missing:
            message = f"{len(missing)} of {len(self.ids)} particles are missing in the last frame"
            yield self._finding("DK203", message, missing=len(missing))

    @cached_property
    def stability(self) -> float | None:
        """Median stability number of frames of the second half; None if constants are not known."""
        step_s, scenes = self.facts.timestep_s, self.kept[len(self.kept) // 2 :]
        masses = [masses_of(scene.frame, self.facts) for scene in scenes]
        if self.constants is None or step_s is None or not masses:
            return None
        numbers = []
        for (frame, centre, radius, walls, contacts), mass in zip(scenes, masses, strict=True):
            types = np.append(types_of(frame), [wall.type for wall in walls]).astype(np.int64)
            if mass is None or not (mass > 0).all() or not self._has_types(types):
                return None
            density = mass / (4 / 3 * math.pi * radius**3)
            number = network_number(
                centre, radius, density, contacts, self.constants, step_s, types
            )
            numbers.append(number)
        return float(np.median(numbers))

    def _has_types(self, types: Ints) -> bool:
        """Whether the constants of all these types are known."""
        return bool(((types >= 0) & (types < len(self.constants or ()))).all())

    def _spin(self) -> Results:
        gravity = math.hypot(*self.facts.gravity or ())
        if not self.energies or self.last is None or not {*_SPIN} <= self.last.frame.columns.keys():
            yield NotApplied("DK205", "no velocities and spins in the last frame")
            return
        if not gravity:
            yield NotApplied("DK205", "no gravity, with which the energy of a spin is compared")
            return
        moving = 0.5 * (self.last.frame.vectors(*_VELOCITY) ** 2).sum(axis=1)
        unit = 2 * gravity * self.last.radius
        spins = (_of_spin(self.last) > _SPINS * unit) & (moving < _AT_REST * unit)
        if spins.any() and np.median(moving) <= _AT_REST * np.median(unit):
            rate = np.where(spins, np.linalg.norm(self.last.frame.vectors(*_SPIN), axis=1), 0)
            at, count = int(rate.argmax()), int(spins.sum())
            message = f"particle {self.last.frame.ids('id')[at]} spins at {rate[at]:.3g} rad/s "
            message += f"at rest; {count} such particles"
            yield self._finding("DK205", message, spin_rad_s=float(rate[at]), count=count)

    def _rest(self) -> Results:
        means = [energy.mean for energy in self.energies]
        if not means or means[-1] <= _AT_REST * (self.energies[-1].unit or max(means)):
            return
        last, third = self.energies[-1], len(means) // 3
        if not is_driven(self.facts):
            energy = f"{last.mean / last.unit:.2g} m g d" if last.unit else f"{last.mean:.2g} J/kg"
            message = f"the mean kinetic energy of a particle is {energy} in the last frame"
            yield self._finding("DK206", message, energy_j_kg=last.mean)
        elif third < 2:
            yield NotApplied("DK206", "too few frames of a driven bed")
        else:
            before = math.fsum(means[-2 * third : -third])
            ratio = math.fsum(means[-third:]) / before if before else math.inf
            if not 1 / _DRIFT <= ratio <= _DRIFT:
                message = f"the mean kinetic energy changes by a factor of {ratio:.2g}"
                yield self._finding("DK206", f"{message} in the last two thirds", ratio=ratio)

    def contact_results(self, source: str) -> Results:
        """What DK207 says of the dumped contacts."""
        removed, tangential, errors, forces = self.force_sums.tolist()
        above = removed / tangential if tangential else 0.0
        error = errors / forces if forces else 0.0
        if above > _CUT:
            message = f"{100 * above:.1f} % of the tangential forces are above Coulomb's limit, in "
            message += f"{self.n_beyond} of {self.n_contacts} contacts"
            yield Finding("DK207", message, source, values={"above": above})
        if error > _CUT:
            message = f"the contact forces on a particle miss its force by {100 * error:.1f} %"
            yield Finding("DK207", message, source, values={"error": error})


def _are_numbers(rows: Frame, names: set[str]) -> NDArray[np.bool_]:
    """Whether these columns of (N,) rows are numbers that have not diverged."""
    return np.asarray((np.abs(rows.vectors(*names)) < _LARGEST).all(axis=1))


def is_clumped(facts: Facts) -> bool:
    """Whether particles are clumps of spheres."""
    return bool(facts.styled("multisphere", "particletemplate/multisphere"))


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
        once = fix.word("insert_every") == "once"
        if fix.begin < last <= fix.end and not once and (fix.words[0].startswith(_DRIVES) or turns):
            return True
    return False


def _of_spin(scene: MeasuredFrame) -> Floats:
    """Energy of rotation over mass, (N,), J/kg; 0 without spins."""
    if not {*_SPIN} <= scene.frame.columns.keys():
        return np.zeros(scene.frame.rows)
    spin = scene.frame.vectors(*_SPIN)
    return np.asarray(0.2 * scene.radius**2 * (spin**2).sum(axis=1))
