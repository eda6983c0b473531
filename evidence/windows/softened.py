"""The ratio of a quantity at the physical Young's modulus to that at a reduced one, from scenes."""

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.stats import binom

from dragchain.arrays import Floats
from dragchain.statistics.estimate import CONFIDENCE, NORMAL_QUANTILE, student_quantile
from dragdeck.records.windows import softening
from evidence.windows.scene_runs import QuantityOfRun, mean_attribute, variance_of_mean

FEWEST_SCENES = 5
_LARGEST_STD = 0.08
"""A ratio that differs by more than this from scene to scene says too little."""

_BY_CHANCE = 0.01
"""Probability of so many misses of scenes that are left out below which intervals do not cover."""


def between_scenes(
    values: Sequence[float], variances: Sequence[float]
) -> tuple[float, float, float]:
    """Mean over scenes, its standard error, and standard deviation of a further scene from it.

    The variance between scenes is by the method of moments (DerSimonian and Laird 1986, Controlled
    Clinical Trials 7, 177), and never taken as less than that of the mean.
    """
    of, variance = np.asarray(values), np.asarray(variances)
    weight = 1.0 / variance
    mean = float(np.average(of, weights=weight))
    excess = float(weight @ (of - mean) ** 2) - (len(of) - 1)
    between = max(excess / float(weight.sum() - weight @ weight / weight.sum()), 0.0)
    weight = 1.0 / (variance + between)
    error = 1.0 / float(weight.sum())
    return float(np.average(of, weights=weight)), math.sqrt(error), math.sqrt(between + error)


@dataclass(frozen=True)
class Softened:
    """A quantity of a scene at the physical modulus and at reduced ones.

    Attributes
    ----------
    stiff : sequence of QuantityOfRun
    soft : sequence of sequence of QuantityOfRun
        The packings at each reduced modulus, (M,).
    differences : (M,) ndarray
        By how much their `softness` is above that of the physical modulus.
    """

    stiff: Sequence[QuantityOfRun]
    soft: Sequence[Sequence[QuantityOfRun]]
    differences: Floats

    @classmethod
    def of(cls, runs: Sequence[QuantityOfRun]) -> "Softened | None":
        """Of all packings of a scene; None if a modulus is missing."""
        by_scale = defaultdict[float, list[QuantityOfRun]](list)
        for run in runs:
            by_scale[run.run.fidelity.youngs_modulus_scale].append(run)
        stiff = by_scale.pop(1.0, [])
        if not stiff or not by_scale:
            return None
        number = stiff[0].run.numbers["stiffness_number"]
        soft = [softening(number, scale) for scale in by_scale]
        return cls(stiff, list(by_scale.values()), np.array(soft))

    @cached_property
    def per_softness(self) -> float:
        """The logarithm of the ratio per difference of softness, by least squares."""
        soft = np.array([mean_attribute(runs, "value") for runs in self.soft])
        logs = np.log(mean_attribute(self.stiff, "value") / soft)
        return float(self.differences @ logs / (self.differences @ self.differences))

    @cached_property
    def variance(self) -> float:
        """Of that, by the scatter along the paths."""
        x, of_stiff = self.differences, variance_of_mean(self.stiff)
        of_soft = np.array([variance_of_mean(runs) for runs in self.soft])
        return float(of_stiff * x.sum() ** 2 + x**2 @ of_soft) / float(x @ x) ** 2

    def misses(self, per_softness: float, std: float, degrees: int) -> Iterator[bool]:
        """Of each soft run, whether its estimate and the stiff runs exclude each other."""
        stiff, of_stiff = (
            math.log(mean_attribute(self.stiff, "value")),
            variance_of_mean(self.stiff),
        )
        for runs, difference in zip(self.soft, self.differences, strict=True):
            for run in runs:
                along = student_quantile(len(run.blocks) - 1) ** 2 * run.variance_of_mean
                between = (student_quantile(degrees) * std * difference) ** 2
                half = math.sqrt(along + between + NORMAL_QUANTILE**2 * of_stiff)
                yield abs(math.log(run.value) + per_softness * difference - stiff) > half


def ratio_of_softness(scenes: Sequence[Softened]) -> tuple[float, float, float]:
    """Logarithm of the ratio per difference of softness, its standard deviation, and coverage.

    The coverage is that of scenes that are left out by what the others give. Where that is too low
    by more than chance, the standard deviation is infinite.
    """
    if len(scenes) < FEWEST_SCENES:
        return 0.0, math.inf, 0.0
    mean, std = _over(scenes)
    missed = [
        miss
        for number, scene in enumerate(scenes)
        for miss in scene.misses(*_over([*scenes[:number], *scenes[number + 1 :]]), len(scenes) - 2)
    ]
    by_chance = binom.sf(sum(missed) - 1, len(missed), 1.0 - CONFIDENCE)
    useful = std <= _LARGEST_STD and by_chance >= _BY_CHANCE
    return mean, std if useful else math.inf, 1.0 - sum(missed) / len(missed)


def _over(scenes: Sequence[Softened]) -> tuple[float, float]:
    mean, _, std = between_scenes(
        [scene.per_softness for scene in scenes], [scene.variance for scene in scenes]
    )
    return mean, std
