"""The next round of a search, and the page on what it has found."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from dragchain.figures.panels import band, legend_below, new_panels
from dragchain.figures.style import BLUE, GREEN, GREY, MARKERS, ORANGE, RED, WIDE_IN
from dragchain.report.campaign import write_report
from dragchain.report.page import number, with_interval
from dragchain.search.rounds import (
    Measured,
    SearchedStudy,
    SearchFindings,
    label,
    loss,
    next_points,
    read_findings,
    read_point,
)
from dragchain.statistics.estimate import Estimate, EstimateColumns, Verdict, flattened, t_interval
from dragdeck.engine.reports import say
from dragdeck.errors import InputError
from dragdeck.project import find_project
from dragdeck.study.search import SearchPoint, SearchRecord

NAME = "search"
_AT_BOUND = 0.02
"""Of the range of a field: nearer to a bound, the best setting lies on it."""

_COLOURS = {"start": GREY, "model": BLUE, "confirmation": RED}


def write_round(study: str) -> None:
    """Choose the next settings of a search, write its page, and print how far it is.

    Prints ``unfinished`` where runs of the last round are missing, ``round N``, or ``complete``.

    Raises
    ------
    InputError
        The study has no search or cannot be used, or it has changed since the search began.
    """
    print(advance(SearchedStudy(find_project(Path.cwd()), study)))


def advance(
    studied: SearchedStudy, measure: Callable[[SearchedStudy, SearchPoint], Measured] = read_point
) -> str:
    """One step of a search; see `write_round`. `measure` reads the runs of a setting."""
    file, asked = studied.record, studied.asked()
    record = SearchRecord.read(file) if file.is_file() else SearchRecord(asked=asked)
    if record.asked != asked:
        raise InputError("the study has changed since this search began", file=file, field="asked",
                         remedy="remove the file to search anew (runs of the same settings are "
                         "not repeated), or undo the change")  # fmt: skip
    found = read_findings(studied, record.points, measure)
    if found is None:
        return "unfinished"
    more = next_points(found)
    if np.isfinite(found.means[:, 0]).sum() >= 2:
        write_search(file.parent, found)
    record.model_copy(update={"points": (*found.points, *more)}).write(file)
    if not more:
        return "complete"
    runs = sum(not one.refused for one in more)
    say(f"search: round {more[0].round}: {runs} settings to run, {len(more) - runs} refused")
    return f"round {more[0].round}"


# --- the page ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class SearchRow:
    """A point on the page.

    `objective` and `limits` are as measured; `predicted` is what the model expected of them before
    the run, of the distance from the value where the goal is a target.
    """

    number: int
    point: SearchPoint
    objective: Estimate | None
    limits: tuple[Estimate, ...]
    predicted: Estimate | None
    verdicts: Sequence[Verdict]
    as_good: bool


def _signed(found: SearchFindings, value: float, error: float) -> Estimate:
    """An expectation of the model in the unit of the objective."""
    sign = -1.0 if found.studied.search.objective.goal == "maximise" else 1.0
    return t_interval(sign * value, error, found.degrees)


def rows_of(found: SearchFindings) -> list[SearchRow]:
    """The points in the order of the search."""
    rows = []
    for k, one in enumerate(found.points):
        known = [] if one.refused else [found.estimate(k, m) for m in range(found.means.shape[1])]
        said = None
        if one.predicted is not None and one.predicted_se is not None:
            said = _signed(found, one.predicted, one.predicted_se)
        rows.append(
            SearchRow(
                k + 1,
                one,
                known[0] if known else None,
                tuple(known[1:]),
                said,
                found.verdict(k) if known else (),
                k in found.as_good,
            )
        )
    return rows


def at_bounds(found: SearchFindings, point: SearchPoint) -> list[str]:
    """Fields whose value at a point is their lowest or highest one."""
    place = found.studied.place(point.values)
    ends = {"lowest": place < _AT_BOUND, "highest": place > 1 - _AT_BOUND}
    fields = list(found.studied.search.vary)
    return [f"{fields[k]} ({end} value)" for end, on in ends.items() for k in np.flatnonzero(on)]


def draw_search(found: SearchFindings, rows: list[SearchRow]) -> dict[str, Figure]:
    """The path of the search, the response along each field, and predicted against measured."""
    objective = fill(label(found.studied.search.objective), 30)
    path, (axes,) = new_panels(3.2, width_in=WIDE_IN)
    for purpose, marker in zip(_COLOURS, MARKERS, strict=False):
        own = [one for one in rows if one.point.purpose == purpose and one.objective]
        _bars(axes, [one.number for one in own], own, purpose, marker)
    gone = [one.number for one in rows if one.point.refused]
    axes.plot(gone, np.full(len(gone), 0.03), "x", color=ORANGE, label="refused or rejected",
              transform=axes.get_xaxis_transform())  # fmt: skip
    axes.set(xlabel="setting in the order of the search", ylabel=objective)
    axes.locator_params(axis="x", integer=True)
    figures = {"path": legend_below(path)}
    fields, model = list(found.studied.search.vary.items()), found.trials.responses
    if found.studied.search.objective.goal != "target":
        at = _centre(found)
        figures["response"], panels = new_panels(
            2.9 * -(-len(fields) // 3), len(fields), WIDE_IN, 3, sharey=True
        )
        for k, (axes, (field, (low, high))) in enumerate(zip(panels, fields, strict=True)):
            along = np.tile(at, (101, 1))
            along[:, k] = np.linspace(0, 1, 101)
            mean, error = (columns[:, 0] for columns in model.predict(along))
            x = np.linspace(low, high, 101)
            each = [_signed(found, *pair) for pair in zip(mean, error, strict=True)]
            axes.plot(x, [one.value for one in each], color=GREEN)
            columns = EstimateColumns.of(each)
            band(axes, x, Estimate(0.0, columns.ci95_low, columns.ci95_high), GREEN)  # type: ignore[arg-type]
            own = [one for one in rows if one.objective and not one.point.confirms]
            _bars(axes, [one.point.values[field] for one in own], own, "model", "o")
            axes.axvline(low + at[k] * (high - low), color=RED, ls=":")
            axes.set(xlabel=field, ylabel="" if k % 3 else objective)
    said = [one for one in rows if one.predicted and one.objective]
    if said and found.studied.search.objective.goal != "target":
        figures["predicted"], (axes,) = new_panels(3.6, width_in=4.6)
        for one in said:
            assert one.predicted and one.objective
            colour = _COLOURS[one.point.purpose]
            axes.errorbar(one.predicted.value, one.objective.value, one.objective.half_width,
                          one.predicted.half_width, fmt="o", color=colour)  # fmt: skip
        first = said[0].predicted
        assert first
        axes.axline((first.value, first.value), slope=1, color=GREY)
        axes.set(xlabel="predicted before the run", ylabel="measured")
    return figures


def _centre(found: SearchFindings) -> Any:
    """Where the responses are drawn: at the confirmed setting, or else at the best point so far."""
    last = found.points[-1]
    if last.confirms:
        return found.studied.place(last.values)
    return found.trials.places[np.nanargmin(found.trials.values[:, 0])]


def _bars(axes: Any, x: list[Any], rows: list[SearchRow], purpose: str, marker: str) -> None:
    values = [one.objective.value for one in rows if one.objective]
    reach = [one.objective.half_width for one in rows if one.objective]
    axes.errorbar(x, values, reach, ls="", marker=marker, color=_COLOURS[purpose], label=purpose)


def write_search(out_dir: Path, found: SearchFindings) -> None:
    """Write ``search.html`` and ``points.csv``."""
    studied, search, rows = found.studied, found.studied.search, rows_of(found)
    confirmed = [one for one in rows if one.point.confirms]
    best = None
    if confirmed:
        full = confirmed[-1]
        same = [one for one in rows if one.point.values.items() <= full.point.values.items()]
        place = studied.place(full.point.values)
        best = {
            "full": full,
            "soft": same[0],
            "bounds": at_bounds(found, full.point),
            "meets": bool(found.trials.responses.meets(place[None])[0]),
            "probability": math.exp(found.trials.responses.allowed(place[None])[0]),
        }
    measured = [one for one in rows if one.objective and not one.point.confirms]
    lowest = min(measured, key=lambda one: loss(search.objective, one.objective.value))  # type: ignore[union-attr]
    table = pd.DataFrame(
        flattened(
            {
                "round": one.point.round,
                "purpose": one.point.purpose,
                **{field: one.point.values[field] for field in search.vary},
                "fidelity": one.point.values.get("fidelity", ""),
                search.objective.quantity: one.objective or math.nan,
                **{f"limit_{k}": value for k, value in enumerate(one.limits, 1)},
                "predicted": one.predicted or math.nan,
                "as_good": one.as_good,
                "refused": one.point.refused,
            }
        )
        for one in rows
    )
    write_report(
        out_dir,
        "search/search.html.j2",
        draw=lambda: draw_search(found, rows),
        tables={"points": table},
        name=NAME,
        filters={"label": label, "estimated": with_interval, "six": lambda value: number(value, 6)},
        studied=studied,
        search=search,
        rows=rows,
        best=best,
        lowest=lowest,
        compared=sum(bool(one.objective) and "fidelity" not in one.point.values for one in rows),
        packings=found.packings.shape[1],
    )
