"""A search for a setting of the machine: what may vary, what is wanted, and the points so far.

A search is like a `sweep` whose points are not known beforehand: `SearchRecord` keeps those that
were chosen, and each of them is a case of the study.
"""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, model_validator

from dragdeck.documents import Document
from dragdeck.parts import Part
from dragdeck.study.base import Distinct, Model, Name, Number, Whole
from dragdeck.study.quantities import QUANTITIES

RECORD = Path("search/points.json")
"""The record of a search in the results of its study."""

_OF_TARGET = ("minutes", "minutes_slowest")
_OF_REMOVAL = ("removal_depth", "removal_variation", *_OF_TARGET)
_OF_TOUCH = ("peak_pressure",)
_NEEDED = {
    "removal": _OF_REMOVAL,
    "removal.target_depth_m": _OF_TARGET,
    "outputs.first_touch_fraction": _OF_TOUCH,
    "motion.spin": ("torque_mean",),
}
"""Fields, and the quantities that no run has without them."""

_SIGNED = {row["name"] for row in QUANTITIES if row["negative"]}
"""Quantities that may be negative."""

if TYPE_CHECKING:
    SearchedQuantity = str
else:
    _REPORTED = tuple(row["name"] for row in QUANTITIES if row["reported"])
    SearchedQuantity = Literal[(*_OF_REMOVAL, *_OF_TOUCH, *_REPORTED)]


class SearchedMeasure(Model):
    """A quantity of a process, of the whole workpiece or of a part of its surface."""

    quantity: SearchedQuantity
    """`removal_depth` (mean over the immersed surface, um/h), `removal_variation` (its coefficient
    of variation), `minutes` (to `removal.target_depth_m` on average), `minutes_slowest` (on 95 % of
    the surface), `peak_pressure` (95th percentile over first touches, Pa), or a quantity of the
    report, in its unit"""
    heights_m: tuple[Number, Number] | None = None
    """for `removal_*`: two heights above the tip between which the surface counts, m; none: all of
    it"""

    @model_validator(mode="after")
    def _part(self) -> "SearchedMeasure":
        if self.heights_m and self.quantity not in ("removal_depth", "removal_variation"):
            raise ValueError(f"heights_m has no meaning for {self.quantity}: remove it")
        if self.heights_m and self.heights_m[0] >= self.heights_m[1]:
            raise ValueError("heights_m must increase: give the lower height first")
        return self

    @property
    def least(self) -> float:
        """Below which the quantity never is."""
        return -math.inf if self.quantity in _SIGNED else 0.0

    def lacks(self, given: Mapping[str, bool]) -> str:
        """The field without which no run has this quantity, empty if there is none.

        Parameters
        ----------
        given : mapping
            Whether a study has each of these fields, or what does the same.
        """
        needed = (field for field, quantities in _NEEDED.items() if self.quantity in quantities)
        return next((field for field in needed if not given[field]), "")


class Objective(SearchedMeasure):
    """What is to be as small or large as possible, or near a value."""

    goal: Literal["minimise", "maximise", "target"] = "minimise"
    """whether the quantity is minimised, maximised, or brought to `value`"""
    value: Number | None = None
    """target value"""

    @model_validator(mode="after")
    def _wanted(self) -> "Objective":
        if (self.value is None) == (self.goal == "target"):
            raise ValueError("value belongs to the goal target, and to no other")
        if self.value is not None and self.value < self.least:
            raise ValueError(f"{self.quantity} is never below 0, but value is {self.value:g}")
        return self


