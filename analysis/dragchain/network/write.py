"""The tables of a run's contact network."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.errors import TableError
from dragchain.network.chain_table import chain_table
from dragchain.network.clusters import cluster_rows, frame_clusters
from dragchain.network.frame import read_frames
from dragchain.network.statistics import frame_statistics
from dragchain.tables.parquet import table_writer, write_parquet


def write_chains(run_dir: Path) -> None:
    """Write the tables ``network``, ``clusters`` and ``chains`` of a process run.

    They contain the frames of the drag that enter the statistics. At most one frame is in memory.

    Raises
    ------
    TableError
        If a table is missing, or if the statistics contain no frame of the network.
    """
    network: list[dict[str, float]] = []
    grown: list[dict[str, NDArray[Any]]] = []
    tables = run_dir / "tables"
    with table_writer(tables / "chains.parquet") as found:
        for frame in read_frames(run_dir):
            clusters = frame_clusters(frame)
            network.append(frame_statistics(frame, clusters))
            grown.append(cluster_rows(frame, clusters))
            found.write(chain_table(frame))
        if not network:
            raise TableError(
                f"{run_dir}: the statistics contain no frame of the contact network; "
                "increase outputs.network_hz or use a longer path"
            )
    write_parquet(pd.DataFrame(network), tables / "network.parquet")
    columns = {name: np.concatenate([part[name] for part in grown]) for name in grown[0]}
    write_parquet(pd.DataFrame(columns), tables / "clusters.parquet")
