"""Which setting to try next, and which is best: Gaussian processes on what is known so far.

Pure functions of the trials and a seed: the same trials give the same setting. A *place* is a
setting in fractions of its bounds. Expected improvement times the probability that all limits are
met (Gardner et al. 2014) is maximised by the package bayesian-optimization; the Gaussian processes
are those of scikit-learn (Matern covariance with the exponent 5/2, a length per field), and include
the standard error of each value.
"""

import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.optimize import NonlinearConstraint
from scipy.special import log_ndtr
from scipy.stats import qmc

from dragchain.arrays import Floats

_CANDIDATES = 12
"""Power of two of the places among which the best one is looked for."""

_LEAST_NOISE = 1e-4
"""Least variance of a value over that of all, which keeps the covariance invertible."""

_REFUSED_LIMIT, _REFUSED_SE = 0.5, 0.05
"""Of the response that is 1 where the study's checks refuse a setting, and else 0."""


@dataclass(frozen=True)
class Trials:
    """What is known of N places in D dimensions: Q responses, the first of which is minimised.

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

    @cached_property
    def responses(self) -> "Responses":
        """The model of these trials, which is fitted once."""
        return Responses(self)

    def believing(self, place: Floats) -> "Trials":
        """With a place whose run has not ended: its values are those that the model expects."""
        mean, _ = self.responses.predict(place[None])
        return self.joined(place, mean, 1e-9)

    def joined(self, place: Floats, value: Any, error: float) -> "Trials":
        """With a further place; its values are NaN if it was refused."""
        rows = [np.broadcast_to(one, (1, len(self.low))) for one in (value, error)]
        every = (self.places, place), (self.values, rows[0]), (self.errors, rows[1])
        places, values, errors = (np.vstack(pair) for pair in every)
        return Trials(places, values, errors, self.low, self.high)


@contextmanager
def _quiet() -> Iterator[None]:
    """Without the warnings that a length of a covariance is at its bound."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _process(values: Floats, errors: Floats, dimensions: int) -> Any:
    """A Gaussian process for (N,) values with these standard errors, not yet fitted."""
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import ConstantKernel, Matern

    spread = float(values.std()) or 1.0
    kernel = ConstantKernel(1.0, (0.1, 10.0)) * Matern([0.5] * dimensions, (0.1, 10.0), nu=2.5)
    return GaussianProcessRegressor(
        kernel=kernel,
        alpha=(errors / spread) ** 2 + _LEAST_NOISE,
        normalize_y=True,
        n_restarts_optimizer=1,
        random_state=0,
    )


@dataclass(frozen=True)
class Responses:
    """The Gaussian processes of all responses."""

    trials: Trials

    @cached_property
    def _fitted(self) -> Sequence[Any]:
        known, found = ~self.trials.refused, []
        places = self.trials.places[known]
        with _quiet():
            for value, error in zip(
                self.trials.values[known].T, self.trials.errors[known].T, strict=True
            ):
                found.append(_process(value, error, places.shape[1]).fit(places, value))
        return found

    def predict(self, places: Floats) -> tuple[Floats, Floats]:
        """Expected responses at (M, D) places and their standard errors, (M, Q) each."""
        each = [one.predict(places, return_std=True) for one in self._fitted]
        mean, error = (np.stack(columns, axis=1) for columns in zip(*each, strict=True))
        return mean, error

    def allowed(self, places: Floats) -> Floats:
        """Logarithm of the probability that (M, D) places meet all limits, each apart, (M,)."""
        mean, error = self.predict(places)
        ends = self.trials.high - mean, mean - self.trials.low
        each = [log_ndtr(end / np.maximum(error, 1e-12)) for end in ends]
        return np.asarray(np.sum(each, axis=(0, 2)))


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
    from bayes_opt import BayesianOptimization
    from bayes_opt.acquisition import ExpectedImprovement
    from bayes_opt.exception import NoValidPointRegisteredError

    dimensions, gone = trials.places.shape[1], trials.refused[:, None]
    if (~gone).sum() < 2:
        return np.asarray(np.random.default_rng(seed).random(dimensions))
    mean, _ = trials.responses.predict(trials.places)
    values = np.hstack([np.where(gone, mean, trials.values), gone])
    errors = np.where(gone, np.nanstd(trials.values, axis=0), trials.errors)
    errors = np.hstack([errors, np.full(gone.shape, _REFUSED_SE)])
    processes = [_process(*pair, dimensions) for pair in zip(values.T, errors.T, strict=True)]
    names = [f"x{k}" for k in range(dimensions)]
    search = BayesianOptimization(
        None,
        dict.fromkeys(names, (0.0, 1.0)),
        acquisition_function=ExpectedImprovement(xi=0.0),
        constraint=NonlinearConstraint(
            _unused, [*trials.low[1:], -np.inf], [*trials.high[1:], _REFUSED_LIMIT]
        ),
        random_state=seed,
        verbose=0,
        allow_duplicate_points=True,
    )
    assert search.constraint is not None
    search.set_gp_params(**processes[0].get_params(deep=False))
    for one, process in zip(search.constraint.model, processes[1:], strict=True):
        one.set_params(**process.get_params(deep=False))
    for place, row in zip(trials.places, values, strict=True):
        limits = row[1:] if len(row) > 2 else row[1]
        search.register(dict(zip(names, place, strict=True)), -row[0], limits)
    try:
        with _quiet():
            found = search.suggest()
    except NoValidPointRegisteredError:  # no limit was ever met: go where that is most probable
        places = candidates(dimensions)
        return np.asarray(places[trials.responses.allowed(places).argmax()])
    return np.array([found[name] for name in names])


def _unused(_: Any) -> Any:
    """The package asks for a function of a limit, but never calls it: values are registered."""
    raise NotImplementedError


def best_place(trials: Trials, accepted: Callable[[Floats], bool]) -> Floats | None:
    """The place of the least expected response where all limits are expected to be met.

    Where that is nowhere, of the largest probability that they do; None if none is accepted.
    """
    places = np.vstack([trials.places[~trials.refused], candidates(trials.places.shape[1])])
    mean, _ = trials.responses.predict(places)
    holds = ((mean >= trials.low) & (mean <= trials.high)).all(axis=1)
    rank = np.where(holds, mean[:, 0], np.inf) if holds.any() else -trials.responses.allowed(places)
    order = np.argsort(rank, kind="stable")
    return next(
        (places[k] for k in order[:200] if np.isfinite(rank[k]) and accepted(places[k])), None
    )
