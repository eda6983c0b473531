"""The rounds of a search: read the runs of its settings, choose the next ones, confirm the best.

`write_round` is called before each round. What it chooses follows from the study, the record and
the runs alone, so that an interrupted search goes on as if it had not been interrupted.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from dragchain.arrays import Floats
from dragchain.quantities.registry import REPORTED
from dragchain.report.cases import ReportedCase, read_study_runs
from dragchain.report.removal import depth_spread, removal_of
from dragchain.run.workpiece import read_surface
from dragchain.search.proposals import Trials, best_place, propose, spread_places
from dragchain.statistics.estimate import (
    CONFIDENCE,
    Estimate,
    Verdict,
    student_quantile,
    t_interval,
)
from dragdeck.advice.advise import resolve
from dragdeck.cases.case import Case, digest
from dragdeck.engine.status import run_status
from dragdeck.errors import InputError
from dragdeck.project import Project, check_buildable
from dragdeck.scenes.process import PROCESS
from dragdeck.study.base import Json
from dragdeck.study.check import validate
from dragdeck.study.model import Study
from dragdeck.study.search import (
    RECORD,
    Objective,
    Purpose,
    Search,
    SearchedMeasure,
    SearchLimit,
    SearchPoint,
)
from dragdeck.study.yaml import read_study
from dragdeck.sweep.cases import settle_case, study_file
from dragdeck.sweep.design import Settings

_MOST_REFUSED = 20
"""Settings of a round that the study's checks may refuse one after the other."""

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
        self.project.cases(self.name)
        valid = validate(read_study(self.file), self.file, whole=True)
        if valid.search is None:
            raise InputError(
                "a required key is missing",
                file=self.file,
                field="search",
                remedy="say what may vary and what is wanted: docs/howto/sweep.md",
            )
        return valid

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
        return [self.project.run_folder(case, PROCESS) for case in cases]

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


PointValues = Floats | str | None
"""Of a setting: its (P, Q) quantities in each packing; why its runs were rejected; or not yet."""

PointMeasure = Callable[[SearchedStudy, SearchPoint], PointValues]


def read_point(studied: SearchedStudy, point: SearchPoint) -> PointValues:
    """What the runs of a setting say."""
    folders = studied.folders(point.values)
    states = [run_status(folder) for folder in folders]
    failed = next((state for state in states if state.state == "failed" and state.final), None)
    if failed:
        return failed.problem.partition("\n")[0]
    if any(state.state != "complete" for state in states):
        return None
    values = np.array(
        [[quantity_of(measure, folder) for measure in studied.measures] for folder in folders]
    )
    return values if np.isfinite(values).all() else "a quantity has no finite value"


