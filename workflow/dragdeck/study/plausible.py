"""Which values are plausible: slips of a unit are named before anything is computed."""

import contextlib
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

from dragdeck.errors import InputError
from dragdeck.files import table_rows
from dragdeck.study.base import Json, flat

_FILE = Path(__file__).parents[1] / "data" / "plausible.csv"

_FACTORS = {
    "um": 1e-6, "mm": 1e-3, "cm": 1e-2, "mm/s": 1e-3, "m/min": 1 / 60, "ms": 1e-3, "min": 60.0,
    "GPa": 1e9, "MPa": 1e6, "kHz": 1e3, "1/min": 1 / 60, "g": 1e-3, "mg": 1e-6, "g/cm3": 1e3,
    "rad": 180 / math.pi, "rad/s": 30 / math.pi, "%": 0.01, "cm/s2": 0.01, "mm/s2": 1e-3,
    "kJ/m3": 1e3, "MJ/m3": 1e6, "mN": 1e-3, "mm3/(N m)": 1e-9,
}  # fmt: skip
"""What a unit that a number may be in by mistake is in the unit of the field."""


@dataclass(frozen=True)
class PlausibleRange:
    """A row of ``data/plausible.csv``.

    Attributes
    ----------
    field : str
        Pattern of dotted fields.
    slips : tuple of str
        Other units that such a number may be in.
    refused_below, warned_below, warned_above, refused_above : float
    """

    field: str
    slips: tuple[str, ...]
    refused_below: float
    warned_below: float
    warned_above: float
    refused_above: float

    def hint(self, value: float) -> str:
        """The unit in which the value would be plausible, if there is one."""
        for unit in self.slips:
            meant = value * _FACTORS[unit]
            if self.warned_below <= meant <= self.warned_above:
                return f"did you mean {value:g} {unit}? That is {meant:.6g}"
        return "check the value and its unit"


@cache
def _ranges() -> Sequence[PlausibleRange]:
    """Every number of a study, by its dotted field; the first row that fits counts.

    Assumptions: they span laboratory and industrial processes, and more.
    """
    rows = (row.values() for row in table_rows(_FILE))
    return [
        PlausibleRange(field, tuple(filter(None, slips.split("; "))), *map(float, limits))
        for field, *limits, slips in rows
    ]


@cache
def plausible_range(field: str) -> PlausibleRange | None:
    """The range of a dotted field; None if it has none."""
    return next((row for row in _ranges() if fnmatch(field, row.field)), None)


def implausible(data: Json) -> Iterator[tuple[InputError, bool]]:
    """Values of a study's plain data that are hardly meant, and whether they are refused.

    Of a list or table, the first stands for all, or the first that is refused.

    Parameters
    ----------
    data : mapping
        Numbers may be text, as YAML 1.1 reads ``5e6``; what is no number is passed by.
    """
    alike: dict[tuple[str, str], list[tuple[InputError, bool]]] = {}
    for field, value in _numbers(flat(data)):
        known = plausible_range(field)
        if known is None or known.warned_below <= value <= known.warned_above:
            continue
        refused = not known.refused_below <= value <= known.refused_above
        limit = (
            f"{known.refused_below:g} to {known.refused_above:g}; usual: "
            f"{known.warned_below:g} to {known.warned_above:g}"
        )
        problem, remedy = "is not plausible", known.hint(value)
        error = InputError(problem, field=field, value=value, limit=limit, remedy=remedy)
        of_list = known.field, re.sub(r"\.\d+(?=\.|$)", "", field)
        alike.setdefault(of_list, []).append((error, refused))
    for doubts in alike.values():
        (error, refused), *others = sorted(doubts, key=lambda doubt: not doubt[1])
        error.problem += f", nor {len(others)} more of its list" if others else ""
        yield error, refused


def _numbers(values: Json) -> Iterator[tuple[str, float]]:
    for field, value in values.items():
        if isinstance(value, list | tuple):
            yield from _numbers({f"{field}.{index}": item for index, item in enumerate(value)})
        elif isinstance(value, Mapping):
            yield from _numbers(flat(value, f"{field}."))
        elif isinstance(value, int | float | str) and not isinstance(value, bool):
            with contextlib.suppress(ValueError, OverflowError):
                yield field, float(value)
