"""Tables, figures, ``tradeoff.json`` and page of the trade-off of speed against accuracy."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from dragchain.report.campaign import write_report
from dragchain.report.page import DASH, MINUS, number
from dragchain.statistics.estimate import CONFIDENCE, Estimate
from dragchain.tradeoff.changes import (
    RUINED,
    gains,
    modulus_effects,
    modulus_levels,
    read_costs,
    softness,
    step_costs,
)
from dragchain.tradeoff.compare import Error, read_plan_runs
from dragchain.tradeoff.drops import choose_drop, compare_drops
from dragchain.tradeoff.figures import draw_tradeoff
from dragchain.tradeoff.measure_run import LONG_WAVE, SHORT_WAVE
from dragchain.tradeoff.measures import MAIN
from dragchain.tradeoff.outcome import (
    TOLERANCES,
    choose,
    compare_settings,
    errors_by_setting,
    run_table,
)
from dragchain.tradeoff.path_length import along, chance, reaches
from dragchain.tradeoff.record import tradeoff_record

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
    known, comparisons, levels = reaches(tradeoff), tradeoff.comparisons, modulus_levels(tradeoff)
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
        levels=levels,
        softness={
            name: [softness(tradeoff, own, level) for level in levels]
            for name, own in comparisons.items()
        },
        effects=modulus_effects(tradeoff),
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