# --- findings ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SearchFindings:
    """What the settings so far have shown.

    Attributes
    ----------
    studied : SearchedStudy
    points : sequence of SearchPoint
    packings : (N, P, Q) ndarray
        Quantities of each point in each packing; NaN where no run counts.
    """

    studied: SearchedStudy
    points: Sequence[SearchPoint]
    packings: Floats

    @cached_property
    def searched(self) -> Any:
        """Whether a point is no confirmation, (N,)."""
        return np.array([not point.confirms for point in self.points])

    @cached_property
    def means(self) -> Floats:
        """Means over the packings, (N, Q)."""
        return np.asarray(self.packings.mean(axis=1))

    @cached_property
    def _scale(self) -> Floats:
        """What the scatter of a quantity is in proportion to, (N, Q): its mean.

        That of a coefficient of variation is taken as the same at all points.
        """
        varied = [measure.quantity == "removal_variation" for measure in self.studied.measures]
        return np.where(varied, 1.0, np.abs(self.means))

    @cached_property
    def _residuals(self) -> Floats:
        """Of the packings about the mean of each point searched that counts, (N, P, Q)."""
        residuals = (self.packings - self.means[:, None]) / self._scale[:, None]
        return np.asarray(residuals[self.searched & np.isfinite(self.means).all(axis=1)])

    def _errors(self, residuals: Floats, degrees: int) -> Floats:
        pooled = np.sqrt((residuals**2).sum(axis=(0, 1)) / degrees / residuals.shape[1])
        return np.asarray(pooled * self._scale)

    @cached_property
    def errors(self) -> Floats:
        """Standard errors of the means, (N, Q), from the scatter pooled over points searched."""
        points, packings, _ = self._residuals.shape
        return self._errors(self._residuals, points * (packings - 1))

    @cached_property
    def noise(self) -> Floats:
        """The same without what a packing does to all points alike: of their differences."""
        residuals = self._residuals - self._residuals.mean(axis=0)
        return self._errors(residuals, self.degrees)

    @property
    def degrees(self) -> int:
        """Degrees of freedom of `noise`."""
        points, packings, _ = self._residuals.shape
        return int((points - 1) * (packings - 1))

    def estimate(self, point: int, measure: int) -> Estimate:
        """A quantity at a point with its interval."""
        points, packings, _ = self._residuals.shape
        error = self.errors[point, measure]
        return t_interval(self.means[point, measure], error, points * (packings - 1))

    def verdict(self, point: int) -> Sequence[Verdict]:
        """Whether the whole interval of a point meets each limit."""
        limits = enumerate(self.studied.search.limits, 1)
        return [_met(limit, self.estimate(point, measure)) for measure, limit in limits]

    @cached_property
    def as_good(self) -> list[int]:
        """Points at the fidelity of the search that may be the best ones.

        None of them contradicts a limit, nor is worse than the least mean that meets all limits by
        more than Bonferroni's one-sided t test over all comparisons allows: with 95 % confidence,
        the best setting of all that were run is among them (subset selection: Gupta 1965,
        Technometrics 7, 225). The places may depend on earlier values: the errors do not.
        """
        trials, search = self.trials, self.studied.search
        loss_of = loss(search.objective, self.means[:, 0])
        run = [k for k, point in enumerate(self.points)
               if np.isfinite(loss_of[k]) and "fidelity" not in point.values
               and "contradicted" not in self.verdict(k)]  # fmt: skip
        if len(run) < 2:
            return run
        inside = (self.means >= trials.low) & (self.means <= trials.high)
        meets = [k for k in run if inside[k, 1:].all()] or run
        best = min(meets, key=lambda k: loss_of[k])
        tests = (len(run) - 1) * (2 if search.objective.goal == "target" else 1)
        quantile = student_quantile(self.degrees, 1 - 2 * (1 - CONFIDENCE) / tests)
        reach = quantile * np.hypot(self.noise[:, 0], self.noise[best, 0])
        return [k for k in run if loss_of[k] - loss_of[best] <= reach[k]]

    @cached_property
    def trials(self) -> Trials:
        """Points searched as the model knows them: its first response is to be small."""
        search, values = self.studied.search, self.means[self.searched].copy()
        values[:, 0] = loss(search.objective, values[:, 0])
        ends = [(-math.inf, math.inf), *(limit.ends for limit in search.limits)]
        return Trials(
            np.array([self.studied.place(point.values) for point in self.of_search]),
            values,
            self.noise[self.searched],
            *np.array(ends).T,
        )

    @property
    def of_search(self) -> list[SearchPoint]:
        """The points that are no confirmation."""
        return list(compress(self.points, self.searched))


def _met(limit: SearchLimit, value: Estimate) -> Verdict:
    low, high = limit.ends
    if low <= value.ci95_low and value.ci95_high <= high:
        return "confirmed"
    return "contradicted" if value.ci95_high < low or value.ci95_low > high else "not confirmed"


def loss(objective: Objective, value: Any) -> Any:
    """What is to be small for the goal; its own inverse but for a target."""
    if objective.goal == "target":
        return abs(value - objective.value)
    return -value if objective.goal == "maximise" else value


