"""The documents of a run's quantities: ``quantities.json``, and ``extrapolated.json``.

The first has what the run itself gives; the second, what its windows make of it at the physical
Young's modulus.
"""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dragchain.quantities.blocks import Blocks, estimate_of
from dragchain.quantities.registry import MEASURED
from dragchain.statistics.estimate import Estimate
from dragdeck.documents import Document
from dragdeck.parts import Part
from dragdeck.records.case import FidelityOfRun, StudyOfRun
from dragdeck.records.run import AcceptanceCheck
from dragdeck.records.windows import UNKNOWN, Known

MEASURED_FILE = Path("tables") / "quantities.json"
EXTRAPOLATED = Path("tables") / "extrapolated.json"


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
    begin_m : float
        Path before the counted one, from the beginning of the drag at full speed, m.
    arc_m : float
        Counted path, m.
    block_m : float
        Length of a block, m.
    blocks : mapping
        Quantity to a sequence of B values, None where a block has none.
    weights : mapping
        Quantity to what each block counts, for example its samples, contacts or chains. All
        blocks of a quantity that is not named count the same.
    load_map : sequence of float
        Mean normal load by depth and azimuth, N, a depth after the other.
    """

    begin_m: float = 0.0
    arc_m: float = 0.0
    block_m: float = 0.0
    blocks: Mapping[str, tuple[float | None, ...]] = {}
    weights: Mapping[str, tuple[float, ...]] = {}
    load_map: tuple[float, ...] = ()

    def of_blocks(self, name: str) -> Blocks:
        """The blocks of a quantity; none if the run does not have it."""
        values = np.array(self.blocks.get(name, ()), dtype=np.float64)
        return Blocks(values, np.array(self.weights.get(name, np.ones(len(values)))))

    def values(self, start: int = 0, stop: int | None = None) -> dict[str, float]:
        """The quantities over some blocks, all if not given; without those that have no value."""
        values = {
            quantity.name: quantity.of_mean(
                self.of_blocks(quantity.name).part(slice(start, stop)).mean
            )
            for quantity in MEASURED
        }
        return {name: value for name, value in values.items() if math.isfinite(value)}

    def estimates(self, known: Mapping[str, Known]) -> dict[str, Estimate]:
        """The quantities of the run with their intervals, without those that have no value.

        Parameters
        ----------
        known : mapping
            Quantity to what runs of other scenes say of it, for those of which they do.
        """
        there = self.values()
        return {
            quantity.name: estimate_of(
                quantity, self.of_blocks(quantity.name), known.get(quantity.name, UNKNOWN)
            )
            for quantity in MEASURED
            if quantity.name in there
        }


class RunQuantities(PathQuantities, Document):
    """The content of ``quantities.json``.

    Attributes
    ----------
    values_of_run : mapping
        Quantity to its value with interval, in simulated time.
    failure : sequence of AcceptanceCheck
        Checks that did not pass; a failed run has no quantities.
    single : mapping
        The quantities of the packing.
    """

    remedy = "make it with: ./run dragchain quantities"

    study_name: str
    study: StudyOfRun
    run: str
    bed: str | None
    fidelity: FidelityOfRun
    numbers: Mapping[str, float] = {}
    complete: bool
    cost: RunCost
    versions: Mapping[str, str]
    started: str
    failure: tuple[AcceptanceCheck, ...] = ()
    single: Mapping[str, float] = {}
    values_of_run: Mapping[str, Estimate] = {}

    @property
    def why_failed(self) -> str:
        """The checks that did not pass, and what was seen."""
        return "; ".join(f"{check.name}: {check.seen}" for check in self.failure)


class Need(NamedTuple):
    """How many windows, and else packings of all windows, bring a quantity to its tolerance."""

    windows: int
    packings: int


class Reached(Part):
    """What a run was asked for, and what it and its windows reached.

    Attributes
    ----------
    tolerance : float
        Relative half-width of the 95 % interval that was asked for.
    packings : int
        Whose mean is to be inside it; in each, no further window is run at its root times that.
    asked : tuple of str
        Quantities to which it applies, by name.
    reached : bool
        Whether all of them are inside the tolerance.
    needed : Need
        Windows and packings that are expected to do.
    runs : tuple of str
        Windows that enter; none if the run itself has the physical modulus.
    whole : bool
        Whether that is a single run of the whole drag instead.
    refused : mapping
        Reason by window, of those that do not enter.
    """

    tolerance: float
    packings: int = 1
    asked: tuple[str, ...]
    reached: bool
    needed: Need
    runs: tuple[str, ...] = ()
    whole: bool = False
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
    values : mapping
        Quantity to its value at the physical Young's modulus, of those that windows give.
    tolerance : Reached or None
        Of a run that was asked for one.
    load_map : LoadMap or None
        Of a run with windows.
    """

    remedy = "make it with: ./run dragchain step extrapolate"

    values: Mapping[str, Estimate] = {}
    tolerance: Reached | None = None
    load_map: LoadMap | None = None

    @property
    def said(self) -> str:
        """What was asked and reached, in a sentence; empty if nothing was asked."""
        reached = self.tolerance
        if reached is None:
            return ""
        labels = [f"the {_LABELS.get(name, name)}" for name in reached.asked]
        what = " and ".join(filter(None, (", ".join(labels[:-1]), labels[-1])))
        of_each = reached.tolerance * math.sqrt(reached.packings)
        asked = f"{what} to within {100 * of_each:.3g} %"
        if reached.packings > 1:
            mean = f"{100 * reached.tolerance:.3g} % for the mean over {reached.packings} packings"
            asked = f"{asked} in this packing, which makes {mean}"
        who, verb = "The run at the physical Young's modulus", ("gives", "does not give")
        if reached.whole:
            who = "The whole drag at the physical Young's modulus, which began softer,"
        elif reached.runs:
            who = f"{len(reached.runs)} windows at the physical Young's modulus"
            verb = ("give", "do not give")
        if reached.reached:
            return f"{who} {verb[0]} {asked}."
        windows, packings = reached.needed
        more = f"{windows} windows" if packings == 1 and windows else f"{packings} seeds"
        return f"{who} {verb[1]} {asked}: about {more} would."


_LABELS = {quantity.name: quantity.label for quantity in MEASURED}
