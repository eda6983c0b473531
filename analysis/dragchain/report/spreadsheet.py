"""A spreadsheet of the summary, with definitions and assumptions, for those who work with one."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from io import BytesIO
from typing import TYPE_CHECKING

import pandas as pd

from dragchain.run.case import Assumption
from dragchain.tables.meanings import descriptions, unit_end

if TYPE_CHECKING:
    from xlsxwriter.worksheet import Worksheet

_WORDS = {
    "ci95 low": "95 % CI lower end", "ci95 high": "95 % CI upper end", "youngs": "Young's",
    "std": "standard deviation", "timestep": "time step", "poissons": "Poisson's",
}  # fmt: skip


def definitions(columns: Iterable[str]) -> pd.DataFrame:
    """What the columns of the summary mean.

    Parameters
    ----------
    columns : iterable of str
        Names of N columns.

    Returns
    -------
    DataFrame
        N rows ``heading``, ``column``, ``unit``, ``meaning``. The heading ends with the unit.
    """
    rows = []
    for column in columns:
        meaning = descriptions(column).get("summary", "")
        rows.append((_heading(column), column, unit_end(column)[1], meaning))
    return pd.DataFrame(rows, columns=["heading", "column", "unit", "meaning"], dtype=object)


def _heading(column: str) -> str:
    """A column's name in words, with its unit in brackets."""
    end, unit = unit_end(column)
    text = column.removesuffix(end).replace("_", " ")
    for word, shown in _WORDS.items():
        text = f" {text} ".replace(f" {word} ", f" {shown} ").strip()
    return f"{text[:1].upper()}{text[1:]}" + (f" ({unit})" if unit else "")


def summary_workbook(table: pd.DataFrame, assumptions: Mapping[str, Sequence[Assumption]]) -> bytes:
    """The summary as an XLSX file with the sheets Summary, Definitions and Assumptions.

    Parameters
    ----------
    table : DataFrame
        The summary, one row per case.
    assumptions : mapping of str to sequence of Assumption
        The assumptions of each run, by its name.
    """
    about = definitions(table.columns)
    assumed = [
        {"run": run, "field": one.field, "value": json.dumps(one.value), "reason": one.why}
        for run, found in assumptions.items()
        for one in found
    ]
    summary = table.set_axis(about["heading"], axis=1)
    assumption_sheet = pd.DataFrame(assumed, columns=["run", "field", "value", "reason"])
    return workbook({"Summary": summary, "Definitions": about, "Assumptions": assumption_sheet})


def workbook(sheets: Mapping[str, pd.DataFrame]) -> bytes:
    """Tables as the sheets of an XLSX file; text stays text, whatever it starts with."""
    from xlsxwriter import Workbook

    content = BytesIO()
    with Workbook(content, {"in_memory": True}) as book:
        bold = book.add_format({"bold": True, "text_wrap": True, "valign": "top"})
        for name, table in sheets.items():
            sheet = book.add_worksheet(name)
            for column, (heading, values) in enumerate(table.items()):
                sheet.write_string(0, column, str(heading), bold)
                for row, value in enumerate(values.tolist(), start=1):
                    _write(sheet, row, column, value)
            sheet.freeze_panes(1, 0)
            sheet.autofit(300)
    return content.getvalue()


def _write(sheet: "Worksheet", row: int, column: int, value: object) -> None:
    """Write a cell by the type of its value; a number that there is none of stays blank."""
    if isinstance(value, bool):
        sheet.write_boolean(row, column, value)
    elif isinstance(value, int | float):
        if math.isfinite(value):
            sheet.write_number(row, column, value)
    elif value is not None:
        sheet.write_string(row, column, str(value))
