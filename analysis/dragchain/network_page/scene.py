"""What the page draws: frames, workpiece, bowl and force curve, in mm, N and s.

`Scene.head` is what the page's scripts read as JSON; its entries have the names used there.
"""

import base64
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import pandas as pd
from matplotlib.colors import to_hex
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation as Quaternion

from dragchain.arrays import Floats, Ints
from dragchain.drag import DragPeaks, drag_peaks, peak_separation_s, read_counted
from dragchain.errors import TableError
from dragchain.export.frames import FrameData, FrameSeries
from dragchain.figures.style import force_map
from dragchain.network.frame import KINDS, PARTICLE, NetworkFrame
from dragchain.run.kinematics import drag_phase, needed, process_time
from dragchain.run.workpiece import read_surface
from dragchain.tables.by_step import read_table
from dragchain.tables.columns import CENTRE, POINT, VELOCITY
from dragchain.tables.run_folder import Run
from dragdeck.records.case import CaseOfRun

# --- columns as bytes ----------------------------------------------------------------------------


Kind = Literal["u8", "u16", "u32", "f24"]
"""Whole numbers of 1, 2 or 4 bytes, or the first 3 bytes of a single-precision number."""

_BYTES = {"u8": 1, "u16": 2, "u32": 4, "f24": 3}

ROUNDING = 2.0**-16
"""Largest relative error of a number of kind ``f24``: it keeps 16 significant bits."""


def short_floats(values: Floats) -> NDArray[np.uint32]:
    """Numbers in single precision, rounded to their first 3 bytes, (N,)."""
    bits = np.ascontiguousarray(values, dtype=np.float32).view(np.uint32)
    return (bits + np.uint32(0x80)) >> np.uint32(8)


@dataclass
class PackedColumns:
    """Columns in the order in which they were added.

    Attributes
    ----------
    entries : list of dict
        ``name``, ``kind`` and ``length`` of each, for the page.
    """

    entries: list[dict[str, Any]] = field(default_factory=list)
    _parts: list[bytes] = field(default_factory=list)

    def add(self, name: str, kind: Kind, values: NDArray[Any]) -> None:
        """Add a column; values are (N,) or are taken row by row."""
        flat = np.ravel(values)
        whole = short_floats(flat) if kind == "f24" else flat
        planes = whole.astype(">u4").view(np.uint8).reshape(-1, 4)[:, 4 - _BYTES[kind] :]
        self.entries.append({"name": name, "kind": kind, "length": flat.size})
        self._parts.append(np.ascontiguousarray(planes.T).tobytes())

    def text(self) -> str:
        """All columns, one after another, compressed (zlib) and in base64."""
        return base64.b64encode(zlib.compress(b"".join(self._parts))).decode("ascii")


# --- shown frames --------------------------------------------------------------------------------


FRAMES = 100
"""Frames at equal intervals that are shown, or fewer if the run has fewer."""

PEAKS = 10
"""The highest peaks of the drag force, whose nearest frames are shown too."""

MOST_PARTICLES = 2000
"""Of a frame; if it has more, those nearest to the workpiece are shown."""

QUASI_LINEAR, PATH, DOMINANT = 1, 2, 4
"""Flags of a contact: in a quasi-linear chain, on a path to the bowl, on the dominant one."""

BODIES = 0xFFFF
"""Stands for the body 0, the workpiece; others, with negative numbers, come before it."""


@dataclass(frozen=True)
class ShownFrame:
    """A frame with N particles and M contacts as the page shows them.

    Attributes
    ----------
    data : FrameData
        The whole frame.
    particles : (N,) int
        Rows of the shown particles in the frame.
    contacts : (M,) int
        Rows of the shown contacts: those of which no particle is left out.
    a, b : (M,) int
        A contact's particles as places in `particles`; for a body that is no particle, ``b`` is its
        ``b_id`` plus `BODIES`.
    flags : (M,) int
        Sums of `QUASI_LINEAR`, `PATH` and `DOMINANT`.
    """

    data: FrameData
    particles: Ints
    contacts: Ints
    a: Ints
    b: Ints
    flags: Ints


def highest_peaks(run: Run) -> DragPeaks:
    """The peaks of the drag force in the counted stretch, the highest first, `PEAKS` at most.

    Raises
    ------
    SeriesError
        If the run is too short to have peaks.
    """
    peaks = drag_peaks(read_counted(run.folder, ("time_s", "drag_n")), run.case)
    order = np.argsort(peaks.drag_n, kind="stable")[:PEAKS]
    return DragPeaks(
        peaks.index[order], peaks.time_s[order], peaks.drag_n[order], peaks.prominence_n[order]
    )