def read_findings(
    studied: SearchedStudy, points: Sequence[SearchPoint], measure: PointMeasure
) -> SearchFindings | None:
    """Read all points; those whose runs were rejected say so then. None if a run has not ended."""
    rows, known = list[Floats](), list[SearchPoint]()
    shape = len(studied.study.sweep["seed"]), len(studied.measures)
    for point in points:
        measured = point.refused if point.refused else measure(studied, point)
        if measured is None:
            return None
        if isinstance(measured, str):
            ran = point.ran or not point.refused
            point = point.model_copy(update={"refused": measured, "ran": ran})
            measured = np.full(shape, np.nan)
        rows.append(measured)
        known.append(point)
    return SearchFindings(studied, known, np.array(rows).reshape(-1, *shape))


# --- the next round ------------------------------------------------------------------------------


def next_points(findings: SearchFindings) -> list[SearchPoint]:
    """The points of the next round; none if the search is complete."""
    studied, search, points = findings.studied, findings.studied.search, findings.of_search
    tried = [point for point in points if point.ran or not point.refused]
    number = 1 + max((point.round for point in findings.points), default=0)
    if not points:
        places = list(spread_places(search.start, len(search.vary), search.seed))
        return [_point(studied, place, number, "start") for place in places]
    if np.isfinite(findings.means[:, 0]).sum() < 2:
        raise _stuck(studied, "fewer than two settings can be compared", points[0].refused)
    if len(tried) >= search.runs:
        done = findings.points[-1].confirms
        return [] if done else _confirmation(findings, number)
    trials, chosen = findings.trials, list[SearchPoint]()
    wanted = min(search.at_once, search.runs - len(tried))
    while (
        sum(not chosen_point.refused for chosen_point in chosen) < wanted
        and len(chosen) < _MOST_REFUSED
    ):
        seed = search.seed + 1000 * len(findings.points) + len(chosen)
        point = _point(studied, propose(trials, seed), number, "model")
        if any(point.values == other.values for other in (*findings.points, *chosen)):
            place = np.random.default_rng(seed).random(len(search.vary))
            point = _point(studied, place, number, "model")
        place = studied.place(point.values)
        gone = bool(point.refused)
        trials = trials.joined(place, math.nan, math.nan) if gone else trials.believing(place)
        chosen.append(point)
    if all(chosen_point.refused for chosen_point in chosen):
        raise _stuck(studied, "one setting after the other is refused", chosen[-1].refused)
    return chosen


def _stuck(studied: SearchedStudy, problem: str, value: str = "") -> InputError:
    remedy = "other bounds; search/points.json has the reason of each setting"
    return InputError(
        problem, file=studied.file, field="search.vary", value=value or None, remedy=remedy
    )


def _point(studied: SearchedStudy, place: Floats, number: int, purpose: Purpose) -> SearchPoint:
    values = studied.values_at(place)
    return SearchPoint(
        values=values, round=number, purpose=purpose, refused=studied.refusal(values)
    )


def _confirmation(findings: SearchFindings, number: int) -> list[SearchPoint]:
    """The best setting by the model at the fidelity of the confirmation, and at the study's own."""
    studied = findings.studied
    gone = [refused_point.values for refused_point in findings.points if refused_point.refused]

    def accepted(place: Floats) -> bool:
        values = studied.values_at(place)
        return values not in gone and not studied.refusal(values)

    best = best_place(findings.trials, accepted)
    if best is None:
        raise _stuck(studied, "every setting that the model expects to be good is refused")
    soft = _point(studied, best, number, "confirmation")
    if studied.search.confirm == studied.study.fidelity:
        return [soft]
    values = {**soft.values, "fidelity": studied.search.confirm}
    full = soft.model_copy(update={"values": values, "refused": studied.refusal(values)})
    known = [known_point.values for known_point in findings.points]
    return [option for option in (soft, full) if option.values not in known]
