"""The record of a trade-off: what ``tradeoff.json`` says of its runs."""

import os
import platform
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from dragchain.tradeoff.changes import Costs
from dragchain.tradeoff.compare import Setting
from dragchain.tradeoff.drops import ComparedDrop
from dragchain.tradeoff.outcome import Tradeoff, breaks
from dragdeck.records.tradeoff import (
    DropEntry,
    ErrorEntry,
    FidelityParameters,
    Machine,
    QuantityEntry,
    SettingEntry,
    TradeoffRecord,
)


def tradeoff_record(
    tradeoff: Tradeoff,
    drops: Iterable[ComparedDrop],
    costs: Costs,
    plan: str,
    commands: Sequence[str],
) -> TradeoffRecord:
    """The content of ``tradeoff.json``: when, with what and on what was measured, and what."""
    measures = [run.measures for run in tradeoff.runs]
    return TradeoffRecord(
        measured=max(one.started for one in measures)[:10],
        commands=tuple(commands),
        plan=plan,
        study=_joined(one.study for one in measures),
        versions={
            **{
                name: _joined(one.versions[name] for one in measures)
                for name in ("dragdeck", "engine")
            },
            "python": platform.python_version(),
            "numpy": np.__version__,
        },
        machine=Machine(cores=os.cpu_count(), processor=processor()),
        runs=len(measures),
        engine_hours=sum(one.cost.cpu_time_s for one in measures) / 3600.0,
        scene=_scene_numbers(tradeoff),
        reference=FidelityParameters(**tradeoff.reference.parameters()),
        quantities={
            name: QuantityEntry.model_validate(
                {**vars(own.quantity), **vars(own), "arc_m": tradeoff.arc_m}
            )
            for name, own in tradeoff.comparisons.items()
        },
        settings=tuple(
            _setting_entry(tradeoff, one) for one in tradeoff.settings() if not one.other
        ),
        drop_test=tuple(
            DropEntry.model_validate({**vars(drop), "restitution_error": drop.bound})
            for drop in drops
            if not drop.other
        ),
        costs=tuple(costs.entries),
    )


def _joined(names: Iterable[object]) -> str:
    return ", ".join(sorted(set(map(str, names))))


def processor() -> str:
    """Name of the machine's processor, as far as it is known."""
    file = Path("/proc/cpuinfo")
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def _scene_numbers(tradeoff: Tradeoff) -> Mapping[str, float]:
    """Dimensionless numbers of the scene, as the runs at the reference have them."""
    numbers = [run.measures.numbers for run in tradeoff.of(tradeoff.reference)]
    return next((own for own in numbers if own), {})


def _setting_entry(tradeoff: Tradeoff, setting: Setting) -> SettingEntry:
    runs = tradeoff.of(setting)
    complete = sum(run.complete for run in runs)
    return SettingEntry(
        **setting.parameters(),
        seeds=len({run.measures.seed for run in runs}),
        runs=len(runs),
        failed=len(runs) - complete,
        arc_m=tradeoff.arc_m * complete,
        breaks=breaks(tradeoff, setting),
        relative_cost=tradeoff.cost(setting),
        errors={
            name: ErrorEntry(
                **vars(own.errors[setting]),
                single_parameter_error=own.alone(setting, tradeoff.reference),
            )
            for name, own in tradeoff.comparisons.items()
            if setting in own.errors
        },
    )
