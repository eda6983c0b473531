"""The document ``extrapolated.json``: quantities of a run, and at the physical modulus."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from dragchain.statistics.estimate import Estimate
from dragdeck.documents import Document, Part

EXTRAPOLATED = Path("tables") / "extrapolated.json"


class ExtrapolatedQuantity(Part):
    """A quantity of a run, and its value at the physical modulus where windows give it.

    Attributes
    ----------
    name, label, unit : str
    measured : Estimate
        Value of the run as it was simulated.
    value : Estimate or None
        At the physical Young's modulus, None if neither windows nor the run itself give it.
    """

    name: str
    label: str
    unit: str
    measured: Estimate
    value: Estimate | None = None


class Need(NamedTuple):
    """How many windows, and else packings of all windows, bring a quantity to its tolerance."""

    windows: int
    packings: int


class Reached(Part):
    """What a run was asked for, and what it and its windows reached.

    Attributes
    ----------
    tolerance : float
        Relative half-width of the 95 % interval at which no further window is run.
    asked : tuple of str
        Quantities to which it applies, by name.
    reached : bool
        Whether all of them are inside the tolerance.
    needed : Need
        Windows and packings that are expected to do.
    runs : tuple of str
        Windows that enter; none if the run itself has the physical modulus.
    refused : mapping
        Reason by window, of those that do not enter.
    """

    tolerance: float
    asked: tuple[str, ...]
    reached: bool
    needed: Need
    runs: tuple[str, ...] = ()
    refused: Mapping[str, str] = {}


class LoadMap(Part):
    """Mean normal load on the workpiece by depth and azimuth; 4 depths, 12 azimuths each.

    Attributes
    ----------
    soft : tuple of float
        Of the run with reduced moduli, N.
    value, std : tuple of float
        At the physical modulus, N, and its standard deviation.
    soft_error, error : float
        Expected relative L1 error (sum of the absolute errors over the total load): of the soft
        run's map, and of the corrected one.
    """

    soft: tuple[float, ...]
    value: tuple[float, ...]
    std: tuple[float, ...]
    soft_error: float
    error: float

    @property
    def said(self) -> str:
        """How far both maps are expected to be off, in a sentence."""
        soft, corrected = 100 * self.soft_error, 100 * self.error
        return (
            f"The load map of the run is off by about {soft:.0f} % of the load at the physical "
            f"Young's modulus, the corrected one in {EXTRAPOLATED.name} by about {corrected:.0f} % "
            "(sum of the absolute errors of 48 patches, over the total load)."
        )


class Extrapolated(Document):
    """The content of ``extrapolated.json``.

    Attributes
    ----------
    tolerance : Reached or None
        Of a run that was asked for one.
    load_map : LoadMap or None
        Of a run with windows.
    """

    remedy = "make it with: ./run dragchain step extrapolate"

    quantities: tuple[ExtrapolatedQuantity, ...]
    tolerance: Reached | None = None
    load_map: LoadMap | None = None

    @property
    def said(self) -> str:
        """What was asked and reached, in a sentence; empty if nothing was asked."""
        reached = self.tolerance
        if reached is None:
            return ""
        known = {quantity.name: quantity.label for quantity in self.quantities}
        labels = [f"the {known.get(name, name)}" for name in reached.asked]
        what = " and ".join(filter(None, (", ".join(labels[:-1]), labels[-1])))
        asked = f"{what} to within {100 * reached.tolerance:.3g} %"
        who, verb = "The run at the physical Young's modulus", ("gives", "does not give")
        if reached.runs:
            who = f"{len(reached.runs)} windows at the physical Young's modulus"
            verb = ("give", "do not give")
        if reached.reached:
            return f"{who} {verb[0]} {asked}."
        windows, packings = reached.needed
        more = f"{windows} windows" if packings == 1 and reached.runs else f"{packings} seeds"
        return f"{who} {verb[1]} {asked}: about {more} would."

    def of(self, name: str) -> ExtrapolatedQuantity | None:
        """A quantity by its name, None if it was not measured."""
        return next((quantity for quantity in self.quantities if quantity.name == name), None)