def shown_frames(run: Run, peak_time_s: Floats) -> FrameSeries:
    """`FRAMES` network frames of the counted stretch, and the nearest one to each peak.

    Raises
    ------
    TableError
        If the run wrote no contact network.
    """
    if not run.wrote("contacts", "particles", "workpiece_contacts", "workpiece_particles"):
        raise TableError(
            f"{run.folder}: this {run.case.scene} run wrote no contact network, which the"
            " page requires\n  remedy: use the outputs contacts and particles"
        )
    network = read_table(run.table("network.parquet"), ["step", "time_s"])
    steps, times = network["step"].to_numpy(np.int64), network["time_s"].to_numpy(np.float64)
    even = np.linspace(0, len(steps) - 1, min(FRAMES, len(steps))).round().astype(np.int64)
    nearest = np.abs(times[:, None] - peak_time_s).argmin(axis=0)
    rows = np.union1d(even, nearest)
    series = FrameSeries(run, steps[rows], times[rows])
    if not series.has_chains:
        raise TableError(
            f"{run.folder}: the force chains are missing: run `dragchain chains {run.folder}`"
        )
    return series


def read_shown(series: FrameSeries) -> Iterator[ShownFrame]:
    """Read the frames of a series; errors are those of its iterator."""
    for data in series:
        assert data.network is not None and data.membership is not None
        assert data.contacts is not None and data.workpiece is not None
        kept = _near(data.network, data.workpiece[0])
        place = np.full(kept.size, -1, dtype=np.int64)
        place[kept] = np.arange(kept.sum())
        a, inner = place[data.network.a], data.network.between_particles()
        bodies = BODIES + data.contacts["b_id"].to_numpy(np.int64)
        b = np.where(inner, place[data.network.b], bodies)
        rows = np.flatnonzero((a >= 0) & (b >= 0))
        chain = data.membership
        flags = (
            QUASI_LINEAR * (chain.contact_peters > 0)
            + PATH * (chain.contact_paths > 0)
            + DOMINANT * chain.contact_dominant
        )
        yield ShownFrame(data, np.flatnonzero(kept), rows, a[rows], b[rows], flags[rows])


def _near(frame: NetworkFrame, workpiece_m: Floats) -> NDArray[np.bool_]:
    """The `MOST_PARTICLES` particles that are nearest to the workpiece's axis, (N,) bool."""
    away = np.hypot(*(frame.centre[:, :2] - workpiece_m[:2]).T)
    if away.size <= MOST_PARTICLES:
        return np.ones(away.size, dtype=bool)
    return np.asarray(away < np.partition(away, MOST_PARTICLES)[MOST_PARTICLES])


# --- scene ---------------------------------------------------------------------------------------


_LOADS = {
    "force_slide_pa": ("sliding load", "N/m²"),
    "mean_pressure_pa": ("mean pressure", "Pa"),
    "friction_work_pa": ("friction work", "J/m³"),
}
"""Columns of ``facets.parquet`` that the workpiece can be coloured by: name, unit."""

_MOST_SAMPLES = 50_000
"""Of the force curve; of a longer one only every n-th sample is shown."""

_SMOOTHED_DIAMETERS = 0.1
"""Path of the workpiece, in mean particle diameters, over which the filtered curve is averaged."""

_TOP = 0.999
"""Quantile of all speeds, and of all displacements, at the top of their colour scale."""


@dataclass(frozen=True)
class PageScene:
    """The content of a page: `head` is plain data, `columns` has the long series."""

    head: dict[str, Any]
    columns: PackedColumns


def page_scene(run: Run) -> PageScene:
    """Read what the page of a process run shows.

    Raises
    ------
    TableError
        If the run wrote no contact network, or a table is missing or damaged.
    SeriesError
        If the run is too short to have peaks.
    """
    case, columns, peaks = run.case, PackedColumns(), highest_peaks(run)
    series = shown_frames(run, peaks.time_s)
    frames = list(read_shown(series))
    times_s = process_time(series.times_s, case)
    bowl, surface = case.bowl, 1e3 * needed(case.surface_m, "surface_m")
    head = {
        "run": case.run,
        "steps": series.steps.tolist(),
        "times": times_s.tolist(),
        "frames": _frames(columns, frames, case),
        "scales": _scales(frames, case),
        "paths": _dominant_paths(run, frames),
        "bodies": {BODIES + body: name for body, name in KINDS.items() if body != PARTICLE},
        "bowl": {"radius": 1e3 * bowl.radius_m, "height": 1.2 * surface},
        "surface": surface,
        "media": {
            "radius": 1e3 * case.media.radius_mean_m,
            "count": max(len(frame.data.particles) for frame in frames),
            "most": MOST_PARTICLES,
        },
        "workpieces": [_workpiece(columns, run, frames)],
        "curve": _curve(columns, run),
        "peaks": _peaks(peaks, times_s, case),
        "colours": _colours(),
    }
    return PageScene(head | {"columns": columns.entries}, columns)


