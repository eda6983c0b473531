"""What a round of windows found: ``round-<number>.json``; and what is known beforehand."""

import math
from collections.abc import Mapping
from typing import Annotated

from pydantic import AllowInfNan, BeforeValidator

from dragchain.documents import Document, Part
from dragchain.report.extrapolated import LoadMap, Need
from dragchain.statistics.estimate import Estimate


def _infinite(number: object) -> object:
    return math.inf if number is None else number


class Known(Part):
    """What windows of other scenes say of a quantity before there are any.

    Attributes
    ----------
    ratio_log, ratio_log_std : float
        Logarithm of the value at the physical modulus over that of the soft run: its mean, and its
        standard deviation from scene to scene; infinite if they say nothing.
    variance_ratio, degrees : float
        Relative variance of windows over that of the soft run's stretches of their length, and how
        many windows' worth of evidence that is.
    packing_std : float
        Relative standard deviation of the mean from packing to packing.
    """

    ratio_log: float
    ratio_log_std: Annotated[float, AllowInfNan(True), BeforeValidator(_infinite)]
    variance_ratio: float
    degrees: float
    packing_std: float


class WindowsRecord(Document):
    """The content of ``windows.json``: measured in development scenes.

    Attributes
    ----------
    measured : str
        Date.
    source : str
    quantities : mapping
    """

    made_by = "benchmarks/windows.py"

    measured: str
    source: str
    quantities: Mapping[str, Known]


class WindowOfRun(Part):
    """A window of a run.

    Attributes
    ----------
    run : str
    refused : str
        Why it does not enter; empty if it does.
    arc_m : float
        Path of the sample, m.
    values : mapping
        Quantities of the sample.
    load_map : tuple of float
        As in `PathQuantities`.
    cpu_time_s : float
    stability_number : float or None
    """

    run: str
    refused: str = ""
    arc_m: float = 0.0
    values: Mapping[str, float] = {}
    load_map: tuple[float, ...] = ()
    cpu_time_s: float
    stability_number: float | None = None


class WindowedQuantity(Part):
    """A quantity of a run, and its value at physical stiffness from the windows.

    Attributes
    ----------
    name, label, unit : str
    asked : bool
        Whether the tolerance applies to it.
    soft : float
        Value of the run with reduced moduli.
    value : Estimate
        At physical stiffness; NaN if too few windows have it.
    """

    name: str
    label: str
    unit: str
    asked: bool
    soft: float
    value: Estimate

    @property
    def half_width(self) -> float:
        """Half-width of the interval, relative."""
        return abs((self.value.ci95_high - self.value.ci95_low) / 2 / self.value.value)


class Round(Document):
    """The content of ``round-<number>.json``.

    Attributes
    ----------
    tolerance : float
    asked : sequence of str
        Quantities to which it applies, whether the run has them or not.
    windows : sequence of WindowOfRun
        So far, in the order in which they were run.
    wanted : int
        How many windows to run in all; as many as there were if this round is the last.
    last : bool
    reached : bool
        Whether every asked quantity is inside the tolerance.
    needed : Need
        Windows of this run, and packings, that are expected to do.
    quantities : sequence of WindowedQuantity
    load_map : LoadMap or None
        At physical stiffness; None if fewer than two windows have one.
    """

    made_by = "dragchain step windows"

    tolerance: float
    asked: tuple[str, ...]
    windows: tuple[WindowOfRun, ...]
    wanted: int
    last: bool
    reached: bool
    needed: Need
    quantities: tuple[WindowedQuantity, ...]
    load_map: LoadMap | None = None

    @property
    def entering(self) -> list[WindowOfRun]:
        """The windows that were not refused."""
        return [one for one in self.windows if not one.refused]
