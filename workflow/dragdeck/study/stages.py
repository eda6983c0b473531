"""Quantities in stages: one value after another, the last of which stays."""

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import takewhile
from typing import Any

import numpy as np
from numpy.typing import NDArray

StepCounts = NDArray[np.float64] | NDArray[np.int64]


def chain(
    name: str, start: int, stages: Iterable[tuple[int, float]], per_formula: int = 1
) -> dict[str, str]:
    """Formulas of equal-style variables by name; the last one has the value of each stage.

    Parameters
    ----------
    name : str
        Of the variables, which are numbered from 1.
    start : int
        The step at which the first stage begins.
    stages : iterable
        Number of steps of each stage, and its value.
    per_formula : int
        Stages that one formula adds: many would be too long a line, and few are slower.
    """
    formulas: dict[str, str] = {}
    end = start
    for number, (steps, value) in enumerate(stages):
        variable = f"{name}_{number // per_formula + 1}"
        before = formulas.get(variable, f"v_{name}_{number // per_formula}")
        later = f"{before}*(step<={end})+({value!r})*(step>{end})"
        formulas[variable] = later if number else f"{value!r}"
        end += steps
    return formulas


def in_steps(
    ends_s: Iterable[float], steps: int, timestep_s: float
) -> Iterator[tuple[int, float, float]]:
    """Stages in whole steps, which together take a given number of them.

    A quantity that adds up to what it should between the two times of each stage has no error of
    rounding at the end of any of them. A stage has a step at least, unless there are too few.

    Parameters
    ----------
    ends_s : iterable of float
        End of each stage; those that begin after the last step are left out, and the last one
        ends with it.
    steps : int
        Of all stages together.
    timestep_s : float

    Yields
    ------
    steps : int
        Of the stage.
    begin_s, end_s : float
        Between which it is, before rounding.
    """
    whole_s = steps * timestep_s
    ends = [*takewhile(lambda end: end < whole_s, ends_s), whole_s]
    begun, begin_s = 0, 0.0
    for left, end_s in zip(reversed(range(len(ends))), ends, strict=True):
        end = min(max(begun + 1, round(end_s / timestep_s)), steps - left)
        if end > begun:
            yield end - begun, begin_s, end_s
            begun, begin_s = end, end_s


def integral(stages: Sequence[tuple[float, Any]], time_s: float) -> Any:
    """What a rate adds up to from the beginning of the first stage to a time.

    Parameters
    ----------
    stages : sequence
        End of each stage, s, and its rate: a number or an array.
    time_s : float
    """
    *others, (_, last) = stages
    total, begun = 0.0, 0.0
    for end, rate in [*others, (math.inf, last)]:
        total += rate * max(0.0, min(time_s, end) - begun)
        begun = end
    return total


def stage_at(steps: StepCounts, lengths: Sequence[int]) -> NDArray[np.int64]:
    """Index of the stage of each step, (N,); a stage owns its last step.

    Parameters
    ----------
    steps : (N,) ndarray of int
        Counted from the start of the drag. Those before it belong to the first stage, those
        after it to the last one.
    lengths : sequence of int
        Number of steps of each stage.
    """
    stage = np.searchsorted(np.cumsum(lengths), steps, side="left")
    return np.minimum(stage, len(lengths) - 1)
