"""Quantities of a run, and at the physical Young's modulus: ``extrapolated.json``."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from dragchain.documents import Document, Part
from dragchain.statistics.estimate import Estimate

FILE = Path("tables") / "extrapolated.json"


class ExtrapolatedQuantity(Part):
    """A quantity of a run, and its value at the physical modulus where windows give it.

    Attributes
    ----------
    name, label, unit : str
    measured : float
        Uncorrected value of the run.
    value, ci95_low, ci95_high : float or None
        At the physical Young's modulus, None without windows.
    """

    name: str
    label: str
    unit: str
    measured: float
    value: float | None = None
    ci95_low: float | None = None
    ci95_high: float | None = None

    @property
    def estimate(self) -> Estimate | None:
        """The value at the physical modulus with its interval."""
        if self.value is None or self.ci95_low is None or self.ci95_high is None:
            return None
        return Estimate(self.value, self.ci95_low, self.ci95_high)


class Need(NamedTuple):
    """How many windows, and else packings of all windows, bring a quantity to its tolerance."""

    windows: int
    packings: int


class WindowsOfRun(Part):
    """What the windows of a run were asked for, and what they reached.

    Attributes
    ----------
    tolerance : float
        Relative half-width of the 95 % interval at which no further window is run.
    asked : tuple of str
        Quantities to which it applies, in words.
    reached : bool
        Whether all of them are inside the tolerance.
    runs : tuple of str
        Windows that enter.
    refused : mapping
        Reason by window, of those that do not enter.
    needed : Need
        Windows and packings that are expected to do.
    """

    tolerance: float
    asked: tuple[str, ...]
    reached: bool
    runs: tuple[str, ...]
    refused: Mapping[str, str]
    needed: Need

    @property
    def said(self) -> str:
        """What was asked and reached, in a sentence."""
        percent, *rest = f"{100 * self.tolerance:.3g} %", self.asked[-1]
        asked = " and the ".join(filter(None, (", the ".join(self.asked[:-1]), *rest)))
        told = f"{len(self.runs)} windows at the physical Young's modulus"
        if self.reached:
            return f"{told} give the {asked} to within {percent}."
        windows, packings = self.needed
        more = f"about {windows} windows" if packings == 1 else f"about {packings} seeds"
        return f"{told} do not give the {asked} to within {percent}: {more} would."


class Extrapolated(Document):
    """The content of ``extrapolated.json``.

    Attributes
    ----------
    windows : WindowsOfRun or None
        Where the values at the physical modulus are from.
    """

    made_by = "dragchain step extrapolate"

    quantities: tuple[ExtrapolatedQuantity, ...]
    windows: WindowsOfRun | None = None

    def of(self, name: str) -> ExtrapolatedQuantity | None:
        """A quantity by its name, None if it was not measured."""
        return next((one for one in self.quantities if one.name == name), None)
