"""A quantity of a run of the suite beside a reference: its rows and their verdicts."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from evidence.verification.recording import Recording

EXACT = "exact formula"
INTEGRATED = "law integrated in small steps"
COULOMB = "Coulomb sliding of rigid bodies"
INPUT = "input restitution"
PUBLISHED = "published curve"

JUDGED = (EXACT, INTEGRATED)
"""References that are the same law: a difference is a failure."""

CheckVerdict = Literal["pass", "fail", "agrees", "differs"]
"""``pass`` or ``fail`` against the same law, ``agrees`` or ``differs`` against another one."""

CheckRows = Sequence[tuple[float, float, float]]
"""Rows of x, reference and engine."""


@dataclass(frozen=True)
class QuantityCheck:
    """A quantity of a run beside a reference.

    Attributes
    ----------
    quantity, against : str
    rows : rows of (x, reference, engine)
        What is judged; x is what varies in the test, NaN if nothing does.
    tolerance : float
    scale : float, optional
        To which errors are relative; None: the largest reference of the rows.
    series : str
        Name of the series, if not that of the run.
    """

    quantity: str
    against: str
    rows: CheckRows
    tolerance: float
    scale: float | None = None
    series: str = ""


# --- tables ---------------------------------------------------------------------------------


def check_rows(run: Recording, check: QuantityCheck) -> pd.DataFrame:
    """The rows of a comparison with their verdicts.

    Returns
    -------
    DataFrame
        One row per value. ``x_name`` and ``x`` are what varies in the test and its value (NaN if
        nothing does), ``scale`` is the largest absolute reference of the series, or 1 for a
        ratio, and ``error`` is that of the engine divided by it.
    """
    x, reference, engine = np.array(check.rows, dtype=np.float64).reshape(-1, 3).T
    size = check.scale or float(np.abs(reference).max(initial=0.0)) or 1.0
    error = np.abs(engine - reference) / size
    verdicts = ("pass", "fail") if check.against in JUDGED else ("agrees", "differs")
    return pd.DataFrame(
        {
            "number": run.case.number,
            "test": run.case.test,
            "series": check.series or series_name(run),
            "quantity": check.quantity,
            "x_name": run.case.vary,
            "x": x,
            "against": check.against,
            "reference": reference,
            "engine": engine,
            "scale": size,
            "error": error,
            "tolerance": check.tolerance,
            "verdict": np.where(error <= check.tolerance, *verdicts),
        }
    )


_BY_SERIES_AND_LIMIT = ("restitution", "oblique_study", "spin_plane", "time_step")
"""Tests that are run with and without the limit on attraction."""


def series_name(run: Recording) -> str:
    """Materials, and whether attraction is cut off where a test has both."""
    case = run.case
    limit = "limitForce on" if case.limit_force else "limitForce off"
    series = case.series.replace("_", " ")
    name = f"{series}, {limit}" if case.test in _BY_SERIES_AND_LIMIT else series
    steps = case.test in ("time_step", "bounce")
    return f"{name}, {case.steps_per_contact} steps a contact" if steps else name
