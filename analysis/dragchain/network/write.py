"""The tables of a run's contact network: statistics, clusters, and chains by both definitions."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.arrays import Floats, Ints
from dragchain.errors import TableError
from dragchain.network.chains import (
    ChainRows,
    major_stress,
    particle_stress,
    path_rows,
    peters_rows,
    split_chains,
)
from dragchain.network.frame import BODY_NAMES, FLOOR, SIDE, NetworkFrame, network_frames
from dragchain.network.statistics import cluster_rows, frame_clusters, frame_statistics
from dragchain.tables.parquet import table_writer, write_parquet
from dragdeck.records.case import load_case
from dragdeck.study.rotations import wrap_angle


def chain_table(frame: NetworkFrame) -> pd.DataFrame:
    """The chains of a frame by both definitions, one row per chain.

    Returns
    -------
    DataFrame
        ``definition`` (`peters` or `widest_path`), ``n_particles``, ``particle_ids`` (list, in
        order), ``bottleneck_n`` and ``mean_force_n`` (smallest and mean normal force of the
        chain's contacts), ``length_m`` (polyline through the centres; a workpiece path's begins at
        the workpiece contact and ends at the bowl contact), ``azimuth_rad`` (direction from first
        to last point in the xy plane, counter-clockwise from the workpiece's heading, in (-pi,
        pi]), ``inclination_rad`` (the same line's angle above the horizontal), ``altitude_m``
        (mean height of the centres above the floor), ``major_stress_mean_pa`` (peters only),
        ``reaches_bowl``, ``end_kind`` (`floor`, `side` or `none`) and ``dominant``: the workpiece
        path of the frame with the largest bottleneck, by mean force where two are equal. A
        workpiece contact without a path to the bowl has a row with ``reaches_bowl`` false, the
        particle on the workpiece only, and NaN for bottleneck, mean force, length and angles. A
        chain by Peters et al. has no direction: it is listed from its higher end, and reaches the
        bowl if one of its particles touches it; ``end_kind`` is then `none` all the same.
    """
    peters, paths = _peters(frame), _paths(frame)
    return pd.DataFrame({name: _joined(name, peters[name], paths[name]) for name in peters})


def _joined(name: str, peters: Any, paths: Any) -> Any:
    """A column of the chains of both definitions."""
    if name == "particle_ids":
        return pd.Series([*peters, *paths], dtype=object)
    if name in ("definition", "end_kind"):
        return pd.array([*peters, *paths], dtype="str")
    return np.concatenate([peters, paths])


def _peters(frame: NetworkFrame) -> dict[str, Any]:
    major = major_stress(particle_stress(frame))
    rows = peters_rows(frame, major=major)
    on_bowl = np.zeros(frame.particle_id.size, dtype=bool)
    on_bowl[frame.a[(frame.other == FLOOR) | (frame.other == SIDE)]] = True
    return _columns(
        frame,
        rows,
        _shape(frame, frame.centre[rows.particles], rows.particle_starts),
        definition="peters",
        stress_pa=_of_each(rows.particle_starts, major[0][rows.particles], _mean),
        reaches=_of_each(rows.particle_starts, on_bowl[rows.particles], _any).astype(bool),
        ends=["none"] * len(rows),
    )


def _paths(frame: NetworkFrame) -> dict[str, Any]:
    rows = path_rows(frame)
    whole = np.diff(rows.contact_starts) > 1
    first = rows.contacts[rows.contact_starts[:-1]]
    last = rows.contacts[rows.contact_starts[1:] - 1]
    starts = rows.particle_starts + 2 * np.arange(len(rows) + 1)
    points = np.empty((starts[-1], 3))
    inner = np.ones(len(points), dtype=bool)
    inner[starts[:-1]] = inner[starts[1:] - 1] = False
    points[inner] = frame.centre[rows.particles]
    points[starts[:-1]], points[starts[1:] - 1] = frame.point[first], frame.point[last]
    kinds = zip(frame.other[last].tolist(), whole, strict=True)
    columns = _columns(
        frame,
        rows,
        _shape(frame, points, starts),
        definition="widest_path",
        stress_pa=np.full(len(rows), np.nan),
        reaches=whole,
        ends=[BODY_NAMES[kind] if there else "none" for kind, there in kinds],
    )
    for name in _OF_WHOLE_PATHS:
        columns[name][~whole] = np.nan
    order = np.lexsort((-columns["mean_force_n"], -columns["bottleneck_n"]))
    columns["dominant"][order[:1]] = whole[order[:1]]
    return columns


_OF_WHOLE_PATHS = ["bottleneck_n", "mean_force_n", "length_m", "azimuth_rad", "inclination_rad"]


def _columns(
    frame: NetworkFrame,
    rows: ChainRows,
    shape: Mapping[str, Floats],
    *,
    definition: str,
    stress_pa: Floats,
    reaches: NDArray[np.bool_],
    ends: list[str],
) -> dict[str, Any]:
    """The columns of chains of one definition, none of them dominant."""
    forces, count = frame.normal_force[rows.contacts], len(rows)
    ids = split_chains(frame.particle_id[rows.particles], rows.particle_starts)
    height = frame.centre[rows.particles, 2]
    return {
        "step": np.full(count, frame.step),
        "time_s": np.full(count, frame.time_s),
        "definition": [definition] * count,
        "n_particles": np.diff(rows.particle_starts),
        "particle_ids": ids,
        "bottleneck_n": _of_each(rows.contact_starts, forces, lambda x: x.min(axis=1)),
        "mean_force_n": _of_each(rows.contact_starts, forces, _mean),
        **shape,
        "altitude_m": _of_each(rows.particle_starts, height, _mean),
        "major_stress_mean_pa": stress_pa,
        "reaches_bowl": reaches,
        "end_kind": ends,
        "dominant": np.zeros(count, dtype=bool),
    }


def _shape(frame: NetworkFrame, points: Floats, starts: Ints) -> dict[str, Floats]:
    """Length of polylines, one after another, and direction from their first to last points."""
    line = points[starts[1:] - 1] - points[starts[:-1]]
    x, y, z = np.ascontiguousarray(line.T)
    return {
        "length_m": _of_each(starts, points, _length),
        "azimuth_rad": wrap_angle(np.arctan2(y, x) - frame.direction_rad),
        "inclination_rad": np.arctan2(z, np.hypot(x, y)),
    }


def _of_each(starts: Ints, values: NDArray[Any], measure: Callable[[Any], NDArray[Any]]) -> Floats:
    """Measure each chain's values: all chains of one length at once, (n, length, ...)."""
    means = np.empty(len(starts) - 1)
    lengths = np.diff(starts)
    for length in np.unique(lengths):
        which = np.flatnonzero(lengths == length)
        means[which] = measure(values[starts[which][:, None] + np.arange(length)])
    return means


def _mean(values: NDArray[Any]) -> Floats:
    return np.asarray(values.mean(axis=1))


def _any(values: NDArray[Any]) -> NDArray[np.bool_]:
    return np.asarray(values.any(axis=1))


def _length(points: Floats) -> Floats:
    return np.asarray(np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1))


