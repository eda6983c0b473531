"""What the page draws: frames, workpiece, bowl and force curve, in mm, N and s.

`Scene.head` is what the page's scripts read as JSON; its entries have the names used there.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.colors import to_hex
from pydantic import JsonValue

from dragchain.arrays import Floats, Ints
from dragchain.drag import peak_separation_s
from dragchain.figures.style import force_map, top_of_scale
from dragchain.network.frame import BODY_NAMES, PARTICLE
from dragchain.network_page.packed import PackedColumns
from dragchain.network_page.shown import (
    BODIES,
    MOST_PARTICLES,
    Shown,
    highest_peaks,
    read_shown,
    shown_frames,
)
from dragchain.run.kinematics import drag_phase, needed, process_time
from dragchain.run.workpiece import read_surface
from dragchain.tables.by_step import read_table
from dragchain.tables.columns import CENTRE, ORIENTATION, POINT, VELOCITY
from dragchain.tables.run_folder import Run
from dragdeck.records.case import CaseOfRun

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
    series = shown_frames(run, peaks["time_s"].to_numpy())
    shown = read_shown(series)
    times_s = process_time(series.times_s, case)
    clumps = [
        {"first": of.first_id, "spheres": (1e3 * np.array(of.spheres_m)).tolist()}
        for of in case.bodies
    ]
    bowl, surface = case.bowl, 1e3 * needed(case.surface_m, "surface_m")
    head = {
        "run": case.run,
        "steps": series.steps.tolist(),
        "times": times_s.tolist(),
        "frames": _frames(columns, shown, case),
        "scales": _scales(shown, case),
        "paths": _dominant_paths(run, series.steps),
        "bodies": {BODIES + body: name for body, name in BODY_NAMES.items() if body != PARTICLE},
        "bowl": {
            "radius": 1e3 * bowl.reach_m,
            "height": 1.2 * surface,
            "lines": [(1e3 * line).round(3).tolist() for line in bowl.lines(1.2e-3 * surface)],
            "surface": [(1e3 * line).round(3).tolist() for line in bowl.sections(1e-3 * surface)],
        },
        "surface": surface,
        "media": {
            "radius": 1e3 * case.media.radius_mean_m,
            "count": shown.most,
            "most": MOST_PARTICLES,
            "reach": 1e3 * shown.reach_m(),
            "classes": [{"name": class_.name, "first": class_.first_id} for class_ in case.classes],
        },
        **({"clumps": clumps} if clumps else {}),
        "workpieces": [_workpiece(columns, run, shown, series.steps)],
        "curve": _curve(columns, run),
        "peaks": _peaks(peaks, times_s, case),
        "colours": _colours(),
    }
    return PageScene(head | {"columns": columns.entries}, columns)


def _colours() -> list[str]:
    """The colour map of all figures, without its palest end, which could not be seen on white."""
    colours = force_map()
    return [to_hex(colour) for colour in colours(np.linspace(0.06, 0.94, 33))]


# --- frames ----------------------------------------------------------------------------------


def _frames(columns: PackedColumns, shown: Shown, case: CaseOfRun) -> dict[str, JsonValue]:
    """Add particles and contacts of all frames; where each frame starts, and the box of places."""
    particles, contacts, touching = shown.particles, shown.contacts, shown.touching()
    centre, point = (
        table[list(names)].to_numpy() for table, names in ((particles, CENTRE), (touching, POINT))
    )
    box = np.concatenate([centre, point])
    low, step = box.min(axis=0), float(np.ptp(box, axis=0).max()) / 0xFFFF or 1.0
    columns.add("centre", "u16", ((centre - low) / step).round().T)
    columns.add("point", "u16", ((point - low) / step).round().T)
    columns.add("id", "u32", particles["particle_id"].to_numpy())
    columns.add("radius", "f24", 1e3 * particles["radius_m"].to_numpy())
    if case.bodies:
        columns.add("turn", "f24", particles[list(ORIENTATION)].to_numpy().ravel())
    columns.add("speed", "f24", 1e3 * _speeds(particles, case))
    columns.add("a", "u16", contacts["a"].to_numpy())
    columns.add("b", "u16", contacts["b"].to_numpy())
    columns.add("flags", "u8", contacts["flags"].to_numpy())
    columns.add("normal", "f24", contacts["normal_force_n"].to_numpy())
    columns.add("tangential", "f24", contacts["tangential_force_n"].to_numpy())
    tables = {"particles": particles, "contacts": contacts, "points": touching}
    rows: dict[str, JsonValue] = {
        name: np.bincount(table["frame"], minlength=len(shown.poses)).tolist()
        for name, table in tables.items()
    }
    return rows | {"low": (1e3 * low).tolist(), "step": 1e3 * step}


def _speeds(particles: pd.DataFrame, case: CaseOfRun) -> Floats:
    """Speeds of particles in process time, m/s."""
    simulated = np.linalg.norm(particles[list(VELOCITY)].to_numpy(), axis=1)
    return np.asarray(simulated / case.fidelity.speed_factor)


def _scales(shown: Shown, case: CaseOfRun) -> dict[str, float]:
    """The tops of the colour scales, and the mean normal force, over all shown frames."""
    forces = shown.contacts["normal_force_n"].to_numpy()
    largest = np.zeros(len(shown.poses))
    np.maximum.at(largest, shown.contacts["frame"], forces)
    return {
        "force": float(np.median(largest)) or 1.0,
        "largest": float(largest.max()),
        "mean": float(forces.mean()),
        "speed": float(1e3 * np.quantile(_speeds(shown.particles, case), _TOP)) or 1.0,
        "displacement": 1e3 * _displacement(shown) or 1.0,
    }


def _displacement(shown: Shown) -> float:
    """Quantile `_TOP` of how far particles have moved at the end, m."""
    places = shown.particles.set_index(["frame", "particle_id"])[list(CENTRE)]
    moved = (places.loc[len(shown.poses) - 1] - places.loc[0]).dropna().to_numpy()
    return float(np.quantile(np.linalg.norm(moved, axis=1), _TOP)) if len(moved) else 0.0


def _dominant_paths(run: Run, steps: Ints) -> list[dict[str, JsonValue] | None]:
    """The dominant path of each frame: bottleneck in N, particles in order, where it ends."""
    names = ["step", "particle_ids", "bottleneck_n", "mean_force_n", "end_kind", "dominant"]
    table = run.table("chains", names)
    rows = {int(row["step"]): row for row in table[table["dominant"]].to_dict("records")}
    return [_path(rows.get(step)) for step in steps.tolist()]


def _path(row: Mapping[Any, Any] | None) -> dict[str, JsonValue] | None:
    if row is None:
        return None
    return {
        "bottleneck": row["bottleneck_n"],
        "mean": row["mean_force_n"],
        "particles": [int(number) for number in row["particle_ids"]],
        "end": row["end_kind"],
    }


# --- workpiece and force -----------------------------------------------------------------------


def _workpiece(columns: PackedColumns, run: Run, shown: Shown, steps: Ints) -> dict[str, JsonValue]:
    """Add the workpiece's facets in its own frame and their loads; its poses, frame by frame."""
    case = run.case
    surface = read_surface(run.folder, case)
    columns.add("corners", "f24", 1e3 * surface.corners)
    workpiece = needed(case.workpiece, "workpiece")
    return {
        "poses": (shown.poses * [1e3, 1e3, 1e3, 1.0, 1.0, 1.0, 1.0]).tolist(),
        "radius": 1e3 * workpiece.radius_m,
        "immersion": 1e3 * workpiece.immersion_depth_m,
        "headings": _headings(run, steps).tolist(),
        "loads": _loads(columns, run),
    }


