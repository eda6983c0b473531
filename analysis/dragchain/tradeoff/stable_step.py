"""The stability number of a time step, as a law of stiffness, damping and step.

The acceptance check takes its largest eigenvalue from ``dt^2 K + 2 dt C``, see
docs/evidence/stability.md.

In a packing, the product of contact frequency and Rayleigh time is proportional to kappa^(-1/4),
with the stiffness number kappa, since the stiffness of a Hertz contact is proportional to the
square root of its overlap. With the step f over the Rayleigh time, which is that of the smallest
particle, the damping ratio z of a contact between two particles and the relative standard
deviation s of their radii::

    number^2 = (a u^2 + b z u) exp(2 c s),    u = f kappa^(-1/4)

Three constants are fitted, to the logarithms of the measured numbers.
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares

from dragchain.arrays import Floats
from dragchain.documents import Part
from dragchain.errors import SeriesError, TableError
from dragchain.tradeoff.measures import Measures
from dragchain.tradeoff.six_digits import SixDigits

_FEWEST_RUNS = 10


class StableStepLaw(Part):
    """The constants a (`stiffness`), b (`damping`) and c (`spread`).

    Attributes
    ----------
    scatter : float
        Standard deviation of the logarithm of a measured number about the law.
    largest : float
        How far a number lies above the law at most, as a logarithm.
    runs : int
    stiffness_numbers, restitutions : (float, float)
        Lowest and highest of the runs: kappa with the modulus of the run.
    """

    stiffness: SixDigits
    damping: SixDigits
    spread: SixDigits
    scatter: SixDigits
    largest: SixDigits
    runs: int
    stiffness_numbers: tuple[SixDigits, SixDigits]
    restitutions: tuple[SixDigits, SixDigits]


def fit_stable_step(runs: Sequence[Measures]) -> StableStepLaw:
    """The law of the stability number, from complete and rejected runs.

    Parameters
    ----------
    runs : sequence of Measures

    Raises
    ------
    SeriesError
        If fewer than ten of them have a number.
    TableError
        If a run with a number does not say its restitution or its radii.
    """
    rows = np.array([_row(run) for run in runs if run.stability_number and run.numbers])
    if len(rows) < _FEWEST_RUNS:
        raise SeriesError(f"{len(rows)} runs have a stability number, too few to fit a law")
    number, kappa, restitution, fraction, spread = rows.T
    reach = fraction * kappa**-0.25
    damping = damping_ratio(restitution) * reach

    def misfit(constants: Floats) -> Floats:
        a, b = np.exp(constants[:2])
        of_mean = 0.5 * np.log(a * reach**2 + b * damping)
        return np.asarray(np.log(number) - of_mean - constants[2] * spread)

    found = least_squares(misfit, [math.log(50.0), math.log(50.0), 0.0])
    a, b = np.exp(found.x[:2]).tolist()
    return StableStepLaw(
        stiffness=a,
        damping=b,
        spread=float(found.x[2]),
        scatter=math.sqrt(float(np.sum(found.fun**2)) / (len(rows) - 3)),
        largest=float(found.fun.max()),
        runs=len(rows),
        stiffness_numbers=(kappa.min(), kappa.max()),
        restitutions=(restitution.min(), restitution.max()),
    )


def damping_ratio(restitution: Floats) -> Floats:
    """Damping ratio of a contact in LIGGGHTS from its coefficient of restitution, (N,)."""
    log = np.log(restitution)
    return np.asarray(-log / np.hypot(log, np.pi))


def _row(run: Measures) -> tuple[float, float, float, float, float]:
    """Stability number, kappa, restitution, step over Rayleigh time, relative spread of radii."""
    softer = run.fidelity.youngs_modulus_scale ** (2.0 / 3.0)
    kappa = run.numbers["stiffness_number"] * softer
    media = run.inputs["media.material"]
    restitution, mean, std = (
        _number(run, name)
        for name in (
            f"pairs.{media}-{media}.restitution",
            "media.radius_mean_m",
            "media.radius_std_m",
        )
    )
    step = run.fidelity.timestep_fraction
    return run.stability_number or math.nan, kappa, restitution, step, std / mean


def _number(run: Measures, name: str) -> float:
    value = run.inputs.get(name)
    if not isinstance(value, int | float):
        raise TableError(
            f"{run.study} {run.run}: measures.json has no number for {name}, but {value!r}: "
            "measure the run again"
        )
    return float(value)
