"""What reduced stiffness does to a quantity, fitted to runs in many scenes.

The logarithm of a quantity Q follows the stiffness number kappa of the run::

    ln Q = ln Q_full + A (kappa^-b - kappa_full^-b)

which is what Richardson's extrapolation assumes of a discretisation error, with a rate b that is
measured. The amplitude A of a scene grows with the inertial number I, since particles with reduced
stiffness stay in contact for longer, and scatters about that: A ~ N(alpha + beta I, tau^2). With
that prior one run is corrected, and several are extrapolated, by one and the same estimator: the
best linear unbiased prediction of ln Q_full (Robinson 1991, Statistical Science 6, 15-32).
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

UNIT_INERTIA = 0.1
"""Unit of inertial numbers, so that slopes have a plain size."""

_START = (math.log(0.3), math.log(0.1), math.log(0.05))
"""Logarithms of rate, tau and sigma to begin the search with."""


@dataclass(frozen=True)
class ScaledRuns:
    """The runs of a scene, in one quantity.

    Attributes
    ----------
    stiffness_number, inertial_number : float
        Of the scene at the physical Young's modulus.
    scales : (N,) ndarray
        Factor on Young's modulus in each run.
    logarithms : (N,) ndarray
        Logarithm of the quantity in each run.
    path_to_particle : float
        Path that each value covers over the mean diameter of a particle.
    """

    stiffness_number: float
    inertial_number: float
    scales: Floats
    logarithms: Floats
    path_to_particle: float

    def reduction(self, rate: float) -> Floats:
        """What the amplitude is multiplied with, (N,): 0 at the physical Young's modulus."""
        full = (self.stiffness_number / UNIT) ** -rate
        return np.asarray(full * (self.scales ** (-2.0 / 3.0 * rate) - 1.0))

    @property
    def of_amplitude(self) -> Floats:
        """What alpha and beta are multiplied with, (2,)."""
        return np.array([1.0, self.inertial_number / UNIT_INERTIA])


@dataclass(frozen=True)
class StiffnessLaw:
    """The common law of a quantity.

    Attributes
    ----------
    rate : float
        Exponent b.
    amplitude, slope : float
        Amplitude alpha of a quasi-static drag, and its slope beta over I / `UNIT_INERTIA`.
    covariance : (float, float, float)
        Variance of alpha, covariance, variance of beta.
    amplitude_std : float
        Standard deviation tau of the amplitude from scene to scene.
    run_std : float
        Standard deviation sigma of the logarithm in one run.
    model_std : float
        What the errors of scenes that were left out say beyond all that, as a standard deviation.
    """

    rate: SixDigits
    amplitude: SixDigits
    slope: SixDigits
    covariance: tuple[SixDigits, SixDigits, SixDigits]
    amplitude_std: SixDigits
    run_std: SixDigits
    model_std: SixDigits = 0.0

    def prior(self, runs: ScaledRuns) -> tuple[float, float]:
        """Mean and variance of the amplitude in a scene."""
        one, inertia = runs.of_amplitude
        variance, common, of_slope = self.covariance
        error = variance + 2.0 * inertia * common + inertia**2 * of_slope
        return self.amplitude * one + self.slope * inertia, self.amplitude_std**2 + error


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
        If fewer than four scenes were run at two moduli.
    """
    useful = [one for one in scenes if len(set(one.scales.tolist())) > 1]
    if len(useful) < 4:
        raise SeriesError("fewer than four scenes were run at two moduli")

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
    _, (amplitude, slope), covariance = _likelihood(useful, rate, amplitude_std, run_std)
    entries = (covariance[0, 0], covariance[0, 1], covariance[1, 1])
    return StiffnessLaw(rate, amplitude, slope, entries, amplitude_std, run_std)


def _likelihood(
    scenes: Iterable[ScaledRuns], rate: float, amplitude_std: float, run_std: float
) -> tuple[float, Floats, Floats]:
    """Logarithm of the likelihood, alpha and beta, (2,), and their covariance, (2, 2).

    The levels of the scenes are integrated out (restricted likelihood), alpha and beta are
    estimated.
    """
    weight, moment = np.zeros((2, 2)), np.zeros(2)
    square = constant = 0.0
    for one in scenes:
        h, y, ones = one.reduction(rate), one.logarithms, np.ones(len(one.scales))
        covariance = run_std**2 * np.eye(len(h)) + amplitude_std**2 * np.outer(h, h)
        inverse = np.linalg.inv(covariance)
        level = float(ones @ inverse @ ones)
        projected = inverse - np.outer(inverse @ ones, ones @ inverse) / level
        weight += float(h @ projected @ h) * np.outer(one.of_amplitude, one.of_amplitude)
        moment += float(h @ projected @ y) * one.of_amplitude
        square += float(y @ projected @ y)
        constant += float(np.linalg.slogdet(covariance)[1]) + math.log(level)
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
            if (error := _error_in(one, law, plan)) is not None
        ]
        for plan in plans
    ]


def _error_in(
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
