"""The next round of a search, and the page on what it has found."""

import math
from collections.abc import Sequence
from pathlib import Path
from textwrap import fill
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from dragchain.figures.panels import band, legend_below, new_panels
from dragchain.figures.style import BLUE, GREEN, GREY, MARKERS, ORANGE, RED, WIDE_IN
from dragchain.report.campaign import write_report
from dragchain.report.page import number, with_interval
from dragchain.search.rounds import SearchFindings, loss, next_points, read_findings
from dragchain.search.studied import PointMeasure, SearchedStudy, label, read_point
from dragchain.statistics.estimate import Estimate, EstimateColumns, Verdict, flattened, t_interval
from dragdeck.engine.reports import say
from dragdeck.errors import InputError
from dragdeck.project import find_project
from dragdeck.study.search import SearchPoint, SearchRecord, SearchRound

NAME = "search"
_AT_BOUND = 0.02
"""Of the range of a field: nearer to a bound, the best setting lies on it."""

_COLOURS = {"start": GREY, "model": BLUE, "confirmation": RED}


def choose_settings(study: str, number: int, out: Path) -> None:
    """Choose the settings of a round of a search, and write the page on those before.

    Raises
    ------
    InputError
        The study has no search or cannot be used, or it has changed since the search began; or a
        run of the settings before has not ended.
    """
    advance(SearchedStudy(find_project(Path.cwd()), study), number).write(out)


def advance(studied: SearchedStudy, number: int, measure: PointMeasure = read_point) -> SearchRound:
    """A round of a search; see `choose_settings`. `measure` reads the runs of a setting."""
    file, asked = studied.record, studied.asked()
    record = SearchRecord.read(file) if file.is_file() else SearchRecord(asked=asked)
    if record.asked != asked:
        raise InputError("the study has changed since this search began", file=file, field="asked",
                         remedy="remove its folder to search anew (runs of the same settings are "
                         "not repeated), or undo the change")  # fmt: skip
    before = [point for point in record.points if point.round < number]
    findings = read_findings(studied, before, measure)
    more = record.points[len(before) :] or next_points(findings)
    if np.isfinite(findings.means[:, 0]).sum() >= 2:
        write_search(file.parent, findings)
    record.model_copy(update={"points": (*findings.points, *more)}).write(file)
    chosen = [point for point in more if point.round == number]
    tried = [point for point in chosen if point.ran or not point.refused]
    said = f"round {number}: {len(tried)} settings to run, {len(chosen) - len(tried)} refused"
    say(f"search: {said if chosen else file.with_name('search.html')}")
    runs = [folder.name for point in tried for folder in studied.folders(point.values)]
    return SearchRound(runs=tuple(runs), last=not chosen)


# --- the page ------------------------------------------------------------------------------------


class SearchRow(NamedTuple):
    """A point on the page; `objective` and `limits` are as measured."""

    number: int
    point: SearchPoint
    objective: Estimate | None
    limits: tuple[Estimate, ...]
    verdicts: Sequence[Verdict]
    as_good: bool


def rows_of(findings: SearchFindings) -> list[SearchRow]:
    """The points in the order of the search."""
    rows = []
    for k, point in enumerate(findings.points):
        measures = range(0 if point.refused else findings.means.shape[1])
        values = [findings.estimate(k, measure) for measure in measures]
        objective, verdicts = (values[0], findings.verdict(k)) if values else (None, ())
        good = k in findings.as_good
        rows.append(SearchRow(k + 1, point, objective, tuple(values[1:]), verdicts, good))
    return rows


def at_bounds(findings: SearchFindings, point: SearchPoint) -> list[str]:
    """Fields whose value at a point is their lowest or highest one."""
    place = findings.studied.place(point.values)
    ends = {"lowest": place < _AT_BOUND, "highest": place > 1 - _AT_BOUND}
    fields = list(findings.studied.search.vary)
    return [f"{fields[k]} ({end} value)" for end, on in ends.items() for k in np.flatnonzero(on)]


