"""A spreadsheet of the summary, with definitions and assumptions, for those who work with one."""

import json
import math
from collections.abc import Mapping, Sequence
from io import BytesIO
from typing import TYPE_CHECKING

import pandas as pd
import pyarrow as pa

from dragchain.run.case import Assumption
from dragchain.tables.meanings import descriptions, unit_end, unit_of

if TYPE_CHECKING:
    from xlsxwriter.worksheet import Worksheet

_WORDS = {
    "ci95 low": "95 % CI lower end", "ci95 high": "95 % CI upper end", "youngs": "Young's",
    "std": "standard deviation", "timestep": "time step", "poissons": "Poisson's",
}  # fmt: skip


def definitions(table: pd.DataFrame, name: str = "summary") -> pd.DataFrame:
    """What the columns of a table mean, by `dragchain.tables.meanings`.

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


def summary_workbook(
    table: pd.DataFrame,
    assumptions: Mapping[str, Sequence[Assumption]],
) -> bytes:
    """The summary as an XLSX file with the sheets Summary, Definitions and Assumptions.

    Parameters
    ----------
    table : DataFrame
        The summary, one row per case.
    assumptions : mapping of str to sequence of Assumption
        The assumptions of each run, by its name.
    """
    about = definitions(table)
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
