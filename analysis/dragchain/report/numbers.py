"""The main numbers of a study in a few lines, read from its summary."""

from pathlib import Path

import pandas as pd

from dragchain.errors import TableError

_SHOWN = 10
"""Cases that are listed; all are in the summary."""

_COLUMNS = ("case", "drag_mean_n", "drag_ci95_low_n", "drag_ci95_high_n", "drag_std_n",
            "drag_reliable", "workpiece_contacts_per_frame")  # fmt: skip


def main_numbers(report_dir: Path) -> str:
    """Where the report is, and the mean drag of each case with its 95 % confidence interval.

    Raises
    ------
    TableError
        There is no summary.
    """
    file = report_dir / "summary.parquet"
    if not file.is_file():
        raise TableError(f"{file}: there is no such file; run `dragchain report` first")
    table = pd.read_parquet(file, columns=list(_COLUMNS))
    lines = [_line(*row) for row in table[list(_COLUMNS)].head(_SHOWN).itertuples(index=False)]
    more = f"  and {len(table) - _SHOWN} more: {report_dir / 'summary.csv'}"
    head = f"report: {report_dir / 'report.html'}"
    return "\n".join([head, *lines, *([more] if len(table) > _SHOWN else [])])


def _line(
    case: str, mean: float, low: float, high: float, std: float, reliable: bool, contacts: float
) -> str:
    doubt = "" if reliable else ", too short for a reliable interval"
    return (
        f"  {case}: mean drag {mean:.3g} N (95 % CI {low:.3g} to {high:.3g} N{doubt}), standard "
        f"deviation {std:.3g} N, {contacts:.3g} contacts on the workpiece"
    )