def _loads(columns: PackedColumns, run: Run) -> list[JsonValue]:
    """Add the columns of ``facets.parquet`` that are shown, if the table was made."""
    file = run.file("facets.parquet")
    if not file.is_file():
        return []
    table = read_table(file, [*_LOADS, "area_m2"])
    loads: list[JsonValue] = []
    for name, (label, unit) in _LOADS.items():
        values = table[name].to_numpy(np.float64)
        columns.add(name, "f24", values)
        top = top_of_scale(values, table["area_m2"].to_numpy(np.float64))
        loads.append({"name": name, "label": label, "unit": unit, "top": top})
    return loads


def _headings(run: Run, steps: Ints) -> Floats:
    """The direction of motion at each frame, rad."""
    table = _force(run, ["step", "direction_rad"])
    heading = np.unwrap(table["direction_rad"].to_numpy(np.float64))
    return np.interp(steps, table["step"], heading)


def _force(run: Run, names: list[str]) -> pd.DataFrame:
    return run.table("workpiece_force", names)


def _curve(columns: PackedColumns, run: Run) -> dict[str, float]:
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


def _peaks(peaks: pd.DataFrame, times_s: Floats, case: CaseOfRun) -> list[dict[str, float]]:
    """The highest peaks, each with its nearest frame."""
    times = process_time(peaks["time_s"].to_numpy(), case).tolist()
    return [
        {"time": time, "force": -drag, "frame": int(np.abs(times_s - time).argmin())}
        for time, drag in zip(times, peaks["drag_n"].tolist(), strict=True)
    ]
