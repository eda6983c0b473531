"""``windows.json``: what runs of other scenes say of a quantity."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

from pydantic import AllowInfNan, BeforeValidator

import dragdeck
from dragdeck.documents import Document, Part


def _infinite(number: object) -> object:
    return math.inf if number is None else number


class Known(Part):
    """What runs of other scenes say of a quantity.

    Attributes
    ----------
    ratio_log, ratio_log_std : float
        Logarithm of the value at the physical modulus over that of the soft run: its mean, and its
        standard deviation from scene to scene; infinite if they say nothing.
    slope, slope_std : float
        How far a window is above the mean of all, relative to it, where the soft run beside it is
        above its mean by the same; and its standard deviation from scene to scene.
    variance_ratio, degrees : float
        Relative variance of windows about that slope over the variance of the soft run's stretches
        of their length, and how many windows' worth of evidence that is.
    packing_std : float
        Relative standard deviation of the mean from packing to packing.
    correlation : float
        Correlation of neighbouring blocks of one particle diameter.
    """

    ratio_log: float
    ratio_log_std: Annotated[float, AllowInfNan(True), BeforeValidator(_infinite)]
    slope: float
    slope_std: float
    variance_ratio: float
    degrees: float
    packing_std: float
    correlation: float


UNKNOWN = Known(
    ratio_log=0.0, ratio_log_std=math.inf, slope=0.0, slope_std=0.0, variance_ratio=0.0,
    degrees=0.0, packing_std=0.0, correlation=0.3,
)  # fmt: skip
"""Of a quantity of which nothing is known; few quantities have a larger correlation."""


class WindowsRecord(Document):
    """The content of ``windows.json``: measured in development scenes.

    Attributes
    ----------
    measured : str
        Date.
    source : str
    quantities : mapping
    """

    remedy = "install dragdeck again: it belongs to the package"

    measured: str
    source: str
    quantities: Mapping[str, Known]

    @classmethod
    def shipped(cls) -> "WindowsRecord":
        """That of the package."""
        return cls.read(Path(dragdeck.__file__).parent / "data" / "windows.json")
