"""A spreadsheet of the summary, with definitions and assumptions, for those who work with one."""

import json
import math
from collections.abc import Mapping, Sequence
from io import BytesIO

import pandas as pd
import pyarrow as pa

from dragchain.tables.columns import descriptions, unit_of
from dragdeck.records.case import AssumptionOfRun


def definitions(table: pd.DataFrame) -> pd.DataFrame:
    """What the columns of the summary mean, by `dragchain.tables.columns`.

    Parameters
    ----------
    table : DataFrame
        A table of N columns.

    Returns
    -------
    DataFrame
        N rows ``column``, ``unit`` (``1`` for plain numbers) and ``meaning``.
    """
    rows = [
        (field.name, unit_of(field), descriptions(field.name).get("summary", ""))
        for field in pa.Schema.from_pandas(table, preserve_index=False)
    ]
    return pd.DataFrame(rows, columns=["column", "unit", "meaning"], dtype=object)


def summary_workbook(
    table: pd.DataFrame, assumptions: Mapping[str, Sequence[AssumptionOfRun]]
) -> bytes:
    """The summary as an XLSX file: sheets Summary, Definitions and Assumptions.

    Parameters
    ----------
    table : DataFrame
        The summary, one row per run.
    assumptions : mapping of str to sequence of AssumptionOfRun
        The assumptions of each run, by its name.
    """
    assumed = [
        {"run": run, "field": row.field, "value": json.dumps(row.value), "reason": row.why}
        for run, rows in assumptions.items()
        for row in rows
    ]
    assumption_sheet = pd.DataFrame(assumed, columns=["run", "field", "value", "reason"])
    return workbook(
        {"Summary": table, "Definitions": definitions(table), "Assumptions": assumption_sheet}
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
