"""The runs of a validation, and what several packings say together."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import JsonValue

from dragchain.errors import SeriesError, TableError
from dragchain.statistics.estimate import Estimate, mean_of
from dragchain.tradeoff.compare import Setting, changed_settings
from dragchain.tradeoff.measures import FILE, Measures
from dragdeck.records.case import CaseOfRun, load_case

_FEWEST = 2
"""Packings below which nothing is known of the differences between them."""


@dataclass(frozen=True)
class Point:
    """A process run of a validation.

    Attributes
    ----------
    folder : Path
    case : CaseOfRun
    measures : Measures
    changed : mapping
        Dotted names and values of the inputs that differ from the reference's.
    """

    folder: Path
    case: CaseOfRun
    measures: Measures
    changed: Mapping[str, JsonValue]

    @property
    def fidelity(self) -> Setting:
        """Modulus scale, time step over the Rayleigh time, and speed factor."""
        return Setting.of(self.measures.fidelity)

    @property
    def seed(self) -> int:
        """Seed of its bed."""
        return self.measures.seed

    @property
    def setting(self) -> tuple[object, ...]:
        """What runs that differ in their bed alone have in common."""
        return (self.fidelity, json.dumps(self.changed, sort_keys=True))


@dataclass(frozen=True)
class Points:
    """All runs of a validation.

    Attributes
    ----------
    packings : list of Point
        At the reference's settings, one per bed, by seed.
    others : list of Point
        At other settings, in the order given.
    """

    packings: list[Point]
    others: list[Point]

    @property
    def all(self) -> list[Point]:
        """The packings first."""
        return [*self.packings, *self.others]


def read_points(folders: Sequence[Path]) -> Points:
    """Read the runs of a validation; the first is the reference.

    Parameters
    ----------
    folders : sequence of Path
        Run folders, with their tables and ``measures.json``.

    Raises
    ------
    DocumentError
        A run has no measures.
    TableError
        Fewer than two packings are complete.
    """
    measures = {folder: Measures.read(folder / FILE) for folder in folders}
    standard = measures[folders[0]]
    if not standard.complete:
        raise TableError(f"{folders[0]}: the reference run is not complete, so nothing is known")
    first, *points = (
        Point(folder, load_case(folder), own, changed_settings(own, standard))
        for folder, own in measures.items()
        if own.complete
    )
    packings = [first, *(point for point in points if point.setting == first.setting)]
    if len(packings) < _FEWEST:
        raise TableError(
            f"{len(packings)} complete run at the reference's settings: the differences between "
            f"packings need {_FEWEST} at least; give the plan's reference more seeds"
        )
    others = [point for point in points if point.setting != first.setting]
    return Points(sorted(packings, key=lambda point: point.seed), others)


def over_packings(values: Sequence[float], *, ratio: bool = False) -> Estimate:
    """The mean of one number per packing, with the interval that their differences give.

    Student's t with one degree of freedom less than there are packings: nothing is
    assumed of how well a single packing knows its own number.

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
        If there are fewer than two packings.
    """
    if len(values) < _FEWEST:
        raise SeriesError(f"an interval over packings needs {_FEWEST} of them, not {len(values)}")
    with np.errstate(divide="ignore", invalid="ignore"):
        numbers = np.log(values) if ratio else np.asarray(values, dtype=np.float64)
    if not np.isfinite(numbers).all():
        return Estimate(math.nan, math.nan, math.nan)
    mean = mean_of(numbers)
    return mean.mapped(math.exp) if ratio else mean
