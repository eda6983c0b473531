"""``windows.json``: what soft runs, their windows and whole runs of other scenes say."""

import math
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Annotated

from pydantic import AllowInfNan, BeforeValidator

import dragdeck
from dragdeck.documents import Document
from dragdeck.parts import Part

_NORMAL_QUANTILE = 1.96
"""Of 95 % of a normal distribution."""


def softness(stiffness_number: float) -> float:
    """Measure of how soft particles are; 1 at a stiffness number of 1000, 0 of rigid ones.

    Logarithms of ratios of quantities at two moduli are nearly proportional to the difference of
    this (docs/evidence/windows.md).
    """
    return math.sqrt(math.sqrt(1000.0 / stiffness_number))


def softening(stiffness_number: float, youngs_modulus_scale: float) -> float:
    """By how much `softness` rises if every Young's modulus is multiplied by a factor.

    The stiffness number is that at the physical modulus, and proportional to its power 2/3.
    """
    soft = stiffness_number * youngs_modulus_scale ** (2 / 3)
    return softness(soft) - softness(stiffness_number)


TYPICAL_FRONT = 10.0
"""Particles on the front of a workpiece, of which the record gives the scatter."""


def front_of(numbers: Mapping[str, float]) -> float:
    """How many particles fit side by side on the front of a workpiece.

    Soft runs of 30 scenes have 1.6 times as many contacts, with a standard deviation of 14 %.

    Parameters
    ----------
    numbers : mapping
        The dimensionless numbers of a case.
    """
    return (numbers["workpiece_to_particle"] + 1.0) * numbers["depth_to_particle"]


def _infinite(number: object) -> object:
    return math.inf if number is None else number


class Known(Part):
    """What runs of other scenes say of a quantity.

    Attributes
    ----------
    per_softness, per_softness_std : float
        Logarithm of the value of a stiff run over that of a soft one, per difference of their
        `softness`: its mean, and its standard deviation from scene to scene; infinite if that is
        too large to be of use.
    scenes : int
        Of which that is known.
    covered : float
        Share of the soft runs whose estimate, if their own scene is left out, includes the value at
        the physical modulus in its 95 % interval.
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
    block_std, front_power : float
        Relative standard deviation of such a block of a soft run if `TYPICAL_FRONT` particles fit
        on the front of the workpiece; its square falls with this power of their number.
    """

    per_softness: float
    per_softness_std: Annotated[float, AllowInfNan(True), BeforeValidator(_infinite)]
    scenes: int
    covered: float
    slope: float
    slope_std: float
    variance_ratio: float
    degrees: float
    packing_std: float
    correlation: float
    block_std: Annotated[float, AllowInfNan(True)]
    front_power: float

    def at_front(self, particles: float) -> "Known":
        """The same where so many particles fit on the front of the workpiece."""
        wider = (TYPICAL_FRONT / particles) ** (self.front_power / 2)
        return self.model_copy(update={"block_std": self.block_std * wider})

    def soft_half_width(self, blocks: float, difference: float) -> float:
        """Expected relative half-width of the soft run of so many blocks, times the ratio.

        ``difference`` is that of the `softness` of soft and stiff particles.
        """
        ratio = self.per_softness_std * difference
        return self._half_width(self.block_std**2 / blocks + ratio**2)

    def windows_half_width(self, windows: int, sample: float, blocks: float) -> float:
        """Expected relative half-width of windows that sample so many blocks each."""
        about = self.variance_ratio / (sample * windows) + self.slope**2 / blocks
        return self._half_width(about * self.block_std**2)

    def whole_half_width(self, blocks: float) -> float:
        """Expected relative half-width of the whole drag at the physical modulus."""
        return self._half_width((self.variance_ratio + self.slope**2) * self.block_std**2 / blocks)

    def _half_width(self, variance: float) -> float:
        return _NORMAL_QUANTILE * math.sqrt(variance + self.packing_std**2)


UNKNOWN = Known(
    per_softness=0.0, per_softness_std=math.inf, scenes=0, covered=0.0, slope=0.0, slope_std=0.0,
    variance_ratio=0.0, degrees=0.0, packing_std=0.0, correlation=0.3, block_std=math.inf,
    front_power=0.0,
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

    def widest(
        self, quantities: Iterable[str], front: float, half_width: Callable[[Known], float]
    ) -> float:
        """The largest half-width of quantities on a front; infinite if one is not known."""
        known = [self.quantities.get(name) for name in quantities]
        return max(half_width(of.at_front(front)) if of else math.inf for of in known)

    @classmethod
    def shipped(cls) -> "WindowsRecord":
        """That of the package."""
        return cls.read(Path(dragdeck.__file__).parent / "data" / "windows.json")
