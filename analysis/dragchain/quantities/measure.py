"""Measure a process run: its cost, and every quantity with its interval."""

from pathlib import Path

from dragchain.errors import TableError
from dragchain.network.write import write_chains
from dragchain.quantities.along import quantities_along
from dragchain.quantities.document import MEASURED_FILE, RunCost, RunQuantities
from dragchain.run.case import upstream_folders
from dragchain.statistics.estimate import Estimate
from dragchain.tables.write import write_tables
from dragdeck.records.case import CaseOfRun, load_case
from dragdeck.records.packing import Packing
from dragdeck.records.run import RunRecord
from dragdeck.records.windows import WindowsRecord

OUTCOME = "outcome.json"
"""The record of a run whose failure is a finding."""


def write_quantities(run_dir: Path) -> RunQuantities:
    """Measure a process run and write ``tables/quantities.json``.

    A run whose failure is a finding (of a plan, or a window) has an ``outcome.json``. If it is
    complete it gets its tables and chains first; of a failed one only the failure is written.

    Parameters
    ----------
    run_dir : Path
        With the record of the run.

    Raises
    ------
    TableError
        If the run has no record, or its raw outputs cannot be read.
    """
    case, outcome = load_case(run_dir), _outcome(run_dir)
    measured: dict[str, object] = {"failure": outcome.failed_checks}
    if outcome.complete:
        if (run_dir / OUTCOME).is_file():
            write_tables(run_dir)
            write_chains(run_dir)
        bed = Packing.read(upstream_folders(run_dir, case)["filling"] / "tables" / "packing.json")
        along = quantities_along(run_dir, case)
        measured = {
            **dict(along),
            "single": {"bed_height": bed.bed_height_m, "solid_fraction": bed.solid_fraction},
            "values_of_run": along.estimates(WindowsRecord.shipped().quantities),
        }
    quantities = RunQuantities.model_validate(
        {
            **dict(case),
            "bed": case.upstream.get("filling"),
            "complete": outcome.complete,
            "cost": _cost(case, outcome),
            "versions": {**case.versions, "engine": outcome.engine_version},
            "started": outcome.started,
            **measured,
        }
    )
    quantities.write(run_dir / MEASURED_FILE)
    return quantities


def estimates_along(run_dir: Path, case: CaseOfRun) -> dict[str, Estimate]:
    """The quantities of a complete run with tables and chains, without writing them.

    Errors are those of `quantities_along`.
    """
    return quantities_along(run_dir, case).estimates(WindowsRecord.shipped().quantities)


def _outcome(run_dir: Path) -> RunRecord:
    """How the run ended: ``run.json``, or of a run whose failure is a finding ``outcome.json``."""
    for name in (OUTCOME, "run.json"):
        if (run_dir / name).is_file():
            return RunRecord.read(run_dir / name)
    raise TableError(
        f"{run_dir}: neither run.json nor outcome.json is there: run it with `./run dragdeck run`"
    )


def _cost(case: CaseOfRun, outcome: RunRecord) -> RunCost:
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
