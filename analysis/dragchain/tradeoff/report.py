"""Tables, figures, ``tradeoff.json`` and page of the trade-off of speed against accuracy."""

import math
import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.report.campaign import write_report
from dragchain.report.page import DASH, MINUS, number
from dragchain.statistics.estimate import CONFIDENCE, Estimate
from dragchain.tradeoff.changes import (
    RUINED,
    Costs,
    gains,
    read_costs,
    softness_by_level,
    step_costs,
)
from dragchain.tradeoff.compare import Error, Setting, read_plan_runs
from dragchain.tradeoff.drops import ComparedDrop, choose_drop, compare_drops
from dragchain.tradeoff.figures import draw_tradeoff
from dragchain.tradeoff.measure_run import LONG_WAVE, SHORT_WAVE
from dragchain.tradeoff.measures import MAIN, QUANTITIES
from dragchain.tradeoff.outcome import TOLERANCES, Tradeoff, breaks, choose, compare_settings
from dragchain.tradeoff.path_length import along, chance, reaches
from dragdeck.records.tradeoff import (
    DropEntry,
    ErrorEntry,
    FidelityParameters,
    Machine,
    QuantityEntry,
    SettingEntry,
    TradeoffRecord,
)

# --- numbers -------------------------------------------------------------------------------------


_FOLD = 2.0
"""Relative errors from this on are told as multiples."""


def error_percent(value: float, sign: bool = True) -> str:
    """A share in per cent with as many digits as matter."""
    size = abs(100.0 * value)
    digits = 0 if size >= 9.95 else 1 if size >= 0.095 else 2 if size >= 0.0095 else 3
    text = f"{100.0 * value:{'+' if sign else ''}.{digits}f}"
    text = text if float(text) else "0"
    return text.replace("-", MINUS)


def size_percent(value: float) -> str:
    """As `error_percent`, of a size that has no sign."""
    return error_percent(value, False)


def error_size(error: Error) -> str:
    """An error in per cent; a large one as a multiple."""
    if error.value >= _FOLD:
        return f"{number(1.0 + error.value, 2)}-fold"
    return f"{error_percent(error.value)} %"


def error_interval(error: Error) -> str:
    """The interval of an error, in per cent; that of a large one in multiples."""
    if error.value >= _FOLD:
        return f"{number(1.0 + error.ci95_low, 2)} to {number(1.0 + error.ci95_high, 2)}"
    return f"{error_percent(error.ci95_low)} to {error_percent(error.ci95_high)} %"


def times(ratio: float) -> str:
    """A ratio of costs with two digits."""
    return DASH if not math.isfinite(ratio) else number(float(f"{ratio:.2g}"), 2)


def cheaper(ratio: float) -> str:
    """A ratio of costs in words."""
    if ratio >= 1.0:
        return f"{times(ratio)} times cheaper"
    return f"{times(1.0 / ratio)} times more expensive"


def span(gain: Estimate) -> str:
    """The interval of a ratio of costs; "one run" where there is none."""
    if math.isnan(gain.ci95_low):
        return "one run"
    return f"{times(gain.ci95_low)} to {times(gain.ci95_high)}"


FILTERS: Mapping[str, Callable[..., str]] = {
    function.__name__: function
    for function in (error_percent, size_percent, error_size, error_interval, times, cheaper, span)
}
"""Filters of the page."""


# --- tables --------------------------------------------------------------------------------------


def run_table(tradeoff: Tradeoff) -> pd.DataFrame:
    """One row a run: settings, bed, cost, outcome and the value of every quantity."""
    rows = [
        {
            "run": run.measures.run,
            **vars(run.setting),
            "bed": run.bed,
            "complete": run.complete,
            "failure": "; ".join(f"{one.name}: {one.seen}" for one in run.measures.failure),
            "counted_path_m": run.measures.arc_m or math.nan,
            **run.measures.cost.model_dump(),
            **{one.name: run.stretches[0].get(one.name, math.nan) for one in QUANTITIES},
        }
        for run in tradeoff.runs
    ]
    return pd.DataFrame(rows)


