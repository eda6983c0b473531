"""What reduced stiffness does to a quantity, fitted to runs in many scenes.

The logarithm of a quantity Q follows the stiffness number kappa of the run::

    ln Q = ln Q_full + A g(kappa),    g = C (kappa^-b - kappa_full^-b) / b

which is what Richardson's extrapolation assumes of a discretisation error, with a rate b that is
measured (Box and Cox 1964, Journal of the Royal Statistical Society B 26, 211-252). For b = 0, g is
the logarithm, and nothing limits b. The factor C makes g = 1 for E x `UNIT_SCALE` in a scene with
the stiffness number `UNIT`. The amplitude A of a scene depends on the inertial number I, since
particles with reduced stiffness stay in contact for longer, and on the friction mu between
particles, and scatters about that: A ~ N(alpha + beta I + gamma ln mu, tau^2). With that prior one
run is corrected, and several are extrapolated, by one and the same estimator: the best linear
unbiased prediction of ln Q_full (Robinson 1991, Statistical Science 6, 15-32).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize
from scipy.special import exprel

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragchain.statistics.estimate import NORMAL_QUANTILE
from dragchain.tradeoff.six_digits import SixDigits

UNIT = 5e4
"""Stiffness number in whose units kappa is written: about the middle of the designed scenes."""

UNIT_SCALE = 1e-3
"""Modulus scale that changes a logarithm by the amplitude, where kappa is `UNIT`."""

UNIT_INERTIA, UNIT_FRICTION = 0.1, 0.3
"""Inertial number and friction in whose units amplitudes are written, to have a plain size."""

COEFFICIENTS = 3
"""Coefficients of the amplitude, which take as many degrees of freedom from the scenes."""

_RATE, _RATE_STD = 0.5, 1.0
"""What is known of a rate beforehand, for effects too small to have a rate of their own."""

_RATE_STEP = 0.02
"""Step of the differences that take the place of derivatives by the rate."""


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
    stiffness_power : float
        The law is that of the quantity times kappa to this power.
    """

    stiffness_number: float
    inertial_number: float
    friction: float
    scales: Floats
    logarithms: Floats
    path_to_particle: float
    stiffness_power: float = 0.0

    @property
    def softening(self) -> Floats:
        """Logarithm of kappa at the physical modulus over that of the run, (N,)."""
        return np.asarray(-2.0 / 3.0 * np.log(self.scales))

    def reduction(self, rate: float) -> Floats:
        """What the amplitude is multiplied with, g, (N,): 0 at the physical Young's modulus."""
        return reduction(self.stiffness_number, self.softening, rate)

    @property
    def of_law(self) -> Floats:
        """Logarithms of what the law is about, (N,): as they are at the physical modulus."""
        return np.asarray(self.logarithms - self.stiffness_power * self.softening)

    @property
    def of_amplitude(self) -> Floats:
        """What alpha, beta and gamma are multiplied with, (3,)."""
        rough = math.log(self.friction / UNIT_FRICTION)
        return np.array([1.0, self.inertial_number / UNIT_INERTIA, rough])


def reduction(stiffness_number: Floats | float, softening: Floats, rate: float) -> Floats:
    """The function g of the law.

    Parameters
    ----------
    stiffness_number : float or ndarray
        At the physical Young's modulus.
    softening : ndarray
        Logarithm of this number over that of the run.
    rate : float
    """
    unit = -2.0 / 3.0 * math.log(UNIT_SCALE)
    full = (np.asarray(stiffness_number) / UNIT) ** -rate
    return np.asarray(full * softening * exprel(rate * softening) / (unit * exprel(rate * unit)))


