"""What the balls do to the tool, facet by facet: load, sliding and friction work.

These are the quantities a law of wear starts from; no wear coefficient enters,
so none of them is a removed volume. See docs/removal.md.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from dragchain.bearing import circumference, parts, within
from dragchain.case import Case, Circle, load_case, load_outputs
from dragchain.contact_events import (
    AMOUNTS,
    POINT,
    SLIP,
    TYPES,
    Thresholds,
    event_types,
    find_events,
    surfaces,
)
from dragchain.errors import TableError
from dragchain.findings import (
    CONFIDENCE,
    Estimate,
    block_length,
    estimates,
    finite,
)
from dragchain.forces import counted_mask, motion_of, needed, tool_velocity, workpiece_frame
from dragchain.frames import Floats, Ints, write_parquet
from dragchain.parquet import write_json
from dragchain.streams import read_groups

SCHEMA = 1
FILE = Path("tables") / "removal.json"
WRITTEN = ("facets.parquet", "contact_events.parquet", "removal.json", "rod.vtp")

OFF_FACET = 1e-5
"""Largest distance of a contact point from its facet over the tool's length: rounding."""

BLOCK_ROWS = 100_000
"""Contacts that are held against their facets at once."""

THINNING = (2, 5, 10)
"""Every n-th sample is taken to see what a lower rate of samples would give."""

GAPS = (1, 2, 5)
"""Samples without force that may lie within a stay, to see what they do to its number."""

MOBILISED = (0.9, 0.95, 0.99, 0.999)
"""Limits of a sliding contact, to see what they do to the sums."""

DEPTH_BINS, BEARING_BINS = 20, 24

UNCERTAIN = ("normal_impulse_ns", "force_slide_nm", "friction_work_j")
"""Sums of a facet that come with a standard error."""

WORKPIECE = ("drag_impulse_ns", "lateral_impulse_ns", "vertical_impulse_ns")
_FORCE = ["force_x_n", "force_y_n", "force_z_n"]
_PLACE = ["point_x_m", "point_y_m", "point_z_m"]
_VELOCITY = ["slip_x_m_s", "slip_y_m_s", "slip_z_m_s"]
_REFERENCE = ["ref_x_m", "ref_y_m", "ref_z_m"]
_CONTACT = [
    *("step", "time_s", "ball_id", "facet_id", *_PLACE, *_FORCE, "normal_force_n"),
    *("tangential_force_n", *_VELOCITY, "approach_m_s", "bearing_rad", "depth_m", "counted"),
]

_KEPT = [
    *("frame", "time_s", "ball_id", "facet_id", "normal_force_n", "bearing_rad", "depth_m"),
    *(*POINT, *SLIP, *WORKPIECE, *AMOUNTS),
    *("mobilisation", "mobilised", "normal_work_j", "tool_work_j"),
]
"""What is held of every contact."""

DRAWN = ["tool_z_m", "depth_m", "bearing_rad", "force_slide_nm"]
"""What is left of it for the picture, which needs memory itself."""


@dataclass(frozen=True)
class Sampled:
    """The counted contacts on a tool, with what each adds to the sums.

    Attributes
    ----------
    rows : DataFrame
        A contact with force: as `find_events` takes them, and `WORKPIECE` and
        ``tool_work_j``, the work that the tool does on the ball through it.
    frames : int
        Number of counted samples, those without contact included.
    interval_s : float
        Time between two, s.
    path_m : float
        Way of the tool's reference point in all of them, m.
    rod_impulse_ns : (3,) ndarray
        Impulse on the tool along its motion, to the left of it and up, from
        ``rod_force.parquet`` at the same steps, N s.
    """

    rows: pd.DataFrame
    frames: int
    interval_s: float
    path_m: float
    rod_impulse_ns: Floats


