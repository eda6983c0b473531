"""A quantity in stages: one value after another, the last of which stays."""

import math
from collections.abc import Iterable, Sequence


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
        Steps of each stage, and its value.
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


def integral(stages: Sequence[tuple[float, float]], time_s: float) -> float:
    """What a rate adds up to from the beginning of the first stage to a time.

    Parameters
    ----------
    stages : sequence
        End of each stage, s, and its rate.
    time_s : float
    """
    *others, (_, last) = stages
    total, begun = 0.0, 0.0
    for end, rate in [*others, (math.inf, last)]:
        total += rate * max(0.0, min(time_s, end) - begun)
        begun = end
    return total
