"""The runs of a validation, and what several packings say together."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import JsonValue

from dragchain.errors import SeriesError, TableError
from dragchain.quantities.document import MEASURED_FILE, RunQuantities
from dragchain.statistics.estimate import Estimate, mean_of
from dragchain.tables.run_folder import Run
from dragchain.tradeoff.compare import Setting, differing_inputs
from dragdeck.records.case import load_case

_FEWEST = 2
"""Packings below which nothing is known of the differences between them."""


@dataclass(frozen=True)
class MeasuredRun(Run):
    """A process run of a validation.

    Attributes
    ----------
    measures : RunQuantities
    changed : mapping
        Dotted names and values of the inputs that differ from the reference's.
    """

    measures: RunQuantities
    changed: Mapping[str, JsonValue]

    @property
    def settings(self) -> Setting:
        """Modulus scale, time step over the Rayleigh time, and speed factor."""
        return Setting.of(self.measures.fidelity)

    @property
    def seed(self) -> int:
        """Seed of its bed."""
        return self.measures.study.seed

    @property
    def but_for_bed(self) -> tuple[object, ...]:
        """What runs that differ in their bed alone have in common."""
        return (self.settings, json.dumps(self.changed, sort_keys=True))


@dataclass(frozen=True)
class RunsByBed:
    """All runs of a validation.

    Attributes
    ----------
    packings : list of MeasuredRun
        At the reference's settings, one per bed, by seed.
    others : list of MeasuredRun
        At other settings, in the order given.
    """

    packings: list[MeasuredRun]
    others: list[MeasuredRun]

    @property
    def all(self) -> list[MeasuredRun]:
        """The packings first."""
        return [*self.packings, *self.others]


def read_validation_runs(folders: Sequence[Path]) -> RunsByBed:
    """Read the runs of a validation; the first is the reference.

    Parameters
    ----------
    folders : sequence of Path
        Run folders, with their tables.

    Raises
    ------
    DocumentError
        A run has no ``quantities.json``.
    TableError
        Fewer than two packings are complete.
    """
    measures = {folder: RunQuantities.read(folder / MEASURED_FILE) for folder in folders}
    standard = measures[folders[0]]
    if not standard.complete:
        raise TableError(f"{folders[0]}: the reference run is not complete, so nothing is known")
    first, *runs = (
        MeasuredRun(folder, load_case(folder), measure, differing_inputs(measure, standard))
        for folder, measure in measures.items()
        if measure.complete
    )
    packings = [first, *(run for run in runs if run.but_for_bed == first.but_for_bed)]
    if len(packings) < _FEWEST:
        raise TableError(
            f"{len(packings)} complete run at the reference's settings: the differences between "
            f"packings need {_FEWEST} at least; give the plan's reference more seeds"
        )
    others = [run for run in runs if run.but_for_bed != first.but_for_bed]
    return RunsByBed(sorted(packings, key=lambda run: run.seed), others)


def packing_mean(values: Sequence[float], *, ratio: bool = False) -> Estimate:
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
