"""Whether a run is within the limits of its scene: past one of them it is stopped."""

import math
from collections.abc import Sequence

from dragdeck.engine.log import Sample
from dragdeck.physics.run_limits import SPEED_FACTOR, RunLimits
from dragdeck.records.run import AcceptanceCheck, CheckReason


def breach(samples: Sequence[Sample], limits: RunLimits) -> AcceptanceCheck | None:
    """The first sample past a limit, as an acceptance check that did not pass; None without."""
    for sample in samples:
        past = _past(sample, limits)
        if past is not None:
            reason, seen, limit = past
            return _check(False, f"{seen} at step {sample.step:,}", limit, reason)
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
    return _check(True, "no limit exceeded", f"{most:.3g} J per particle, {limits.why}")


def _check(
    passed: bool, seen: str, limit: str, reason: CheckReason | None = None
) -> AcceptanceCheck:
    return AcceptanceCheck(
        code="within_limits",
        reason=reason,
        name="energy and speed within limits",
        passed=passed,
        seen=seen,
        limit=limit,
    )
