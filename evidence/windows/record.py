"""What runs of designed scenes say: ``windows.json`` and ``stable_step.json`` of dragdeck.

``windows.json`` has, for each quantity, what soft runs and their windows in drawn scenes say: the
ratio of the values at both moduli, the slope of windows on the soft run beside them, and the
scatter about it, each with its scatter from scene to scene. Scatter between packings, correlation
of neighbouring blocks, and ``stable_step.json``, the law of the stability number of a time step
(`StableStepLaw`), are from whole runs of designed scenes at the physical Young's modulus and at
reduced ones, over one or more packings. Where there are windows in fewer than five scenes, whole
runs give ratio and scatter, too, and the slope is 0.
"""

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.optimize import brentq
from scipy.special import digamma, polygamma
from scipy.stats import truncnorm

from dragchain.arrays import Floats
from dragchain.errors import SeriesError
from dragchain.quantities.blocks import neighbour_correlation
from dragchain.quantities.document import RunQuantities
from dragchain.quantities.registry import MEASURED, Quantity
from dragchain.statistics.estimate import NORMAL_QUANTILE
from dragchain.windows.estimate import WindowOfRun
from dragchain.windows.rounds import beside, of_windows, stretches, window_of
from dragdeck.records.windows import TYPICAL_FRONT, UNKNOWN, Known, WindowsRecord, front_of
from evidence.windows.scene_runs import (
    QuantityOfRun,
    Scenes,
    is_soft,
    last_day,
    mean_attribute,
    read_archive,
    read_scenes,
    runs_with,
)
from evidence.windows.softened import FEWEST_SCENES, Softened, between_scenes, ratio_of_softness
from evidence.windows.stable_step import stable_step_record

_FEWEST_DEGREES, _MOST_DEGREES = 0.5, 10.0
"""Windows' worth of evidence on a variance: never more, whatever the scenes agree on."""


_LARGEST_VARIANCE = 0.05
"""Relative, of means whose scatter between packings is of use: not of those that may be zero."""


def write_scene_records(out_dir: Path, archives: Sequence[Path], windows: Path | None) -> str:
    """Write ``windows.json`` and ``stable_step.json``; return a line on each.

    Parameters
    ----------
    out_dir : Path
    archives : sequence of Path
        Tar archives of ``quantities.json`` files of whole runs.
    windows : Path or None
        Archive of soft runs and their windows, of `evidence.windows.drawn.collect_windows`.

    Raises
    ------
    SeriesError
        Too few scenes or runs.
    """
    scenes = read_scenes(archives)
    windowed, files = (read_windows(windows), [windows]) if windows else ([], [])
    record = windows_record(scenes, windowed, [file.name for file in (*files, *archives)])
    step = stable_step_record(scenes)
    record.write(out_dir / "windows.json")
    step.write(out_dir / "stable_step.json")
    return (
        f"windows.json: {len(record.quantities)} quantities\n"
        f"stable_step.json: {step.stable_step.runs} runs"
    )


@dataclass(frozen=True)
class Windowed:
    """A soft run and its windows."""

    soft: RunQuantities
    windows: Sequence[WindowOfRun]

    def pairs(self, quantity: Quantity) -> "Pairs | None":
        """A quantity in the windows and beside them, None where it is not in all of them."""
        there = [self.soft.values(), *(window.values for window in self.windows)]
        if len(self.windows) < _FEWEST_WINDOWS or any(quantity.name not in of for of in there):
            return None
        windows = of_windows(quantity, self.windows)
        soft = beside(self.soft, quantity.name, self.windows)
        along = stretches(self.soft, quantity.name, self.windows[0].arc_m)
        blocks = self.soft.of_blocks(quantity.name).values
        known = blocks[np.isfinite(blocks)]
        return Pairs(
            windows / windows.mean() - 1.0,
            soft / soft.mean() - 1.0,
            along / along.mean() - 1.0,
            (
                front_of(self.soft.numbers),
                float(np.var(known / known.mean(), ddof=1)) / (1 + quantity.squared) ** 2,
            ),
        )


