"""A study with a search, and what the runs of a setting say."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from dragchain.arrays import Floats
from dragchain.quantities.registry import REPORTED
from dragchain.report.cases import ReportedCase, read_study_runs
from dragchain.report.removal import depth_spread, removal_of
from dragchain.run.workpiece import read_surface
from dragdeck.advice.advise import resolve
from dragdeck.cases.case import Case, digest
from dragdeck.engine.status import run_status
from dragdeck.errors import InputError
from dragdeck.project import Project, check_buildable
from dragdeck.scenes.process import PROCESS
from dragdeck.study.base import Json
from dragdeck.study.model import Study
from dragdeck.study.search import RECORD, Search, SearchedMeasure, SearchPoint
from dragdeck.study.yaml import read_study
from dragdeck.sweep.cases import settle_case, study_file
from dragdeck.sweep.design import Settings

_OWN: Mapping[str, tuple[str, str]] = {
    "removal_depth": ("mean depth of removal per hour", "µm/h"),
    "removal_variation": ("coefficient of variation of the depth of removal", ""),
    "minutes": ("time to the target depth on average", "min"),
    "minutes_slowest": ("time to the target depth on 95 % of the surface", "min"),
    "peak_pressure": ("95th percentile of the peak Hertz pressure", "Pa"),
}
"""Label and unit of the quantities that are not in the registry of the report."""

_LABELS = {**_OWN, **{quantity.name: (quantity.label, quantity.unit) for quantity in REPORTED}}


def label(measure: SearchedMeasure) -> str:
    """What is measured, with its unit."""
    (text, unit), part = _LABELS[measure.quantity], measure.heights_m
    heights = f" from {1e3 * part[0]:g} to {1e3 * part[1]:g} mm above the tip" if part else ""
    return text + heights + (f" ({unit})" if unit else "")


def quantity_of(measure: SearchedMeasure, run_dir: Path) -> float:
    """A quantity of one process run, NaN if it has no finite value."""
    case, name = ReportedCase((read_study_runs(run_dir),)), measure.quantity
    if name == "peak_pressure":
        touches = case.first.wear.touches if case.first.wear else None
        return touches.quantities["peak_pressure_pa"].p95 if touches else math.nan
    if name not in _OWN:
        standing = case.values.of(name)
        return standing.shown.value if standing else math.nan
    removal = removal_of(case)
    if removal is None:
        return math.nan
    if name in ("minutes", "minutes_slowest"):
        mean, slowest = removal.minutes.values()
        value = (mean if name == "minutes" else slowest).value
        return value if math.isfinite(value) else math.nan
    facets = removal.facets[removal.facets["immersed"]]
    if measure.heights_m:
        low, high = measure.heights_m
        height = read_surface(run_dir, case.first.process.case).centres[:, 2]
        facets = facets[((height >= low) & (height < high))[facets.index]]
    if facets.empty or not facets["depth_m_s"].any():
        return math.nan
    depth, variation = depth_spread(facets)
    return depth if name == "removal_depth" else variation[1]


# --- the study -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class SearchedStudy:
    """A study with a search."""

    project: Project
    name: str

    @cached_property
    def file(self) -> Path:
        """The study file."""
        return study_file(self.project.studies, self.name)

    @cached_property
    def study(self) -> Study:
        """The study with its search; its bounds are checked."""
        return self.project.searched(self.name)

    @property
    def search(self) -> Search:
        """Its search."""
        assert self.study.search is not None
        return self.study.search

    @property
    def measures(self) -> Sequence[SearchedMeasure]:
        """The objective, and the quantities of the limits."""
        return list(self.search.measures.values())

    @property
    def record(self) -> Path:
        """The file of the record."""
        return self.project.results(self.name) / RECORD

    def asked(self) -> str:
        """Hash of all that the choice of settings depends on, but not of how many there are."""
        plain = self.study.plain()
        search = {name: entry for name, entry in self.search.plain().items() if name != "runs"}
        run = PROCESS.run_id(self.case({}, self.study.sweep["seed"][0]))
        others = {name: plain.get(name) for name in ("sweep", "removal")}
        return digest({"run": run, "search": search, **others})

    @cached_property
    def _plain(self) -> Json:
        """The study of a single case."""
        return {**read_study(self.file), "sweep": {}, "search": None}

    def case(self, values: Settings, seed: int) -> Case:
        """The case of a setting with a packing."""
        return settle_case(self.file, self._plain, {**values, "seed": seed}, resolve=resolve)

    def folders(self, values: Settings) -> list[Path]:
        """The process runs of a setting, one per packing."""
        cases = [self.case(values, seed) for seed in self.study.sweep["seed"]]
        known = self.project.with_left(self.name, cases)
        return [self.project.run_folder(case, PROCESS) for case in known]

    def refusal(self, values: Settings) -> str:
        """Why the study's checks refuse a setting, in one line; empty if they accept it."""
        try:
            check_buildable(self.case(values, self.study.sweep["seed"][0]))
        except InputError as error:
            return " ".join(filter(None, (error.field, error.problem)))
        return ""

    def place(self, values: Settings) -> Floats:
        """A setting in fractions of its bounds."""
        return np.array(
            [
                (values[field] - low) / (high - low)
                for field, (low, high) in self.search.vary.items()
            ]
        )

    def values_at(self, place: Floats) -> dict[str, Any]:
        """The setting at a place, rounded to a thousandth of its range."""
        parts = zip(self.search.vary, place, strict=True)
        return {field: self.search.value(field, float(part)) for field, part in parts}


PointValues = Floats | str
"""Of a setting: its (P, Q) quantities in each packing; or why its runs were rejected."""

PointMeasure = Callable[[SearchedStudy, SearchPoint], PointValues]


def read_point(studied: SearchedStudy, point: SearchPoint) -> PointValues:
    """What the runs of a setting say.

    Raises
    ------
    InputError
        A run has not ended.
    """
    folders = studied.folders(point.values)
    for folder in folders:
        status = run_status(folder)
        if not status.final:
            raise InputError("a run of a search has not ended", file=folder, value=status.state,
                             remedy=f"./run search --config study={studied.name}")  # fmt: skip
        if status.state == "failed":
            return status.problem.partition("\n")[0]
    values = np.array(
        [[quantity_of(measure, folder) for measure in studied.measures] for folder in folders]
    )
    return values if np.isfinite(values).all() else "a quantity has no finite value"
