"""Quantities of a run, and at the physical Young's modulus: ``extrapolated.json``."""

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


class Extrapolated(Document):
    """The content of ``extrapolated.json``.

    Attributes
    ----------
    youngs_modulus_scale : float
        Multiplier of every Young's modulus in the run.
    source : str
        Source of the laws.
    outside : tuple of str
        Dimensionless numbers of the scene outside the range of the record; the intervals are then
        too narrow by an unknown amount.
    """

    made_by = "dragchain step extrapolate"

    youngs_modulus_scale: float
    source: str
    outside: tuple[str, ...]
    quantities: tuple[ExtrapolatedQuantity, ...]

    def of(self, name: str) -> ExtrapolatedQuantity | None:
        """A quantity by its name, None if it was not measured."""
        return next((one for one in self.quantities if one.name == name), None)