def draw_search(findings: SearchFindings, rows: list[SearchRow]) -> dict[str, Figure]:
    """The path of the search, and the response along each field."""
    objective = fill(label(findings.studied.search.objective), 30)
    path, (axes,) = new_panels(3.2, width_in=WIDE_IN)
    for purpose, marker in zip(_COLOURS, MARKERS, strict=False):
        drawn = [row for row in rows if row.point.purpose == purpose and row.objective]
        _bars(axes, [row.number for row in drawn], drawn, purpose, marker)
    gone = [row.number for row in rows if row.point.refused]
    axes.plot(gone, np.full(len(gone), 0.03), "x", color=ORANGE, label="refused or rejected",
              transform=axes.get_xaxis_transform())  # fmt: skip
    axes.set(xlabel="setting in the order of the search", ylabel=objective)
    axes.locator_params(axis="x", integer=True)
    figures = {"path": legend_below(path)}
    fields = list(findings.studied.search.vary.items())
    if findings.studied.search.objective.goal != "target":
        at = _centre(findings)
        figures["response"], panels = new_panels(
            2.9 * -(-len(fields) // 3), len(fields), WIDE_IN, 3, sharey=True
        )
        for k, (axes, (field, (low, high))) in enumerate(zip(panels, fields, strict=True)):
            along = np.tile(at, (101, 1))
            along[:, k] = np.linspace(0, 1, 101)
            mean, error = (columns[:, 0] for columns in findings.trials.predict(along))
            x = np.linspace(low, high, 101)
            sign = -1.0 if findings.studied.search.objective.goal == "maximise" else 1.0
            pairs = zip(sign * mean, error, strict=True)
            columns = EstimateColumns.of([t_interval(*pair, findings.degrees) for pair in pairs])
            axes.plot(x, columns.value, color=GREEN)
            band(axes, x, columns, GREEN)
            drawn = [row for row in rows if row.objective and not row.point.confirms]
            _bars(axes, [row.point.values[field] for row in drawn], drawn, "model", "o")
            axes.axvline(low + at[k] * (high - low), color=RED, ls=":")
            axes.set(xlabel=field, ylabel="" if k % 3 else objective)
    return figures


def _centre(findings: SearchFindings) -> Any:
    """Where the responses are drawn: at the confirmed setting, or else at the best point so far."""
    last = findings.points[-1]
    if last.confirms:
        return findings.studied.place(last.values)
    return findings.trials.places[np.nanargmin(findings.trials.values[:, 0])]


def _bars(axes: Any, x: list[Any], rows: list[SearchRow], purpose: str, marker: str) -> None:
    values = [row.objective.value for row in rows if row.objective]
    reach = [row.objective.half_width for row in rows if row.objective]
    axes.errorbar(x, values, reach, ls="", marker=marker, color=_COLOURS[purpose], label=purpose)


def write_search(out_dir: Path, findings: SearchFindings) -> None:
    """Write ``search.html`` and ``points.csv``."""
    studied, search, rows = findings.studied, findings.studied.search, rows_of(findings)
    confirmed = [row for row in rows if row.point.confirms]
    best = None
    if confirmed:
        full = confirmed[-1]
        same = [row for row in rows if row.point.values.items() <= full.point.values.items()]
        place = studied.place(full.point.values)
        best = {
            "full": full,
            "soft": same[0],
            "bounds": at_bounds(findings, full.point),
            "meets": bool(findings.trials.meets(place[None])[0]),
            "probability": math.exp(findings.trials.allowed(place[None])[0]),
        }
    measured = [row for row in rows if row.objective and not row.point.confirms]
    lowest = min(measured, key=lambda row: loss(search.objective, row.objective.value))  # type: ignore[union-attr]
    table = pd.DataFrame(
        flattened(
            {
                "round": row.point.round,
                "purpose": row.point.purpose,
                **{field: row.point.values[field] for field in search.vary},
                "fidelity": row.point.values.get("fidelity", ""),
                search.objective.quantity: row.objective or math.nan,
                **{f"limit_{k}": value for k, value in enumerate(row.limits, 1)},
                "as_good": row.as_good,
                "refused": row.point.refused,
            }
        )
        for row in rows
    )
    write_report(
        out_dir,
        "search/search.html.j2",
        draw=lambda: draw_search(findings, rows),
        tables={"points": table},
        name=NAME,
        filters={"label": label, "estimated": with_interval, "six": lambda value: number(value, 6)},
        studied=studied,
        search=search,
        rows=rows,
        best=best,
        lowest=lowest,
        compared=sum(bool(row.objective) and "fidelity" not in row.point.values for row in rows),
        packings=findings.packings.shape[1],
    )