@dataclass(frozen=True)
class Pairs:
    """A quantity in K windows and in the soft run beside them, (K,) each, about their means.

    Attributes
    ----------
    windows, beside : (K,) ndarray
        Relative to the means.
    stretches : (B,) ndarray
        The soft run's stretches, relative to the mean of it.
    of_block : tuple of float
        Particles that fit on the front of the workpiece, and relative variance of a block of the
        soft run; of the root of a mean square.
    """

    windows: Floats
    beside: Floats
    stretches: Floats
    of_block: tuple[float, float]

    @property
    def variance(self) -> float:
        """Relative, of the soft run's stretches."""
        return float(np.var(self.stretches, ddof=1))

    @property
    def is_usable(self) -> bool:
        """Whether both scatter; a number of rare events may be the same in all windows."""
        return self.variance > 0.0 and self.slope_variance > 0.0

    @cached_property
    def slope(self) -> float:
        """Of the windows on the soft run."""
        return float(self.beside @ self.windows / (self.beside @ self.beside))

    def about(self, slope: float) -> float:
        """Variance of a window about a slope that is given."""
        rest = self.windows - slope * self.beside
        return float(rest @ rest) / (len(rest) - 1)

    @property
    def slope_variance(self) -> float:
        """Of the slope of the windows."""
        degrees = len(self.windows) - 1
        return self.about(self.slope) * degrees / (degrees - 1) / float(self.beside @ self.beside)


_FEWEST_WINDOWS = 5
"""Of which a slope is taken."""


def read_windows(archive: Path) -> list[Windowed]:
    """The soft runs of an archive with their windows."""
    folders = defaultdict[Path, dict[str, RunQuantities]](dict)
    for file, run in read_archive(archive):
        folders[file.parent][file.name] = run
    return [
        Windowed(runs.pop("soft.json"), list(map(window_of, runs.values())))
        for runs in folders.values()
    ]


def windows_record(
    scenes: Scenes, windowed: Sequence[Windowed], sources: Sequence[str]
) -> WindowsRecord:
    """What is known of every quantity that enough of the soft runs and windows have.

    Raises
    ------
    SeriesError
        There is none.
    """
    rows = {quantity.name: _known(quantity, scenes, windowed) for quantity in MEASURED}
    quantities = {name: known for name, known in rows.items() if known}
    if not quantities:
        raise SeriesError(f"no quantity is known in {FEWEST_SCENES} scenes or more")
    return WindowsRecord(
        measured=last_day([*scenes, [of.soft for of in windowed]]),
        source=f"runs of scenes: {', '.join(sources)}",
        quantities=quantities,
    )


def _known(quantity: Quantity, scenes: Scenes, windowed: Sequence[Windowed]) -> Known | None:
    measured = [[*runs_with(quantity, runs)] for runs in scenes]
    pairs = [of for windows in windowed if (of := windows.pairs(quantity)) and of.is_usable]
    if len(pairs) >= FEWEST_SCENES:
        said = _of_windows(quantity, pairs)
    elif (whole := _of_whole_runs(measured)) is None:
        return None
    else:
        said = whole
    of_blocks = [of.of_block for of in pairs]
    of_blocks += [
        (front_of(soft[0].run.numbers), mean_attribute(soft, "variance"))
        for runs in measured
        if (soft := _soft(runs))
    ]
    block_std, front_power = _of_blocks(of_blocks)
    softened = [softened for runs in measured if (softened := Softened.of(runs))]
    per_softness, std, covered = ratio_of_softness([] if quantity.signed else softened)
    return Known(
        **{name: round(value, 4) for name, value in said.items()},
        block_std=round(block_std, 4),
        front_power=round(front_power, 2),
        per_softness=round(per_softness, 4),
        per_softness_std=round(std, 4),
        scenes=len(softened),
        covered=round(covered, 3),
        packing_std=round(_between_packings(measured), 4),
        correlation=round(_correlation(measured), 2),
    )