@dataclass(frozen=True)
class Surface:
    """The M facets of a tool in its own frame.

    The reference point is the origin; +x is the direction of motion when the
    drag begins, and z is up.

    Attributes
    ----------
    corners : (M, 3, 3) ndarray
        Corners of the facets in the order of the STL file, which is also that
        of the engine's numbers, from 0, m.
    """

    corners: Floats

    @property
    def centres(self) -> Floats:
        """Centres, (M, 3), m."""
        return np.asarray(self.corners.mean(axis=1))

    @property
    def areas(self) -> Floats:
        """Areas, (M,), m2."""
        return np.asarray(0.5 * np.linalg.norm(self._crossed(), axis=1))

    @property
    def normals(self) -> Floats:
        """Unit normals, (M, 3), by the order of the corners."""
        return np.asarray(self._crossed() / (2.0 * self.areas)[:, None])

    def _crossed(self) -> Floats:
        first, second, third = self.corners.transpose(1, 0, 2)
        return np.asarray(np.cross(second - first, third - first))


def write_removal(run_dir: Path, limits: Thresholds | None = None) -> list[Path]:
    """Write load, sliding and friction work of a process run's tool, and their picture.

    Parameters
    ----------
    run_dir : Path
        The folder of a process run, with ``rod_force.parquet`` and
        ``rod_contacts.parquet`` made.
    limits : Thresholds, optional
        Limits between the types of contact.

    Returns
    -------
    list of Path
        `WRITTEN` in ``tables/``, and ``figures/rod.png``.

    Raises
    ------
    TableError
        If it is no process run, or a table is missing, holds no velocities or does
        not fit the mesh.
    SeriesError
        If the run is too short for its statistics.
    """
    from dragchain.removal_figure import draw_rod

    limits = limits or Thresholds()
    case = load_case(run_dir)
    if case.scene != "process":
        raise TableError(f"{run_dir}: its scene is {case.scene}; only a process run has a tool")
    sampled = sample(run_dir, case, limits)
    surface = read_surface(run_dir, case)
    off = _check_facets(sampled, surface, case)
    events, event = find_events(sampled.rows, sampled.frames, sampled.interval_s)
    events["type"] = event_types(events, case, sampled.interval_s, limits)
    facets = facet_table(sampled, surface, events)
    found = findings(sampled, facets, events, event, case, limits)
    found["closure"]["point_off_facet_max_m"] = off
    files = [run_dir / "tables" / name for name in WRITTEN]
    write_parquet(facets, files[0])
    write_parquet(events.drop(columns="frame"), files[1])
    write_json(files[2], found)
    write_vtp(surface, facets, files[3])
    sampled = replace(sampled, rows=sampled.rows[DRAWN].copy())
    del event
    return [*files, draw_rod(run_dir, case, sampled, surface, facets, found)]


def read_removal(run_dir: Path) -> dict[str, Any]:
    """Read the ``removal.json`` that `write_removal` wrote.

    Raises
    ------
    TableError
        If it is not there.
    """
    file = run_dir / FILE
    if not file.is_file():
        raise TableError(f"{file}: there is no such file; run `dragchain removal {run_dir}` first")
    found: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    return found


# --- reading ---------------------------------------------------------------------------------


def sample(run_dir: Path, case: Case, limits: Thresholds) -> Sampled:
    """Read the counted contacts of a run, a row group at a time; see `Sampled`."""
    tables = run_dir / "tables"
    steps, interval_s = _counted_steps(run_dir, case)
    rod = _rod_at(tables / "rod_force.parquet", steps)
    parts = []
    for contacts in _read_contacts(tables / "rod_contacts.parquet", run_dir):
        contacts["frame"] = np.searchsorted(steps, contacts["step"])
        at = rod.reindex(contacts["step"])
        parts.append(_with_amounts(contacts, at, case, interval_s, limits)[_KEPT])
    if not parts:
        raise TableError(f"{run_dir}: no ball touches the tool in the counted drag")
    impulse = rod[["drag_n", "lateral_n", "vertical_n"]].to_numpy().sum(axis=0) * interval_s
    path = motion_of(case).speed_m_s * interval_s * len(steps)
    return Sampled(pd.concat(parts, ignore_index=True), len(steps), interval_s, path, impulse)


def _rod_at(file: Path, steps: Ints) -> pd.DataFrame:
    """Place, heading and force of the tool at rising steps, by step."""
    names = ["step", "heading_rad", *_REFERENCE, "drag_n", "lateral_n", "vertical_n"]
    parts = (rows[np.isin(rows["step"], steps)] for rows in read_groups(file, names))
    rod = pd.concat(parts, ignore_index=True).set_index("step").reindex(steps)
    if rod.isna().any(axis=None):
        raise TableError(
            f"{file.parent}: rod_force.parquet lacks steps of rod_contacts.parquet;"
            " make both again with `dragchain tables`"
        )
    return rod


