"""The points of a stability map: a design for each regime, and the beds that some start from."""

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import get_args

from pydantic import TypeAdapter, ValidationError, model_validator

from dragdeck.parts import Part
from dragdeck.scenes.scene import Regime
from dragdeck.study.base import Number
from dragdeck.study.check import explained
from dragdeck.sweep.design import Design, Variation
from evidence.stability.scenes import BedKind

REGIMES: tuple[Regime, ...] = get_args(Regime)
"""What a point models: single impacts; a bed that settles; a bed or a stack at
rest under a load; a bed with a workpiece dragged through it."""

_STEP = "timestep_fraction"
"""Time step over the Rayleigh time of the smallest particle: what every condition is run at."""

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

PointSettings = Mapping[str, BedKind | Number]

_SETTINGS: TypeAdapter[PointSettings] = TypeAdapter(PointSettings)


class _Regime(Design[Variation]):
    """The conditions of a regime, each run at the step of the reference and at others."""

    vary: dict[str, list[Number]]

    @model_validator(mode="after")
    def _known(self) -> "_Regime":
        blocks = [*(point.values for block in self.points for point in block.points())]
        unknown = {key for values in blocks for key in values} - set(self.base)
        steps = [*self.reference.vary, *self.reference.others, *self.vary]
        unknown |= set(steps) - {_STEP}
        if unknown:
            raise ValueError(f"{', '.join(sorted(unknown))} is not among the base point's settings")
        return self

    def conditions(self) -> Iterator[tuple[str, PointSettings]]:
        """The settings of each condition, and the axis that they lie on."""
        yield "base", _SETTINGS.validate_python(self.base)
        for block in self.points:
            for axis, values in block.points():
                yield axis or "more", _SETTINGS.validate_python({**self.base, **values})

    def steps(self) -> list[tuple[float, bool]]:
        """The steps of each condition, and whether it is the reference."""
        (fine,) = self.reference.points()
        return [(fine.values[_STEP], True), *((step, False) for step in self.vary[_STEP])]


class MapPoint(Part):
    """One run of the map.

    Attributes
    ----------
    regime : str
        One of `REGIMES`.
    axis : str
        The setting that differs from the base point: ``base``, its name, or ``more``.
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
    settings: PointSettings
    fraction: float
    reference: bool

    @property
    def name(self) -> str:
        """Name of the run's folder."""
        return f"{self.axis}-{self.condition}-dt-{self.fraction:g}"

    @property
    def folder(self) -> str:
        """The run's folder in the results."""
        return f"{self.regime}/{self.name}"

    def number(self, name: str) -> float:
        """A setting that is a number."""
        return float(self.settings[name])

    def label(self, base: PointSettings) -> str:
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


def load_points(file: Path, regime: str) -> list[MapPoint]:
    """The points of a regime, each condition's reference first.

    Raises
    ------
    InputError
        The file is no such map, or lacks the regime.
    """
    design, known = _Regime.read(file, regime), dict[str, MapPoint]()
    try:
        for axis, settings in design.conditions():
            if axis != "base" and settings == design.base:
                continue
            condition = _digest({"regime": regime, **settings})
            shared = {"regime": regime, "axis": axis, "condition": condition, "settings": settings}
            for fraction, reference in design.steps():
                step = {"fraction": fraction, "reference": reference}
                point = MapPoint.model_validate({**shared, **step})
                known.setdefault(point.name, point)
    except ValidationError as error:
        raise explained(error, file) from None
    return list(known.values())


# --- the beds that columns and drags start from ----------------------------------------------


def bed_settings(points: Iterable[MapPoint]) -> dict[str, PointSettings]:
    """Every bed that a column or a drag among the points starts from, by its run id."""
    return {
        bed_name(point.settings): _bed(point.settings)
        for point in points
        if point.regime in ("column", "drag") and point.settings.get("packing", "bed") == "bed"
    }


def bed_name(settings: PointSettings) -> str:
    """Run id of the bed that a point with these settings starts from."""
    return f"bed-{_digest(_bed(settings))}"


def _bed(settings: PointSettings) -> dict[str, float]:
    """What a bed depends on; one of elastic particles would never rest, so it is damped."""
    numbers = {
        key: float(settings[key]) for key in ("youngs_modulus_pa", "restitution", "friction")
    }
    return {**numbers, "restitution": min(numbers["restitution"], _MOST_ELASTIC_BED)}