def errors_by_setting(tradeoff: Tradeoff) -> pd.DataFrame:
    """One row a setting and quantity: cost, error, interval and bound."""
    rows = [
        {
            "quantity": name,
            **vars(setting),
            "runs": sum(run.complete for run in tradeoff.of(setting)),
            "relative_cost": tradeoff.cost(setting),
            **error.columns(),
        }
        for name, comparison in tradeoff.comparisons.items()
        for setting, error in comparison.errors.items()
    ]
    return pd.DataFrame(rows)


# --- record --------------------------------------------------------------------------------------


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
        machine=Machine.here(),
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


# --- report --------------------------------------------------------------------------------------


_TOGETHER = ("contact_force_mean", "contact_force_p90")
"""What the distribution of contact forces is judged by."""

_CHOSEN = (
    *((name,) for name in ("drag_mean", "drag_std", "workpiece_contacts", *_TOGETHER)),
    _TOGETHER,
    *((name,) for name in ("coordination_number", "chain_count", "chain_length")),
)
"""The quantities, or the two together, that the page names settings for."""


def write_tradeoff(
    out_dir: Path,
    measures: Sequence[Path],
    reference_run: Path,
    drops: Sequence[Path] = (),
    costs: Path | None = None,
    plan: str = "",
    command: str | None = None,
    largest_step: float = math.inf,
) -> None:
    """Write tables, figures and page of a trade-off whose runs were measured.

    Parameters
    ----------
    out_dir : Path
        Gets ``runs.csv``, ``runs.parquet``, ``errors.csv``, ``errors.parquet``,
        ``tradeoff.json``, ``figures/*.png`` and ``report.html``.
    measures : sequence of Path
        ``measures.json`` of every run, that of the reference among them.
    reference_run : Path
        Folder of a run at the reference.
    drops : sequence of Path
        Folders of drop tests, with their tables.
    costs : Path, optional
        Costs of what the decks leave out.
    plan : str
        Name of the plan.
    command : str, optional
        What the user typed, for ``tradeoff.json``.
    largest_step : float
        Over the Rayleigh time: no setting with a larger one is recommended.

    Raises
    ------
    DocumentError
        A file was written by another version.
    TableError
        No run is complete, or a drop cannot be used.
    """
    priced, dropped = read_costs(costs), compare_drops(drops)
    tradeoff = compare_settings(
        *read_plan_runs(measures, reference_run), step_costs(priced), largest_step
    )
    commands = [command] if command else []
    record = tradeoff_record(tradeoff, dropped, priced, plan, commands)
    known, comparisons = reaches(tradeoff), tradeoff.comparisons
    soft = softness_by_level(tradeoff)
    every = [one for found in soft.values() for one in found.values() if one]
    named = [names for names in _CHOSEN if all(name in comparisons for name in names)]
    write_report(
        out_dir,
        "tradeoff/tradeoff.html.j2",
        draw=lambda: draw_tradeoff(tradeoff, known, dropped),
        tables={"runs": run_table(tradeoff), "errors": errors_by_setting(tradeoff)},
        documents={"tradeoff": record},
        filters=FILTERS,
        tradeoff=tradeoff,
        record=record,
        costs=priced,
        main=[comparisons[name] for name in MAIN if name in comparisons],
        choices=[(names, [choose(tradeoff, names, one) for one in TOLERANCES]) for names in named],
        softness=soft,
        mixed=sorted({one.mixed for one in every if one.mixed}),
        gains=gains(tradeoff),
        chance=chance(tradeoff),
        drops=dropped,
        drop_choices=[choose_drop(dropped, one) for one in TOLERANCES],
        paths=[(reach, along(tradeoff, reach.quantity)) for reach in known],
        tolerances=TOLERANCES,
        confidence=CONFIDENCE,
        ruined=RUINED,
        waves=(SHORT_WAVE, LONG_WAVE),
    )
