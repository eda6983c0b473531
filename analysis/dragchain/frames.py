"""The contact network frame by frame, as arrays that the network and chain measures share."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from dragchain.errors import TableError
from dragchain.streams import RisingSteps, needed_table, read_steps

BALL, ROD, FLOOR, SIDE = 1, 0, -1, -2
"""The other body of a contact; the last three are the ``b_id`` of the contacts table."""

KINDS = {BALL: "ball", ROD: "rod", FLOOR: "floor", SIDE: "side"}

_POINT = ["point_x_m", "point_y_m", "point_z_m"]
_FORCE = ["force_x_n", "force_y_n", "force_z_n"]
_CENTRE = ["x_m", "y_m", "z_m"]
_CONTACTS = ["step", "a_id", "b_id", *_POINT, *_FORCE, "normal_force_n"]
_BALLS = ["step", "time_s", "ball_id", *_CENTRE, "radius_m"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Columns = Mapping[str, NDArray[Any]]
"""Columns of a table by their names, (n,) each."""

GROUP_ROWS = 131_072
"""Rows of a row group that `TableParts` writes: what it holds of a table."""


@dataclass(frozen=True)
class NetworkFrame:
    """One frame of the contact network; N balls and M contacts.

    Attributes
    ----------
    step, time_s, heading_rad
        When the frame was written, and the tool's direction of motion in the xy plane then.
    ball_id : (N,) int
        The balls, sorted.
    centre, radius : (N, 3) and (N,) float
        Their centres and radii in m.
    a, b : (M,) int
        A contact's ball and its other body, as rows of the ball arrays; ``b`` is -1 where the
        other body is no ball.
    other : (M,) int
        What the other body is: `ROD`, `FLOOR`, `SIDE` or `BALL`.
    point, force : (M, 3) float
        Contact point in m and the force on ball ``a`` in N.
    normal_force : (M,) float
        Normal force in N, positive in compression.
    """

    step: int
    time_s: float
    heading_rad: float
    ball_id: Ints
    centre: Floats
    radius: Floats
    a: Ints
    b: Ints
    other: Ints
    point: Floats
    force: Floats
    normal_force: Floats

    def between_balls(self) -> NDArray[np.bool_]:
        """Tell which contacts are between two balls, (M,) bool."""
        return np.equal(self.other, BALL)

    def mean_force_n(self, *, with_rod: bool = True) -> float:
        """Return the mean normal force of all contacts in N, 0 for a frame without contacts.

        With `with_rod` false the contacts of the rod do not count.
        """
        forces = self.normal_force if with_rod else self.normal_force[self.other != ROD]
        return float(forces.mean()) if forces.size else 0.0


def frame_of(
    contacts: pd.DataFrame | Columns,
    balls: pd.DataFrame | Columns,
    step: int,
    time_s: float,
    heading_rad: float,
) -> NetworkFrame:
    """Return the frame that rows of the contacts and balls tables of one step describe.

    Raises
    ------
    TableError
        If a contact names a ball that the frame does not have, or a ball has two rows.
    """
    ball_id = np.array(balls["ball_id"], dtype=np.int64)
    centre, radius = _vectors(balls, _CENTRE), np.array(balls["radius_m"], dtype=np.float64)
    if (np.diff(ball_id) <= 0).any():
        order = np.argsort(ball_id)
        ball_id, centre, radius = ball_id[order], centre.T[:, order].T, radius[order]
    twice = np.flatnonzero(np.diff(ball_id) == 0)
    if twice.size:
        raise TableError(f"balls.parquet has ball {ball_id[twice[0]]} twice in step {step}")
    b_id = np.asarray(contacts["b_id"], dtype=np.int64)
    b = np.full(b_id.shape, -1, dtype=np.int64)
    b[b_id > 0] = _rows_of(b_id[b_id > 0], ball_id, step)
    return NetworkFrame(
        step=step,
        time_s=time_s,
        heading_rad=heading_rad,
        ball_id=ball_id,
        centre=centre,
        radius=radius,
        a=_rows_of(np.asarray(contacts["a_id"], dtype=np.int64), ball_id, step),
        b=b,
        other=np.where(b_id > 0, BALL, b_id),
        point=_vectors(contacts, _POINT),
        force=_vectors(contacts, _FORCE),
        normal_force=np.array(contacts["normal_force_n"], dtype=np.float64),
    )


def _vectors(table: pd.DataFrame | Columns, names: Iterable[str]) -> Floats:
    """Return three columns as vectors, (n, 3), each column in one piece."""
    return np.array([table[name] for name in names], dtype=np.float64).T


def _rows_of(ids: Ints, ball_id: Ints, step: int) -> Ints:
    """Return the row of each id in the sorted `ball_id`."""
    rows = places(ids, ball_id)
    unknown = ids[rows < 0]
    if unknown.size:
        raise TableError(
            f"contacts of step {step} name ball {unknown[0]}, which balls.parquet does not have "
            "in that step: make the tables again from whole dumps"
        )
    return rows


def places(ids: Ints, known: Ints) -> Ints:
    """Return the place of each id in `known`, whose ids are unlike; -1 where it is not there.

    By hashing: in a time linear in both.
    """
    return np.asarray(pd.Index(known).get_indexer(pd.Index(ids)), dtype=np.int64)


def counted_range(rod_force: pd.DataFrame) -> tuple[int, int]:
    """Return the first and the last step of the drag that statistics count.

    Raises
    ------
    TableError
        If no sample is counted, or if the counted samples are not one stretch.
    """
    counted = rod_force["counted"].to_numpy(bool)
    where = np.flatnonzero(counted)
    if not where.size:
        raise TableError(
            "rod_force.parquet holds no counted sample: the run ended before the drag's run-in "
            "was over; run longer or set a shorter statistics.run_in_s"
        )
    if not counted[where[0] : where[-1] + 1].all():
        raise TableError("the counted samples of rod_force.parquet are not one stretch")
    step = rod_force["step"].to_numpy(np.int64)
    return int(step[where[0]]), int(step[where[-1]])


def read_frames(run_dir: Path, steps: tuple[int, int] | None = None) -> Iterator[NetworkFrame]:
    """Yield the network frames of a process run in the order of their steps.

    The tables are read row group by row group: of each no more is held than a frame and the row
    groups that it lies in, however long the run is.

    Parameters
    ----------
    run_dir
        The folder of the run, with ``tables/`` made.
    steps
        First and last step to read; by default the stretch that statistics count.

    Raises
    ------
    TableError
        If a table is missing or the tables contradict each other.
    """
    tables = run_dir / "tables"
    rod_force = read_table(tables / "rod_force.parquet", ["step", "heading_rad", "counted"])
    first, last = counted_range(rod_force) if steps is None else steps
    contacts = RisingSteps(tables / "contacts.parquet", _CONTACTS, (first, last))
    heading_step = rod_force["step"].to_numpy(np.int64)
    heading = np.unwrap(rod_force["heading_rad"].to_numpy(np.float64))
    balls = read_steps(tables / "balls.parquet", _BALLS, (first, last))
    for step, of_step in balls:
        yield frame_of(
            contacts.at(step),
            of_step,
            step,
            float(of_step["time_s"].iloc[0]),
            float(np.interp(step, heading_step, heading)),
        )


def read_table(path: Path, columns: list[str] | None = None) -> pd.DataFrame:
    """Read a table, or say which command makes it.

    Raises
    ------
    TableError
        If the file is not there.
    """
    return pd.read_parquet(needed_table(path), columns=columns)


def write_parquet(table: pd.DataFrame, path: Path) -> None:
    """Write a table to a temporary file beside `path` and then put it in its place."""
    draft = path.with_name(path.name + ".part")
    table.to_parquet(draft, index=False)
    draft.replace(path)


class TableParts:
    """A table that is written part by part and appears under its name only once it is whole.

    Use it as a context manager. It holds no more than `GROUP_ROWS` rows and the last part. If the
    block ends in an exception, nothing is left behind.

    Parameters
    ----------
    path : Path
        The table's final name.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._draft = path.with_name(path.name + ".part")
        self._parts: list[pd.DataFrame] = []
        self._writer: Any = None

    def __enter__(self) -> Self:
        """Begin; the file is there with the first rows."""
        return self

    def write(self, part: pd.DataFrame) -> None:
        """Append the rows of a part."""
        self._parts.append(part)
        if sum(map(len, self._parts)) >= GROUP_ROWS:
            self._flush()

    def _flush(self) -> None:
        if not self._parts:
            return
        rows = pd.concat(self._parts, ignore_index=True)
        schema = None if self._writer is None else self._writer.schema
        table = pa.Table.from_pandas(rows, schema, preserve_index=False)
        if self._writer is None:
            self._writer = pq.ParquetWriter(self._draft, table.schema)
        self._writer.write_table(table)
        self._parts = []

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Put the draft in the table's place, or remove it after an exception."""
        try:
            if kind is None:
                self._flush()
            if self._writer is not None:
                self._writer.close()
            if kind is None:
                self._draft.replace(self._path)
        finally:
            self._draft.unlink(missing_ok=True)
