"""What the frames of dumps say of a run, together with its script."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dragdeck.arrays import Floats, Ints
from dragdeck.audit.materials import ScriptMaterials, radii_of, types_of
from dragdeck.audit.walls import WallAtStep, Walls, speeds
from dragdeck.dumps.frame import Frame
from dragdeck.physics.contact_network import network_number, touching
from dragdeck.physics.coulomb import within_friction
from dragdeck.physics.run_limits import run_limits, thrown_speed
from dragdeck.script.facts import Facts
from dragdeck.script.findings import Hits, hit, unknown

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
_FORCE = ("fx", "fy", "fz")
_MEASURED = {"id", "type", *_PLACE, *_VELOCITY, *_SPIN, *_FORCE, "radius", "diameter", "density",
             "mass"}  # fmt: skip
_LARGEST, _SMALLEST = 2.0**53, 1e-12
"""Limits of the numbers in a dump, and of radii: what is beyond has diverged."""


Extreme = tuple[float, str, int]
"""A largest value, where it is, and the step."""


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
    energies : list of (float, float)
        Of each frame: mean kinetic energy, and m g d or 0, per mass, J/kg.
    n_contacts, n_beyond : int
        Dumped contacts, and those above Coulomb's limit.
    left_out : str
        Why the frames need not contain all particles.
    """

    def __init__(self, facts: Facts) -> None:
        self.facts, self.walls, self.materials = facts, Walls(facts), ScriptMaterials(facts)
        self.overlap: Extreme = 0.0, "", 0
        self.speed: Extreme = 0.0, "", 0
        self.energies: list[tuple[float, float]] = []
        self.numbers: list[float | None] = []
        self.ids, self.last_ids = set[int](), set[int]()
        self.through: dict[str, set[int]] = {}
        self.below: dict[str, set[int]] = {}
        self.bounds = np.array([[np.inf] * 3, [-np.inf] * 3])
        self.frames = self.n_unsound = self.n_contacts = self.n_beyond = 0
        self.every, self.first_speed = 1, 0.0
        self.force_sums = np.zeros(4)
        self.last: MeasuredFrame | None = None
        self.left_out = ""

    @property
    def known(self) -> dict[str, float | str]:
        """Numbers for every report."""
        last = [mean for mean, _ in self.energies[-1:]]
        known: dict[str, float | str | None] = {
            "frames": self.frames, "contacts of": self.scope, "largest speed, m/s": self.speed[0],
            "largest overlap over radius": self.overlap[0], "stability number": self.stability,
            "mean kinetic energy in the last frame, J/kg": last[0] if last else None,
        }  # fmt: skip
        return {name: value for name, value in known.items() if value is not None}

    @property
    def scope(self) -> str:
        """Which contacts the measures know."""
        if self.walls.unknown:
            return f"without {', '.join(self.walls.unknown)}: a lower bound"
        return "particles and walls" if self.walls.known else "particles only: a lower bound"

    @property
    def stability(self) -> float | None:
        """Median stability number of frames of the second half; None if constants are not known."""
        numbers = [n for n in self.numbers[len(self.numbers) // 2 :] if n is not None]
        return float(np.median(numbers)) if numbers else None

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
        self.last = scene = MeasuredFrame(frame, centre, radius, walls, contacts)
        self.bounds = np.stack([np.minimum(self.bounds[0], centre.min(axis=0)),
                                np.maximum(self.bounds[1], centre.max(axis=0))])  # fmt: skip
        self._add_overlap(scene)
        self._add_sides(scene, before)
        if {*_VELOCITY} <= frame.columns.keys():
            self._add_speed(scene)
        if (self.frames - 1) % self.every == 0:
            self.numbers.append(self._stability(scene))
            if len(self.numbers) > 2 * _FRAMES:
                self.numbers, self.every = self.numbers[::2], 2 * self.every

    def _add_overlap(self, scene: MeasuredFrame) -> None:
        (first, second), _, overlap = scene.contacts
        radii = np.append(scene.radius, np.full(len(scene.walls), np.inf))
        fractions = overlap / np.minimum(radii[first], radii[second])
        if len(fractions) and fractions.max() > self.overlap[0]:
            at = int(fractions.argmax())
            ids = [*scene.frame.ids("id").tolist(), *(f"a wall, {w.name}" for w in scene.walls)]
            pair = f"particle {ids[first[at]]} with {ids[second[at]]}"
            self.overlap = float(fractions[at]), pair, scene.frame.step

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
        if self.frames == 1:
            self.first_speed = float(speed[fastest])
        if speed[fastest] > self.speed[0]:
            particle = f"particle {scene.frame.ids('id')[fastest]}"
            self.speed = float(speed[fastest]), particle, scene.frame.step
        weight = scene.radius**3 / (scene.radius**3).sum()
        unit = math.hypot(*self.facts.gravity or ()) * 2 * scene.radius
        energy = 0.5 * speed**2 + _of_spin(scene)
        self.energies.append((float(weight @ energy), float(weight @ unit)))

    def _stability(self, scene: MeasuredFrame) -> float | None:
        mass, step_s = self.materials.masses(scene.frame), self.facts.timestep_s
        types = np.append(types_of(scene.frame), [wall.type for wall in scene.walls])
        types = types.astype(np.int64)
        if mass is None or step_s is None or not (mass > 0).all() or not self.materials.has(types):
            return None
        density = mass / (4 / 3 * math.pi * scene.radius**3)
        _, centre, radius, _, contacts = scene
        constants = self.materials.constants
        return network_number(centre, radius, density, contacts, constants, step_s, types)

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
        kinds, laws = types_of(frame)[pair], (*self.facts.laws, *self.facts.walls)
        if self.materials.has(kinds) and not any(law.has("cohesion") for law in laws):
            friction = np.array([[c.friction for c in row] for row in self.materials.constants])
            across = force - np.einsum("ij,ij->i", force, normal)[:, None] * normal
            _, removed = within_friction(force, normal, friction[kinds[0], kinds[1]])
            sizes = np.linalg.norm(across, axis=1)
            self.n_beyond += int((removed > _ROUNDING * sizes).sum())
            self.force_sums[:2] += removed.sum(), sizes.sum()
        mass, gravity = self.materials.masses(frame), self.facts.gravity
        if {*_FORCE} <= frame.columns.keys() and not self.walls.unknown and mass is not None:
            self._add_closure(self.last, pair, force, mass[:, None] * np.array(gravity or np.nan))

    def _add_closure(self, scene: MeasuredFrame, pair: Ints, force: Floats, totals: Floats) -> None:
        """Add forces of particles without a wall: errors of their sums, and magnitudes."""
        count, (first, second) = len(totals), scene.contacts[0]
        magnitudes = np.zeros(count)
        np.add.at(totals, pair[0], force)
        np.add.at(totals, pair[1], -force)
        np.add.at(magnitudes, pair.ravel(), np.tile(np.linalg.norm(force, axis=1), 2))
        inside = np.ones(count, dtype=bool)
        inside[first[second >= count]] = False
        errors = np.linalg.norm(totals - scene.frame.vectors(*_FORCE), axis=1)
        self.force_sums[2:] += np.nansum(errors[inside]), magnitudes[inside].sum()

    def overlaps(self) -> Hits:
        """Overlaps beyond the range of the contact law (DK201)."""
        if is_clumped(self.facts):
            yield unknown("particles are clumps, whose spheres overlap")
        elif self.overlap[0] > _MOST_OVERLAP:
            overlap, what, step = self.overlap
            yield hit("overlap", overlap=overlap, what=what, step=step)

    def speeds(self) -> Hits:
        """Speeds and energies above every known cause (DK202)."""
        gravity, box = self.facts.gravity, self.facts.box
        begins = [] if self.facts.styled("insert/") else [self.first_speed]
        causes = [0.0, *begins, *speeds(self.facts, self.bounds)] if self.energies else [None]
        known = [cause for cause in causes if cause is not None]
        if gravity is None or len(known) < len(causes):
            yield unknown("velocities, or a cause of speed, are not known")
            return
        extent = np.maximum(self.bounds[1] - self.bounds[0],
                            [high - low for low, high in box.bounds] if box else 0.0)  # fmt: skip
        size, speed = math.hypot(*gravity), max(known)
        height = float(np.abs(gravity) @ extent) / (size or 1.0)
        limit = thrown_speed(size, height, speed)
        energy = run_limits(len(self.ids), 1.0, size, height, speed).mean_kinetic_energy_j
        mean = max(mean for mean, _ in self.energies)
        if self.speed[0] > limit > 0:
            fastest, what, step = self.speed
            yield hit("speed", speed_m_s=fastest, what=what, step=step, limit_m_s=limit)
        elif mean > energy > 0:
            yield hit("energy", energy_j_kg=mean, limit_j_kg=energy)

    def balance(self) -> Hits:
        """Particles that are missing, or went through a wall (DK203)."""
        missing = self.ids - self.last_ids
        if self.n_unsound:
            yield hit("rows", rows=self.n_unsound)
        for name, ids in self.through.items():
            if ids:
                yield hit("through", through=len(ids), wall=name, particle=min(ids))
        if missing and (why := self.left_out or removal(self.facts)):
            yield unknown(why)
        elif missing:
            yield hit("missing", missing=len(missing), there=len(self.ids))

    def stable(self) -> Hits:
        """A time step that is too large for the contacts (DK204)."""
        if is_clumped(self.facts) or self.stability is None:
            yield unknown("density, hertz constants or time step are not known")
        elif self.stability > 1:
            yield hit("number", stability_number=self.stability, scope=self.scope)

    def spins(self) -> Hits:
        """Particles that spin in a bed at rest (DK205)."""
        gravity, scene = math.hypot(*self.facts.gravity or ()), self.last
        if scene is None or not {*_VELOCITY, *_SPIN} <= scene.frame.columns.keys() or not gravity:
            yield unknown("no velocities and spins in the last frame, or no gravity")
            return
        moving = 0.5 * (scene.frame.vectors(*_VELOCITY) ** 2).sum(axis=1)
        unit = 2 * gravity * scene.radius
        spins = (_of_spin(scene) > _SPINS * unit) & (moving < _AT_REST * unit)
        if spins.any() and np.median(moving) <= _AT_REST * np.median(unit):
            rate = np.where(spins, np.linalg.norm(scene.frame.vectors(*_SPIN), axis=1), 0)
            at, count = int(rate.argmax()), int(spins.sum())
            particle = int(scene.frame.ids("id")[at])
            yield hit("spin", particle=particle, spin_rad_s=float(rate[at]), count=count)

    def rest(self) -> Hits:
        """A bed that moves at the end, or is not steady if it is driven (DK206)."""
        means = [mean for mean, _ in self.energies]
        last, unit = self.energies[-1] if means else (0.0, 0.0)
        third = len(means) // 3
        if not means or last <= _AT_REST * (unit or max(means)):
            return
        if not is_driven(self.facts):
            weight = f" ({last / unit:.2g} m g d)" if unit else ""
            yield hit("moving", energy_j_kg=last, weight=weight)
        elif third < 2:
            yield unknown("too few frames of a driven bed")
        else:
            before = math.fsum(means[-2 * third : -third])
            ratio = math.fsum(means[-third:]) / before if before else math.inf
            if not 1 / _DRIFT <= ratio <= _DRIFT:
                yield hit("drift", ratio=ratio)

    def limited(self) -> Hits:
        """Dumped contact forces above Coulomb's limit, or that do not add up (DK207)."""
        removed, tangential, errors, forces = self.force_sums.tolist()
        above = removed / tangential if tangential else 0.0
        error = errors / forces if forces else 0.0
        if above > _CUT:
            yield hit("above", above=above, beyond=self.n_beyond, contacts=self.n_contacts)
        if error > _CUT:
            yield hit("closure", error=error)


RULES: Mapping[str, Callable[[Measures], Hits]] = {
    "DK201": Measures.overlaps, "DK202": Measures.speeds, "DK203": Measures.balance,
    "DK204": Measures.stable, "DK205": Measures.spins, "DK206": Measures.rest,
}  # fmt: skip
"""Rules on the frames."""


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
    return any(
        fix.begin < last <= fix.end
        and fix.word("insert_every") != "once"
        and bool(fix.words[0].startswith(_DRIVES)
                 or {"surface_vel", "surface_ang_vel", "shear"} & {*fix.words})
        for fix in facts.fixes
    )  # fmt: skip


def _of_spin(scene: MeasuredFrame) -> Floats:
    """Energy of rotation over mass, (N,), J/kg; 0 without spins."""
    if not {*_SPIN} <= scene.frame.columns.keys():
        return np.zeros(scene.frame.rows)
    spin = scene.frame.vectors(*_SPIN)
    return np.asarray(0.2 * scene.radius**2 * (spin**2).sum(axis=1))