def _read_contacts(file: Path, run_dir: Path) -> Iterator[pd.DataFrame]:
    """Counted contacts with force, a row group at a time."""
    for contacts in read_groups(file, _CONTACT):
        loaded = contacts[_loaded(contacts)].reset_index(drop=True)
        if loaded[_VELOCITY].isna().any(axis=None):
            raise TableError(
                f"{file}: slip_x_m_s is not known: the run's rod_balls holds no velocities,"
                " as runs did before it was asked for them; run the case again, then "
                f"dragchain tables {run_dir}"
            )
        if len(loaded):
            yield loaded


def _loaded(contacts: pd.DataFrame) -> pd.Series:
    """Tell which contacts count and carry force."""
    return contacts["counted"] & (contacts[_FORCE] != 0.0).any(axis=1)


def _counted_steps(run_dir: Path, case: Case) -> tuple[Ints, float]:
    """Return the counted steps of ``rod_contacts`` and the time between two, s."""
    output = load_outputs(run_dir)["rod_contacts"]
    last = needed(output.last_step, "last_step of rod_contacts")
    steps = np.arange(output.first_step, last + 1, output.period_steps, dtype=np.int64)
    counted = counted_mask(steps, case)
    file = run_dir / "tables" / "rod_contacts.parquet"
    for rows in read_groups(file, ["step", "counted"]):
        counted &= ~np.isin(steps, rows.loc[~rows["counted"], "step"].unique())
    return steps[counted], output.period_steps * case.timestep_s


def _with_amounts(
    rows: pd.DataFrame, rod: pd.DataFrame, case: Case, interval_s: float, limits: Thresholds
) -> pd.DataFrame:
    """Add to each contact what it adds to the sums, and its point and slip in the tool's frame."""
    force, slip, point = (rows[names].to_numpy() for names in (_FORCE, _VELOCITY, _PLACE))
    normal, tangential = (rows[f"{name}_force_n"].to_numpy() for name in ("normal", "tangential"))
    reference = rod[_REFERENCE].to_numpy()
    heading = rod["heading_rad"].to_numpy()
    turn = tool_turn(heading, case)
    speed = np.linalg.norm(slip, axis=1)
    most = surfaces(case).friction * normal
    mobilisation = np.divide(tangential, most, out=np.full_like(most, np.inf), where=most > 0.0)
    mobilised = mobilisation >= limits.mobilised
    velocity = tool_velocity(rows["step"].to_numpy(), point, reference[:, :2], case)
    drag = workpiece_frame(force, heading) * interval_s
    return rows.assign(
        **dict(zip(POINT, turned(point - reference, -turn).T, strict=True)),
        **dict(zip(SLIP, turned(slip, -turn).T, strict=True)),
        **dict(zip(WORKPIECE, drag.T, strict=True)),
        mobilisation=mobilisation,
        mobilised=mobilised,
        normal_impulse_ns=normal * interval_s,
        tangential_impulse_ns=tangential * interval_s,
        relative_path_m=speed * interval_s,
        sliding_m=speed * mobilised * interval_s,
        force_slide_nm=normal * speed * mobilised * interval_s,
        friction_work_j=np.einsum("ij,ij->i", force, slip) * interval_s,
        normal_work_j=normal * rows["approach_m_s"].to_numpy() * interval_s,
        tool_work_j=-np.einsum("ij,ij->i", force, velocity) * interval_s,
    )


def tool_turn(heading_rad: Floats, case: Case) -> Floats:
    """Angle of the tool's own frame about the vertical at these headings, rad."""
    motion = motion_of(case)
    if isinstance(motion, Circle) and not motion.turns_with_path:
        return np.full_like(heading_rad, motion.start_heading_rad)
    return heading_rad


