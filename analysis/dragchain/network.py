"""Statistics of the contact network, frame by frame.

Only frames inside the counted stretch of the drag are used: those between the first and the last
sample that ``rod_force.parquet`` marks as ``counted``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.chains import chain_table
from dragchain.clusters import Clusters, cluster_rows, frame_clusters
from dragchain.errors import TableError
from dragchain.frames import KINDS, Ints, NetworkFrame, TableParts, read_frames, write_parquet

LEAST_CONTACTS = 4
"""A ball with fewer contacts is a rattler. Four is the mean number with which frictional spheres
are isostatic; Thornton (2000) leaves out only balls with fewer than two."""


def contact_counts(frame: NetworkFrame) -> Ints:
    """Return the number of contacts of each ball, those with rod and bowl included, (N,)."""
    size = frame.ball_id.size
    return np.bincount(frame.a, minlength=size) + np.bincount(
        frame.b[frame.between_balls()], minlength=size
    )


def coordination_number(counts: NDArray[np.integer[Any]]) -> float:
    """Return the mean number of contacts per ball.

    Without walls that is 2 M / N for M contacts (Thornton 2000, Geotechnique 50, 43-53); a contact
    with rod or bowl counts once, for the ball.
    """
    return float(counts.mean()) if counts.size else float("nan")


def mechanical_coordination_number(
    counts: NDArray[np.integer[Any]], least: int = LEAST_CONTACTS
) -> float:
    """Return the mean number of contacts of the balls that carry load.

    After Thornton (2000, Geotechnique 50, 43-53), whose (2 M - N1) / (N - N0 - N1) is the case
    ``least=2``: balls with fewer than `least` contacts are left out as carriers, while their
    contacts still count for the carriers that they touch. NaN where no ball is left.
    """
    return coordination_number(counts[counts >= least])


def frame_statistics(frame: NetworkFrame, clusters: Clusters | None = None) -> dict[str, float]:
    """Return one row of ``network.parquet``; forces in N, NaN where a frame has no contact.

    `clusters` is what `frame_clusters` returns for the frame, if it is known already.
    """
    clusters = clusters or frame_clusters(frame)
    counts = contact_counts(frame)
    normal = frame.normal_force
    mean = float(normal.mean()) if normal.size else float("nan")
    of_kind = {
        f"ball_{name}_contacts": int((frame.other == kind).sum()) for kind, name in KINDS.items()
    }
    return {
        "step": frame.step,
        "time_s": frame.time_s,
        "balls": frame.ball_id.size,
        "contacts": normal.size,
        **of_kind,
        "coordination_number": coordination_number(counts),
        "mechanical_coordination_number": mechanical_coordination_number(counts),
        "rattler_share": float((counts < LEAST_CONTACTS).mean()) if counts.size else float("nan"),
        "normal_force_mean_n": mean,
        "normal_force_max_n": float(normal.max()) if normal.size else float("nan"),
        "above_mean_share": float((normal > mean).mean()) if normal.size else float("nan"),
        **{f"{name}_n": force for name, force in clusters.percolation_n.items()},
    }


def write_chains(run_dir: Path) -> None:
    """Write the tables ``network``, ``clusters`` and ``chains`` of a process run.

    They hold the frames of the counted stretch of the drag and no others. One frame is in memory
    at a time.

    Raises
    ------
    TableError
        If a table is missing, or if the counted stretch holds no network frame.
    """
    network: list[dict[str, float]] = []
    grown: list[dict[str, NDArray[Any]]] = []
    tables = run_dir / "tables"
    with TableParts(tables / "chains.parquet") as found:
        for frame in read_frames(run_dir):
            clusters = frame_clusters(frame)
            network.append(frame_statistics(frame, clusters))
            grown.append(cluster_rows(frame, clusters))
            found.write(chain_table(frame))
        if not network:
            raise TableError(
                f"{run_dir}: the counted stretch of the drag holds no network frame; "
                "write the outputs contacts and balls more often or run longer"
            )
    write_parquet(pd.DataFrame(network), tables / "network.parquet")
    columns = {name: np.concatenate([part[name] for part in grown]) for name in grown[0]}
    write_parquet(pd.DataFrame(columns), tables / "clusters.parquet")
