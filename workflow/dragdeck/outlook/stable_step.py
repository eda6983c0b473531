"""Whether the contacts of a bed will be stable with a time step, before the run is made.

The acceptance check measures a stability number on the frames of a run, and rejects it above 1
(docs/evidence/stability.md). A law fitted to the numbers of many runs predicts it.
"""

import math
from collections.abc import Iterator

from dragdeck.cases.bed import full_stiffness_number
from dragdeck.cases.case import Case
from dragdeck.errors import Caution, InputError
from dragdeck.outlook.measured import stable_step_law
from dragdeck.physics.rounding import rounded

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
    study, law = case.study, stable_step_law()
    softer = study.chosen_fidelity().youngs_modulus_scale ** (2 / 3)
    kappa = softer * full_stiffness_number(study)
    restitution = study.pair(study.media.material, study.media.material).restitution
    spread = study.media.radius_std_m / study.media.radius_mean_m
    return law.largest_fraction(kappa, restitution, spread, math.exp(margin))


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
    """What ``check`` and ``explain`` say of it: a heading and a text."""
    own, limit = case.study.chosen_fidelity().timestep_fraction, stable_fraction(case)
    verdict = "below" if own < limit else "NOT BELOW"
    runs = stable_step_law().runs
    return "stable step", (
        f"{100 * own:.3g} % is {verdict} {100 * limit:.3g} %, at which the contacts of this "
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
            file=case.file,
            field=f"{block}.timestep_fraction",
            value=chosen.timestep_fraction,
            limit=f"{stable:g} of the Rayleigh time (docs/evidence/stability.md)",
            remedy="choose a smaller one, or give a reason in accepted.unsafe_timestep",
        )