def turned(vectors: Floats, angle_rad: Floats | float) -> Floats:
    """Turn (..., 3) vectors about the vertical."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=-1)


def read_surface(run_dir: Path, case: Case) -> Surface:
    """Read the tool's mesh into its own frame.

    The STL file of a user's mesh looks along +x as it is; a cylinder is put into
    the bed unturned, whatever its heading.

    Raises
    ------
    TableError
        If the file is not there.
    """
    import meshio

    tool = needed(case.tool, "tool")
    file = run_dir / tool.mesh
    if not file.is_file():
        raise TableError(f"{file} is not there, though case.json names it as the tool's mesh")
    with np.errstate(over="ignore"):
        mesh = meshio.read(file)
    corners = np.asarray(mesh.points[mesh.cells_dict["triangle"]], dtype=np.float64)
    motion = motion_of(case)
    if tool.kind == "cylinder":
        start = motion.start_heading_rad if isinstance(motion, Circle) else motion.heading_rad
        corners = turned(corners, -start)
    return Surface(corners)


def _check_facets(sampled: Sampled, surface: Surface, case: Case) -> float:
    """Return how far contact points lie off their facets at most, m, if that is rounding."""
    facet = sampled.rows["facet_id"].to_numpy()
    if facet.min() < 0 or facet.max() >= len(surface.corners):
        raise TableError(
            f"rod_contacts.parquet names facet {facet.max()}, but the tool's mesh has facets"
            f" 0 to {len(surface.corners) - 1}: is it the mesh of this run?"
        )
    point = sampled.rows[POINT].to_numpy()
    parts = np.array_split(np.arange(len(facet)), 1 + len(facet) // BLOCK_ROWS)
    off = np.concatenate([off_facet(point[part], surface.corners[facet[part]]) for part in parts])
    limit = OFF_FACET * needed(case.tool, "tool").length_m
    worst = int(off.argmax())
    if off[worst] > limit:
        raise TableError(
            f"a contact point of facet {facet[worst]} lies {off[worst]:.3g} m off it, more than"
            f" {limit:.3g} m: facet numbers and mesh do not belong together"
        )
    return float(off[worst])


def off_facet(point_m: Floats, corners: Floats) -> Floats:
    """Return the distance of (N, 3) points from (N, 3, 3) triangles, (N,) in m."""
    edges = np.roll(corners, -1, axis=1) - corners
    away = point_m[:, None] - corners
    normal = np.cross(edges[:, 0], edges[:, 1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    inside = (np.einsum("ijk,ijk->ij", np.cross(edges, away), normal[:, None]) >= 0).all(axis=1)
    along = np.einsum("ijk,ijk->ij", away, edges) / np.einsum("ijk,ijk->ij", edges, edges)
    nearest = corners + np.clip(along, 0.0, 1.0)[..., None] * edges
    from_edges = np.linalg.norm(point_m[:, None] - nearest, axis=2).min(axis=1)
    from_plane = np.abs(np.einsum("ij,ij->i", away[:, 0], normal))
    return np.asarray(np.where(inside, from_plane, from_edges))


# --- facets ----------------------------------------------------------------------------------


def facet_table(sampled: Sampled, surface: Surface, events: pd.DataFrame) -> pd.DataFrame:
    """Return the sums of each facet, a row a facet in the order of their numbers."""
    rows, count = sampled.rows, len(surface.corners)
    facet = rows["facet_id"].to_numpy()
    peak = np.zeros(count)
    np.maximum.at(peak, facet, rows["normal_force_n"])
    samples = np.bincount(facet, minlength=count)
    names = (*AMOUNTS, *WORKPIECE)
    sums = {name: np.bincount(facet, rows[name], count) for name in names}
    errors = {f"{name}_se": _standard_error(sampled, name, count) for name in UNCERTAIN}
    area = surface.areas
    return pd.DataFrame(
        {
            "facet_id": np.arange(count),
            **_axes("centre", "_m", surface.centres),
            **_axes("normal", "", surface.normals),
            "area_m2": area,
            "samples": samples,
            "events": np.bincount(events["facet_id"], minlength=count),
            "mean_contacts": samples / sampled.frames,
            **sums,
            **errors,
            "peak_normal_force_n": peak,
            "mean_pressure_pa": sums["normal_impulse_ns"]
            / (area * sampled.frames * sampled.interval_s),
            "force_slide_pa": sums["force_slide_nm"] / (area * sampled.path_m),
            "friction_work_pa": sums["friction_work_j"] / (area * sampled.path_m),
        }
    )


def _standard_error(sampled: Sampled, name: str, count: int) -> Floats:
    """Return the standard error of a sum of each facet, (count,), by batch means.

    The samples are cut into batches that outlast the memory of the whole tool's
    series (`block_length`); the batches' spread gives the error.
    """
    rows = sampled.rows
    series = np.bincount(rows["frame"], rows[name], sampled.frames)
    batches = max(2, sampled.frames // block_length(series[:, None].astype(np.float64)))
    batch = rows["frame"].to_numpy() * batches // sampled.frames
    at = batch * count + rows["facet_id"].to_numpy()
    sums = np.bincount(at, rows[name], batches * count).reshape(batches, count)
    return np.asarray(np.sqrt(batches) * sums.std(axis=0, ddof=1))


def _axes(name: str, unit: str, vectors: Floats) -> dict[str, Floats]:
    return {f"{name}_{axis}{unit}": column for axis, column in zip("xyz", vectors.T, strict=True)}


def write_vtp(surface: Surface, facets: pd.DataFrame, file: Path) -> None:
    """Write the tool's mesh in its own frame with a cell array for each column of `facets`."""
    mesh = as_polydata(surface)
    for name in facets:
        mesh.cell_data[name] = facets[name].to_numpy()
    draft = file.with_name(f".{file.stem}.part.vtp")
    mesh.save(draft)
    draft.replace(file)


