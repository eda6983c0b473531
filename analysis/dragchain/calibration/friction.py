"""Friction and rolling friction of the media from measured angles.

Each measurement is simulated at some pairs of coefficients. A polynomial through the angles says
what the angle is at any pair, and how well that is known. On a grid over both coefficients, the
measured angles then give their joint probability.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from dragchain.arrays import Floats
from dragchain.calibration.angle_runs import AngleSet
from dragchain.errors import TableError
from dragchain.statistics.bed_effects import EffectsFit, fit_effects
from dragchain.statistics.estimate import CONFIDENCE, Estimate
from dragdeck.parts import Part
from dragdeck.study.calibration import Rig

GRID = 121
"""Values of each coefficient at which the probability is computed."""

_DEGREE, _SPARE = 3, 4
"""Of the polynomial; least degrees of freedom that are left."""


@dataclass(frozen=True)
class AngleModel:
    """A cubic polynomial through simulated angles, in the square roots of both coefficients.

    The roots are those of the distances from the lower ends, in units of the ranges: there, angles
    that saturate are nearly straight.

    Attributes
    ----------
    ranges : (2, 2) array
        Lower and upper end of friction and rolling friction.
    fit : EffectsFit
        Factors of its 10 terms; the residuals are those of a run, and lack of fit.
    """

    ranges: Floats
    fit: EffectsFit

    @classmethod
    def through(cls, pairs: Floats, angle_deg: Floats, ranges: Floats) -> "AngleModel":
        """Least squares through (N,) angles at (N, 2) pairs of coefficients.

        Raises
        ------
        TableError
            There are too few.
        """
        terms = _terms(pairs, ranges)
        spare = len(terms) - terms.shape[1]
        if spare < _SPARE:
            least = terms.shape[1] + _SPARE
            raise TableError(f"{len(terms)} runs of a measured angle succeeded, not {least}")
        return cls(ranges, fit_effects(terms, angle_deg, range(len(terms))))

    def at(self, pairs: Floats) -> tuple[Floats, Floats]:
        """Mean angle at (M, 2) pairs of coefficients and its standard uncertainty, degrees."""
        terms = _terms(pairs, self.ranges)
        variance = ((terms @ self.fit.covariance) * terms).sum(axis=1)
        return terms @ self.fit.effects, np.sqrt(variance)


def _terms(pairs: Floats, ranges: Floats) -> Floats:
    low, high = ranges.T
    u, v = np.sqrt((pairs - low) / (high - low)).T
    powers = [(i, j) for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)]
    return np.stack([u**i * v**j for i, j in powers], axis=-1)


class Coefficients(Part):
    """What measurements say of both coefficients.

    Attributes
    ----------
    friction, rolling_friction : Estimate
        Mean and 95 % credible interval.
    correlation : float
    narrowed : (float, float)
        Length of each interval over that of the range alone: near 1, the measurement says nothing.
    """

    friction: Estimate
    rolling_friction: Estimate
    correlation: float
    narrowed: tuple[float, float]


class FrictionFile(AngleSet):
    """The content of ``angles.json``; docs/evidence/calibration.md explains it.

    Attributes
    ----------
    best : (float, float)
        The most likely friction and rolling friction.
    misfit : mapping
        Measured minus simulated angle there, in standard uncertainties.
    scatter_deg : mapping
        Scatter of the simulated angles of a measurement, degrees.
    found : mapping
        By ``repose``, ``drum`` and, of two measurements, ``both``.
    """

    best: tuple[float, float]
    misfit: Mapping[Rig, float]
    scatter_deg: Mapping[Rig, float]
    found: Mapping[str, Coefficients]


@dataclass(frozen=True)
class Posterior:
    """The joint probability of both coefficients, equally likely in their ranges beforehand.

    Attributes
    ----------
    axes : (2, GRID) array
        Friction and rolling friction.
    misfit : mapping of str to (GRID, GRID) array
        Measured minus simulated angle, in standard uncertainties.
    weights : mapping of str to (GRID, GRID) array
        Probability of each pair by ``repose``, ``drum`` and ``both``, or what there is of them; the
        last one has all measurements.
    """

    axes: Floats
    misfit: Mapping[Rig, Floats]
    weights: Mapping[str, Floats]

    @classmethod
    def of(
        cls, models: Mapping[Rig, AngleModel], measured: Mapping[Rig, tuple[float, float]]
    ) -> "Posterior":
        """From measured angles and their standard uncertainties, degrees."""
        ranges = next(iter(models.values())).ranges
        axes = np.stack([np.linspace(low, high, GRID) for low, high in ranges])
        pairs = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        misfit, log = dict[Rig, Floats](), dict[str, Floats]()
        for name, model in models.items():
            (angle, reading_error), (mean, std) = measured[name], model.at(pairs)
            width = np.hypot(std, reading_error).reshape(GRID, GRID)
            misfit[name] = (angle - mean.reshape(GRID, GRID)) / width
            log[name] = -(misfit[name] ** 2) / 2 - np.log(width)
        if len(log) > 1:
            log["both"] = np.sum(list(log.values()), axis=0)
        likelihoods = {name: np.exp(logarithm - logarithm.max()) for name, logarithm in log.items()}
        return cls(
            axes,
            misfit,
            {name: likelihood / likelihood.sum() for name, likelihood in likelihoods.items()},
        )

    def coefficients(self, name: str) -> Coefficients:
        """Means, equal-tailed intervals and correlation."""
        weights, tail = self.weights[name], (1 - CONFIDENCE) / 2
        marginal = np.stack([weights.sum(axis=1), weights.sum(axis=0)])
        mean = (self.axes * marginal).sum(axis=1)
        below = np.cumsum(marginal, axis=1) - marginal / 2
        pairs = zip(below, self.axes, strict=True)
        ends = np.array([np.interp([tail, 1 - tail], part, axis) for part, axis in pairs])
        away = self.axes - mean[:, None]
        spread = np.sqrt((away**2 * marginal).sum(axis=1))
        length = CONFIDENCE * np.ptp(self.axes, axis=1)
        first, second = (Estimate(*row) for row in np.column_stack([mean, ends]).tolist())
        return Coefficients(
            friction=first,
            rolling_friction=second,
            correlation=float(away[0] @ weights @ away[1] / spread.prod()),
            narrowed=tuple((np.ptp(ends, axis=1) / length).tolist()),
        )


def angle_models(known: AngleSet, runs: pd.DataFrame) -> dict[Rig, AngleModel]:
    """The angle of each measurement as a function of the coefficients, from ``angles.csv``."""
    ranges, models = np.array([known.friction, known.rolling_friction]), {}
    for name in known.measured:
        of_rig = runs[runs["rig"] == name]
        pairs = of_rig[["friction", "rolling_friction"]].to_numpy(np.float64)
        models[name] = AngleModel.through(pairs, of_rig["angle_deg"].to_numpy(np.float64), ranges)
    return models


def find_friction(known: AngleSet, runs: pd.DataFrame) -> FrictionFile:
    """What the measured angles of a study say of the coefficients.

    Raises
    ------
    TableError
        Too few runs succeeded.
    """
    models = angle_models(known, runs)
    posterior = Posterior.of(models, known.measured)
    weights = [*posterior.weights.values()][-1]
    i, j = np.unravel_index(int(weights.argmax()), weights.shape)
    return FrictionFile(
        **dict(known),
        best=(float(posterior.axes[0, i]), float(posterior.axes[1, j])),
        misfit={name: float(misfits[i, j]) for name, misfits in posterior.misfit.items()},
        scatter_deg={name: model.fit.residual_std for name, model in models.items()},
        found={name: posterior.coefficients(name) for name in posterior.weights},
    )
