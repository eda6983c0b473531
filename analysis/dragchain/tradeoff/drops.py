"""Drop tests against the one with the finest step."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import JsonValue

from dragchain.arrays import Floats
from dragchain.errors import TableError
from dragchain.run.case import changed_inputs
from dragchain.tables.by_step import read_table
from dragdeck.records.case import load_case
from dragdeck.records.run import RunRecord


@dataclass(frozen=True)
class ComparedDrop:
    """A drop test against the one with the finest step.

    Attributes
    ----------
    timestep_fraction : float
    other : str
        What else it changes; "" if nothing.
    restitution : float
        Mean of its impacts.
    error : float
        Relative, of the mean.
    bound : float
        The largest of any impact, relative; each impact against the same one of the reference.
    relative_cost : float
        Its processor time over the reference's.
    """

    timestep_fraction: float
    other: str
    restitution: float
    error: float
    bound: float
    relative_cost: float


@dataclass(frozen=True)
class _DropRun:
    """A complete drop test: step over the Rayleigh time, inputs, ratios of its impacts, cost."""

    fraction: float
    inputs: Mapping[str, JsonValue]
    ratios: Floats
    cost_s: float


def compare_drops(folders: Sequence[Path]) -> list[ComparedDrop]:
    """Drop tests, the finest step first.

    Parameters
    ----------
    folders : sequence of Path
        Complete runs of the drop test with their tables.

    Raises
    ------
    TableError
        If a folder holds another scene, or a run is not complete or has no table.
    """
    runs = sorted((_read_drop(folder) for folder in folders), key=lambda run: run.fraction)
    return [
        ComparedDrop(
            timestep_fraction=run.fraction,
            other=_difference(run.inputs, runs[0].inputs),
            restitution=float(run.ratios.mean()),
            error=float(run.ratios.mean() / runs[0].ratios.mean() - 1.0),
            bound=_worst_impact(run.ratios, runs[0].ratios),
            relative_cost=run.cost_s / runs[0].cost_s,
        )
        for run in runs
    ]


def _read_drop(folder: Path) -> _DropRun:
    case = load_case(folder)
    if case.scene != "drop_test":
        raise TableError(f"{folder}: the scene is {case.scene}, not drop_test")
    impacts = read_table(folder / "tables" / "impacts.parquet", ["restitution"])
    record = RunRecord.read(folder / "run.json")
    if not record.complete:
        raise TableError(f"{folder}: its state is {record.state!r}, not 'complete'")
    own_step = ("seed", "drop_test.timestep_fraction")
    return _DropRun(
        fraction=float(f"{case.timestep_s / case.rayleigh_time_s:.4g}"),
        inputs={name: value for name, value in case.inputs.items() if name not in own_step},
        ratios=impacts["restitution"].to_numpy(),
        cost_s=record.processor_time_s,
    )


def _difference(own: Mapping[str, JsonValue], standard: Mapping[str, JsonValue]) -> str:
    return ", ".join(f"{name} {value}" for name, value in changed_inputs(own, standard).items())


def _worst_impact(ratios: Floats, reference: Floats) -> float:
    common = min(len(ratios), len(reference))
    return float(np.abs(ratios[:common] / reference[:common] - 1.0).max())


@dataclass(frozen=True)
class DropChoice:
    """The drop test to run for a tolerance: the cheapest that holds it, else None.

    `nearest` is that of the smallest bound.
    """

    drop: ComparedDrop | None
    nearest: ComparedDrop | None


def choose_drop(drops: Sequence[ComparedDrop], tolerance: float) -> DropChoice:
    """The cheapest drop that changes only its step and is within a tolerance at every impact."""
    own = [drop for drop in drops[1:] if not drop.other]
    able = [drop for drop in own if drop.bound <= tolerance and drop.relative_cost < 1.0]
    return DropChoice(
        min(able, key=lambda drop: drop.relative_cost, default=None),
        min(own, key=lambda drop: drop.bound, default=None),
    )
