"""Tables and page of the verification suite."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path

import matplotlib
import pandas as pd

from dragchain.errors import RejectedRunError, TableError
from dragchain.figures.style import STYLE, png
from dragchain.report.page import data_uri, render_page
from dragchain.tables.by_step import read_table
from dragchain.tables.parquet import write_parquet
from dragchain.verification.checks import JUDGED, Check, judge
from dragchain.verification.figures import draw
from dragchain.verification.recording import Recording, read_recording
from dragchain.verification.words import WORDS

BY_SERIES = ["number", "test", "series", "quantity", "against"]


def write_verification(out_dir: Path, run_dirs: Sequence[Path]) -> pd.DataFrame:
    """Judge the runs of the suite and write its tables and its page.

    Writes ``checks.csv`` and ``checks.parquet`` (a row is one comparison),
    ``verification.csv`` and ``verification.parquet`` (a row is one quantity of
    one series: its worst comparison) and ``verification.html``.

    Parameters
    ----------
    out_dir : Path
        Made if need be.
    run_dirs : sequence of Path
        Folders of runs of the `collide` scene.

    Returns
    -------
    DataFrame
        The rows of ``verification.parquet``.

    Raises
    ------
    RejectedRunError
        A run is not complete.
    TableError
        No run is given, or an impact is not whole.
    """
    if not run_dirs:
        raise TableError("no folder of a run is given, so there is nothing to verify")
    runs = [read_recording(folder) for folder in run_dirs]
    checks = judge(runs)
    table = pd.DataFrame([vars(check) for check in checks])
    summary = summarise(checks)
    page = render(runs, summary)
    out_dir.mkdir(parents=True, exist_ok=True)
    for name, frame in (("checks", table), ("verification", summary)):
        write_parquet(frame, out_dir / f"{name}.parquet")
        _write(out_dir / f"{name}.csv", frame.to_csv(index=False, lineterminator="\n"))
    _write(out_dir / "verification.html", page)
    return summary


def _write(file: Path, text: str) -> None:
    draft = file.with_name(f".{file.name}.tmp")
    draft.write_text(text, encoding="utf-8")
    draft.replace(file)


def summarise(checks: Sequence[Check]) -> pd.DataFrame:
    """The worst comparison of each quantity of each series, with their number."""
    table = pd.DataFrame([vars(check) for check in checks])
    rows = []
    for _, group in table.groupby(BY_SERIES, sort=False):
        worst = group.sort_values("error", kind="stable").iloc[-1].to_dict()
        rows.append({**worst, "points": len(group)})
    return pd.DataFrame(rows)


def counts(summary: pd.DataFrame) -> dict[str, int]:
    """How many rows have each verdict."""
    verdicts = summary["verdict"].tolist()
    return {name: verdicts.count(name) for name in ("pass", "fail", "agrees", "differs")}


def verdict(report_dir: Path) -> str:
    """How many quantities have each verdict, in words.

    Raises
    ------
    RejectedRunError
        At least one failed: names each, with its error.
    TableError
        There is no summary.
    """
    summary = read_table(report_dir / "verification.parquet")
    found = ", ".join(f"{number} {name}" for name, number in counts(summary).items())
    bad = summary[summary["verdict"] == "fail"]
    if bad.empty:
        return found
    lines = [
        f"{row.test}, {row.series}, {row.quantity}: error {row.error:.2g}"
        f" (allowed: {row.tolerance:.2g})"
        for row in bad.itertuples()
    ]
    raise RejectedRunError("\n  ".join([f"{report_dir / 'verification.html'}: {found}", *lines]))


def render(runs: Sequence[Recording], summary: pd.DataFrame) -> str:
    """The page: HTML that needs no other file and no network."""
    ordered = sorted(runs, key=lambda run: (run.case["number"], _place(str(run.case["test"]))))
    parts = [
        _part(test, list(group), summary)
        for test, group in groupby(ordered, key=lambda run: str(run.case["test"]))
    ]
    return render_page(
        "verification/verification.html.j2",
        {"quantity": quantity},
        parts=parts,
        counts=counts(summary),
        failures=_rows(summary[summary["verdict"] == "fail"]),
        runs=len(runs),
    )


def _place(test: str) -> int:
    return list(WORDS).index(test)


def _part(test: str, runs: Sequence[Recording], summary: pd.DataFrame) -> Mapping[str, object]:
    rows = summary[summary["test"] == test]
    with matplotlib.rc_context(STYLE):
        picture = data_uri(png(draw(test, runs)))
    first = runs[0].case
    return {
        "test": test,
        "number": first["number"],
        "heading": first["heading"],
        "words": WORDS[test],
        "picture": picture,
        "same": _rows(rows[rows["against"].isin(JUDGED)]),
        "others": _rows(rows[~rows["against"].isin(JUDGED)]),
        "steps": sorted({run.steps_per_contact for run in runs}),
    }


def _rows(table: pd.DataFrame) -> list[dict[str, object]]:
    return [
        {str(key): None if _missing(value) else value for key, value in row.items()}
        for row in table.to_dict("records")
    ]


def _missing(value: object) -> bool:
    return isinstance(value, float) and math.isnan(value)


_UNITS = {
    "_rad_s2": "rad/s²",
    "_m_s2": "m/s²",
    "_rad_s": "rad/s",
    "_m_s": "m/s",
    "_deg": "degrees",
    "_n": "N",
    "_m": "m",
    "_s": "s",
}


def quantity(name: str) -> str:
    """A quantity's name in words, its unit in brackets."""
    for ending, unit in _UNITS.items():
        if name.endswith(ending):
            return f"{name.removesuffix(ending).replace('_', ' ')} ({unit})"
    return name.replace("_", " ")
