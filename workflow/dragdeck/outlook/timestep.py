"""What to expect of a time step: fractions of the Rayleigh time, steps per contact, stability.

The errors and the safe steps were measured on the engine by the stability map;
``data/stability.json`` holds them with engine version and date. The acceptance check measures a
stability number on the frames of a run, and rejects it above 1 (docs/evidence/stability.md); a law
fitted to the numbers of many runs predicts it.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from dragdeck.cases import bed as beds
from dragdeck.cases.case import Case
from dragdeck.errors import Caution, InputError
from dragdeck.physics import contact_mechanics as mechanics
from dragdeck.physics.estimates import SOLID_FRACTION_ESTIMATE
from dragdeck.physics.rounding import rounded
from dragdeck.records.stability import RestitutionErrors, stability_map, stable_step_law
from dragdeck.scenes.scene import Regime, SceneType, StudyScene
from dragdeck.study.model import Study

ORDINARY_RESTITUTION = 0.5
"""The map tells apart conditions below and above: strong damping needs smaller steps."""


@dataclass(frozen=True)
class PairOutlook:
    """What a time step means for two bodies that meet.

    Attributes
    ----------
    bodies : str
    limiting : str
        The body with the smaller Rayleigh time.
    rayleigh_fraction : float
        Time step over that time.
    speed_m_s : float
        Expected speed of an impact.
    steps_per_contact : float
        Elastic Hertz contact time at that speed over the time step.
    error : float
        Largest absolute error of the restitution that was seen.
    measured : bool
        Whether the number of steps lies within the measured range; if not, the error is that of the
        range's nearest end.
    """

    bodies: str
    limiting: str
    rayleigh_fraction: float
    speed_m_s: float
    steps_per_contact: float
    error: float
    measured: bool

    def __str__(self) -> str:
        outside = "" if self.measured else " (outside the measured range)"
        return (
            f"{100 * self.rayleigh_fraction:.3g} % of the Rayleigh time ({self.limiting}), "
            f"{self.steps_per_contact:.3g} steps per contact at {self.speed_m_s:.3g} m/s, "
            f"error of restitution up to {self.error:.2g}{outside}"
        )


def expected_error(steps: float, restitution: float, table: RestitutionErrors) -> float:
    """Error of the restitution at a number of steps per contact.

    Parameters
    ----------
    steps : float
    restitution : float
        From `ORDINARY_RESTITUTION` on, the errors of such impacts count.
    table : RestitutionErrors
        Between its entries the error is interpolated on logarithmic scales.
    """
    ordinary = restitution >= ORDINARY_RESTITUTION
    errors = table.ordinary_worst if ordinary else table.worst
    known = np.log(table.steps_per_contact)
    return math.exp(np.interp(math.log(steps), known, np.log(errors)))


def outlook(case: Case, scene: SceneType, timestep_s: float) -> Iterator[PairOutlook]:
    """Every pair of bodies that meets in a scene, unlike ones included.

    LIGGGHTS's own check of the time step looks at particles of one material only.

    Parameters
    ----------
    case : Case
    scene : SceneType
    timestep_s : float
    """
    study, particle = case.study, beds.particle_material(case.study)
    scale = 1.0 if scene.single_particle else study.chosen_fidelity().youngs_modulus_scale
    radius = study.media.typical_radius_m if scene.single_particle else beds.smallest_radius(study)
    mass, speed = mechanics.particle_mass(particle, radius), scene.impact_speed(case)
    table = stability_map().restitution_error
    for name, other, others_radius in scene.partners(case):
        partner = study.materials[other]
        times = {"particle": mechanics.rayleigh_time(particle, radius, scale)}
        times.setdefault(name, mechanics.rayleigh_time(partner, others_radius, scale))
        limiting = min(times, key=lambda body: times[body])
        # the engine meets walls and facets as planes: half of it all for two particles
        part = 0.5 if name == "particle" else 1.0
        modulus = mechanics.effective_modulus(particle, partner, scale)
        steps = (
            mechanics.hertz_contact_time(part * mass, part * radius, modulus, speed) / timestep_s
        )
        restitution = study.pair(study.media.main_material, other).restitution
        yield PairOutlook(
            bodies=f"particle on {name}",
            limiting=limiting,
            rayleigh_fraction=timestep_s / times[limiting],
            speed_m_s=speed,
            steps_per_contact=steps,
            error=expected_error(steps, restitution, table),
            measured=table.steps_per_contact[0] <= steps <= table.steps_per_contact[-1],
        )


def safe_fraction(case: Case, scene: SceneType) -> tuple[float, str]:
    """Largest step over the Rayleigh time that was safe in the scene's regime, and where from.

    Strongly damped particles have a limit of their own. The safety factor is not in it.
    """
    known = stability_map()
    lowest = _lowest_restitution(case)
    strong = lowest < ORDINARY_RESTITUTION
    damping = "any restitution" if strong else f"restitution of {ORDINARY_RESTITUTION:g} or more"
    engine = ", ".join(known.engine_versions)
    source = f"{scene.regime}, {damping}; LIGGGHTS {engine}, {known.measured}"
    return _regime_fraction(scene.regime, lowest), source


def _lowest_restitution(case: Case) -> float:
    return min(pair.restitution for pair in case.study.pairs.values())


def _regime_fraction(regime: Regime, lowest_restitution: float) -> float:
    row = stability_map().regimes[regime]
    strong = lowest_restitution < ORDINARY_RESTITUTION
    if strong or row.ordinary_fraction is None:
        return row.safe_fraction
    return row.ordinary_fraction


def largest_fraction(regime: Regime, lowest_restitution: float) -> float:
    """Largest step of a regime over the Rayleigh time that keeps the safety factor."""
    return stability_map().safety_factor * _regime_fraction(regime, lowest_restitution)


def largest_of_case(case: Case, kind: SceneType) -> float:
    """`largest_fraction` of a case's run of a scene."""
    return largest_fraction(kind.regime, _lowest_restitution(case))


