"""The force on the workpiece: the samples that statistics use, and their means."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd

from dragchain.statistics.correlated import MeanEstimate, estimate_mean
from dragchain.tables.by_step import intact


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
        The rows of ``workpiece_force.parquet`` with ``counted`` true.

    Raises
    ------
    TableError
        If the table is not there or damaged.
    """
    file = Path(run_dir) / "tables" / "workpiece_force.parquet"
    wanted = None if columns is None else list(columns)
    with intact(file):
        return pd.read_parquet(file, columns=wanted, filters=[("in_statistics", "==", True)])


def summarise_forces(run_dir: Path | str) -> dict[str, MeanEstimate]:
    """Mean and spread of the force on the workpiece in the workpiece frame.

    Parameters
    ----------
    run_dir : Path or str
        The run folder, with its tables made.

    Returns
    -------
    dict of str to MeanEstimate
        For ``drag_n``, ``lateral_n`` and ``vertical_n``, in N.

    Raises
    ------
    TableError
        If ``workpiece_force.parquet`` is not there.
    SeriesError
        If too few samples are counted.
    """
    names = ("drag_n", "lateral_n", "vertical_n")
    samples = read_counted(run_dir, names)
    return {name: estimate_mean(samples[name].to_numpy()) for name in names}
