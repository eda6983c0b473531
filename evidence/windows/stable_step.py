"""The law of the stability number of a time step, from whole runs of designed scenes."""

import math

import numpy as np
from scipy.optimize import least_squares

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragdeck.physics.contact_mechanics import damping_ratio
from dragdeck.records.stability import StableStepLaw, StableStepRecord
from dragdeck.records.tradeoff import SixDigits
from evidence.windows.scene_runs import SceneRun, Scenes, last_day

# --- stable_step.json ----------------------------------------------------------------------------


class MeasuredStepLaw(StableStepLaw):
    """The law with the range of the stiffness numbers and restitutions of its runs."""

    stiffness: SixDigits
    damping: SixDigits
    spread: SixDigits
    scatter: SixDigits
    largest: SixDigits
    stiffness_numbers: tuple[SixDigits, SixDigits]
    restitutions: tuple[SixDigits, SixDigits]


class MeasuredStepRecord(StableStepRecord):
    """The content of ``stable_step.json``."""

    engine_versions: tuple[str, ...]
    stable_step: MeasuredStepLaw


def stable_step_record(scenes: Scenes) -> MeasuredStepRecord:
    """The law of the stability number, by least squares on the logarithms of the measured ones.

    In a packing, the product of contact frequency and Rayleigh time is proportional to
    kappa^(-1/4), with the stiffness number kappa, since the stiffness of a Hertz contact is
    proportional to the square root of its overlap.

    Raises
    ------
    SeriesError
        Fewer runs with a number than constants of the law.
    """
    runs = [run for scene in scenes for run in scene if run.stability_number and run.numbers]
    if len(runs) <= 3:
        raise SeriesError(f"{len(runs)} runs have a stability number, too few to fit a law")
    rows = np.array([_step_row(run) for run in runs])
    number, kappa, restitution, fraction, spread = rows.T
    reach = fraction * kappa**-0.25
    damping = np.array([damping_ratio(coefficient) for coefficient in restitution]) * reach

    def misfit(constants: Floats) -> Floats:
        stiffness, of_damping = np.exp(constants[:2])
        of_mean = 0.5 * np.log(stiffness * reach**2 + of_damping * damping)
        return np.asarray(np.log(number) - of_mean - constants[2] * spread)

    fit = least_squares(misfit, [math.log(50.0), math.log(50.0), 0.0])
    return MeasuredStepRecord(
        measured=last_day(scenes),
        engine_versions=tuple(sorted({run.versions["engine"] for run in runs})),
        stable_step=MeasuredStepLaw(
            stiffness=math.exp(fit.x[0]),
            damping=math.exp(fit.x[1]),
            spread=float(fit.x[2]),
            scatter=math.sqrt(float(np.sum(fit.fun**2)) / (len(runs) - 3)),
            largest=float(fit.fun.max()),
            runs=len(runs),
            stiffness_numbers=(kappa.min(), kappa.max()),
            restitutions=(restitution.min(), restitution.max()),
        ),
    )


def _step_row(run: SceneRun) -> tuple[float, ...]:
    """Stability number, kappa, restitution, step over Rayleigh time, relative spread of radii."""
    media = run.study.media
    kappa = run.numbers["stiffness_number"] * run.fidelity.youngs_modulus_scale ** (2.0 / 3.0)
    return (
        run.stability_number or math.nan,
        kappa,
        run.study.pair(media.main_material, media.main_material).restitution,
        run.fidelity.timestep_fraction,
        media.typical_std_m / media.typical_radius_m,
    )