def timestep_notes(case: Case, kind: SceneType, scene: StudyScene) -> list[tuple[str, str]]:
    """What ``check`` says of a scene's time step: a heading and a text each."""
    step = scene.deck.timestep_s
    pairs = [(pair.bodies, str(pair)) for pair in outlook(case, kind, step)]
    fraction, source = safe_fraction(case, kind)
    factor = stability_map().safety_factor
    step_fraction = step / scene.case.rayleigh_time_s
    verdict = "within" if step_fraction <= factor * fraction * (1 + 1e-9) else "ABOVE"
    text = (
        f"{100 * step_fraction:.3g} % is {verdict} {100 * factor * fraction:.3g} %: "
        f"{factor:g} (safety factor) times the {100 * fraction:.3g} % measured to be "
        f"safe ({source})"
    )
    if kind.needs_bed:
        text += "; of a drag, the stable step decides"
    elif not kind.single_particle:
        text += f"; of a filling, {100 * settling_limit(case):.3g} % decides, by its restitution"
    return [*pairs, ("safe step", text)]


# --- stability of contacts -----------------------------------------------------------------------


_MOMENTUM = 0.25
"""Part of the dynamic pressure of the bed, its density times the square of the speed, that adds to
the weight of the bed above the tip: from runs at 0.3 to 3 m/s (docs/evidence/stability.md)."""

_DOUBT = 2.0
"""Standard deviations about the law within which a run may pass or not."""


def stable_fraction(case: Case, margin: float = 0.0) -> float:
    """Largest stable step of a case's process over the Rayleigh time.

    Parameters
    ----------
    case : Case
    margin : float
        Logarithm of the stability number that the step then is forecast to have.
    """
    return stable_step_law().largest_fraction(
        *_contacts(case.study, _pressure(case)), number=math.exp(margin)
    )


def stability_forecast(case: Case) -> float:
    """Stability number that a case's process is forecast to have."""
    fraction = case.study.chosen_fidelity().timestep_fraction
    return stable_step_law().number(fraction, *_contacts(case.study, _pressure(case)))


def _pressure(case: Case) -> float:
    """Pressure in the bed at the tip of the moving workpiece, Pa."""
    density = SOLID_FRACTION_ESTIMATE * beds.bed_density(case.study)
    return beds.tip_pressure(case.study) + _MOMENTUM * density * case.axis_speed_m_s**2


def _contacts(study: Study, pressure_pa: float) -> tuple[float, float, float]:
    """Stiffness number, restitution and relative spread of the radii, under a pressure."""
    softer = study.chosen_fidelity().youngs_modulus_scale ** (2 / 3)
    kappa = softer * mechanics.stiffness_number(beds.particle_material(study), pressure_pa)
    restitution = study.pair(study.media.main_material, study.media.main_material).restitution
    spread = study.media.typical_std_m / study.media.typical_radius_m
    return kappa, restitution, spread


