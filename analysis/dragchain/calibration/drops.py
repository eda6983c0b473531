"""The drops that a calibration of the restitution needs.

A measured drop test is compared with drops of the same particle on the same plate, run as the
process runs: same modulus, step and contact options.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from pydantic import PositiveFloat

from dragdeck.cases.bed import bed_rayleigh_time, particle_material
from dragdeck.cases.case import Case
from dragdeck.parts import Part
from dragdeck.physics import contact_mechanics as mechanics
from dragdeck.physics.rounding import timestep
from dragdeck.scenes.drop_test import DropFidelity
from dragdeck.study.calibration import measurements
from dragdeck.study.model import Study

IMPACTS = 3
"""Impacts compared at the most (Uhlmann et al. 2015, section 4)."""

DropPurpose = Literal["production", "reference", "confirm"]
"""Of a drop: as the process runs; full modulus, fine step; production at the fitted value."""


class DropTestOfStudy(Part):
    """The drop test of the study, as in ``result.json``.

    Attributes
    ----------
    pair : str
        Particle and plate, as the study names their pair.
    record : str
        The CSV of the measured drop test.
    height_m, height_std_m : float
        Drop height (gap below the particle) and its standard uncertainty, m.
    peaks : str
        Whether to compare peak forces.
    limit_force : bool
        Whether tensile normal forces are suppressed, as in the study.
    restitution_now : float
        Coefficient of restitution of the study.
    """

    study: str
    title: str
    pair: str
    fidelity: str
    record: str
    height_m: PositiveFloat
    height_std_m: PositiveFloat
    peaks: Literal["auto", "yes", "no"]
    gravity_m_s2: PositiveFloat
    limit_force: bool
    restitution_now: float

    @classmethod
    def of(cls, case: Case) -> "DropTestOfStudy":
        """The drop test of a case with a measured one."""
        study, section = case.study, measurements(case.study.calibration, case.file)
        particle, plate = study.media.main_material, study.workpiece.material
        return cls(
            study=case.study_name,
            title=study.title,
            pair=f"{particle}-{plate}",
            fidelity=case.fidelity_name,
            record=section.record or "",
            height_m=study.drop_test.height_m,
            height_std_m=section.height_std_m,
            peaks=section.peaks,
            gravity_m_s2=study.gravity_m_s2,
            limit_force=study.contact.limit_force,
            restitution_now=study.pair(particle, plate).restitution,
        )


_RESTITUTIONS = tuple(round(0.05 * k, 2) for k in range(8, 21))
"""Deck values of the sweep: 0.40, 0.45, ... 1.00."""

_PHASES = 4
"""Production drops per deck value. Their heights differ by a fraction of a step's
path, so that the first contact begins at another place within a time step."""

_REFERENCE_FRACTION = 0.01
"""Finest time step of the sweep over the Rayleigh time: restitution converged to 1e-4."""

_GOLDEN = 0.618
"""Fraction of a step between the phases of reference drops, one a deck value."""


@dataclass(frozen=True)
class Drop:
    """One drop to run.

    Attributes
    ----------
    name : str
        Of its folder.
    purpose : str
        ``production``: as the process runs; ``reference``: full modulus, fine
        step; ``confirm``: production at the fitted value.
    restitution : float
        In the deck.
    height_m : float
    fidelity : DropFidelity
    """

    name: str
    purpose: DropPurpose
    restitution: float
    height_m: float
    fidelity: DropFidelity


def production(study: Study) -> DropFidelity:
    """Modulus and time step of the study's process runs."""
    fidelity = study.chosen_fidelity()
    dt = timestep(bed_rayleigh_time(study), fidelity.timestep_fraction)
    return DropFidelity(fidelity.youngs_modulus_scale, dt)


def sweep(study: Study) -> Iterator[Drop]:
    """Drops over a range of deck values.

    At production several drops a value, over the phase of the first contact in
    its step; at the reference, where the step is fine, one, each at another
    phase.
    """
    coarse, fine = production(study), full(study, _REFERENCE_FRACTION)
    for number, value in enumerate(_RESTITUTIONS):
        for phase in range(_PHASES):
            height = _height(study, coarse, (phase + 0.5) / _PHASES)
            yield Drop(f"production-{value:.2f}-{phase}", "production", value, height, coarse)
        height = _height(study, fine, (number * _GOLDEN) % 1.0)
        yield Drop(f"reference-{value:.2f}", "reference", value, height, fine)


def confirmation(study: Study, restitution: float, full_restitution: float) -> Iterator[Drop]:
    """Drops at the fitted values: production over the phases, and one at full modulus."""
    coarse, fine = production(study), full(study, _REFERENCE_FRACTION)
    for phase in range(2 * _PHASES):
        height = _height(study, coarse, (phase + 0.25) / (2 * _PHASES))
        yield Drop(f"confirm-{phase}", "confirm", restitution, height, coarse)
    yield Drop("confirm-full", "reference", full_restitution, study.drop_test.height_m, fine)


def full(study: Study, fraction: float) -> DropFidelity:
    """Full modulus, and a step that is a fraction of the mean particle's Rayleigh time."""
    rayleigh = mechanics.rayleigh_time(particle_material(study), study.media.typical_radius_m)
    return DropFidelity(1.0, timestep(rayleigh, fraction))


def _height(study: Study, fidelity: DropFidelity, phase: float) -> float:
    """The study's height, less or more by up to half of a step's path at the plate, m."""
    height = study.drop_test.height_m
    step_path = mechanics.fall_speed(height, study.gravity_m_s2) * (fidelity.timestep_s or 0.0)
    return height + (phase - 0.5) * step_path


def drop_case(case: Case, drop: Drop) -> Case:
    """The case with a drop's restitution and height in place."""
    study = case.study
    particle, plate = study.media.main_material, study.workpiece.material
    pair = study.pair(particle, plate).model_copy(update={"restitution": drop.restitution})
    key = f"{particle}-{plate}" if f"{particle}-{plate}" in study.pairs else f"{plate}-{particle}"
    changed = study.model_copy(
        update={
            "pairs": {**study.pairs, key: pair},
            "drop_test": study.drop_test.model_copy(
                update={"height_m": drop.height_m, "impacts": max(IMPACTS, study.drop_test.impacts)}
            ),
        }
    )
    return Case(case.file, case.settings, changed)
