"""What one process run says of every quantity that a trade-off compares, along its path.

The counted path is cut into blocks of about one mean particle diameter; each
quantity has one value a block. A run's value is the mean over its blocks.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from pydantic import JsonValue

from dragchain.arrays import Floats
from dragdeck.documents import Document, Part
from dragdeck.files import table_rows
from dragdeck.records.case import FidelityOfRun
from dragdeck.records.run import AcceptanceCheck
from dragdeck.study.base import QUANTITIES_FILE


@dataclass(frozen=True)
class Measurand:
    """Something a trade-off compares.

    Attributes
    ----------
    name, label, unit : str
    short : str
        Head of a column, of the main quantities.
    squared : bool
        Its blocks hold squares: a run's value is the root of their mean.
    signed : bool
        It may be zero or change its sign: errors are counted in mean drags.
    """

    name: str
    label: str
    unit: str = ""
    short: str = ""
    squared: bool = False
    signed: bool = False

    def rooted(self, blocks: Floats) -> Floats:
        """Values of blocks, (B,), as a run's value is one."""
        return np.sqrt(blocks) if self.squared else blocks

    def of_blocks(self, blocks: Floats) -> float:
        """A run's value from the values of its blocks, (B,)."""
        mean = float(np.mean(blocks))
        return math.sqrt(mean) if self.squared else mean


QUANTITIES = tuple(
    Measurand(
        row["name"], row["label"], row["unit"], row["short"].replace("|", "\N{SOFT HYPHEN}"),
        row["kind"] == "squared", row["kind"] == "signed",
    )
    for row in table_rows(QUANTITIES_FILE)
    if row["kind"]
)  # fmt: skip
"""All but those of the packing, which are last, have a value for every block of the path."""

MAIN = tuple(quantity.name for quantity in QUANTITIES if quantity.short)
"""The quantities that figures and the tables of settings show."""


# --- measures of a run ---------------------------------------------------------------------------


FILE = "measures.json"


def checks_in_words(checks: Iterable[AcceptanceCheck]) -> str:
    """Acceptance checks and what was seen."""
    return "; ".join(f"{check.name}: {check.seen}" for check in checks)


class RunCost(Part):
    """The cost of a run.

    Attributes
    ----------
    steps : int
        Number of time steps.
    wall_time_s, cpu_time_s : float
        Wall-clock time, and CPU time of all ranks, s.
    ranks : int
        MPI ranks.
    timestep_s : float
        Time step, s.
    axis_speed_m_s : float
        Speed of the workpiece along its path, m/s.
    steps_per_m : float
        Time steps per metre of path.
    """

    steps: int
    wall_time_s: float
    cpu_time_s: float
    ranks: int
    timestep_s: float
    axis_speed_m_s: float
    steps_per_m: float

    @property
    def cpu_per_m(self) -> float:
        """Processor time for a metre of path, s/m; NaN for a run that failed at once."""
        return self.cpu_time_s / self.steps * self.steps_per_m if self.steps else math.nan


class PathQuantities(Part):
    """The quantities of a complete run along its counted path.

    Attributes
    ----------
    arc_m : float
        Counted path, m.
    block_m : float
        Length of a block, m.
    blocks : mapping
        Quantity to a sequence of B values, None where a block has none.
    load_map : sequence of float
        Mean normal load by depth and azimuth, N, a depth after the other.
    """

    arc_m: float = 0.0
    block_m: float = 0.0
    blocks: Mapping[str, tuple[float | None, ...]] = {}
    load_map: tuple[float, ...] = ()

    def of_blocks(self, name: str) -> Floats:
        """The values of a quantity, (B,), NaN where a block has none; (0,) if none has one."""
        return np.array(self.blocks.get(name, ()), dtype=np.float64)

    def values(self, start: int = 0, stop: int | None = None) -> dict[str, float]:
        """The quantities over some blocks, all if not given, that have a value in each."""
        found = {}
        for quantity in QUANTITIES:
            blocks = self.of_blocks(quantity.name)[start:stop]
            if blocks.size and np.isfinite(blocks).all():
                found[quantity.name] = quantity.of_blocks(blocks)
        return found


class Measures(PathQuantities, Document):
    """The content of ``measures.json``.

    Attributes
    ----------
    failure : sequence of AcceptanceCheck
        Checks that did not pass; a failed run has no quantities.
    single : mapping
        The quantities of the bed.
    """

    remedy = "make it with: ./run dragchain step measure"

    study: str
    run: str
    bed: str | None
    inputs: Mapping[str, JsonValue]
    fidelity: FidelityOfRun
    numbers: Mapping[str, float] = {}
    complete: bool
    cost: RunCost
    versions: Mapping[str, str]
    started: str
    failure: tuple[AcceptanceCheck, ...] = ()
    single: Mapping[str, float] = {}

    @property
    def seed(self) -> int:
        """Seed of its bed."""
        seed = self.inputs["seed"]
        assert isinstance(seed, int)
        return seed

    @property
    def why_failed(self) -> str:
        """The checks that did not pass, and what was seen."""
        return checks_in_words(self.failure)