def _of_blocks(scenes: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Standard deviation of a block at the typical front, and the power of its square with it.

    The power is that of a line through the logarithms, of no more independent contacts than there
    are, and of no more scatter with more of them: 0 to 1.
    """
    fronts, variances = np.array(scenes).T
    wider = np.log(fronts / TYPICAL_FRONT)
    about = wider - wider.mean()
    power = -float(about @ np.log(np.maximum(variances, 1e-12)) / (about @ about or 1.0))
    power = min(max(power, 0.0), 1.0)
    return math.sqrt(float(np.mean(variances * np.exp(power * wider)))), power


def _of_windows(quantity: Quantity, pairs: Sequence[Pairs]) -> dict[str, float]:
    """What soft runs and their windows say."""
    slope, error, slope_std = between_scenes(
        [of.slope for of in pairs], [of.slope_variance for of in pairs]
    )
    if quantity.signed or slope < NORMAL_QUANTILE * error:  # it would add more than it removes
        slope = slope_std = 0.0
    slope = min(slope, 1.0)  # a window repeats its bed, it does not exaggerate it
    logs = [
        math.log(of.about(slope) / of.variance) - _log_bias(of.windows) + _log_bias(of.stretches)
        for of in pairs
    ]
    degrees = [(len(of.windows) - 1, len(of.stretches) - 1) for of in pairs]
    return {"slope": slope, "slope_std": slope_std, **_ratio_of_variances(logs, degrees)}


def _soft(runs: Sequence[QuantityOfRun]) -> list[QuantityOfRun]:
    return [run for run in runs if is_soft(run.run)]


def _of_whole_runs(scenes: Sequence[Sequence[QuantityOfRun]]) -> dict[str, float] | None:
    """What runs at both moduli say, which know nothing of each other's noise; None if too few."""
    pairs = [
        (stiff, soft)
        for runs in scenes
        if (stiff := [run for run in runs if run.run.fidelity.youngs_modulus_scale == 1.0])
        and (soft := _soft(runs))
    ]
    if len(pairs) < FEWEST_SCENES:
        return None
    logs = [
        math.log(mean_attribute(stiff, "variance") / mean_attribute(soft, "variance"))
        for stiff, soft in pairs
    ]
    degrees = [[sum(len(run.blocks) - 1 for run in runs) for runs in pair] for pair in pairs]
    return {"slope": 0.0, "slope_std": 0.0, **_ratio_of_variances(logs, degrees)}


def _ratio_of_variances(
    logs: Sequence[float], degrees: Sequence[Sequence[int]]
) -> dict[str, float]:
    """A ratio of variances, and degrees of freedom of its scatter from scene to scene.

    The scatter is that of the logarithms of the measured ratios beyond chance, of which the
    logarithm of a variance with so many degrees of freedom has the trigamma function of half.
    """
    by_chance = polygamma(1, np.array(degrees) / 2).sum(axis=1).mean()
    return {
        "variance_ratio": math.exp(float(np.mean(logs))),
        "degrees": _degrees(float(np.var(logs, ddof=1) - by_chance)),
    }


def _log_bias(values: Floats) -> float:
    """Of the logarithm of the variance of N normal values, whose mean is estimated, too."""
    half = (len(values) - 1) / 2
    return float(digamma(half) - math.log(half))


def _correlation(scenes: Sequence[Sequence[QuantityOfRun]]) -> float:
    """Mean correlation of neighbouring blocks; that of a quantity of which nothing is known."""
    series = [run.blocks for runs in scenes for run in runs if run.variance]
    if not series:
        return UNKNOWN.correlation
    of_runs = [neighbour_correlation(blocks) for blocks in series]
    return float(np.average(of_runs, weights=[len(blocks) for blocks in series]))


def _degrees(excess: float) -> float:
    """Degrees of freedom of a variance whose logarithm has this variance."""
    if polygamma(1, _MOST_DEGREES / 2) >= excess:
        return _MOST_DEGREES
    if polygamma(1, _FEWEST_DEGREES / 2) <= excess:
        return _FEWEST_DEGREES
    between = _FEWEST_DEGREES, _MOST_DEGREES
    return float(brentq(lambda degrees: polygamma(1, degrees / 2) - excess, *between))


def _between_packings(measured: Sequence[Sequence[QuantityOfRun]]) -> float:
    """Relative standard deviation of a mean between packings beyond that along the path.

    The variance is the mean of its distribution above zero, where the estimate is normal: one that
    is zero or below within its error is no proof of packings that do not differ.
    """
    squares = square_error = degrees = 0.0
    for runs in measured:
        groups = defaultdict[object, list[QuantityOfRun]](list)
        for run in runs:
            fidelity = run.run.fidelity
            groups[fidelity.youngs_modulus_scale, fidelity.timestep_fraction].append(run)
        for group in groups.values():
            values, free = np.array([run.value for run in group]), len(group) - 1
            along = mean_attribute(group, "variance_of_mean")
            if free and along < _LARGEST_VARIANCE:
                excess = float((values / values.mean()).var(ddof=1)) - along
                squares += excess * free
                square_error += 2.0 * (along + max(excess, 0.0)) ** 2 * free
                degrees += free
    if not degrees:
        return 0.0
    error = math.sqrt(square_error)
    return math.sqrt(truncnorm.mean(-squares / error, math.inf, squares, error) / degrees)