def settling_limit(case: Case) -> float:
    """Largest step of a case's filling over the Rayleigh time that gives no warning.

    Fillings with a forecast stability number above 1 under the weight of the bed may never come to
    rest (measured: docs/evidence/stability.md). The limit is the smaller of that forecast, which
    depends on the damping, and of the largest step of the map, which was measured at weak damping.
    """
    study = case.study.at_filling()
    forecast = stable_step_law().largest_fraction(*_contacts(study, beds.floor_pressure(study)))
    return min(forecast, largest_fraction("settle", 1.0))


def settling_cautions(case: Case) -> Iterator[Caution]:
    """A caution if the step of the filling may keep particles moving, with one that does not."""
    step, limit = case.study.chosen_fidelity().filling_timestep_fraction, settling_limit(case)
    if step > limit * (1 + 1e-9):
        yield Caution(
            "stable_timestep",
            f"the filling's step of {100 * step:g} % of the Rayleigh time is above "
            f"{rounded(100 * limit, up=False):g} %: contacts may keep particles moving",
            {"filling_timestep_fraction": rounded(limit, up=False)},
        )


def step_cautions(case: Case, kind: SceneType) -> Iterator[Caution]:
    """A caution if the step of a scene may be too long: of a drop test, what no setting changes."""
    if not kind.single_particle:
        yield from stable_step_cautions(case) if kind.needs_bed else settling_cautions(case)
        return
    step, limit = case.study.drop_test.timestep_fraction, largest_of_case(case, kind)
    if step > limit * (1 + 1e-9):
        yield Caution(
            "stable_timestep",
            f"drop_test.timestep_fraction is {step:g}; above {limit:.2g}, the restitution may be "
            "wrong: use a smaller one",
        )


def stable_step_cautions(case: Case, surely: bool = False) -> Iterator[Caution]:
    """A caution if the contacts may be unstable, with a step that is stable.

    Parameters
    ----------
    case : Case
    surely : bool
        With the margin that no measured run would have needed more of, instead of two standard
        deviations.
    """
    chosen, law = case.study.chosen_fidelity(), stable_step_law()
    sure = stable_fraction(case, -law.largest)
    doubtful = sure if surely else stable_fraction(case, -_DOUBT * law.scatter)
    if chosen.timestep_fraction > doubtful * (1 + 1e-9):
        yield Caution(
            "stable_timestep",
            f"with E x {chosen.youngs_modulus_scale:g}, contacts become unstable at about "
            f"{100 * stable_fraction(case):.2g} % of the Rayleigh time: the run may be rejected",
            {"timestep_fraction": rounded(sure, up=False)},
        )


def stable_step_note(case: Case) -> tuple[str, str]:
    """What ``check`` says of it: a heading and a text."""
    fraction, limit = case.study.chosen_fidelity().timestep_fraction, stable_fraction(case)
    verdict = "below" if fraction < limit else "NOT BELOW"
    runs = stable_step_law().runs
    return "stable step", (
        f"{100 * fraction:.3g} % is {verdict} {100 * limit:.3g} %, at which the contacts of this "
        f"packing become unstable (law of {runs} runs)"
    )


def check_timestep(case: Case, block: str = "fidelity") -> None:
    """Refuse a step with which the run is sure to be rejected, unless the study accepts it.

    Raises
    ------
    InputError
        The contacts will be unstable, and the study gives no reason for that.
    """
    chosen, law = case.study.chosen_fidelity(), stable_step_law()
    limit = stable_fraction(case, _DOUBT * law.scatter)
    if chosen.timestep_fraction > limit and not case.study.accepted.unsafe_timestep:
        stable = rounded(stable_fraction(case, -law.largest), up=False)
        raise InputError(
            f"the contacts are not stable at this time step with E x "
            f"{chosen.youngs_modulus_scale:g}",
            file=case.file, field=f"{block}.timestep_fraction", value=chosen.timestep_fraction,
            limit=f"{stable:g} of the Rayleigh time (docs/evidence/stability.md)",
            remedy="choose a smaller one, or give a reason in accepted.unsafe_timestep",
        )  # fmt: skip
