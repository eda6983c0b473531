"""Measure a process run of a trade-off: its cost, and its quantities along the path."""

from pathlib import Path

from dragchain.errors import TableError
from dragchain.network.write import write_chains
from dragchain.run.case import Case, load_case
from dragchain.run.completeness import RunRecord
from dragchain.tables.bed import Packing
from dragchain.tables.write import write_tables
from dragchain.tradeoff.measures import FILE, Measures, RunCost
from dragchain.tradeoff.path_blocks import quantities_along


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
        raise TableError(f"{file} is missing: `dragdeck run --outcome` writes it")
    outcome, case = RunRecord.read(file), load_case(run_dir)
    measures = Measures.model_validate(
        {
            **dict(case),
            "bed": case.upstream.get("filling"),
            "complete": outcome.complete,
            "cost": _cost(case, outcome),
            "versions": {**case.versions, "engine": outcome.engine_version},
            "started": outcome.started,
            "stability_number": next(
                (one.number for one in outcome.checks if one.code == "stable_timestep"), None
            ),
        }
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
    single = {"bed_height": bed.bed_height_m, "solid_fraction": bed.solid_fraction}
    return measures.model_copy(update={**dict(quantities_along(run_dir, case)), "single": single})


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
