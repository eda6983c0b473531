"""The registry of quantities, `dragdeck/study/quantities.csv`: a row is a quantity."""

import math
from dataclasses import dataclass

import numpy as np

from dragchain.arrays import Floats
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
    squared : bool
        Its blocks hold squares: a run's value is the root of their mean.
    signed : bool
        It may be zero or change its sign: errors are counted in mean drags.
    time : int
        Power of time in it. A workpiece that is f times as fast takes 1/f of the time.
    robust : bool
        Whether a reduced modulus and a faster workpiece change it so little that the run's value
        stands for the process where there is no correction: force and torque on the whole
        workpiece.
    """

    name: str
    label: str
    unit: str = ""
    short: str = ""
    squared: bool = False
    signed: bool = False
    time: int = 0
    robust: bool = False

    def rooted(self, blocks: Floats) -> Floats:
        """Values of blocks, (B,), as a run's value is one."""
        return np.sqrt(blocks) if self.squared else blocks

    def of_blocks(self, blocks: Floats) -> float:
        """A run's value from the values of its blocks, (B,)."""
        mean = float(np.mean(blocks))
        return math.sqrt(mean) if self.squared else mean


def _quantities(column: str) -> tuple[Quantity, ...]:
    """The quantities that have something in a column of the table, in its order."""
    return tuple(
        Quantity(
            row["name"], row["label"], row["unit"], row["short"].replace("|", "\N{SOFT HYPHEN}"),
            row["kind"] == "squared", row["kind"] == "signed",
            int(row["time"] or 0), row["robust"] == "yes",
        )
        for row in QUANTITIES
        if row[column]
    )  # fmt: skip


REPORTED = _quantities("reported")
"""What a report tells of a process run, in its order."""

COMPARED = _quantities("kind")
"""What a trade-off compares. All but those of the packing, which are last, have a value for every
block of the path."""

MAIN = tuple(quantity.name for quantity in COMPARED if quantity.short)
"""The quantities that figures and the tables of settings show."""