Three = tuple[SixDigits, SixDigits, SixDigits]
Four = tuple[SixDigits, SixDigits, SixDigits, SixDigits]


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
    covariance : 4 rows of 4 floats
        Of these and of the rate.
    amplitude_std : float
        Standard deviation tau of the amplitude from scene to scene.
    run_std : float
        Standard deviation sigma of the logarithm in one run.
    misfit : sequence of (float, float)
        Modulus scales, and what the errors of scenes that were left out say beyond all that in an
        extrapolation from there, as a standard deviation.
    """

    rate: SixDigits
    amplitude: Three
    covariance: tuple[Four, Four, Four, Four]
    amplitude_std: SixDigits
    run_std: SixDigits
    misfit: tuple[tuple[SixDigits, SixDigits], ...] = ()

    def effect(self, runs: ScaledRuns) -> tuple[Floats, Floats]:
        """Expected change of the logarithm in each run, (N,), and its covariance, (N, N)."""
        g = runs.reduction(self.rate)
        mean = float(runs.of_amplitude @ np.array(self.amplitude))
        step = _RATE_STEP
        slope = (runs.reduction(self.rate + step) - runs.reduction(self.rate - step)) / (2.0 * step)
        along = np.column_stack([np.outer(g, runs.of_amplitude), mean * slope])
        misfit = self._misfit(runs.softening)
        covariance = along @ np.array(self.covariance) @ along.T
        covariance += self.amplitude_std**2 * np.outer(g, g) + np.outer(misfit, misfit)
        return mean * g, covariance

    def _misfit(self, softening: Floats) -> Floats:
        """The misfit of each run, (N,): between the measured scales in proportion."""
        known = np.array(sorted(self.misfit, reverse=True)).reshape(-1, 2)
        at = np.concatenate([[0.0], -2.0 / 3.0 * np.log(known[:, 0])])
        stds = np.concatenate([[0.0], known[:, 1]])
        beyond = np.maximum(softening / at[-1], 1.0) if len(known) else 1.0
        return np.asarray(np.interp(softening, at, stds) * beyond)


@dataclass(frozen=True)
class Extrapolation:
    """Logarithm of a quantity at the physical Young's modulus.

    Attributes
    ----------
    logarithm : float
    law_se, run_se : float
        Standard errors by the law and by the scatter of the runs.
    """

    logarithm: float
    law_se: float
    run_se: float

    @property
    def se(self) -> float:
        """Standard error by both."""
        return math.hypot(self.law_se, self.run_se)

    def half_width(self, quantile: float) -> float:
        """Half-width of the 95 % interval.

        Parameters
        ----------
        quantile : float
            Of the errors by the law. The scatter of a run is known from many runs.
        """
        return math.hypot(quantile * self.law_se, NORMAL_QUANTILE * self.run_se)


def fit_stiffness_law(scenes: Sequence[ScaledRuns]) -> StiffnessLaw:
    """The law of a quantity by restricted maximum likelihood, every scene with a level of its own.

    Raises
    ------
    SeriesError
        If fewer than five scenes were run at two moduli, or their inertial numbers and
        coefficients of friction do not tell the amplitudes apart.
    """
    useful = [one for one in scenes if len(set(one.scales.tolist())) > 1]
    if len(useful) < 5:
        raise SeriesError("fewer than five scenes were run at two moduli")
    if np.linalg.matrix_rank(np.array([one.of_amplitude for one in useful])) < COEFFICIENTS:
        raise SeriesError("the scenes differ too little in inertial number or friction")
    rows = _Rows.of(useful)

    def cost(point: Floats) -> float:
        return rows.fit(float(point[0]), math.exp(point[1])).cost

    best = minimize(
        cost,
        np.array([_RATE, 0.0]),
        method="Nelder-Mead",
        bounds=[(-np.inf, np.inf), (-6.0, 6.0)],
        options={"xatol": 1e-3, "fatol": 1e-5},
    )
    rate, ratio = float(best.x[0]), math.exp(best.x[1])
    below, at, above = (rows.fit(rate + step, ratio) for step in (-_RATE_STEP, 0.0, _RATE_STEP))
    curvature = (below.cost - 2.0 * at.cost + above.cost) / _RATE_STEP**2
    slope = (above.amplitude - below.amplitude) / (2.0 * _RATE_STEP)
    along = np.array([*slope, 1.0])
    covariance = np.outer(along, along) / max(curvature, _RATE_STD**-2.0)
    covariance[:3, :3] += at.covariance
    return StiffnessLaw(
        rate=rate,
        amplitude=tuple(at.amplitude.tolist()),
        covariance=tuple(tuple(row) for row in covariance.tolist()),  # type: ignore[arg-type]
        amplitude_std=ratio * at.run_std,
        run_std=at.run_std,
    )


@dataclass(frozen=True)
class _Fit:
    """Alpha to gamma, (3,), their covariance, (3, 3), and sigma at a rate and at tau over sigma.

    `cost`: minus the logarithm of the likelihood, but for a constant.
    """

    cost: float
    amplitude: Floats
    covariance: Floats
    run_std: float


@dataclass(frozen=True)
class _Rows:
    """The runs of S scenes beside each other, (S, N); where a scene has fewer, `there` is 0."""

    stiffness_numbers: Floats
    of_amplitude: Floats
    softening: Floats
    logarithms: Floats
    there: Floats

    @classmethod
    def of(cls, scenes: Sequence[ScaledRuns]) -> "_Rows":
        shape = len(scenes), max(len(one.scales) for one in scenes)
        softening, logarithms, there = (np.zeros(shape) for _ in range(3))
        for row, one in enumerate(scenes):
            own = row, slice(len(one.scales))
            softening[own], there[own] = one.softening, 1.0
            logarithms[own] = one.of_law - one.of_law.mean()
        return cls(
            np.array([[one.stiffness_number] for one in scenes]),
            np.array([one.of_amplitude for one in scenes]),
            softening,
            logarithms,
            there,
        )

    def fit(self, rate: float, ratio: float) -> _Fit:
        """Fit the rest. Levels of scenes and alpha to gamma are integrated out of the likelihood.

        What is known of the rate beforehand is part of it.
        """
        g = reduction(self.stiffness_numbers, self.softening, rate)
        known = np.stack([self.there, g, self.logarithms])
        # 1, g and y under the inverse covariance (Sherman and Morrison), the level projected out
        products = np.einsum("isn,jsn->sij", known, known)
        along = products[:, :, 1]
        growth = 1.0 + ratio**2 * products[:, 1, 1]
        shrunk = ratio**2 / growth
        products = products - shrunk[:, None, None] * along[:, :, None] * along[:, None, :]
        level = products[:, 0, 0]
        first = products[:, :, 0]
        projected = products - first[:, :, None] * first[:, None, :] / level[:, None, None]
        weight = np.einsum("s,si,sj->ij", projected[:, 1, 1], self.of_amplitude, self.of_amplitude)
        variance = np.asarray(np.linalg.inv(weight), dtype=np.float64)
        moment = projected[:, 1, 2] @ self.of_amplitude
        amplitude = variance @ moment
        square = float(projected[:, 2, 2].sum() - moment @ amplitude)
        degrees = self.there.sum() - len(self.there) - COEFFICIENTS
        constant = float(np.log(growth).sum() + np.log(level).sum() + np.linalg.slogdet(weight)[1])
        cost = 0.5 * (degrees * math.log(square) + constant + ((rate - _RATE) / _RATE_STD) ** 2)
        run_variance = square / degrees
        return _Fit(cost, amplitude, run_variance * variance, math.sqrt(run_variance))


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
    effect, covariance = law.effect(runs)
    stds = np.full(len(effect), law.run_std) if run_stds is None else run_stds
    weight = np.linalg.inv(covariance + np.diag(stds**2)).sum(axis=0)
    weight /= weight.sum()
    return Extrapolation(
        logarithm=float(weight @ (runs.of_law - effect)),
        law_se=math.sqrt(max(0.0, float(weight @ covariance @ weight))),
        run_se=math.sqrt(float(weight**2 @ stds**2)),
    )


@dataclass(frozen=True)
class ErrorIn:
    """The error of an extrapolation in a scene.

    Attributes
    ----------
    found : Extrapolation
        Extrapolated minus measured logarithm, with the standard errors of that difference.
    raw : float
        The difference without a correction, of the runs at the largest modulus.
    """

    found: Extrapolation
    raw: float


def with_misfit(law: StiffnessLaw, errors: Mapping[float, Sequence[ErrorIn]]) -> StiffnessLaw:
    """A law with what its errors in scenes left out of the fit are beyond their standard errors.

    The misfit is the moment estimate of a variance between scenes, zero where it is negative
    (DerSimonian and Laird 1986, Controlled Clinical Trials 7, 177-188).

    Parameters
    ----------
    law : StiffnessLaw
    errors : mapping of float to sequence of ErrorIn
        Of extrapolations from one run, by its modulus scale.
    """
    misfit = []
    for scale, found in errors.items():
        expected = float(np.mean([one.found.se**2 for one in found]))
        beyond = float(np.mean([one.found.logarithm**2 for one in found])) - expected
        misfit.append((scale, math.sqrt(max(beyond, 0.0))))
    return replace(law, misfit=tuple(misfit))


def left_out(
    scenes: Sequence[ScaledRuns], plans: Sequence[Mapping[float, int]]
) -> list[list[ErrorIn]]:
    """Errors of extrapolations in scenes that were left out of the fit, a list for each plan.

    Parameters
    ----------
    scenes : sequence of ScaledRuns
    plans : sequence of mapping of float to int
        Runs at each modulus scale that an extrapolation may use.

    Returns
    -------
    list of list of ErrorIn
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


def error_in(scene: ScaledRuns, law: StiffnessLaw, plan: Mapping[float, int]) -> ErrorIn | None:
    """The error of an extrapolation; None where the scene lacks runs of the plan or at E x 1."""
    stiff = scene.logarithms[scene.scales == 1.0]
    chosen = np.concatenate(
        [np.flatnonzero(scene.scales == scale)[:count] for scale, count in plan.items()]
    )
    if not len(stiff) or len(chosen) < sum(plan.values()):
        return None
    reduced = replace(scene, scales=scene.scales[chosen], logarithms=scene.logarithms[chosen])
    guess, level = extrapolate(law, reduced), float(stiff.mean())
    plain = float(reduced.logarithms[reduced.scales == max(plan)].mean())
    run_se = math.hypot(guess.run_se, law.run_std / math.sqrt(len(stiff)))
    expected = replace(guess, logarithm=guess.logarithm - level, run_se=run_se)
    return ErrorIn(expected, plain - level)
