"""Which setting to try next, and which is best: Gaussian processes on what is known so far.

Pure functions of the trials and a seed: the same trials give the same setting. A *place* is a
setting in fractions of its bounds. The next one has the largest expected improvement on the least
expectation at a place tried (Picheny et al. 2013, Struct. Multidiscip. Optim. 48, 607) times the
probability that all limits are met (Gardner et al. 2014). The Gaussian processes are those of
scikit-learn (Matern covariance with the exponent 5/2, a length per field), and include the standard
error of each value.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.special import log_ndtr
from scipy.stats import norm, qmc

from dragchain.arrays import Floats

_CANDIDATES = 12
"""Power of two of the places among which the best one is looked for."""

_NEAR, _REACH = 256, (0.02, 0.1)
"""Further places near the best one so far, and how far they are from it."""

_LEAST_NOISE = 1e-4
"""Least variance of a value over that of all, which keeps the covariance invertible."""

_REFUSED_LIMIT, _REFUSED_SE = 0.5, 0.05
"""Of the response that is 1 where a setting was refused, and else 0."""


@dataclass(frozen=True)
class Response:
    """The Gaussian process of (N,) values with standard errors at (N, D) places."""

    places: Floats
    values: Floats
    errors: Floats

    @cached_property
    def _scale(self) -> tuple[float, float]:
        return float(self.values.mean()), float(self.values.std()) or 1.0

    @cached_property
    def _process(self) -> Any:
        from sklearn.gaussian_process import GaussianProcessRegressor
        from sklearn.gaussian_process.kernels import ConstantKernel, Matern

        centre, spread = self._scale
        lengths = [0.5] * self.places.shape[1]
        kernel = ConstantKernel(1.0, (0.1, 10.0)) * Matern(lengths, (0.1, 10.0), nu=2.5)
        noise = (self.errors / spread) ** 2 + _LEAST_NOISE
        process = GaussianProcessRegressor(
            kernel, alpha=noise, n_restarts_optimizer=1, random_state=0
        )
        with warnings.catch_warnings():  # a length at its bound
            warnings.simplefilter("ignore")
            return process.fit(self.places, (self.values - centre) / spread)

    def predict(self, places: Floats) -> tuple[Floats, Floats]:
        """Expectations at (M, D) places and their standard errors, (M,) each."""
        centre, spread = self._scale
        mean, error = self._process.predict(places, return_std=True)
        return centre + spread * mean, spread * error


@dataclass(frozen=True)
class Trials:
    """What is known of N places in D dimensions: Q responses, the first of which is minimised.

    The Gaussian processes of the responses are fitted once, when they are asked for.

    Attributes
    ----------
    places : (N, D) ndarray
        In fractions of the bounds.
    values, errors : (N, Q) ndarray
        Responses with their standard errors; NaN where a place was refused or no run of it counts.
    low, high : (Q,) ndarray
        Limits of the responses; infinite where there is none.
    """

    places: Floats
    values: Floats
    errors: Floats
    low: Floats
    high: Floats

    @property
    def refused(self) -> Any:
        """Whether a place has no value, (N,)."""
        return np.isnan(self.values).any(axis=1)

    @property
    def known(self) -> Floats:
        """The places with values."""
        return np.asarray(self.places[~self.refused])

    def believing(self, place: Floats) -> "Trials":
        """With a place whose run has not ended: its values are those that the model expects."""
        mean, _ = self.predict(place[None])
        return self.joined(place, mean, 1e-9)

    def joined(self, place: Floats, value: Any, error: float) -> "Trials":
        """With a further place; its values are NaN if it was refused."""
        rows = [np.broadcast_to(part, (1, len(self.low))) for part in (value, error)]
        every = (self.places, place), (self.values, rows[0]), (self.errors, rows[1])
        places, values, errors = (np.vstack(pair) for pair in every)
        return Trials(places, values, errors, self.low, self.high)

    @cached_property
    def _responses(self) -> list[Response]:
        known = ~self.refused
        columns = zip(self.values[known].T, self.errors[known].T, strict=True)
        return [Response(self.known, value, error) for value, error in columns]

    @cached_property
    def _refusal(self) -> Response:
        gone = self.refused
        return Response(self.places, gone * 1.0, np.full(len(gone), _REFUSED_SE))

    def predict(self, places: Floats) -> tuple[Floats, Floats]:
        """Expected responses at (M, D) places and their standard errors, (M, Q) each."""
        predicted = [prediction.predict(places) for prediction in self._responses]
        mean, error = (np.stack(columns, axis=1) for columns in zip(*predicted, strict=True))
        return mean, error

    def allowed(self, places: Floats) -> Floats:
        """Logarithm of the probability that (M, D) places meet all limits, each apart, (M,)."""
        mean, error = self.predict(places)
        ends = self.high - mean, mean - self.low
        chances = np.sum([log_ndtr(end / np.maximum(error, 1e-12)) for end in ends], axis=(0, 2))
        if self.refused.any():
            gone, unsure = self._refusal.predict(places)
            chances = chances + log_ndtr((_REFUSED_LIMIT - gone) / np.maximum(unsure, 1e-12))
        return np.asarray(chances)

    def meets(self, places: Floats) -> Any:
        """Whether all limits are expected to be met at (M, D) places, (M,)."""
        mean, _ = self.predict(places)
        return ((mean >= self.low) & (mean <= self.high)).all(axis=1)


def spread_places(count: int, dimensions: int, seed: int) -> Floats:
    """Places that are spread evenly, (count, dimensions): a Latin hypercube."""
    return np.asarray(
        qmc.LatinHypercube(dimensions, optimization="random-cd", rng=seed).random(count)
    )


def candidates(dimensions: int) -> Floats:
    """Many places, always the same, corners of the bounds among them."""
    inside = qmc.Sobol(dimensions, scramble=False).random_base2(_CANDIDATES)
    corners = np.stack(np.meshgrid(*[[0.0, 0.5, 1.0]] * dimensions), axis=-1)
    return np.vstack([inside, corners.reshape(-1, dimensions)])


def propose(trials: Trials, seed: int) -> Floats:
    """The place to try next, (D,)."""
    dimensions, random = trials.places.shape[1], np.random.default_rng(seed)
    if len(trials.known) < 2:
        return np.asarray(random.random(dimensions))
    places = candidates(dimensions)
    good = trials.known[trials.meets(trials.known)]
    if not len(good):  # go where the limits are most probably met
        return np.asarray(places[trials.allowed(places).argmax()])
    expected = trials.predict(good)[0][:, 0]
    reach = random.choice(_REACH, (_NEAR, 1)) * random.normal(size=(_NEAR, dimensions))
    places = np.vstack([places, np.clip(good[expected.argmin()] + reach, 0.0, 1.0)])
    mean, error = (columns[:, 0] for columns in trials.predict(places))
    by = (expected.min() - mean) / error
    gain = error * (by * norm.cdf(by) + norm.pdf(by))
    return np.asarray(places[(np.log(np.maximum(gain, 1e-300)) + trials.allowed(places)).argmax()])


def best_place(trials: Trials, accepted: Callable[[Floats], bool]) -> Floats | None:
    """The place, (D,), of the least expected response where all limits are expected to be met.

    Where that is nowhere, of the largest probability that they do; None if none is accepted.
    """
    places = np.vstack([trials.known, candidates(trials.places.shape[1])])
    meets = trials.meets(places)
    mean = trials.predict(places)[0][:, 0]
    rank = np.where(meets, mean, np.inf) if meets.any() else -trials.allowed(places)
    best = (k for k in np.argsort(rank, kind="stable")[:200] if np.isfinite(rank[k]))
    return next((places[k] for k in best if accepted(places[k])), None)
