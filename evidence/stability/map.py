"""The points of a stability map, and the beds that some of them start from."""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Literal, get_args

from pydantic import Field, ValidationError, model_validator

from dragdeck.documents import Document, Part
from dragdeck.errors import InputError
from dragdeck.scenes.scene import Regime
from dragdeck.study.base import Model, Number
from dragdeck.study.check import explained
from dragdeck.study.yaml import read_yaml
from evidence.stability.column import Packing

REGIMES: tuple[Regime, ...] = get_args(Regime)
"""What a point models: single impacts; a bed that settles; a bed or a stack at
rest under a load; a bed with a workpiece dragged through it."""

_MOST_ELASTIC_BED = 0.86
"""Restitution of the beds of more elastic particles while they settle."""

_SHOWN: Mapping[str, str] = {
    "youngs_modulus_pa": "E {:g} Pa",
    "speed_m_s": "{:g} m/s",
    "restitution": "e {:g}",
    "friction": "friction {:g}",
    "size_ratio": "size ratio {:g}",
    "angle_deg": "{:g} degrees",
    "packing": "{}",
    "load_factor": "load {:g} g",
    "workpiece_speed_m_s": "workpiece {:g} m/s",
}

Value = Packing | Number
Settings = Mapping[str, Value]


class _Axis(Model):
    """Values that one setting takes, while others change with it."""

    values: list[Value]
    others: dict[str, Value] = Field(default_factory=dict, alias="with")


class _Plan(Model):
    """The points of a regime: ``map.yaml`` describes them."""

    base: dict[str, Value]
    fractions: list[Number]
    reference: Number
    axes: dict[str, _Axis] = Field(default_factory=dict)
    more: list[dict[str, Value]] = Field(default_factory=list)

    @model_validator(mode="after")
    def _known(self) -> "_Plan":
        changes = {*self.axes, *(key for axis in self.axes.values() for key in axis.others)}
        unknown = changes.union(*self.more) - set(self.base)
        if unknown:
            raise ValueError(f"{', '.join(sorted(unknown))} is not among the base point's settings")
        return self

    def conditions(self) -> Iterator[tuple[str, Settings]]:
        """The settings of each condition, and the axis that they lie on."""
        yield "base", self.base
        for name, axis in self.axes.items():
            for value in axis.values:
                yield name, {**self.base, name: value, **axis.others}
        for changes in self.more:
            yield "more", {**self.base, **changes}


class Point(Part):
    """One run of the map.

    Attributes
    ----------
    regime : str
        One of `REGIMES`.
    axis : str
        The setting that differs from the base point: ``base``, the name of an
        axis, or ``more``.
    condition : str
        Name of all but the step: 8 hex digits.
    settings : mapping
        All settings but the step.
    fraction : float
        Time step over the Rayleigh time of the smallest particle.
    reference : bool
        Whether it is the fine-step run that the others are compared with.
    """

    regime: Regime
    axis: str
    condition: str
    settings: Settings
    fraction: float
    reference: bool

    @property
    def name(self) -> str:
        """Name of the run's folder."""
        return f"{self.axis}-{self.condition}-dt-{self.fraction:g}"

    @property
    def packing(self) -> str:
        """What a column or a drag starts from."""
        return str(self.settings.get("packing", "bed"))

    def number(self, name: str) -> float:
        """A setting that is a number."""
        return float(self.settings[name])

    def label(self, base: Settings) -> str:
        """What sets the condition apart from the base point, in words."""
        shown = [
            words.format(self.settings[name])
            for name, words in _SHOWN.items()
            if name in self.settings
            and (self.settings[name] != base.get(name) or name == self.axis)
        ]
        return ", ".join(shown) or "base point"


def _digest(content: Mapping[str, str | float]) -> str:
    text = json.dumps(content, sort_keys=True, allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()[:8]


class PointOfMap(Point):
    """A point that was run: its folder in the results, and how it ended.

    A point is refused if its deck cannot be made, and failed if an acceptance check did not pass.
    """

    folder: str
    refused: str | None = None
    state: Literal["refused", "failed", "complete"]


class PointsFile(Document):
    """``points/<regime>.json``: the points of a regime."""

    remedy = "run `snakemake stability`"

    points: Sequence[PointOfMap]


class BedOfMap(Part):
    """A settled bed: its materials and its folder in the results."""

    settings: Settings
    folder: str


class BedsFile(Document):
    """``points/beds.json``: the beds that columns and drags start from."""

    beds: Sequence[BedOfMap]


def load_points(file: Path, regime: str) -> list[Point]:
    """The points of a regime, each condition's reference first.

    Raises
    ------
    InputError
        The file is no such map, or lacks the regime.
    """
    data = read_yaml(file)
    known = {name: name for name in REGIMES if name in data}
    if regime not in known:
        raise InputError(
            "the map has no such regime",
            file=file,
            value=regime,
            limit=f"one of: {', '.join(known)}",
        )
    try:
        plan = _Plan.model_validate(data[regime])
    except ValidationError as error:
        raise explained(error, file) from None
    return list(_points(plan, known[regime]))


def _points(plan: _Plan, regime: Regime) -> Iterator[Point]:
    fractions = [(plan.reference, True), *((fraction, False) for fraction in plan.fractions)]
    seen: set[str] = set()
    for axis, settings in plan.conditions():
        for fraction, reference in fractions:
            point = Point(
                regime=regime,
                axis=axis,
                condition=_digest({"regime": regime, **settings}),
                settings=settings,
                fraction=fraction,
                reference=reference,
            )
            if point.name not in seen and (axis == "base" or settings != plan.base):
                seen.add(point.name)
                yield point


def bed_names(map_file: Path) -> list[str]:
    """Run ids of the beds that columns and drags start from, in ``filling/``."""
    return list(bed_settings(map_file))


def bed_settings(map_file: Path) -> dict[str, Settings]:
    """Every bed that a point of the map starts from, by its run id."""
    known = read_yaml(map_file)
    points = [
        point
        for regime in ("column", "drag")
        if regime in known
        for point in load_points(map_file, regime)
        if point.packing == "bed"
    ]
    return {bed_name(point.settings): _own(point.settings) for point in points}


def bed_name(settings: Settings) -> str:
    """Run id of the bed that a point with these settings starts from."""
    return f"bed-{_digest(_own(settings))}"


def _own(settings: Settings) -> dict[str, float]:
    """What a bed depends on. One of elastic particles would never rest.

    It settles with damped ones.
    """
    own = {key: float(settings[key]) for key in ("youngs_modulus_pa", "restitution", "friction")}
    return {**own, "restitution": min(own["restitution"], _MOST_ELASTIC_BED)}
