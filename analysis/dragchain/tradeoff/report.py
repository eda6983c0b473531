"""Tables, figures, ``tradeoff.json`` and page of the trade of speed against accuracy."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib
import numpy as np

from dragchain.figures.style import STYLE, png
from dragchain.report.notation import DASH, number
from dragchain.report.page import data_uri, render_page
from dragchain.tables.parquet import write_parquet
from dragchain.tradeoff.choice_rows import advice, best, choice_rows, plain_note
from dragchain.tradeoff.compare import (
    ADDITIVE_LEVEL,
    CONFIDENCE,
    TOLERANCES,
    compare,
    error_table,
    read_runs,
    run_table,
)
from dragchain.tradeoff.figures import FLOOR, draw
from dragchain.tradeoff.findings import (
    MAIN,
    RUINED,
    modulus_levels,
    reaches,
    read_costs,
    read_drops,
    step_costs,
)
from dragchain.tradeoff.measures import LONG_WAVE, SHORT_WAVE
from dragchain.tradeoff.promises import PromisesFile
from dragchain.tradeoff.record import Findings, record_of
from dragchain.tradeoff.rows import (
    chance_note,
    combination_rows,
    failure_rows,
    gain_rows,
    mixed_note,
    path_rows,
    point_rows,
    reach_words,
    reference_rows,
    softness_rows,
    speed_rows,
    statistic_rows,
    verdicts,
)
from dragchain.tradeoff.words import NOT_RESOLVED, SHORT, percent, plainly


def write_tradeoff(
    out_dir: Path,
    measures: Sequence[Path],
    reference_run: Path,
    drops: Sequence[Path] = (),
    costs: Path | None = None,
    promises: Path | None = None,
    plan: str = "",
    command: str | None = None,
    largest_step: float = math.inf,
) -> None:
    """Write tables, figures and page of a trade whose runs were measured.

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
    promises : Path, optional
        ``promises.json`` of promises on other scenes.
    plan : str
        Name of the plan.
    largest_step : float
        Over the Rayleigh time: no setting with a larger one is recommended.
    command : str, optional
        What the user typed, for ``tradeoff.json``.

    Raises
    ------
    TableError
        A file was written by another version, no run is complete, or a drop cannot be used.
    """
    priced = read_costs(costs)
    tradeoff = compare(*read_runs(measures, reference_run), step_costs(priced), largest_step)
    dropped = read_drops(drops)
    kept = PromisesFile.read(promises).promises if promises else ()
    commands = [command] if command else []
    record = record_of(tradeoff, dropped, priced, kept, plan, commands)
    found = Findings(tradeoff, dropped, priced, kept, record)
    out_dir.mkdir(parents=True, exist_ok=True)
    for name, table in (("runs", run_table(tradeoff)), ("errors", error_table(tradeoff))):
        write_parquet(table, out_dir / f"{name}.parquet")
        table.to_csv(out_dir / f"{name}.csv", index=False, lineterminator="\n")
    with matplotlib.rc_context(STYLE):
        drawn = draw(tradeoff, reaches(tradeoff), found.drops)
        pictures = {name: png(figure) for name, figure in drawn.items()}
    folder = out_dir / "figures"
    folder.mkdir(exist_ok=True)
    for name, picture in pictures.items():
        (folder / f"{name}.png").write_bytes(picture)
    record.write(out_dir / "tradeoff.json")
    (out_dir / "report.html").write_text(render(found, pictures), encoding="utf-8")


# --- page ----------------------------------------------------------------------------------------


CAPTIONS = {
    "pareto": "Every mark is a setting: the size of its error against what a metre of path costs. "
    "The upright line is the 95 % interval of the size. A hollow mark is an error that is not "
    "resolved: its interval holds zero. The short bar is the bound that the true error stays "
    "below with 95 % confidence, and the front joins the settings that no cheaper one undercuts "
    "in it. Dashed lines: the tolerances.",
    "contact_forces": "Share of the contacts on the workpiece whose normal force is above a "
    "value: the "
    "thick line all runs together, the thin ones a run each. Left in newtons, right over the mean. "
    "What the thin lines spread by is chance.",
    "path": "How well one run knows a quantity, seed and time together. Where a line crosses a "
    "tolerance, one run is long enough for it.",
    "drop_test": "Error of the coefficient of restitution against the finest step.",
}


def render(found: Findings, pictures: Mapping[str, bytes]) -> str:
    """The page: HTML that needs no other file and no network."""
    tradeoff = found.tradeoff
    return render_page(
        "tradeoff/tradeoff.html.j2",
        {"in_percent": percent, "plainly": plainly},
        found=found,
        tradeoff=tradeoff,
        what=what_was_run(found),
        references=reference_rows(tradeoff),
        tolerances=TOLERANCES,
        choices=choice_rows(found),
        best=best(found),
        advice=advice(found),
        plain=plain_note(found),
        soft=softness_rows(tradeoff),
        levels=modulus_levels(tradeoff),
        verdicts=verdicts(tradeoff),
        mixed=mixed_note(tradeoff),
        gains=gain_rows(tradeoff),
        combinations=combination_rows(tradeoff),
        speeds=speed_rows(tradeoff),
        main=[SHORT[name] for name in MAIN if name in tradeoff.comparisons],
        paths=path_rows(tradeoff),
        reach_words=reach_words(tradeoff),
        failures=failure_rows(tradeoff),
        drops=found.drops,
        costs=found.costs.entries,
        statistics=statistic_rows(tradeoff),
        points=point_rows(tradeoff),
        chance=chance_note(tradeoff),
        pictures={
            name: {"uri": data_uri(data), "caption": CAPTIONS[name]}
            for name, data in pictures.items()
        },
        confidence=CONFIDENCE,
        additive_level=ADDITIVE_LEVEL,
        ruined=RUINED,
        floor=FLOOR,
        not_resolved=NOT_RESOLVED,
        waves=(SHORT_WAVE, LONG_WAVE),
        dash=DASH,
    )


def what_was_run(found: Findings) -> list[tuple[str, str]]:
    """The facts at the head of the page."""
    tradeoff = found.tradeoff
    beds = {run.bed for run in tradeoff.runs}
    own = tradeoff.of(tradeoff.reference)
    failed = sum(not run.complete for run in tradeoff.runs)
    cpu = float(np.median([run.cpu_per_m for run in own]))
    record = found.record
    versions = record.versions
    return [
        (
            "Study",
            record.study + (f", plan {record.plan}" if record.plan else ""),
        ),
        ("Reference", f"{tradeoff.reference}; {_count(len(own), 'run')}"),
        (
            "Runs",
            f"{_count(len(tradeoff.runs), 'run')} at "
            f"{_count(len(tradeoff.settings()), 'setting')}, "
            f"on {_count(len(beds), 'bed')}; {failed or 'none'} failed",
        ),
        (
            "Path",
            f"the first {number(1e3 * tradeoff.arc_m)} mm after the transient, which every "
            f"complete run "
            "has; longer runs are cut there",
        ),
        (
            "Cost",
            f"processor time for a metre of path; the reference takes {number(cpu / 3600.0, 2)} h "
            f"for it. {number(record.engine_hours, 2)} h of engine time in all",
        ),
        (
            "Measured",
            f"{record.measured} with LIGGGHTS {versions['engine']} and dragdeck "
            f"{versions['dragdeck']} on {record.machine.cores} cores"
            + (f" ({record.machine.processor})" if record.machine.processor else ""),
        ),
    ]


def _count(amount: int, noun: str) -> str:
    return f"{amount} {noun}" + ("" if amount == 1 else "s")
