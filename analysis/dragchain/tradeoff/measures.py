"""The document ``measures.json`` of a run of a plan: its cost, and its quantities or failure."""

import math
from collections.abc import Iterable, Mapping

from dragchain.quantities.along import PathQuantities
from dragdeck.documents import Document, Part
from dragdeck.records.case import FidelityOfRun, StudyOfRun
from dragdeck.records.run import AcceptanceCheck

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

    @property
    def why_failed(self) -> str:
        """The checks that did not pass, and what was seen."""
        return checks_in_words(self.failure)
