"""The runs of a validation, and what several fills say together."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from dragchain.errors import SeriesError, TableError
from dragchain.run.case import Case, load_case
from dragchain.statistics.estimate import CONFIDENCE, Estimate
from dragchain.tradeoff.measures import FILE, Measures
from dragchain.tradeoff.runs import PARAMETERS, changed_settings

FEWEST = 2
"""Fills below which nothing is known of the differences between them."""

Parameters = tuple[float, ...]


@dataclass(frozen=True)
class Point:
    """A process run of a validation.

    Attributes
    ----------
    folder : Path
    case : Case
    measures : Measures
    changed : mapping
        Dotted names and values of the inputs that differ from the reference's.
    """

    folder: Path
    case: Case
    measures: Measures
    changed: Mapping[str, Any]

    @property
    def parameters(self) -> Parameters:
        """Modulus scale, time step over the Rayleigh time, and speed factor."""
        return tuple(float(getattr(self.measures.fidelity, name)) for name in PARAMETERS)

    @property
    def seed(self) -> int:
        """Seed of its bed."""
        return self.measures.seed

    @property
    def setting(self) -> tuple[object, ...]:
        """What runs that differ in their bed alone have in common."""
        return (*self.parameters, json.dumps(self.changed, sort_keys=True))


@dataclass(frozen=True)
class Points:
    """All runs of a validation.

    Attributes
    ----------
    fills : list of Point
        At the reference's settings, one a bed, by seed.
    others : list of Point
        At other settings, in the order given.
    """

    packings: list[Point]
    others: list[Point]

    @property
    def all(self) -> list[Point]:
        """The fills first."""
        return [*self.packings, *self.others]


def read_points(folders: Sequence[Path]) -> Points:
    """Read the runs of a validation; the first is the reference.

    Parameters
    ----------
    folders : sequence of Path
        Run folders, with their tables and ``measures.json``.

    Raises
    ------
    TableError
        A run has no measures, or fewer than two fills are complete.
    """
    measures = {folder: Measures.read(folder / FILE) for folder in folders if _measured(folder)}
    standard = measures[folders[0]]
    points = [
        Point(folder, load_case(folder), own, changed_settings(own, standard))
        for folder, own in measures.items()
        if own.complete
    ]
    first = next((point for point in points if point.folder == folders[0]), None)
    if first is None:
        raise TableError(f"{folders[0]}: the reference run is not complete, so nothing is known")
    packings = [point for point in points if point.setting == first.setting]
    if len(packings) < FEWEST:
        raise TableError(
            f"{len(packings)} complete run at the reference's settings: the differences between "
            f"fills need {FEWEST} at least; give the plan's reference more seeds"
        )
    others = [point for point in points if point.setting != first.setting]
    return Points(sorted(packings, key=lambda point: point.seed), others)


def _measured(folder: Path) -> bool:
    if (folder / FILE).is_file():
        return True
    raise TableError(f"{folder / FILE} is not there: `dragchain measure` writes it")


def over_packings(values: Sequence[float], *, ratio: bool = False) -> Estimate:
    """The mean of one number a fill, with the interval that the fills' differences give.

    Student's t with one degree of freedom less than there are fills: nothing is
    assumed of how well a single fill knows its own number.

    Parameters
    ----------
    values : sequence of N floats
    ratio : bool
        Ratios are averaged by their logarithms.

    Returns
    -------
    Estimate
        All NaN if a value is not finite, or no ratio above zero.

    Raises
    ------
    SeriesError
        If there are fewer than two fills.
    """
    if len(values) < FEWEST:
        raise SeriesError(f"an interval over fills needs {FEWEST} of them, not {len(values)}")
    with np.errstate(divide="ignore", invalid="ignore"):
        numbers = np.log(values) if ratio else np.asarray(values, dtype=np.float64)
    if not np.isfinite(numbers).all():
        return Estimate(math.nan, math.nan, math.nan)
    count = len(numbers)
    mean, error = float(numbers.mean()), float(numbers.std(ddof=1)) / math.sqrt(count)
    reach = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, count - 1)) * error
    found = (mean, mean - reach, mean + reach)
    return Estimate(*(math.exp(number) for number in found)) if ratio else Estimate(*found)
