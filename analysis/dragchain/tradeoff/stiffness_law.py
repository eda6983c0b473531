"""What reduced stiffness does to a quantity, fitted to runs in many scenes.

The logarithm of a quantity Q follows the stiffness number kappa of the run::

    ln Q = ln Q_full + A (kappa^-b - kappa_full^-b)

which is what Richardson's extrapolation assumes of a discretisation error, with a rate b that is
measured. The amplitude A of a scene depends on the inertial number I, since particles with reduced
stiffness stay in contact for longer, and on the friction mu between particles, and scatters about
that: A ~ N(alpha + beta I + gamma ln mu, tau^2). With that prior one run is corrected, and several
are extrapolated, by one and the same estimator: the best linear unbiased prediction of ln Q_full
(Robinson 1991, Statistical Science 6, 15-32).
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragchain.tradeoff.six_digits import SixDigits

UNIT = 1e4
"""Stiffness number at which kappa^-b is 1, so that amplitudes have a plain size."""

UNIT_INERTIA, UNIT_FRICTION = 0.1, 0.3
"""Inertial number and friction in whose units amplitudes are written, to have a plain size."""

_START = (math.log(0.3), math.log(0.1), math.log(0.05))
"""Logarithms of rate, tau and sigma to begin the search with."""


@dataclass(frozen=True)
class ScaledRuns:
    """The runs of a scene, in one quantity.

    Attributes
    ----------
    stiffness_number, inertial_number, friction : float
        Of the scene at the physical Young's modulus; friction between particles.
    scales : (N,) ndarray
        Factor on Young's modulus in each run.
    logarithms : (N,) ndarray
        Logarithm of the quantity in each run.
    path_to_particle : float
        Path that each value covers over the mean diameter of a particle.
    """

    stiffness_number: float
    inertial_number: float
    friction: float
    scales: Floats
    logarithms: Floats
    path_to_particle: float

    def reduction(self, rate: float) -> Floats:
        """What the amplitude is multiplied with, (N,): 0 at the physical Young's modulus."""
        full = (self.stiffness_number / UNIT) ** -rate
        return np.asarray(full * (self.scales ** (-2.0 / 3.0 * rate) - 1.0))

    @property
    def of_amplitude(self) -> Floats:
        """What alpha, beta and gamma are multiplied with, (3,)."""
        rough = math.log(self.friction / UNIT_FRICTION)
        return np.array([1.0, self.inertial_number / UNIT_INERTIA, rough])


Three = tuple[SixDigits, SixDigits, SixDigits]


@dataclass(frozen=True)
class StiffnessLaw:
    """The common law of a quantity.

    Attributes
    ----------
    rate : float
        Exponent b.
    amplitude : (float, float, float)
        Alpha, of a quasi-static drag in particles with the friction `UNIT_FRICTION`; beta, over
        I / `UNIT_INERTIA`; gamma.
    covariance : 3 rows of 3 floats
        Of these.
    amplitude_std : float
        Standard deviation tau of the amplitude from scene to scene.
    run_std : float
        Standard deviation sigma of the logarithm in one run.
    model_std : float
        What the errors of scenes that were left out say beyond all that, as a standard deviation.
    """

    rate: SixDigits
    amplitude: Three
    covariance: tuple[Three, Three, Three]
    amplitude_std: SixDigits
    run_std: SixDigits
    model_std: SixDigits = 0.0

    def prior(self, runs: ScaledRuns) -> tuple[float, float]:
        """Mean and variance of the amplitude in a scene."""
        along = runs.of_amplitude
        error = float(along @ np.array(self.covariance) @ along)
        return float(along @ np.array(self.amplitude)), self.amplitude_std**2 + error


COEFFICIENTS = 3
"""Coefficients of the amplitude, which take as many degrees of freedom from the scenes."""


@dataclass(frozen=True)
class Extrapolation:
    """Logarithm of a quantity at the physical Young's modulus, with its standard error."""

    logarithm: float
    se: float


def fit_stiffness_law(scenes: Sequence[ScaledRuns]) -> StiffnessLaw:
    """The law of a quantity by maximum likelihood, every scene with a level of its own.

    Raises
    ------
    SeriesError
        If fewer than five scenes were run at two moduli, or their inertial numbers and
        coefficients of friction do not tell the amplitudes apart.
    """
    useful = [one for one in scenes if len(set(one.scales.tolist())) > 1]
    if len(useful) < 5:
        raise SeriesError("fewer than five scenes were run at two moduli")
    if np.linalg.matrix_rank(np.array([one.of_amplitude for one in useful])) < 3:
        raise SeriesError("the scenes differ too little in inertial number or friction")

    def against(point: Floats) -> float:
        return -_likelihood(useful, *np.exp(point))[0]

    best = minimize(
        against,
        np.array(_START),
        method="Nelder-Mead",
        bounds=[(math.log(0.05), math.log(2.0)), (math.log(1e-4), 2.0), (math.log(1e-4), 2.0)],
        options={"xatol": 1e-4, "fatol": 1e-6, "maxiter": 4000},
    )
    rate, amplitude_std, run_std = np.exp(best.x).tolist()
    _, found, covariance = _likelihood(useful, rate, amplitude_std, run_std)
    alpha, beta, gamma = found.tolist()
    first, second, third = map(tuple, covariance.tolist())
    entries = (first, second, third)
    return StiffnessLaw(rate, (alpha, beta, gamma), entries, amplitude_std, run_std)


