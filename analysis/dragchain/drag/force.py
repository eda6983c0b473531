"""The force on the workpiece: the samples that statistics use, and their means."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from dragchain.statistics.correlated import MeanEstimate, estimate_mean
from dragchain.tables.by_step import intact

FORCES = ("drag_n", "lateral_n", "vertical_n")
"""The force on the workpiece in the workpiece frame."""


def read_counted(run_dir: Path | str, columns: Sequence[str] | None = None) -> pd.DataFrame:
    """Read the samples of the force on the workpiece that statistics use.

    Parameters
    ----------
    run_dir : Path or str
        The run folder, with its tables made.
    columns : sequence of str, optional
        Columns to read; all if None.

    Returns
    -------
    DataFrame
        The rows of ``workpiece_force.parquet`` with ``in_statistics`` true.

    Raises
    ------
    TableError
        If the table is not there or damaged.
    """
    file = Path(run_dir) / "tables" / "workpiece_force.parquet"
    wanted = None if columns is None else list(columns)
    with intact(file):
        return pd.read_parquet(file, columns=wanted, filters=[("in_statistics", "==", True)])


def summarise_forces(samples: pd.DataFrame) -> dict[str, MeanEstimate]:
    """Mean and spread of `FORCES` over samples of `read_counted`, in N.

    Raises
    ------
    SeriesError
        If there are too few samples.
    """
    return {name: estimate_mean(samples[name].to_numpy()) for name in FORCES}