# --- tables of a run -----------------------------------------------------------------------------


def write_chains(run_dir: Path) -> None:
    """Write the tables ``network``, ``clusters`` and ``chains`` of a process run.

    They contain the frames of the drag that enter the statistics. At most one frame is in memory.
    If the media have classes, ``classes`` of ``chains`` are those of ``particle_ids``.

    Raises
    ------
    TableError
        If a table is missing, or if the statistics contain no frame of the network.
    """
    network: list[dict[str, float]] = []
    grown: list[dict[str, NDArray[Any]]] = []
    tables, case = run_dir / "tables", load_case(run_dir)
    names = np.array([class_.name for class_ in case.classes])
    with table_writer(tables / "chains.parquet") as writer:
        for frame in network_frames(run_dir):
            clusters = frame_clusters(frame)
            network.append(frame_statistics(frame, clusters))
            grown.append(cluster_rows(frame, clusters))
            chains = chain_table(frame)
            if names.size:
                classes = (names[case.class_of(np.array(ids))] for ids in chains["particle_ids"])
                chains["classes"] = [numbers.tolist() for numbers in classes]
            writer.write(chains)
        if not network:
            raise TableError(
                f"{run_dir}: the statistics contain no frame of the contact network; "
                "increase outputs.network_hz or use a longer path"
            )
    write_parquet(pd.DataFrame(network), tables / "network.parquet")
    columns = {name: np.concatenate([part[name] for part in grown]) for name in grown[0]}
    write_parquet(pd.DataFrame(columns), tables / "clusters.parquet")