def as_polydata(surface: Surface) -> Any:
    """Return the facets as PyVista's mesh, in their order."""
    import pyvista as pv

    points, at = np.unique(surface.corners.reshape(-1, 3), axis=0, return_inverse=True)
    return pv.PolyData(points, faces=np.insert(at.reshape(-1, 3), 0, 3, axis=1).ravel())


# --- findings --------------------------------------------------------------------------------


def findings(
    sampled: Sampled,
    facets: pd.DataFrame,
    events: pd.DataFrame,
    event: Ints,
    case: Case,
    limits: Thresholds,
) -> dict[str, Any]:
    """Return the content of ``removal.json``; `event` is the event of each row of `sampled`."""
    known = surfaces(case)
    found = {
        "schema": SCHEMA,
        "run": case.run,
        "confidence": CONFIDENCE,
        "samples": sampled.frames,
        "sample_interval_s": sampled.interval_s,
        "time_s": sampled.frames * sampled.interval_s,
        "path_m": sampled.path_m,
        "friction_coefficient": known.friction,
        "contact_time_s": known.contact_time_s,
        "impact_seen_share": min(1.0, known.contact_time_s / sampled.interval_s),
        "limits": limits.as_json(),
        **_totals(sampled, events),
        "types": _types(sampled, events, event),
        "sensitivity": _sensitivity(sampled, events, case, limits),
        "mobilised": _mobilised(sampled),
        "gaps": [{"samples": gap, "events": _stays(sampled.rows, 1 + gap)} for gap in (0, *GAPS)],
        "profiles": _profiles(sampled),
        "sampling": _sampling(sampled, case, limits),
        "closure": _closure(sampled, facets, events),
    }
    return {**found, "words": words(found)}


def words(found: Mapping[str, Any]) -> list[str]:
    """Say in sentences what the findings are, each number with its 95 % interval."""
    metre, front = found["per_metre"], found["front_share"]
    types = found["types"]
    by_type = "; ".join(
        f"{name} {types[name]['events']} stays with {_percent(share['normal_impulse_ns'])} of the"
        f" normal impulse and {_percent(share['friction_work_j'])} of the friction work"
        for name in TYPES
        for share in (types[name]["share_of"],)
    )
    return [
        f"{_span(found['mean_contacts'])} contacts press on the tool at once, in the mean.",
        f"A metre of way brings a normal impulse of {_span(metre['normal_impulse_ns'])} N s,"
        f" {_percent(front['normal_impulse_ns'])} of it on the front half.",
        f"The contacts together slide {_span(metre['sliding_m'])} m a metre of way. Normal force"
        f" times sliding distance is {_span(metre['force_slide_nm'])} N m a metre,"
        f" {_percent(front['force_slide_nm'])} of it on the front half.",
        f"Friction on the tool takes {_span(metre['friction_work_j'])} J a metre, which is"
        f" {_percent(found['friction_share_of_work'])} of the work that the tool does on the bed.",
        f"{_percent(found['load_while_sliding_share'])} of the normal impulse is carried while a"
        " contact slides, the rest while it sticks.",
        f"By type of stay: {by_type}.",
        f"A lone impact at the tool's speed lasts {1e3 * found['contact_time_s']:.2g} ms and a"
        f" sample comes every {1e3 * found['sample_interval_s']:.2g} ms, so the chance to see one"
        f" is {100 * found['impact_seen_share']:.2g} %. The sums are fair all the same; the number"
        " of stays depends on the rate of samples.",
    ]


