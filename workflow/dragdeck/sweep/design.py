"""Designs of runs: which points are run.

Every campaign has one shape (`dragchain.report.campaign` has the rest of it): a design of runs,
a row of measures of each run, a judgement of the rows, and a report. This is the grammar of all
designs; a campaign whose runs need more, as seeds or a path, adds fields to `Variation` or
`Design`::

    base: {friction: 0.3, restitution: 0.8}         # at all points that do not set it
    reference: {vary: {timestep_fraction: [0.05]}}  # what the others are compared with
    points:
      - vary: {timestep_fraction: [0.2, 0.4]}       # every combination
        one_by_one: {friction: [0, 1]}              # at each of them, one at a time
        with: {restitution: 1}                      # at all of them

Fields are those of the study by their dotted names, or the settings of a scene that no study has.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Generic, NamedTuple, Self, TypeVar

from pydantic import Field, ValidationError

from dragdeck.errors import InputError, choices
from dragdeck.study.base import Model
from dragdeck.study.check import explained
from dragdeck.study.yaml import read_yaml

Settings = Mapping[str, Any]
"""Dotted name of a field to its value."""


MOST_POINTS = 10_000
"""Points of a design, over all its scenes and packings: more than anyone has run."""


def combinations(vary: Mapping[str, Sequence[Any]]) -> Iterator[Settings]:
    """Every combination of the values that fields take."""
    for values in itertools.product(*vary.values()):
        yield dict(zip(vary, values, strict=True))


class DesignPoint(NamedTuple):
    """A point of a design: what it sets, and the field that is varied alone there (or none)."""

    axis: str
    values: Settings


class Variation(Model):
    """Points that belong together: every combination of the values that vary."""

    vary: dict[str, list[Any]] = Field(default_factory=dict)
    """dotted field name: list of values; every combination is a design point"""
    one_by_one: dict[str, list[Any]] = Field(default_factory=dict)
    """dotted field name: list of values that are varied one at a time, at every combination of
    `vary`"""
    others: dict[str, Any] = Field(default_factory=dict, alias="with")
    """dotted field name: value at all these points"""

    @property
    def count(self) -> int:
        """Number of its points, without listing them."""
        alone = sum(map(len, self.one_by_one.values())) or 1
        return math.prod(map(len, self.vary.values())) * alone

    def points(self) -> Iterator[DesignPoint]:
        """The points, the last field of `vary` changing before the first."""
        alone = [
            (field, {field: value}) for field, values in self.one_by_one.items() for value in values
        ]
        for values in combinations(self.vary):
            for axis, fields in alone or [("", {})]:
                yield DesignPoint(axis, {**self.others, **values, **fields})


Block = TypeVar("Block", bound=Variation)


class Design(Model, Generic[Block]):
    """Points with what all of them share and what they are compared with."""

    base: dict[str, Any]
    """dotted field name: value at all points that do not set it"""
    reference: Block
    """reference settings, to which errors are relative; a single point"""
    points: list[Block] = Field(default_factory=list)

    @classmethod
    def read(cls, file: Path, name: str | None = None) -> Self:
        """Read a design, or the one of this name among several in a file.

        Raises
        ------
        InputError
            The file cannot be used; the message names field, value and limit.
        """
        data = read_yaml(file)
        if name is not None and name not in data:
            problem = "the file has no such design"
            raise InputError(problem, file=file, value=name, limit=choices(name, data))
        try:
            plan = cls.model_validate(data if name is None else data[name])
        except ValidationError as error:
            raise explained(error, file) from None
        check_number(sum(block.count for block in plan.points), file)
        if plan.reference.count != 1:
            raise InputError(
                "the reference must be a single point", file=file, field="reference.vary"
            )
        return plan

    def settings(self) -> Iterator[tuple[Block, dict[str, Any]]]:
        """What is set at each point, the reference first, with the block that it is of."""
        for block in (self.reference, *self.points):
            for _, values in block.points():
                yield block, {**self.base, **values}


def check_number(points: int, file: Path) -> None:
    """Refuse a design of more points than can be listed.

    Raises
    ------
    InputError
        It has more than `MOST_POINTS`.
    """
    if points > MOST_POINTS:
        problem, limit = f"the design has {points:,} points", f"at most {MOST_POINTS:,}"
        raise InputError(problem, file=file, field="points", limit=limit, remedy="vary less")
