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
from dragchain.tables.columns import descriptions, unit_end, unit_of
from dragdeck.records.case import AssumptionOfRun

_WORDS = {
    "ci95 low": "95 % CI lower end", "ci95 high": "95 % CI upper end", "youngs": "Young's",
    "std": "standard deviation", "timestep": "time step", "poissons": "Poisson's",
}  # fmt: skip


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
        N rows ``heading``, ``column``, ``unit`` (``1`` for plain numbers) and ``meaning``. The
        heading is the column in words, and ends with its unit.
    """
    rows = []
    for field in pa.Schema.from_pandas(table, preserve_index=False):
        unit = unit_of(field)
        rows.append(
            (_heading(field.name, unit), field.name, unit, descriptions(field.name).get(name, ""))
        )
    return pd.DataFrame(rows, columns=["heading", "column", "unit", "meaning"], dtype=object)


def _heading(column: str, unit: str) -> str:
    """A column's name in words, with its unit in brackets."""
    end = unit_end(column)
    text = column.removesuffix(f"_{end}").replace("_", " ")
    for word, shown in _WORDS.items():
        text = f" {text} ".replace(f" {word} ", f" {shown} ").strip()
    return f"{text[:1].upper()}{text[1:]}" + (f" ({unit})" if end else "")


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
    about = definitions(table)
    assumed = [
        {"run": run, "field": one.field, "value": json.dumps(one.value), "reason": one.why}
        for run, found in assumptions.items()
        for one in found
    ]
    summary = table.set_axis(about["heading"], axis=1)
    assumption_sheet = pd.DataFrame(assumed, columns=["run", "field", "value", "reason"])
    return workbook(
        {
            "Overview": overview(cases),
            "Summary": summary,
            "Definitions": about,
            "Assumptions": assumption_sheet,
        }
    )


def workbook(sheets: Mapping[str, pd.DataFrame]) -> bytes:
    """Tables as the sheets of an XLSX file; text stays text, whatever it starts with."""
    from xlsxwriter import Workbook

    content = BytesIO()
    with Workbook(content, _OPTIONS) as book:
        bold = book.add_format({"bold": True, "text_wrap": True, "valign": "top"})
        formats = {code: book.add_format({"num_format": code}) for code in _NUMBERS.values()}
        for name, table in sheets.items():
            sheet = book.add_worksheet(name)
            for column, (heading, values) in enumerate(table.items()):
                sheet.write_string(0, column, str(heading), bold)
                for row, value in enumerate(values.tolist(), start=1):
                    if not isinstance(value, float) or value == 0.0:
                        sheet.write(row, column, value)
                    elif math.isfinite(value):
                        size = next(least for least in _NUMBERS if abs(value) >= least)
                        sheet.write(row, column, value, formats[_NUMBERS[size]])
            sheet.freeze_panes(1, 0)
            sheet.autofit(300)
    return content.getvalue()


_OPTIONS = {"in_memory": True, "strings_to_formulas": False, "strings_to_urls": False}
_NUMBERS = {1000.0: "#,##0", 10.0: "0.0", 0.01: "0.000", 0.0: "0.00E+00"}
"""Formats of numbers from these sizes on."""