def _span(estimate: Mapping[str, float | None]) -> str:
    value, low, high = (_digits(estimate[key]) for key in ("value", "low", "high"))
    return f"{value} ({low} to {high})"


def _percent(estimate: Mapping[str, float | None]) -> str:
    value, low, high = (
        _digits(None if estimate[key] is None else 100.0 * (estimate[key] or 0.0))
        for key in ("value", "low", "high")
    )
    return f"{value} % ({low} to {high})"


def _digits(value: float | None) -> str:
    """Return a number with three digits and without an exponent, "unknown" for none."""
    if value is None:
        return "unknown"
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"


def _totals(sampled: Sampled, events: pd.DataFrame) -> dict[str, Any]:
    """Return totals, what they are a metre of path, the front's share, and shares of work."""
    rows, known = sampled.rows, [*AMOUNTS, "normal_work_j", "tool_work_j"]
    ahead = within(rows["bearing_rad"].to_numpy(np.float64), np.pi / 2)
    frame, frames = rows["frame"].to_numpy(), sampled.frames
    loads = rows["normal_impulse_ns"] * rows["mobilised"]
    sums = np.column_stack(
        [
            *(np.bincount(frame, rows[name], frames) for name in known),
            *(np.bincount(frame, rows[name] * ahead, frames) for name in known),
            np.bincount(frame, minlength=frames),
            np.bincount(frame, loads, frames),
            np.bincount(events["frame"], minlength=frames),
        ]
    )
    count = len(known)
    at = {name: number for number, name in enumerate(known)}
    metre = sampled.path_m / sampled.frames

    def statistic(means: Floats) -> Floats:
        total, front = means[..., :count], means[..., count : 2 * count]
        work = total[..., [at["friction_work_j"], at["normal_work_j"]]]
        contacts, sliding, begins = np.moveaxis(means[..., 2 * count :], -1, 0)
        shares = [
            *np.moveaxis(work / total[..., [at["tool_work_j"]]], -1, 0),
            sliding / total[..., at["normal_impulse_ns"]],
            contacts,
            begins / metre,
        ]
        return np.concatenate([total / metre, front / total, np.stack(shares, -1)], axis=-1)

    found = [estimate.as_json() for estimate in estimates(sums, statistic)]
    names = ("friction_share_of_work", "normal_share_of_work", "load_while_sliding_share")
    return {
        "totals": {name: float(rows[name].sum()) for name in known} | {"events": len(events)},
        "per_metre": dict(zip(known, found, strict=False)) | {"events": found[-1]},
        "front_share": dict(zip(known, found[count:], strict=False)),
        **dict(zip((*names, "mean_contacts"), found[2 * count : -1], strict=True)),
    }


_SHARED = ("samples", "normal_impulse_ns", "sliding_m", "force_slide_nm", "friction_work_j")