def _likelihood(
    scenes: Iterable[ScaledRuns], rate: float, amplitude_std: float, run_std: float
) -> tuple[float, Floats, Floats]:
    """Logarithm of the likelihood, alpha to gamma, (3,), and their covariance, (3, 3).

    The levels of the scenes are integrated out (restricted likelihood), alpha to gamma are
    estimated.
    """
    weight, moment = np.zeros((3, 3)), np.zeros(3)
    square = constant = 0.0
    for one in scenes:
        h = one.reduction(rate)
        # 1, h and y under the inverse covariance (Sherman and Morrison), the level projected out
        known = np.stack([np.ones(len(h)), h, one.logarithms])
        share = (amplitude_std / run_std) ** 2
        along = known @ h
        growth = 1.0 + share * along[1]
        products = (known @ known.T - share / growth * np.outer(along, along)) / run_std**2
        level = float(products[0, 0])
        projected = products - np.outer(products[0], products[0]) / level
        weight += projected[1, 1] * np.outer(one.of_amplitude, one.of_amplitude)
        moment += projected[1, 2] * one.of_amplitude
        square += float(projected[2, 2])
        constant += 2.0 * len(h) * math.log(run_std) + math.log(growth) + math.log(level)
    variance = np.asarray(np.linalg.inv(weight), dtype=np.float64)
    amplitudes = variance @ moment
    return -0.5 * (constant + square - float(moment @ amplitudes)), amplitudes, variance


def extrapolate(
    law: StiffnessLaw, runs: ScaledRuns, run_stds: Floats | None = None
) -> Extrapolation:
    """The logarithm of a quantity at the physical modulus, from runs at reduced ones.

    Parameters
    ----------
    law : StiffnessLaw
    runs : ScaledRuns
        Any number of runs, at any modulus.
    run_stds : (N,) ndarray, optional
        Standard deviation of the logarithm of each run; none: that of the law.
    """
    h = runs.reduction(law.rate)
    weight = (np.full(len(h), law.run_std) if run_stds is None else run_stds) ** -2.0
    mean, variance = law.prior(runs)
    known = 1.0 / max(variance, 1e-12)
    information = np.array([[weight.sum(), weight @ h], [weight @ h, weight @ h**2 + known]])
    right = np.array(
        [
            weight @ runs.logarithms,
            (weight * h) @ runs.logarithms + known * mean,
        ]
    )
    covariance = np.linalg.inv(information)
    level = float(covariance[0] @ right)
    reduced = float(h.max(initial=0.0) > 0.0)
    return Extrapolation(level, math.hypot(math.sqrt(covariance[0, 0]), law.model_std * reduced))


def left_out(
    scenes: Sequence[ScaledRuns], plans: Sequence[Mapping[float, int]]
) -> list[list[tuple[float, float, float]]]:
    """Errors of extrapolations in scenes that were left out of the fit, a list for each plan.

    Parameters
    ----------
    scenes : sequence of ScaledRuns
    plans : sequence of mapping of float to int
        Runs at each modulus scale that an extrapolation may use.

    Returns
    -------
    list of list of (float, float, float)
        Extrapolated minus measured logarithm, the standard error of that difference, and the
        difference without a correction, of the runs at the largest modulus.
    """
    laws = [fit_stiffness_law([other for other in scenes if other is not one]) for one in scenes]
    return [
        [
            error
            for one, law in zip(scenes, laws, strict=True)
            if (error := error_in(one, law, plan)) is not None
        ]
        for plan in plans
    ]


def error_in(
    scene: ScaledRuns, law: StiffnessLaw, plan: Mapping[float, int]
) -> tuple[float, float, float] | None:
    """As of `left_out`; None where the scene lacks runs of the plan or at full modulus."""
    stiff = scene.logarithms[scene.scales == 1.0]
    chosen = np.concatenate(
        [np.flatnonzero(scene.scales == scale)[:count] for scale, count in plan.items()]
    )
    if not len(stiff) or len(chosen) < sum(plan.values()):
        return None
    reduced = replace(scene, scales=scene.scales[chosen], logarithms=scene.logarithms[chosen])
    guess, level = extrapolate(law, reduced), float(stiff.mean())
    plain = float(reduced.logarithms[reduced.scales == max(plan)].mean())
    se = math.hypot(guess.se, law.run_std / math.sqrt(len(stiff)))
    return guess.logarithm - level, se, plain - level
