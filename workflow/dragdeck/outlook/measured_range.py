"""Whether a scene lies within the range that was measured."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from dragdeck.cases.case import Case
from dragdeck.outlook.measured import measured_stiffness
from dragdeck.scenes.dimensionless import describe
from dragdeck.study.contact_law import compared_labels

WIDENING = 0.1
"""How far beyond the measured scenes a number of a scene still counts as measured."""

RANGE_LABELS = {
    "workpiece_to_particle": "ratio of workpiece to particle diameter",
    "depth_to_particle": "ratio of depth to particle diameter",
    "bowl_to_particle": "ratio of bowl to particle diameter",
    **compared_labels(),
    "superposed_speed": "ratio of additional surface speed to mean speed along the path",
    "bowl_froude_number": "Froude number of the bowl's rotation",
    "tilt_deg": "tilt of the workpiece (degrees)",
    "further_workpieces": "number of further workpieces",
}
"""The numbers of a scene that must lie within the measured range."""

LAW_NAMES = (*RANGE_LABELS, "stiffness_number", "inertial_number")
"""The same for the laws of reduced moduli."""


@dataclass(frozen=True)
class Outside:
    """A number of a scene that no measured scene comes near."""

    field: str
    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return (
            f"{self.field} {self.value:.3g} is outside the range {self.low:.3g} to {self.high:.3g}"
        )


def beyond(
    here: Mapping[str, float], scenes: Sequence[Mapping[str, float]], names: Iterable[str]
) -> Iterator[Outside]:
    """The numbers of a scene that no other scene comes near."""
    for name, value, low, high in _ranges(here, scenes, names):
        low, high = (1 - WIDENING) * low, (1 + WIDENING) * high
        if not low <= value <= high:
            yield Outside(RANGE_LABELS.get(name, name.replace("_", " ")), value, low, high)


def closeness(
    here: Mapping[str, float], scenes: Sequence[Mapping[str, float]], names: Iterable[str]
) -> float:
    """How much of what was measured holds in a scene.

    1 between the measured scenes; it falls in proportion to 0 at `WIDENING` beyond them, and is 0
    where `beyond` finds a number. So what follows from it has no jump where a scene leaves the
    range.
    """
    found = 1.0
    for _, value, low, high in _ranges(here, scenes, names):
        below = (low - value) / low if low else 0.0
        above = (value - high) / high if high else (math.inf if value > 0.0 else 0.0)
        if max(below, above) > 0.0:
            found = min(found, max(0.0, 1.0 - max(below, above) / WIDENING))
    return round(found, 3)


def _ranges(
    here: Mapping[str, float], scenes: Sequence[Mapping[str, float]], names: Iterable[str]
) -> Iterator[tuple[str, float, float, float]]:
    """Name, value here, and lowest and highest value elsewhere; an absent number is 0."""
    for name in names:
        values = [scene.get(name, 0.0) for scene in scenes]
        yield name, here.get(name, 0.0), min(values), max(values)


def outside_of_laws(case: Case) -> str:
    """What a process run outside the range of the laws of reduced moduli means; empty within."""
    scenes = [scene.numbers for scene in measured_stiffness().scenes]
    found = "; ".join(map(str, beyond(describe(case), scenes, LAW_NAMES)))
    scale = case.study.chosen_fidelity().youngs_modulus_scale
    if not found or scale == 1:
        return ""
    return (
        f"the scene is outside the measured range of reduced moduli ({found}): with E x {scale:g}, "
        "use the values that the report extrapolates to E x 1, whose intervals were not tested in "
        "such a scene, or run with E x 1"
    )


def range_note(case: Case) -> tuple[str, str]:
    """What ``check`` and ``explain`` say of a process: a heading and a text."""
    within = (
        "no reduced modulus"
        if case.study.chosen_fidelity().youngs_modulus_scale == 1
        else "the scene is within the measured range of reduced moduli"
    )
    return "measured range", outside_of_laws(case) or within
