"""What one process run says of every quantity that a trade-off compares, along its path.

The counted path is cut into blocks of about one mean particle diameter; each
quantity has one value a block. A run's value is the mean over its blocks.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pydantic import JsonValue

from dragchain.arrays import Floats
from dragchain.documents import Document, Part
from dragchain.errors import TableError
from dragchain.network.write import write_chains
from dragchain.run.case import Case, Fidelity, load_case
from dragchain.run.completeness import AcceptanceCheck, RunRecord
from dragchain.statistics.estimate import finite
from dragchain.tables.bed import Packing
from dragchain.tables.write import write_tables
from dragchain.tradeoff.path_blocks import quantities_along

FILE = "measures.json"

TELLING_CHECKS = ("within_limits", "no_engine_error")
"""Acceptance checks that say more than others why a run failed, the most telling first."""


class RunCost(Part):
    """What a run cost; `steps_per_m` are those for a metre of path."""

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


class Asked(Part):
    """The tolerance that a run's settings were chosen for."""

    quantity: str
    tolerance: float
    held_to: float | None = None

    def same(self, other: Asked) -> bool:
        """Whether the same is asked, however well it can be held."""
        return (self.quantity, self.tolerance) == (other.quantity, other.tolerance)


class Measures(Document):
    """The content of ``measures.json``.

    Attributes
    ----------
    failure : sequence of AcceptanceCheck
        Why the run is not `complete`; it has none of what follows then.
    arc_m : float
        Counted path, m.
    block_m : float
        Length of a block, m.
    blocks : mapping
        Quantity to a sequence of B values, None where a block has none.
    single : mapping
        The quantities of the bed.
    force_histogram : sequence of int
        Counts of contacts on the workpiece between `FORCE_BINS`.
    """

    made_by = "dragchain step measure"

    study: str
    run: str
    bed: str | None
    inputs: Mapping[str, JsonValue]
    fidelity: Fidelity
    numbers: Mapping[str, float] = {}
    asked: Asked | None = None
    complete: bool
    cost: RunCost
    versions: Mapping[str, str]
    started: str
    failure: tuple[AcceptanceCheck, ...] = ()
    arc_m: float = 0.0
    block_m: float = 0.0
    blocks: Mapping[str, tuple[float | None, ...]] = {}
    single: Mapping[str, float] = {}
    force_histogram: tuple[int, ...] = ()

    @property
    def seed(self) -> int:
        """Seed of its bed."""
        seed = self.inputs["seed"]
        assert isinstance(seed, int)
        return seed

    @property
    def telling_failure(self) -> AcceptanceCheck | None:
        """The acceptance check that says most about why the run failed, None if it did not."""
        by_code = {check.code: check for check in self.failure}
        first = self.failure[0] if self.failure else None
        return next((by_code[code] for code in TELLING_CHECKS if code in by_code), first)

    def of_blocks(self, name: str) -> Floats:
        """The values of a quantity, (B,), NaN where a block has none; (0,) if none has one."""
        return np.array(self.blocks.get(name, ()), dtype=np.float64)


def write_measures(run_dir: Path, packing_table: Path) -> Measures:
    """Measure a run of a trade-off and write ``measures.json``.

    A complete run gets its tables and chains first; of a failed one only the
    failure is written.

    Parameters
    ----------
    run_dir : Path
        With the ``outcome.json`` of the run.
    packing_table : Path
        ``packing.json`` of the bed it started from.

    Raises
    ------
    TableError
        If the run has no outcome, or its raw outputs cannot be read.
    """
    file = run_dir / "outcome.json"
    if not file.is_file():
        raise TableError(f"{file} is not there: `dragdeck run --outcome` writes it")
    outcome, case = RunRecord.read(file), load_case(run_dir)
    measures = Measures(
        study=case.study,
        run=case.run,
        bed=case.upstream.get("filling"),
        inputs=case.inputs,
        fidelity=case.fidelity,
        numbers=case.numbers,
        asked=case.asked and Asked.model_validate(case.asked.model_dump()),
        complete=outcome.complete,
        cost=_cost(case, outcome),
        versions={**case.versions, "engine": outcome.engine_version},
        started=outcome.started,
    )
    if measures.complete:
        write_tables(run_dir)
        write_chains(run_dir)
        measures = measured(measures, run_dir, case, Packing.read(packing_table))
    else:
        measures = measures.model_copy(update={"failure": outcome.failed_checks})
    measures.write(run_dir / FILE)
    return measures


def measured(measures: Measures, run_dir: Path, case: Case, bed: Packing) -> Measures:
    """The measures of a complete run with its quantities, from its tables."""
    along = quantities_along(run_dir, case)
    return measures.model_copy(
        update={
            "arc_m": along.length_m,
            "block_m": along.block_m,
            "blocks": {name: _listed(values) for name, values in along.blocks.items()},
            "single": {"bed_height": bed.bed_height_m, "solid_fraction": bed.solid_fraction},
            "force_histogram": tuple(along.force_histogram.tolist()),
        }
    )


def _listed(values: Floats) -> tuple[float | None, ...]:
    return tuple(map(finite, values))


def _cost(case: Case, outcome: RunRecord) -> RunCost:
    """What a run cost; a run without its processor time counts its wall time on every rank."""
    assert case.motion is not None
    speed = case.motion.axis_speed_m_s
    return RunCost(
        steps=outcome.steps,
        wall_time_s=outcome.wall_time_s,
        cpu_time_s=outcome.processor_time_s,
        ranks=outcome.ranks,
        timestep_s=case.timestep_s,
        axis_speed_m_s=speed,
        steps_per_m=1.0 / (speed * case.timestep_s),
    )
