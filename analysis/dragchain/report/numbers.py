"""The main numbers of a study in a few lines, read from its summary."""

from pathlib import Path

import pandas as pd

from dragchain.errors import TableError

_SHOWN = 10
"""Cases that are listed; all are in the summary."""


def main_numbers(report_dir: Path) -> str:
    """Where the report is, and the main numbers of each case as the report states them.

    Raises
    ------
    TableError
        There is no summary.
    """
    file = report_dir / "summary.parquet"
    if not file.is_file():
        raise TableError(f"{file}: there is no such file; run `dragchain report` first")
    lines = pd.read_parquet(file, columns=["headline"])["headline"].drop_duplicates().tolist()
    more = f"  and {len(lines) - _SHOWN} more: {report_dir / 'summary.csv'}"
    shown = [f"  {line}" for line in lines[:_SHOWN]]
    head = f"report: {report_dir / 'report.html'}"
    return "\n".join([head, *shown, *([more] if len(lines) > _SHOWN else [])])
