"""A spreadsheet of the summary, with definitions and assumptions, for those who work with one."""

import json
import math
from collections.abc import Mapping, Sequence
from io import BytesIO
from itertools import chain

import pandas as pd
import pyarrow as pa

from dragchain.quantities.basis import Standing
from dragchain.report.cases import ReportedCase
from dragchain.tables.columns import descriptions, unit_of
from dragdeck.records.case import AssumptionOfRun


def definitions(table: pd.DataFrame, name: str = "summary") -> pd.DataFrame:
    """What the columns of a table mean, by `dragchain.tables.columns`.

    Parameters
    ----------
    table : DataFrame
        A table of N columns.
    name : str
        The table's name there.

    Returns
    -------
    DataFrame
        N rows ``column``, ``unit`` (``1`` for plain numbers) and ``meaning``.
    """
    rows = [
        (field.name, unit_of(field), descriptions(field.name).get(name, ""))
        for field in pa.Schema.from_pandas(table, preserve_index=False)
    ]
    return pd.DataFrame(rows, columns=["column", "unit", "meaning"], dtype=object)


def overview(cases: Sequence[ReportedCase]) -> pd.DataFrame:
    """The main quantities of all cases, one row per line of the set-up and per quantity.

    Parameters
    ----------
    cases : sequence of ReportedCase
        C cases.

    Returns
    -------
    DataFrame
        ``quantity``, ``unit`` and five columns per case: value of the process, the ends of its
        95 % confidence interval, value of the run, and what the first one rests on.
    """
    standings = [{one.quantity: one for one in case.values.standings} for case in cases]
    known = dict.fromkeys(quantity for every in standings for quantity in every)
    rows: list[list[object]] = []
    for line, (name, _) in enumerate(cases[0].set_up):
        texts = [[case.set_up[line][1], *[None] * 4] for case in cases]
        rows.append([name, None, *chain.from_iterable(texts)])
    for quantity in known:
        cells = [_cells(every.get(quantity)) for every in standings]
        rows.append([quantity.label, quantity.unit or "1", *chain.from_iterable(cells)])
    heads = ("process", "95 % CI low", "95 % CI high", "run", "basis")
    columns = [f"{case.name}: {head}" for case in cases for head in heads]
    return pd.DataFrame(rows, columns=["quantity", "unit", *columns], dtype=object)


def _cells(one: Standing | None) -> list[object]:
    if one is None:
        return [None] * 5
    value = [one.value.value, one.value.ci95_low, one.value.ci95_high] if one.value else [None] * 3
    return [*value, one.run.value, f"{one.rests_on}; {one.reason}" if one.reason else one.rests_on]


def summary_workbook(
    table: pd.DataFrame,
    assumptions: Mapping[str, Sequence[AssumptionOfRun]],
    cases: Sequence[ReportedCase],
) -> bytes:
    """The summary as an XLSX file: sheets Overview, Summary, Definitions and Assumptions.

    Parameters
    ----------
    table : DataFrame
        The summary, one row per run.
    assumptions : mapping of str to sequence of AssumptionOfRun
        The assumptions of each run, by its name.
    cases : sequence of ReportedCase
        The cases for the overview.
    """
    assumed = [
        {"run": run, "field": one.field, "value": json.dumps(one.value), "reason": one.why}
        for run, found in assumptions.items()
        for one in found
    ]
    assumption_sheet = pd.DataFrame(assumed, columns=["run", "field", "value", "reason"])
    return workbook(
        {
            "Overview": overview(cases),
            "Summary": table,
            "Definitions": definitions(table),
            "Assumptions": assumption_sheet,
        }
    )


def workbook(sheets: Mapping[str, pd.DataFrame]) -> bytes:
    """Tables as the sheets of an XLSX file; text stays text, whatever it starts with."""
    content = BytesIO()
    options = {"options": {"strings_to_formulas": False, "strings_to_urls": False}}
    with pd.ExcelWriter(content, engine="xlsxwriter", engine_kwargs=options) as book:
        for name, table in sheets.items():
            finite = table.replace([math.inf, -math.inf], None)
            finite.to_excel(book, sheet_name=name, index=False, freeze_panes=(1, 0))
            book.sheets[name].autofit(300)
    return content.getvalue()