def _types(sampled: Sampled, events: pd.DataFrame, event: Ints) -> dict[str, Any]:
    """Return number, shares and intensity of the contacts of each type."""
    rows = sampled.rows.assign(samples=1.0)
    kind = events["type"].to_numpy()
    of_rows = kind[event]
    frame = rows["frame"].to_numpy()
    parts = [
        np.bincount(frame, rows[name] * (of_rows == t), sampled.frames)
        for t in TYPES
        for name in _SHARED
    ]
    begun = [np.bincount(events["frame"][kind == t], minlength=sampled.frames) for t in TYPES]
    sums = np.column_stack([*parts, *begun])
    width = len(_SHARED)

    def statistic(means: Floats) -> Floats:
        loads = means[..., : width * len(TYPES)].reshape(*means.shape[:-1], len(TYPES), width)
        begins = means[..., width * len(TYPES) :, None]
        both = np.concatenate([loads, begins], axis=-1)
        shares = both / both.sum(axis=-2, keepdims=True)
        return np.asarray(shares.reshape(*means.shape[:-1], -1))

    found = iter(estimates(sums, statistic))
    return {
        name: {
            "events": int((kind == name).sum()),
            "share_of": {key: next(found).as_json() for key in (*_SHARED, "events")},
            "intensity": _intensity(events[kind == name]),
        }
        for name in TYPES
    }


def _intensity(events: pd.DataFrame) -> dict[str, dict[str, float | None]]:
    """Return quartiles and 95th percentile over the events of a type."""
    names = ("duration_s", "peak_normal_force_n", "mean_normal_force_n", "normal_impulse_ns")
    shares = {"p25": 0.25, "p50": 0.5, "p75": 0.75, "p95": 0.95}
    return {
        name: {
            key: finite(float(events[name].quantile(share))) if len(events) else None
            for key, share in shares.items()
        }
        for name in (*names, "sliding_m", "friction_work_j")
    }


def _sensitivity(
    sampled: Sampled, events: pd.DataFrame, case: Case, limits: Thresholds
) -> list[dict[str, Any]]:
    """Return the shares by type with each limit halved and doubled."""
    interval_s = sampled.interval_s
    cases = {"as stated": limits, **limits.varied()}
    return [
        {"limits": name, "share_of": _shares(events, event_types(events, case, interval_s, moved))}
        for name, moved in cases.items()
    ]


def _shares(events: pd.DataFrame, kind: Any) -> dict[str, dict[str, float | None]]:
    """Return each type's share of the stays and of what they bring."""
    names = ("normal_impulse_ns", "force_slide_nm", "friction_work_j")
    shares = {
        name: {t: _share(events[name].to_numpy(), kind == t) for t in TYPES} for name in names
    }
    return {"events": {t: float((kind == t).mean()) for t in TYPES}, **shares}


def _share(values: Floats, chosen: Any) -> float | None:
    total = float(values.sum())
    return finite(float(values[chosen].sum()) / total) if total else None


def _mobilised(sampled: Sampled) -> list[dict[str, float]]:
    """Return what counts as sliding with other limits of `Thresholds.mobilised`."""
    rows = sampled.rows
    table = []
    for limit in MOBILISED:
        slides = rows["mobilisation"] >= limit
        path = rows["relative_path_m"][slides]
        load = rows["normal_impulse_ns"][slides].sum() / rows["normal_impulse_ns"].sum()
        force = float((rows["normal_force_n"][slides] * path).sum())
        table.append(
            {
                "limit": limit,
                "load_while_sliding_share": float(load),
                "sliding_m": float(path.sum()),
                "force_slide_nm": force,
            }
        )
    return table


def _profiles(sampled: Sampled) -> dict[str, Any]:
    """Return force times sliding distance by depth and by bearing, a metre of path."""
    rows, metre = sampled.rows, sampled.path_m / sampled.frames
    frame, weight = rows["frame"].to_numpy(), rows["force_slide_nm"].to_numpy()
    depth = rows["depth_m"].to_numpy()
    levels = np.linspace(depth.min(), depth.max(), DEPTH_BINS + 1)
    level = np.clip(np.searchsorted(levels, depth, side="right") - 1, 0, DEPTH_BINS - 1)
    bins = {
        "depth": (levels, (level, level)),
        "bearing": (
            circumference(BEARING_BINS),
            parts(rows["bearing_rad"].to_numpy(np.float64), BEARING_BINS),
        ),
    }
    profiles = {}
    for name, (edges, halves) in bins.items():
        sums = np.zeros((sampled.frames, len(edges) - 1))
        for half in halves:
            np.add.at(sums, (frame, half), 0.5 * weight)
        found = estimates(sums, _per(metre * (edges[1] - edges[0])))
        profiles[name] = {"edges": edges.tolist(), "force_slide": _columns(found)}
    return profiles


