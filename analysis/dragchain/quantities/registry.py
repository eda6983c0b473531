"""The registry of quantities, `dragdeck/study/quantities.csv`: a row is a quantity."""

import math
from dataclasses import dataclass

from dragdeck.study.quantities import QUANTITIES


@dataclass(frozen=True)
class Quantity:
    """A quantity of a process run, and how it depends on the settings.

    Attributes
    ----------
    name, label, unit : str
        The unit is empty for a plain number.
    short : str
        Head of a column, of the main quantities of a trade-off.
    kind : str
        ``squared``: its blocks hold squares, and a run's value is the root of their mean; ``odds``:
        they hold a fraction f, and a run's value is f / (1 - f); ``signed``: it may be zero or
        change its sign, and errors are counted in mean drags; ``packing``: it has one value a
        packing, and no blocks; else ``plain``.
    time : int
        Power of time in it. A workpiece that is f times as fast takes 1/f of the time.
    robust : bool
        Whether a reduced modulus and a faster workpiece change it so little that the run's value
        stands for the process where there is no correction: force and torque on the whole
        workpiece.
    radial : bool
        Whether it depends on the curvature of the path and on unequal walls beside it.
    coarse : str
        How it follows from runs with larger particles of diameter d: ``linear`` in d;
        ``inverse_square``, d^2 times it is linear; ``by_drag``, its product with the number of
        contacts over the drag is constant; empty if that is not known.
    """

    name: str
    label: str
    unit: str = ""
    short: str = ""
    kind: str = "plain"
    time: int = 0
    robust: bool = False
    radial: bool = False
    coarse: str = ""

    @property
    def squared(self) -> bool:
        """Whether its blocks hold squares."""
        return self.kind == "squared"

    @property
    def signed(self) -> bool:
        """Whether it may be zero or change its sign."""
        return self.kind == "signed"

    def of_mean(self, mean: float) -> float:
        """A run's value from the mean of its blocks, NaN where it would be infinite."""
        if self.squared:
            return math.sqrt(mean)
        if self.kind == "odds":
            return mean / (1.0 - mean) if mean < 1.0 else math.nan
        return mean


def _quantities(column: str) -> tuple[Quantity, ...]:
    """The quantities that have something in a column of the table, in its order."""
    return tuple(
        Quantity(
            row["name"], row["label"], row["unit"], row["short"].replace("|", "\N{SOFT HYPHEN}"),
            row["kind"], int(row["time"] or 0), row["robust"] == "yes",
            row["radial"] == "yes", row["coarse"],
        )
        for row in QUANTITIES
        if row[column]
    )  # fmt: skip


REPORTED = _quantities("reported")
"""What a report tells of a process run, in its order."""

MEASURED = _quantities("kind")
"""What is measured of a run. All but those of the packing, which are last, have a value for every
block of the path."""

MAIN = tuple(quantity.name for quantity in MEASURED if quantity.short)
"""The quantities that figures and the tables of settings show."""