def _colours() -> list[str]:
    """The colour map of all figures, without its palest end, which could not be seen on white."""
    colours = force_map()
    return [to_hex(one) for one in colours(np.linspace(0.06, 0.94, 33))]


# --- frames ----------------------------------------------------------------------------------


def _frames(columns: PackedColumns, frames: list[ShownFrame], case: CaseOfRun) -> dict[str, Any]:
    """Add particles and contacts of all frames; where each frame starts, and the box of places."""
    centres = [_vectors(one.data.particles, CENTRE)[one.particles] for one in frames]
    points = [_outer_points(one) for one in frames]
    box = np.concatenate([*centres, *points])
    low, step = box.min(axis=0), float(np.ptp(box, axis=0).max()) / 0xFFFF or 1.0
    contacts = [_table(one).iloc[one.contacts] for one in frames]
    particles = [one.data.particles.iloc[one.particles] for one in frames]
    places = {"centre": centres, "point": points}
    for name, parts in places.items():
        columns.add(name, "u16", ((np.concatenate(parts) - low) / step).round().T)
    columns.add("id", "u32", _joined(particles, "particle_id"))
    columns.add("radius", "f24", 1e3 * _joined(particles, "radius_m"))
    columns.add("speed", "f24", 1e3 * _speeds(pd.concat(particles), case))
    columns.add("a", "u16", np.concatenate([one.a for one in frames]))
    columns.add("b", "u16", np.concatenate([one.b for one in frames]))
    columns.add("flags", "u8", np.concatenate([one.flags for one in frames]))
    columns.add("normal", "f24", _joined(contacts, "normal_force_n"))
    columns.add("tangential", "f24", _joined(contacts, "tangential_force_n"))
    return {
        "particles": [one.particles.size for one in frames],
        "contacts": [one.contacts.size for one in frames],
        "points": [len(part) for part in points],
        "low": (1e3 * low).tolist(),
        "step": 1e3 * step,
    }


def _table(frame: ShownFrame) -> pd.DataFrame:
    assert frame.data.contacts is not None
    return frame.data.contacts


def _outer_points(frame: ShownFrame) -> Floats:
    """The contact points on workpiece and bowl, in the order of the contacts."""
    rows = frame.contacts[frame.b > BODIES - len(KINDS)]
    return _vectors(_table(frame), POINT)[rows]


def _vectors(table: pd.DataFrame, names: tuple[str, ...]) -> Floats:
    return table[list(names)].to_numpy(np.float64)


def _joined(tables: list[pd.DataFrame], name: str) -> Any:
    return np.concatenate([table[name].to_numpy() for table in tables])


def _speeds(particles: pd.DataFrame, case: CaseOfRun) -> Floats:
    """Speeds of particles in process time, m/s."""
    simulated = np.linalg.norm(_vectors(particles, VELOCITY), axis=1)
    return np.asarray(simulated / case.fidelity.speed_factor)


def _scales(frames: list[ShownFrame], case: CaseOfRun) -> dict[str, float]:
    """The tops of the colour scales, and the mean normal force, over all shown frames."""
    forces = [_table(one)["normal_force_n"].to_numpy()[one.contacts] for one in frames]
    largest = [part.max(initial=0.0) for part in forces]
    speeds = np.concatenate([_speeds(one.data.particles, case)[one.particles] for one in frames])
    return {
        "force": float(np.median(largest)) or 1.0,
        "largest": float(max(largest)),
        "mean": float(np.concatenate([*forces, np.zeros(0)]).mean()),
        "speed": float(1e3 * np.quantile(speeds, _TOP)) or 1.0,
        "displacement": 1e3 * _displacement(frames) or 1.0,
    }


def _displacement(frames: list[ShownFrame]) -> float:
    """Quantile `_TOP` of how far particles have moved at the end, m."""
    first, last = (
        frame.data.particles.iloc[frame.particles].set_index("particle_id")[list(CENTRE)]
        for frame in (frames[0], frames[-1])
    )
    moved = (last - first).dropna().to_numpy()
    return float(np.quantile(np.linalg.norm(moved, axis=1), _TOP)) if len(moved) else 0.0


