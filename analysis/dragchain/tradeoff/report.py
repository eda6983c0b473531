"""Tables, figures, ``tradeoff.json`` and page of the trade-off of speed against accuracy."""

import math
import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.quantities.along import LONG_WAVE, SHORT_WAVE
from dragchain.quantities.registry import MAIN, MEASURED
from dragchain.report.campaign import write_report
from dragchain.report.page import MINUS, fixed, number
from dragchain.statistics.estimate import CONFIDENCE
from dragchain.tradeoff.compare import Setting, read_plan_runs
from dragchain.tradeoff.figures import draw_pareto
from dragchain.tradeoff.outcome import (
    TOLERANCES,
    ComparedDrop,
    Tradeoff,
    breaks,
    by_modulus,
    choose,
    compare_drops,
    compare_settings,
    step_costs,
)
from dragdeck.records.tradeoff import (
    CostsFile,
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
    text = fixed(100.0 * value, digits, sign)
    return text if text.strip(f"+{MINUS}0.") else "0"


def error_size(error: ErrorEntry, *, interval: bool = False) -> str:
    """An error, or the ends of its interval, in per cent; of a large one as multiples."""
    values = (error.ci95_low, error.ci95_high) if interval else (error.value,)
    large = error.value >= _FOLD
    texts = [number(1.0 + of, 2) if large else error_percent(of) for of in values]
    return " to ".join(texts) + ("" if large and interval else "-fold" if large else " %")


def cheaper(ratio: float) -> str:
    """A ratio of costs in words."""
    size = number(float(f"{max(ratio, 1.0 / ratio):.2g}"), 2)
    return f"{size} times {'cheaper' if ratio >= 1.0 else 'more expensive'}"


FILTERS: Mapping[str, Callable[..., str]] = {
    "error_percent": error_percent,
    "size_percent": partial(error_percent, sign=False),
    "error_size": error_size,
    "error_interval": partial(error_size, interval=True),
    "cheaper": cheaper,
}
"""Filters of the page."""


# --- tables --------------------------------------------------------------------------------------


def run_table(tradeoff: Tradeoff) -> pd.DataFrame:
    """One row a run: settings, bed, cost, outcome and the value of every quantity."""
    rows = [
        {
            "run": run.measures.run,
            **vars(run.setting),
            "bed": run.measures.bed,
            "complete": run.complete,
            "failure": run.measures.why_failed,
            "counted_path_m": run.measures.arc_m or math.nan,
            **run.measures.cost.model_dump(),
            **{
                quantity.name: run.stretches[0].get(quantity.name, math.nan)
                for quantity in MEASURED
            },
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
            **vars(error),
        }
        for name, comparison in tradeoff.comparisons.items()
        for setting, error in comparison.errors.items()
    ]
    return pd.DataFrame(rows).rename(columns={"value": "error"})


# --- record --------------------------------------------------------------------------------------


def tradeoff_record(
    tradeoff: Tradeoff,
    drops: Iterable[ComparedDrop],
    costs: CostsFile | None,
    plan: str,
    commands: Sequence[str],
) -> TradeoffRecord:
    """The content of ``tradeoff.json``: when, with what and on what was measured, and what."""
    measures = [run.measures for run in tradeoff.runs]
    at_reference = tradeoff.of(tradeoff.reference)
    return TradeoffRecord(
        measured=max(run.started for run in measures)[:10],
        commands=tuple(commands),
        plan=plan,
        study=_joined(run.study_name for run in measures),
        versions={
            **{
                name: _joined(run.versions[name] for run in measures)
                for name in ("dragdeck", "engine")
            },
            "python": platform.python_version(),
            "numpy": np.__version__,
        },
        machine=Machine.here(),
        runs=len(measures),
        engine_hours=sum(run.cost.cpu_time_s for run in measures) / 3600.0,
        scene=next(filter(None, (run.measures.numbers for run in at_reference)), {}),
        reference=FidelityParameters(**tradeoff.reference.parameters()),
        quantities={
            name: QuantityEntry(
                label=comparison.quantity.label,
                unit=comparison.quantity.unit,
                signed=comparison.quantity.signed,
                reference=comparison.reference,
                se=comparison.se,
                run_std=comparison.fit.residual_std,
                arc_m=tradeoff.arc_m,
            )
            for name, comparison in tradeoff.comparisons.items()
        },
        settings=tuple(
            _setting_entry(tradeoff, setting)
            for setting in tradeoff.settings()
            if not setting.other
        ),
        drop_test=tuple(
            DropEntry.model_validate({**vars(drop), "restitution_error": drop.bound})
            for drop in drops
            if not drop.other
        ),
        costs=costs.costs if costs else (),
    )


def _joined(names: Iterable[object]) -> str:
    return ", ".join(sorted(set(map(str, names))))


def _setting_entry(tradeoff: Tradeoff, setting: Setting) -> SettingEntry:
    runs = tradeoff.of(setting)
    complete = sum(run.complete for run in runs)
    return SettingEntry(
        **setting.parameters(),
        seeds=len({run.measures.study.seed for run in runs}),
        runs=len(runs),
        failed=len(runs) - complete,
        arc_m=tradeoff.arc_m * complete,
        breaks=breaks(tradeoff, setting),
        relative_cost=tradeoff.cost(setting),
        errors={
            name: comparison.errors[setting]
            for name, comparison in tradeoff.comparisons.items()
            if setting in comparison.errors
        },
    )


# --- report --------------------------------------------------------------------------------------


_LARGE = 0.1
"""Errors above this are marked as large, those above half of it as middling."""


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
        ``tradeoff.json``, ``figures/pareto.png`` and ``report.html``.
    measures : sequence of Path
        ``quantities.json`` of every run, that of the reference among them.
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
    priced, dropped = CostsFile.read(costs) if costs else None, compare_drops(drops)
    tradeoff = compare_settings(
        *read_plan_runs(measures, reference_run), step_costs(priced), largest_step
    )
    main = [name for name in MAIN if name in tradeoff.comparisons]
    record = tradeoff_record(tradeoff, dropped, priced, plan, [command] if command else [])
    write_report(
        out_dir,
        "tradeoff/tradeoff.html.j2",
        draw=lambda: {"pareto": draw_pareto(tradeoff)} if main else {},
        tables={"runs": run_table(tradeoff), "errors": errors_by_setting(tradeoff)},
        documents={"tradeoff": record},
        filters=FILTERS,
        tradeoff=tradeoff,
        record=record,
        main=[tradeoff.comparisons[name] for name in main],
        choices={name: [choose(tradeoff, name, limit) for limit in TOLERANCES] for name in main},
        soft=by_modulus(tradeoff),
        drops=dropped,
        tolerances=TOLERANCES,
        confidence=CONFIDENCE,
        large=_LARGE,
        waves=(SHORT_WAVE, LONG_WAVE),
    )