def _per(scale: float) -> Any:
    return lambda means: means / scale


def _columns(found: list[Estimate]) -> dict[str, list[float | None]]:
    keys = ("value", "low", "high")
    return {key: [finite(getattr(estimate, key)) for estimate in found] for key in keys}


def _sampling(sampled: Sampled, case: Case, limits: Thresholds) -> list[dict[str, Any]]:
    """Return what every n-th sample alone would give.

    The sums' errors are the worst of its n beginnings, the number of stays is their mean; the
    shares by type are those of the first.
    """
    return [
        {
            "every": every,
            "samples_hz": 1.0 / (every * sampled.interval_s),
            "largest_relative_error": {
                name: _thinned_error(sampled.rows, name, every) for name in AMOUNTS
            },
            "events": float(np.mean([_thinned_stays(sampled, every, i) for i in range(every)])),
            "share_of": _thinned_types(sampled, every, case, limits),
        }
        for every in THINNING
    ]


def _thinned(sampled: Sampled, every: int) -> pd.DataFrame:
    """Return the contacts of every n-th frame, each standing for n; frames are numbered anew."""
    rows = sampled.rows[sampled.rows["frame"] % every == 0]
    amounts = {name: every * rows[name] for name in AMOUNTS}
    return rows.assign(frame=rows["frame"] // every, **amounts).reset_index(drop=True)


def _thinned_stays(sampled: Sampled, every: int, start: int) -> int:
    """Return the number of stays that every n-th frame shows."""
    rows = sampled.rows.loc[sampled.rows["frame"] % every == start, ["ball_id", "frame"]]
    return _stays(rows.assign(frame=rows["frame"] // every))


def _thinned_error(rows: pd.DataFrame, name: str, every: int) -> float | None:
    """Return the largest relative error of a sum over every n-th frame."""
    parts = np.bincount(rows["frame"] % every, rows[name], every)
    return finite(float(np.abs(every * parts / parts.sum() - 1.0).max())) if parts.sum() else None


def _thinned_types(
    sampled: Sampled, every: int, case: Case, limits: Thresholds
) -> dict[str, dict[str, float | None]]:
    interval_s = every * sampled.interval_s
    rows = _thinned(sampled, every)
    events, _ = find_events(rows, -(-sampled.frames // every), interval_s)
    return _shares(events, event_types(events, case, interval_s, limits))


def _stays(rows: pd.DataFrame, step: int = 1) -> int:
    """Return the number of stays on the tool; samples of one are at most `step` apart."""
    touches = rows[["ball_id", "frame"]].drop_duplicates().sort_values(["ball_id", "frame"])
    ball, frame = touches["ball_id"].to_numpy(), touches["frame"].to_numpy()
    return int(len(touches) > 0) + int(((np.diff(ball) != 0) | (np.diff(frame) > step)).sum())


def _closure(sampled: Sampled, facets: pd.DataFrame, events: pd.DataFrame) -> dict[str, Any]:
    """Return how the sums over facets and events agree with those of the tool."""
    whole = {name: float(sampled.rows[name].sum()) for name in AMOUNTS}
    placed = facets[list(WORKPIECE)].to_numpy().sum(axis=0)
    missing = sampled.rod_impulse_ns - placed
    names = ("drag", "lateral", "vertical")
    return {
        "rod_impulse_ns": dict(zip(names, sampled.rod_impulse_ns.tolist(), strict=True)),
        "facets_impulse_ns": dict(zip(names, placed.tolist(), strict=True)),
        "unplaced_impulse_ns": dict(zip(names, missing.tolist(), strict=True)),
        "rod_relative_error": float(
            np.linalg.norm(missing) / np.linalg.norm(sampled.rod_impulse_ns)
        ),
        "facets_relative_error": _largest_error(facets, whole),
        "events_relative_error": _largest_error(events, whole),
    }


def _largest_error(table: pd.DataFrame, whole: Mapping[str, float]) -> float:
    return max(
        abs(float(table[name].sum()) - total) / abs(total) if total else 0.0
        for name, total in whole.items()
    )