def _dominant_paths(run: Run, frames: list[ShownFrame]) -> list[dict[str, Any] | None]:
    """The dominant path of each frame: bottleneck in N, particles in order, where it ends."""
    names = ["step", "particle_ids", "bottleneck_n", "mean_force_n", "end_kind", "dominant"]
    table = read_table(run.table("chains.parquet"), names)
    rows = {int(row["step"]): row for row in table[table["dominant"]].to_dict("records")}
    return [_path(rows.get(frame.data.step)) for frame in frames]


def _path(row: Mapping[Any, Any] | None) -> dict[str, Any] | None:
    if row is None:
        return None
    return {
        "bottleneck": row["bottleneck_n"],
        "mean": row["mean_force_n"],
        "particles": [int(number) for number in row["particle_ids"]],
        "end": row["end_kind"],
    }


# --- workpiece and force -----------------------------------------------------------------------


def _workpiece(columns: PackedColumns, run: Run, frames: list[ShownFrame]) -> dict[str, Any]:
    """Add the workpiece's facets in its own frame and their loads; its poses, frame by frame."""
    case = run.case
    surface = read_surface(run.folder, case)
    columns.add("corners", "f24", 1e3 * surface.corners)
    own = needed(case.workpiece, "workpiece")
    poses = []
    for frame in frames:
        assert frame.data.workpiece is not None
        place, rotation = frame.data.workpiece
        turn = Quaternion.from_matrix(rotation.matrices[0]).as_quat()
        poses.append([*(1e3 * place).tolist(), *turn.tolist()])
    return {
        "poses": poses,
        "headings": _headings(run, frames),
        "radius": 1e3 * own.radius_m,
        "immersion": 1e3 * own.immersion_depth_m,
        "loads": _loads(columns, run),
    }


def _loads(columns: PackedColumns, run: Run) -> list[dict[str, Any]]:
    """Add the columns of ``facets.parquet`` that are shown, if the table was made."""
    file = run.table("facets.parquet")
    if not file.is_file():
        return []
    table, loads = read_table(file, list(_LOADS)), []
    for name, (label, unit) in _LOADS.items():
        values = table[name].to_numpy(np.float64)
        columns.add(name, "f24", values)
        loaded = values[values > 0.0]
        top = float(np.quantile(loaded, 0.99)) if loaded.size else 1.0
        loads.append({"name": name, "label": label, "unit": unit, "top": top})
    return loads


def _headings(run: Run, frames: list[ShownFrame]) -> list[float]:
    """The direction of motion at each frame, rad."""
    table = _force(run, ["step", "direction_rad"])
    heading = np.unwrap(table["direction_rad"].to_numpy(np.float64))
    steps = [frame.data.step for frame in frames]
    return [float(one) for one in np.interp(steps, table["step"], heading)]


def _force(run: Run, names: list[str]) -> pd.DataFrame:
    return read_table(run.table("workpiece_force.parquet"), names)


def _curve(columns: PackedColumns, run: Run) -> dict[str, Any]:
    """Add the force against the motion over the drag; its times, and how it is filtered."""
    table = _force(run, ["step", "time_s", "drag_n", "in_statistics"])
    table = table[table["step"] > drag_phase(run.case).start_step]
    every = -(-len(table) // _MOST_SAMPLES)
    shown = table.iloc[::every]
    times = process_time(shown["time_s"].to_numpy(np.float64), run.case)
    counted = table["time_s"][table["in_statistics"]].to_numpy(np.float64)[:1]
    columns.add("resistance", "f24", -shown["drag_n"].to_numpy(np.float64))
    return {
        "first": float(times[0]),
        "interval": float(np.diff(times).mean()),
        "every": every,
        "counted": float(process_time(counted, run.case)[0]),
        "window": 2
        * _SMOOTHED_DIAMETERS
        * run.case.fidelity.speed_factor
        * peak_separation_s(run.case),
    }


def _peaks(peaks: DragPeaks, times_s: Floats, case: CaseOfRun) -> list[dict[str, Any]]:
    """The highest peaks, each with its nearest frame."""
    return [
        {"time": time, "force": -drag, "frame": int(np.abs(times_s - time).argmin())}
        for time, drag in zip(
            process_time(peaks.time_s, case).tolist(), peaks.drag_n.tolist(), strict=True
        )
    ]
