"""The runs of a validation, and what several packings say together."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import JsonValue

from dragchain.documents import Document, Part
from dragchain.errors import SeriesError, TableError
from dragchain.run.case import Case, Fidelity, load_case
from dragchain.statistics.estimate import Estimate, Real, mean_of
from dragchain.tradeoff.compare import PARAMETERS, SILENT
from dragchain.tradeoff.measures import FILE

FEWEST = 2
"""Packings below which nothing is known of the differences between them."""


class Cost(Part):
    """Steps and processor time of a run."""

    steps: int
    cpu_time_s: float


class Measures(Document):
    """What a validation reads of a run's ``measures.json``; a failed run has no `arc_m`.

    Attributes
    ----------
    numbers : mapping
        Dimensionless numbers of the scene.
    arc_m : float
        Counted path.
    single : mapping
        Quantities of the bed, ``bed_height`` among them.
    """

    made_by = "dragchain step measure"

    inputs: Mapping[str, JsonValue]
    fidelity: Fidelity
    numbers: Mapping[str, float] = {}
    complete: bool
    cost: Cost
    versions: Mapping[str, str]
    started: str
    arc_m: float = math.nan
    single: Mapping[str, Real] = {}

    @property
    def compared_inputs(self) -> dict[str, JsonValue]:
        """Inputs by dotted name, without those that make no other setting."""
        silent = {*SILENT, "fidelity.name", *(f"fidelity.{name}" for name in PARAMETERS)}
        inputs = {**self.inputs, **{f"fidelity.{name}": value for name, value in self.fidelity}}
        return {name: value for name, value in inputs.items() if name not in silent}

    def changed_from(self, other: Measures) -> dict[str, JsonValue]:
        """Inputs, by dotted name, that differ from another run's, with this run's values."""
        own, others = self.compared_inputs, other.compared_inputs
        names = sorted({*own, *others})
        return {name: own.get(name) for name in names if own.get(name) != others.get(name)}


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
    changed: Mapping[str, JsonValue]

    @property
    def parameters(self) -> tuple[float, float, float]:
        """Modulus scale, time step over the Rayleigh time, and speed factor."""
        own = self.measures.fidelity
        return own.youngs_modulus_scale, own.timestep_fraction, own.speed_factor

    @property
    def seed(self) -> int:
        """Seed of its bed."""
        seed = self.measures.inputs["seed"]
        assert isinstance(seed, int)
        return seed

    @property
    def setting(self) -> tuple[object, ...]:
        """What runs that differ in their bed alone have in common."""
        return (*self.parameters, json.dumps(self.changed, sort_keys=True))


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
        Point(folder, load_case(folder), own, own.changed_from(standard))
        for folder, own in measures.items()
        if own.complete
    )
    packings = [first, *(point for point in points if point.setting == first.setting)]
    if len(packings) < FEWEST:
        raise TableError(
            f"{len(packings)} complete run at the reference's settings: the differences between "
            f"packings need {FEWEST} at least; give the plan's reference more seeds"
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
    if len(values) < FEWEST:
        raise SeriesError(f"an interval over packings needs {FEWEST} of them, not {len(values)}")
    with np.errstate(divide="ignore", invalid="ignore"):
        numbers = np.log(values) if ratio else np.asarray(values, dtype=np.float64)
    if not np.isfinite(numbers).all():
        return Estimate(math.nan, math.nan, math.nan)
    mean = mean_of(numbers)
    return Estimate(*(math.exp(edge) for edge in vars(mean).values())) if ratio else mean
