"""What a round of windows found: ``round-<number>.json``."""

from dragchain.documents import Document, Part
from dragchain.statistics.estimate import Estimate, Real


class WindowedQuantity(Part):
    """A quantity of a run, and its value at physical stiffness from the windows.

    Attributes
    ----------
    name, label, unit : str
    asked : bool
        Whether the tolerance applies to it.
    soft : float
        Value of the run with reduced moduli.
    value, ci95_low, ci95_high : float
        At physical stiffness; NaN before there are windows.
    windows : sequence of float
        One value per window.
    """

    name: str
    label: str
    unit: str
    asked: bool
    soft: float
    value: Real
    ci95_low: Real
    ci95_high: Real
    windows: tuple[float, ...] = ()

    @property
    def estimate(self) -> Estimate:
        """The value at physical stiffness with its interval."""
        return Estimate(self.value, self.ci95_low, self.ci95_high)

    @property
    def half_width(self) -> float:
        """Half-width of the interval, relative; NaN before there are windows."""
        return abs((self.ci95_high - self.ci95_low) / 2 / self.value)


class Refused(Part):
    """A window that does not enter, and why."""

    run: str
    why: str


class Round(Document):
    """The content of ``round-<number>.json``.

    Attributes
    ----------
    tolerance : float
    windows : sequence of str
        Runs that enter.
    refused : sequence of Refused
    wanted : int
        How many windows to run in all; as many as there were if this round is the last.
    reached : bool
        Whether every asked quantity is inside the tolerance.
    enough : int
        Expected number of windows that would do.
    quantities : sequence of WindowedQuantity
    """

    made_by = "dragchain step windows"

    tolerance: float
    windows: tuple[str, ...]
    refused: tuple[Refused, ...]
    wanted: int
    last: bool
    reached: bool
    enough: int
    quantities: tuple[WindowedQuantity, ...]
