"""Measure a process run of a trade-off: its cost, and its quantities along the path."""

from pathlib import Path

from dragchain.errors import TableError
from dragchain.network.write import write_chains
from dragchain.quantities.along import quantities_along
from dragchain.tables.write import write_tables
from dragchain.tradeoff.measures import FILE, Measures, RunCost
from dragdeck.records.case import CaseOfRun, load_case
from dragdeck.records.packing import Packing
from dragdeck.records.run import RunRecord

# --- measures ------------------------------------------------------------------------------------


def read_outcome(run_dir: Path) -> RunRecord:
    """The ``outcome.json`` of a run.

    Raises
    ------
    TableError
        If the run has none.
    """
    file = run_dir / "outcome.json"
    if not file.is_file():
        raise TableError(f"{file} is missing: `./run dragdeck run --outcome` writes it")
    return RunRecord.read(file)


def make_tables(run_dir: Path) -> None:
    """Make the tables and chains that the quantities of a complete run come from."""
    write_tables(run_dir)
    write_chains(run_dir)


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
    outcome, case = read_outcome(run_dir), load_case(run_dir)
    found: dict[str, object] = {"failure": outcome.failed_checks}
    if outcome.complete:
        make_tables(run_dir)
        bed = Packing.read(packing_table)
        single = {"bed_height": bed.bed_height_m, "solid_fraction": bed.solid_fraction}
        found = {**dict(quantities_along(run_dir, case)), "single": single}
    measures = Measures.model_validate(
        {
            **dict(case),
            "bed": case.upstream.get("filling"),
            "complete": outcome.complete,
            "cost": _cost(case, outcome),
            "versions": {**case.versions, "engine": outcome.engine_version},
            "started": outcome.started,
            **found,
        }
    )
    measures.write(run_dir / FILE)
    return measures


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
