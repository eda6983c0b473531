"""The command that verifies a study's contact law: runs, tables and page of the suite."""

from collections.abc import Hashable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import get_args

import pandas as pd
from markupsafe import Markup

from dragchain.report.campaign import write_report
from dragchain.tables.columns import UNITS, unit_end
from dragdeck.cases.ranks import cores_here
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import say
from dragdeck.errors import RejectedRunError
from dragdeck.project import find_project, run_path
from evidence.verification.checks import ComparedRuns, checks_by_test
from evidence.verification.quantity_check import JUDGED, CheckVerdict, check_rows
from evidence.verification.recording import read_recording
from evidence.verification.suite import suite_file, suite_of

_BY_SERIES = ["number", "test", "series", "quantity", "against"]

Rows = Sequence[Mapping[Hashable, object]]


# --- the commands ---------------------------------------------------------------------------


def verify(study: str, fidelity: str | None, out_dir: Path, cores: int | None) -> str:
    """Run the suite for the materials of a study and write its report.

    Runs of the same inputs are not repeated; one that was interrupted is gone on with.

    Returns
    -------
    str
        How many quantities have each verdict, in words.

    Raises
    ------
    InputError
        The study cannot be used.
    EngineError
        No LIGGGHTS, or it was interrupted.
    RejectedRunError
        A run did not pass its acceptance checks, or a quantity failed.
    """
    project = find_project(Path.cwd())
    case = project.cases(study, fidelity)[0]
    folder = project.root / run_path("verification", "collide", "")
    batch = Batch(folder, project.templates_of(case))
    suite = suite_of(case.study)
    batch.each({run: partial(suite.__getitem__, run) for run in suite}, say, cores or cores_here())
    return verdict(write_verification(out_dir, [folder / name for name in suite]), out_dir)


def write_verification(out_dir: Path, run_dirs: Sequence[Path]) -> pd.DataFrame:
    """Judge runs of the suite and write its tables and its page.

    Writes ``checks.csv`` and ``checks.parquet`` (one row per comparison), ``verification.csv`` and
    ``verification.parquet`` (one row per quantity of a series: its worst comparison) and
    ``verification.html``.

    Parameters
    ----------
    out_dir : Path
        Made if need be.
    run_dirs : sequence of Path
        Folders of runs of the `collide` scene.

    Returns
    -------
    DataFrame
        The content of ``verification.parquet``.

    Raises
    ------
    RejectedRunError
        A run is not complete.
    TableError
        An impact is not whole.
    """
    compared = checks_by_test([read_recording(folder) for folder in run_dirs])
    tables = [check_rows(run, check) for rows in compared.values() for run, check in rows]
    checks = pd.concat([rows for rows in tables if len(rows)]).sort_values("number", kind="stable")
    checks = checks.reset_index(drop=True)
    summary = worst_rows(checks)
    write_report(
        out_dir,
        "verification/verification.html.j2",
        draw=dict,
        tables={"checks": checks, "verification": summary},
        name="verification",
        package="evidence",
        sections={test: _section(test, rows, summary) for test, rows in compared.items()},
        notes=suite_file().notes,
        counts=counts(summary),
        failures=_shown(summary[summary["verdict"] == "fail"]),
        runs=len(run_dirs),
    )
    return summary


def verdict(summary: pd.DataFrame, report_dir: Path) -> str:
    """How many quantities have each verdict, in words.

    Raises
    ------
    RejectedRunError
        At least one failed: names each, with its error.
    """
    said = ", ".join(f"{number} {name}" for name, number in counts(summary).items())
    bad = summary[summary["verdict"] == "fail"]
    if bad.empty:
        return said
    lines = [
        f"{row.test}, {row.series}, {row.quantity}: error {row.error:.2g}"
        f" (allowed: {row.tolerance:.2g})"
        for row in bad.itertuples()
    ]
    raise RejectedRunError("\n  ".join([f"{report_dir / 'verification.html'}: {said}", *lines]))


# --- tables of the page ---------------------------------------------------------------------


def worst_rows(checks: pd.DataFrame) -> pd.DataFrame:
    """The worst comparison of each quantity of each series, with their number."""
    groups = [
        group.sort_values("error", kind="stable").tail(1).assign(points=len(group))
        for _, group in checks.groupby(_BY_SERIES, sort=False)
    ]
    return pd.concat(groups, ignore_index=True)


def counts(summary: pd.DataFrame) -> dict[str, int]:
    """How many rows have each verdict."""
    verdicts = summary["verdict"].tolist()
    return {name: verdicts.count(name) for name in get_args(CheckVerdict)}


def _section(test: str, compared: ComparedRuns, summary: pd.DataFrame) -> Mapping[str, object]:
    """A test on the page: comparisons with the law that the engine claims to compute, and others.

    Its steps are the time steps in the shortest contact of its runs.
    """
    rows = summary[summary["test"] == test]
    same = rows["against"].isin(JUDGED)
    steps = sorted({run.case.steps_per_contact for run, _ in compared})
    shown = {"same": _shown(rows[same]), "others": _shown(rows[~same])}
    return {"test": suite_file().tests()[test], "steps": steps, **shown}


_CLASSES = {"pass": "good-word", "fail": "bad-word", "agrees": "good-word", "differs": "warn"}


def _shown(rows: pd.DataFrame) -> Rows:
    """Rows of a summary as the page shows them."""
    verdicts = [
        Markup('<span class="{}">{}</span>').format(_CLASSES[word], word)
        for word in rows["verdict"]
    ]
    shown = rows.assign(quantity=rows["quantity"].map(quantity_words), verdict=verdicts)
    return shown.to_dict("records")


def quantity_words(quantity: str) -> str:
    """A quantity's name in words, its unit in brackets."""
    if not (end := unit_end(quantity)):
        return quantity.replace("_", " ")
    unit = UNITS[end].replace("s2", "s\u00b2")
    return f"{quantity.removesuffix(f'_{end}').replace('_', ' ')} ({unit})"
