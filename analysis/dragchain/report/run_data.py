"""What findings and figures need of a run: each table is read once, and only if it is needed."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.arrays import Floats
from dragchain.figures.network_picture import Scene, load_scene
from dragchain.figures.rendering import check_rendering
from dragchain.run.case import Case
from dragchain.run.kinematics import process_time
from dragchain.tables.by_step import read_table


class DragTrace(NamedTuple):
    """The force on the workpiece during the drag, (N,) each.

    Attributes
    ----------
    process_time_s : array
        From the start of the drag, at the speed of the process.
    drag_n, lateral_n : array
    counted : array of bool
        Whether a sample is in the statistics.
    """

    process_time_s: Floats
    drag_n: Floats
    lateral_n: Floats
    counted: NDArray[np.bool_]


@dataclass(frozen=True)
class RunData:
    """A run with its tables made.

    Attributes
    ----------
    folder : Path
    case : Case
    """

    folder: Path
    case: Case

    def table(self, name: str, columns: list[str] | None = None) -> pd.DataFrame:
        """A table of the run, or some of its columns."""
        return read_table(self.folder / "tables" / f"{name}.parquet", columns)

    @cached_property
    def network(self) -> pd.DataFrame:
        """Statistics of the network frames."""
        return self.table("network")

    @cached_property
    def chains(self) -> pd.DataFrame:
        """Force chains and workpiece paths of the network frames."""
        numbers = ["n_particles", "bottleneck_n", "azimuth_rad", "altitude_m"]
        return self.table(
            "chains", ["step", "definition", *numbers, "reaches_bowl", "end_kind", "dominant"]
        )

    @cached_property
    def drag(self) -> DragTrace:
        """The force on the workpiece during the drag."""
        columns = ["time_s", "phase", "drag_n", "lateral_n", "in_statistics"]
        table = self.table("workpiece_force", columns)
        table = table[table["phase"] == "drag"]
        time_s, drag, lateral = (
            table[name].to_numpy(np.float64) for name in ("time_s", "drag_n", "lateral_n")
        )
        counted = table["in_statistics"].to_numpy(bool)
        return DragTrace(process_time(time_s, self.case), drag, lateral, counted)

    @cached_property
    def bottlenecks_n(self) -> Floats:
        """The dominant workpiece path's bottleneck in each network frame, see below."""
        return dominant_bottlenecks(self.network, self.chains)

    @cached_property
    def scene(self) -> Scene:
        """What the pictures of the contact network show, if pictures can be rendered here."""
        check_rendering()
        return load_scene(self.folder, self.case)


def dominant_bottlenecks(network: pd.DataFrame, chains: pd.DataFrame) -> Floats:
    """The dominant workpiece path's bottleneck in each network frame in N, 0 without a path."""
    dominant = chains[chains["dominant"]].set_index("step")["bottleneck_n"]
    return dominant.reindex(network["step"]).fillna(0.0).to_numpy(np.float64)
