"""Quantities of a run extrapolated to the physical Young's modulus: ``extrapolated.json``."""

from pathlib import Path

from dragchain.documents import Document, Part

FILE = Path("tables") / "extrapolated.json"


class ExtrapolatedQuantity(Part):
    """A quantity of a run with a reduced modulus, and what it would be with the physical one.

    Attributes
    ----------
    name, label, unit : str
    measured : float
        In the run, as it is.
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
        Of the run.
    source : str
        Where the laws come from.
    outside : tuple of str
        Numbers of the scene that no scene of the record comes near: the intervals are then too
        narrow by an unknown amount.
    """

    made_by = "dragchain step extrapolate"

    youngs_modulus_scale: float
    source: str
    outside: tuple[str, ...]
    quantities: tuple[ExtrapolatedQuantity, ...]

    def of(self, name: str) -> ExtrapolatedQuantity | None:
        """A quantity by its name, None if it was not extrapolated."""
        return next((one for one in self.quantities if one.name == name), None)