class SearchLimit(SearchedMeasure):
    """A limit on a quantity."""

    at_least: Number | None = None
    """smallest accepted value"""
    at_most: Number | None = None
    """largest accepted value"""

    @model_validator(mode="after")
    def _any(self) -> "SearchLimit":
        low, high = self.at_least, self.at_most
        if low is None and high is None:
            raise ValueError("a limit has at_least, at_most or both")
        if low is not None and high is not None and low >= high:
            raise ValueError(f"at_least {low:g} is not below at_most {high:g}")
        if high is not None and high <= self.least:
            raise ValueError(f"{self.quantity} is never below 0, but at_most is {high:g}")
        return self

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest accepted value; infinite where there is none."""
        low, high = self.at_least, self.at_most
        return -math.inf if low is None else low, math.inf if high is None else high


class Search(Model):
    """Which setting of the machine is best: Bayesian optimisation over some fields."""

    vary: dict[str, tuple[Number, Number]] = Field(min_length=1, max_length=8)
    """dotted field name: its lowest and highest value, in the unit of the field"""
    objective: Objective
    limits: Annotated[list[SearchLimit], Distinct] = Field(default_factory=list)
    """limits on quantities"""
    runs: Annotated[Whole, Field(ge=4, le=200)] = 20
    """number of settings tried before the confirmation"""
    start: Annotated[Whole, Field(ge=3, le=100)] = 6
    """settings of the first round, spread evenly"""
    at_once: Annotated[Whole, Field(ge=1, le=16)] = 1
    """settings per further round"""
    confirm: Name = "full"
    """fidelity of the confirmation of the best setting"""
    seed: Annotated[Whole, Field(ge=0, lt=2**31)] = 1
    """random seed of the search"""

    @model_validator(mode="after")
    def _order(self) -> "Search":
        for field, (low, high) in self.vary.items():
            if low >= high:
                raise ValueError(
                    f"the bounds of {field} must increase, but go from {low:g} to {high:g}"
                )
        if self.runs < self.start:
            raise ValueError(f"runs {self.runs} is fewer than the {self.start} of the first round")
        return self

    @property
    def measures(self) -> Mapping[str, SearchedMeasure]:
        """Objective and limits by their fields."""
        limits = {f"limits.{number}": limit for number, limit in enumerate(self.limits)}
        return {"objective": self.objective, **limits}

    def excluded(self) -> Iterator[tuple[str, str]]:
        """Each limit, by its field, that no setting can meet together with what else is wanted."""
        value, known = self.objective.value, dict[object, tuple[float, float]]()
        if value is not None:
            known[self.objective.quantity, self.objective.heights_m] = value, value
        for number, limit in enumerate(self.limits):
            which, (low, high) = (limit.quantity, limit.heights_m), limit.ends
            least, most = known.get(which, (-math.inf, math.inf))
            if most < low or high < least:
                problem = f"{limit.quantity} is to be {least:g} to {most:g} already"
                yield f"limits.{number}", problem
            known[which] = max(low, least), min(high, most)

    def value(self, field: str, part: float) -> float:
        """The value of a field at a part of its range, rounded to a thousandth of that."""
        low, high = self.vary[field]
        digits = 2 - math.floor(math.log10(high - low))
        value = min(max(round(low + part * (high - low), digits), low), high)
        return int(value) if value.is_integer() else value


Purpose = Literal["start", "model", "confirmation"]


class SearchPoint(Part):
    """A setting that was chosen.

    Attributes
    ----------
    values : mapping
        Dotted field: value.
    round : int
        In which it was chosen, from 1.
    purpose : Purpose
    refused : str
        Why no run of it counts; empty if there is no reason.
    ran : bool
        Whether that is known from its runs, and not from the checks of its study.
    """

    values: Mapping[str, Any]
    round: int
    purpose: Purpose
    refused: str = ""
    ran: bool = False

    @property
    def confirms(self) -> bool:
        """Whether it is a confirmation, which the model does not use."""
        return self.purpose == "confirmation"


class SearchRecord(Document):
    """The content of ``points.json``.

    Attributes
    ----------
    asked : str
        Hash of what the points were chosen for.
    points : tuple of SearchPoint
        In the order in which they were chosen.
    """

    remedy = "remove its folder, and search again: runs that are there are not repeated"

    asked: str
    points: tuple[SearchPoint, ...] = ()


class SearchRound(Document):
    """The content of ``round-N.json``.

    Attributes
    ----------
    runs : tuple of str
        The process runs of its settings.
    last : bool
        Whether the search was complete before it: it has no settings.
    """

    remedy = SearchRecord.remedy

    runs: tuple[str, ...]
    last: bool
