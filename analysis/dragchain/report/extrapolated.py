"""Quantities of a run extrapolated to the physical Young's modulus: ``extrapolated.json``."""

from pathlib import Path

from dragchain.documents import Document, Part

FILE = Path("tables") / "extrapolated.json"


class ExtrapolatedQuantity(Part):
    """A quantity of a run with a reduced modulus, and its value at the physical modulus.

    Attributes
    ----------
    name, label, unit : str
    measured : float
        Uncorrected value of the run.
    value, ci95_low, ci95_high : float
        At the physical Young's modulus. The interval includes the scatter of one run, the
        uncertainty of rate and amplitude, and the model's own error.
    """

    name: str
    label: str
    unit: str
    measured: float
    value: float
    ci95_low: float
    ci95_high: float


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
        """A quantity by its name, None if it was not extrapolated."""
        return next((one for one in self.quantities if one.name == name), None)
