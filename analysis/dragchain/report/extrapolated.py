"""Quantities of a run, and at the physical Young's modulus: ``extrapolated.json``."""

from collections.abc import Mapping
from pathlib import Path

from dragchain.documents import Document, Part
from dragchain.statistics.estimate import Estimate

FILE = Path("tables") / "extrapolated.json"


class ExtrapolatedQuantity(Part):
    """A quantity of a run, and its value at the physical modulus where a law gives it.

    Attributes
    ----------
    name, label, unit : str
    measured : float
        Uncorrected value of the run.
    value, ci95_low, ci95_high : float or None
        At the physical Young's modulus, None if no law applies to the run. The interval includes
        the scatter of one run, the uncertainty of rate and amplitude, and the model's own error.
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
    enough : int
        Expected number of windows that would do.
    """

    tolerance: float
    asked: tuple[str, ...]
    reached: bool
    runs: tuple[str, ...]
    refused: Mapping[str, str]
    enough: int

    @property
    def said(self) -> str:
        """What was asked and reached, in a sentence."""
        percent, *rest = f"{100 * self.tolerance:.3g} %", self.asked[-1]
        asked = " and the ".join(filter(None, (", the ".join(self.asked[:-1]), *rest)))
        told = f"{len(self.runs)} windows at the physical Young's modulus"
        if self.reached:
            return f"{told} give the {asked} to within {percent}."
        return (
            f"{told} do not give the {asked} to within {percent}: about "
            f"{self.enough} would, on a longer path or over several seeds."
        )


class Extrapolated(Document):
    """The content of ``extrapolated.json``.

    Attributes
    ----------
    youngs_modulus_scale : float
        Multiplier of every Young's modulus in the run.
    source : str
        Source of the laws.
    windows : WindowsOfRun or None
        Where the values at the physical modulus are from, if not from laws.
    outside : tuple of str
        Dimensionless numbers of the scene outside the range of the record; the intervals are then
        too narrow by an unknown amount.
    """

    made_by = "dragchain step extrapolate"

    youngs_modulus_scale: float
    source: str
    outside: tuple[str, ...]
    quantities: tuple[ExtrapolatedQuantity, ...]
    windows: WindowsOfRun | None = None

    def of(self, name: str) -> ExtrapolatedQuantity | None:
        """A quantity by its name, None if it was not measured."""
        return next((one for one in self.quantities if one.name == name), None)
