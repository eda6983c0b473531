"""Where the workpiece is at a step, from its table of forces."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.arrays import Floats
from dragchain.run.case import Case
from dragchain.run.kinematics import workpiece_rotation
from dragchain.tables.by_step import read_table
from dragdeck.study.rotation import Rotation

WorkpiecePlaces = Callable[[int], tuple[Floats, Rotation]]

WORKPIECE_COLUMNS = ("step", "ref_x_m", "ref_y_m", "ref_z_m", "direction_rad")
"""Columns of ``workpiece_force.parquet`` that say where the workpiece is."""


def workpiece_places(run_dir: Path, case: Case) -> WorkpiecePlaces:
    """A function of a step: the workpiece's reference point in m, and its orientation.

    Raises
    ------
    TableError
        If ``workpiece_force.parquet`` is not there.
    """
    workpiece = read_table(run_dir / "tables" / "workpiece_force.parquet", list(WORKPIECE_COLUMNS))
    return lambda step: workpiece_place(workpiece, step, case)


def workpiece_place(workpiece: pd.DataFrame, step: int, case: Case) -> tuple[Floats, Rotation]:
    """The workpiece's reference point at a step in m, (3,), and its orientation.

    Parameters
    ----------
    workpiece : DataFrame
        `WORKPIECE_COLUMNS` of ``workpiece_force.parquet``, of the samples around that step at
        least.
    step : int
        The step.
    case : Case
        The case, of a process.
    """
    return _reference_point(workpiece, step), _workpiece_rotation(workpiece, step, case)


def _reference_point(workpiece: pd.DataFrame, step: int) -> Floats:
    """The reference point at a step, between the samples around it."""
    at = workpiece["step"].to_numpy(np.float64)
    point = workpiece[["ref_x_m", "ref_y_m", "ref_z_m"]].to_numpy(np.float64)
    return np.array([np.interp(step, at, column) for column in point.T])


def _workpiece_rotation(workpiece: pd.DataFrame, step: int, case: Case) -> Rotation:
    """The workpiece's orientation at a step, its direction of motion that of the nearest sample."""
    nearest = [int(np.abs(workpiece["step"].to_numpy(np.int64) - step).argmin())]
    direction = workpiece["direction_rad"].to_numpy(np.float64)[nearest]
    return workpiece_rotation(np.array([step]), direction, case)
