"""The rounds of a search: read the runs of its settings, choose the next ones, confirm the best.

`report.advance` is called for each round. What it chooses follows from the study, the record and
the runs alone, so that an interrupted search goes on as if it had not been interrupted.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import compress
from typing import Any

import numpy as np

from dragchain.arrays import Floats
from dragchain.search.proposals import Trials, best_place, propose, spread_places
from dragchain.search.studied import PointMeasure, SearchedStudy
from dragchain.statistics.estimate import (
    CONFIDENCE,
    Estimate,
    Verdict,
    student_quantile,
    t_interval,
)
from dragdeck.errors import InputError
from dragdeck.study.search import Objective, Purpose, SearchLimit, SearchPoint

_MOST_REFUSED = 20
"""Settings of a round that the study's checks may refuse one after the other."""


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
) -> SearchFindings:
    """Read all points; those whose runs were rejected say so then."""
    rows, known = list[Floats](), list[SearchPoint]()
    shape = len(studied.study.sweep["seed"]), len(studied.measures)
    for point in points:
        measured = point.refused if point.refused else measure(studied, point)
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
