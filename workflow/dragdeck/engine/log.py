"""What LIGGGHTS prints on its screen, the rows of its ``thermo`` output, and limits of these."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from dragdeck.decks import END
from dragdeck.physics.run_limits import SPEED_FACTOR, RunLimits
from dragdeck.records.run import AcceptanceCheck, CheckReason, Decomposition, ParticlesPerRank


def engine_errors(screen: str) -> list[str]:
    """The errors of LIGGGHTS, of all ranks or of one, once each, in order."""
    line = r"^.*?(ERROR(?: on proc \d+)?: .*?)\s*$"
    return list(dict.fromkeys(re.findall(line, screen, flags=re.MULTILINE)))


def top_of_box(screen: str) -> float | None:
    """Height of the top of the simulation box, m; None if LIGGGHTS did not state it."""
    box = re.search(r"orthogonal box = \(.*\) to \(\S+ \S+ (\S+)\)", screen)
    return float(box[1]) if box else None


def reached_end(screen: str) -> bool:
    """Whether LIGGGHTS came to the last line of the input script."""
    return re.search(f"^{END}$", screen, flags=re.MULTILINE) is not None


def settling(screen: str) -> tuple[bool, str]:
    """Whether a bed came to rest, and the words in which the input script says so."""
    line = re.search(r"^DRAGDECK ((NOT )?SETTLED: .*)$", screen, flags=re.MULTILINE)
    return (
        (False, "no message of the settling criterion")
        if line is None
        else (line.group(2) is None, line.group(1))
    )


def never_settled(screen: str) -> bool:
    """Whether a filling ended because its bed did not come to rest in time."""
    return re.search(r"^DRAGDECK NOT SETTLED: ", screen, flags=re.MULTILINE) is not None


def last_step(screen: str) -> int | None:
    """The last step in the table that LIGGGHTS prints."""
    rows = re.findall(r"^ *(\d+) +\d+ ", screen, flags=re.MULTILINE)
    return int(rows[-1]) if rows else None


@dataclass(frozen=True)
class Loop:
    """One ``run`` command: wall time, s, and steps."""

    wall_time_s: float
    steps: int


def loops(screen: str) -> list[Loop]:
    """The ``run`` commands that ended, in order."""
    times = re.findall(r"^Loop time of (\S+) on \d+ procs for (\d+) steps", screen, re.MULTILINE)
    return [Loop(float(seconds), int(steps)) for seconds, steps in times]


def decomposition(screen: str) -> Decomposition | None:
    """The split that LIGGGHTS printed; None where it printed none."""
    grids = re.findall(r"^ *(\d+) by (\d+) by (\d+) MPI processor grid$", screen, re.MULTILINE)
    if not grids:
        return None
    loads = re.findall(r"^Nlocal: +(\S+) ave (\d+) max (\d+) min$", screen, re.MULTILINE)
    particles = None
    if loads:
        mean, most, least = loads[-1]
        particles = ParticlesPerRank(mean=float(mean), most=int(most), least=int(least))
    x, y, z = (int(count) for count in grids[-1])
    return Decomposition(grid=(x, y, z), particles=particles)


@dataclass(frozen=True)
class Sample:
    """One row of ``thermo``: energies of all particles together, J; largest speed, m/s."""

    step: int
    n_particles: int
    kinetic_energy_j: float
    rotational_energy_j: float
    fastest_particle_m_s: float

    @property
    def mean_energy_j(self) -> float:
        """Kinetic energy per particle, rotation included, J; NaN without particles."""
        total = self.kinetic_energy_j + self.rotational_energy_j
        return total / self.n_particles if self.n_particles else math.nan

    @property
    def finite(self) -> bool:
        """Whether energies and speed are finite."""
        return math.isfinite(
            self.kinetic_energy_j + self.rotational_energy_j + self.fastest_particle_m_s
        )


def thermo_samples(rows: Sequence[str], columns: Sequence[str]) -> list[Sample]:
    """Rows of a ``thermo`` file; headers, and a row that was cut short, are left out."""
    samples = []
    for row in rows:
        words = row.split()
        if len(words) != len(columns) or not words[0].isdigit():
            continue
        try:
            values = dict(zip(columns, (float(word) for word in words), strict=True))
        except ValueError:
            continue
        count = values["n_particles"]
        samples.append(
            Sample(
                step=int(values["step"]),
                n_particles=int(count) if math.isfinite(count) else 0,
                kinetic_energy_j=values["kinetic_energy_j"],
                rotational_energy_j=values["rotational_energy_j"],
                fastest_particle_m_s=values["fastest_particle_m_s"],
            )
        )
    return samples


def breach(samples: Sequence[Sample], limits: RunLimits) -> AcceptanceCheck | None:
    """The first sample past a limit, as an acceptance check that did not pass; None without."""
    for sample in samples:
        past = _past(sample, limits)
        if past is not None:
            reason, seen, limit = past
            when = f"{seen} at step {sample.step:,}"
            return AcceptanceCheck.of("within_limits", False, when, limit, reason)
    return None


def _past(sample: Sample, limits: RunLimits) -> tuple[CheckReason, str, str] | None:
    """Reason, what was seen and the limit of a sample that is past one."""
    energy, most = sample.mean_energy_j, limits.mean_kinetic_energy_j
    if sample.n_particles < limits.n_particles:
        return "particles", f"{sample.n_particles} particles", f"{limits.n_particles} particles"
    if not math.isfinite(energy):
        return "finite_numbers", f"a kinetic energy of {energy}", "finite numbers"
    if energy > most:
        seen = f"a mean kinetic energy of {energy:.3g} J per particle"
        return "energy", seen, f"{most:.3g} J, {limits.why}"
    if sample.fastest_particle_m_s > limits.speed_m_s:
        limit = f"{limits.speed_m_s:.3g} m/s, {SPEED_FACTOR:g} times the speed of that energy"
        return "speed", f"a particle at {sample.fastest_particle_m_s:.3g} m/s", limit
    return None


def within(limits: RunLimits) -> AcceptanceCheck:
    """The acceptance check of a run that passed no limit."""
    most = limits.mean_kinetic_energy_j
    limit = f"{most:.3g} J per particle, {limits.why}"
    return AcceptanceCheck.of("within_limits", True, "no limit exceeded", limit)
