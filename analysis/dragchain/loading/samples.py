"""The counted contacts on a workpiece, with what each adds to the sums, and those by facet."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from dragchain.arrays import Floats, Ints
from dragchain.errors import TableError
from dragchain.loading.contact_events import AMOUNTS, LIMITS, POINT, SLIP
from dragchain.run.case import attracting, friction_with
from dragchain.run.kinematics import (
    axis_speed,
    bowl_velocity,
    counted_mask,
    needed,
    spins,
    workpiece_frame,
    workpiece_rotation,
    workpiece_velocity,
)
from dragchain.run.workpiece import Surface, off_facet
from dragchain.statistics.correlated import slow_waves
from dragchain.tables.by_step import read_groups, read_table
from dragchain.tables.columns import ATTRACTION, FORCES, REFERENCE, WORKPIECE_CONTACTS
from dragchain.tables.columns import POINT as PLACE
from dragchain.tables.columns import SLIP as RELATIVE
from dragdeck.decks.outputs import TOUCHES, load_outputs
from dragdeck.records.case import CaseOfRun

WORKPIECE = ("drag_impulse_n_s", "lateral_impulse_n_s", "vertical_impulse_n_s")
BODY_IMPULSE = ("body_x_impulse_n_s", "body_y_impulse_n_s", "body_z_impulse_n_s")
"""Impulse on a workpiece that spins, in its own frame."""

TOUCHED = "touches"
"""Table of contacts at so short intervals that each is seen to begin."""

_ALONG = ["drag_n", "lateral_n", "vertical_n"]
_CONTACT = [name for name in WORKPIECE_CONTACTS if name not in ("phase", "overlap_m")]
_FORCE, _PLACE, _VELOCITY, _REFERENCE = map(list, (FORCES, PLACE, RELATIVE, REFERENCE))

_KEPT = [
    *("frame", "time_s", "particle_id", "facet_id", "normal_force_n", "azimuth_rad", "depth_m"),
    *(*POINT, *SLIP, *WORKPIECE, *AMOUNTS),
    *("mobilisation", "mobilised", "normal_work_j", "workpiece_work_j", "normal_velocity_m_s"),
]
"""What is held of every contact."""

SPHERES = "sphere_contacts"
"""Table of the contacts of the spheres of clumps, whose amounts add up."""

DRAWN = ["workpiece_z_m", "depth_m", "azimuth_rad", "force_slide_n_m"]
"""What is left of it for the picture, which needs memory itself."""


@dataclass(frozen=True)
class Sampled:
    """The counted contacts on a workpiece, with what each adds to the sums.

    Attributes
    ----------
    rows : DataFrame
        A contact with force, of a clump each of a sphere: as `find_events` takes them, and
        `WORKPIECE` and ``workpiece_work_j``, the work that the workpiece does on the particle
        through it, seen from the bowl.
    frames : int
        Number of counted samples, those without contact included.
    interval_s : float
        Time between two, s.
    path_m : float
        Way of the workpiece's reference point in all of them, m.
    workpiece_impulse_n_s : (3,) ndarray
        Impulse on the workpiece along its motion, to the left of it and up, from
        ``workpiece_force.parquet`` at the same steps, N s.
    """

    rows: pd.DataFrame
    frames: int
    interval_s: float
    path_m: float
    workpiece_impulse_n_s: Floats

    def per_frame(self, weights: ArrayLike) -> Floats:
        """Sums of a weight of each row by frame, (frames,)."""
        sums = np.bincount(self.rows["frame"], weights, self.frames)
        return np.asarray(sums, dtype=np.float64)


# --- reading ---------------------------------------------------------------------------------


def sample(run_dir: Path, case: CaseOfRun, table: str = "workpiece_contacts") -> Sampled:
    """Read the counted contacts of a run, a row group at a time; see `Sampled`.

    The table may be ``touches`` instead, whose steps lie between those of the force.
    """
    tables = run_dir / "tables"
    steps, interval_s = _counted_steps(run_dir, case, table)
    force = tables / "workpiece_force.parquet"
    workpiece = (
        _workpiece_between(force, steps) if table == TOUCHED else _workpiece_at(force, steps)
    )
    parts = []
    of = table if table == TOUCHED or not case.bodies else SPHERES
    for contacts in _read_contacts(tables / f"{of}.parquet", run_dir, case):
        contacts["frame"] = np.searchsorted(steps, contacts["step"])
        at = workpiece.reindex(contacts["step"])
        parts.append(_with_amounts(contacts, at, case, interval_s))
    if not parts:
        raise TableError(
            f"{run_dir}: no particle touches the workpiece in the part of "
            "the drag that enters the statistics"
        )
    impulse = workpiece[_ALONG].to_numpy().sum(axis=0) * interval_s
    path = axis_speed(case) * interval_s * len(steps)
    rows = pd.concat(parts, ignore_index=True)
    rows["contacts"] = _numbers(rows, case)
    return Sampled(rows, len(steps), interval_s, path, impulse)


def _numbers(rows: pd.DataFrame, case: CaseOfRun) -> Floats:
    """What each row adds to the number of contacts: of those of a clump in a sample the strongest.

    1 for that and for a contact of a sphere that is a particle, else 0.
    """
    if not case.bodies:
        return np.ones(len(rows))
    numbers = np.zeros(len(rows))
    numbers[rows.groupby(["frame", "particle_id"])["normal_force_n"].idxmax()] = 1.0
    return numbers


def _workpiece_at(file: Path, steps: Ints) -> pd.DataFrame:
    """Place, heading and force of the workpiece at rising steps, by step."""
    names = ["step", "direction_rad", *_REFERENCE, *_ALONG]
    parts = (rows[np.isin(rows["step"], steps)] for rows in read_groups(file, names))
    workpiece = pd.concat(parts, ignore_index=True).set_index("step").reindex(steps)
    if workpiece.isna().any(axis=None):
        raise TableError(
            f"{file.parent}: workpiece_force.parquet lacks steps of workpiece_contacts.parquet;"
            " make both again with `./run dragchain tables`"
        )
    return workpiece


def _workpiece_between(file: Path, steps: Ints) -> pd.DataFrame:
    """The same between the samples around each step."""
    table = read_table(file, ["step", "direction_rad", *_REFERENCE, *_ALONG])
    table["direction_rad"] = np.unwrap(table["direction_rad"])
    at = table.pop("step")
    return pd.DataFrame({name: np.interp(steps, at, table[name]) for name in table}, index=steps)


def _read_contacts(file: Path, run_dir: Path, case: CaseOfRun) -> Iterator[pd.DataFrame]:
    """Counted contacts with force, a row group at a time."""
    columns = [*_CONTACT, *([ATTRACTION] if "workpiece" in attracting(case) else [])]
    for contacts in read_groups(file, columns):
        loads = contacts["in_statistics"] & (contacts[_FORCE] != 0.0).any(axis=1)
        loaded = contacts[loads].reset_index(drop=True)
        if loaded[_VELOCITY].isna().any(axis=None):
            raise TableError(
                f"{file}: slip_x_m_s is missing: the output workpiece_particles of this older "
                "run contains no velocities; run the case again, then "
                f"./run dragchain tables {run_dir}"
            )
        if len(loaded):
            yield loaded


def _counted_steps(run_dir: Path, case: CaseOfRun, table: str) -> tuple[Ints, float]:
    """The counted steps of a table of contacts on the workpiece and the time between two, s."""
    output = load_outputs(run_dir)[TOUCHES[1] if table == TOUCHED else table]
    last = needed(output.last_step, f"last_step of {output.name}")
    steps = np.arange(output.first_step, last + 1, output.period_steps, dtype=np.int64)
    counted = counted_mask(steps, case)
    file = run_dir / "tables" / f"{table}.parquet"
    for rows in read_groups(file, ["step", "in_statistics"]):
        counted &= ~np.isin(steps, rows.loc[~rows["in_statistics"], "step"].unique())
    return steps[counted], output.period_steps * case.timestep_s


def _with_amounts(
    rows: pd.DataFrame, workpiece: pd.DataFrame, case: CaseOfRun, interval_s: float
) -> pd.DataFrame:
    """Add to each contact its contributions, and its point and slip in the body frame."""
    force, slip, point = (rows[names].to_numpy() for names in (_FORCE, _VELOCITY, _PLACE))
    normal, tangential = (rows[f"{name}_force_n"].to_numpy() for name in ("normal", "tangential"))
    reference = workpiece[_REFERENCE].to_numpy()
    heading = workpiece["direction_rad"].to_numpy()
    steps = rows["step"].to_numpy()
    rotation = workpiece_rotation(steps, heading, case)
    speed = np.linalg.norm(slip, axis=1)
    ids = rows["particle_id"].to_numpy()
    limit = friction_with(case, "workpiece").at(ids, ids)
    most = limit.friction * (normal + rows.get(ATTRACTION, 0.0))
    mobilisation = np.divide(tangential, most, out=np.full_like(most, np.inf), where=most > 0.0)
    mobilised = mobilisation >= LIMITS.mobilised
    velocity = workpiece_velocity(steps, point, reference, case)
    velocity -= bowl_velocity(point, case)
    drag = workpiece_frame(force, heading) * interval_s
    in_body = {}
    if spins(case):
        in_body = dict(zip(BODY_IMPULSE, (rotation.into(force) * interval_s).T, strict=True))
    added = rows.assign(
        **in_body,
        **dict(zip(POINT, rotation.into(point - reference).T, strict=True)),
        **dict(zip(SLIP, rotation.into(slip).T, strict=True)),
        **dict(zip(WORKPIECE, drag.T, strict=True)),
        mobilisation=mobilisation,
        mobilised=mobilised,
        normal_impulse_n_s=normal * interval_s,
        tangential_impulse_n_s=tangential * interval_s,
        relative_path_m=speed * interval_s,
        sliding_m=speed * mobilised * interval_s,
        force_slide_n_m=normal * speed * mobilised * interval_s,
        friction_work_j=np.einsum("ij,ij->i", force, slip) * interval_s,
        normal_work_j=normal * rows["normal_velocity_m_s"].to_numpy() * interval_s,
        workpiece_work_j=-np.einsum("ij,ij->i", force, velocity) * interval_s,
    )
    return added[[*_KEPT, *in_body]]


# --- checks of facets ----------------------------------------------------------------------------


_OFF_FACET = 1e-5
"""Largest distance of a contact point from its facet over the workpiece's length: rounding."""

_BLOCK_ROWS = 100_000
"""Contacts that are held against their facets at once."""

_UNCERTAIN = ("normal_impulse_n_s", "force_slide_n_m", "friction_work_j")
"""Sums of a facet that come with a standard error."""


def check_facets(sampled: Sampled, surface: Surface, case: CaseOfRun) -> float:
    """How far contact points lie off their facets at most, m, if that is rounding."""
    facet = sampled.rows["facet_id"].to_numpy()
    if facet.min() < 0 or facet.max() >= len(surface.corners):
        raise TableError(
            f"workpiece_contacts.parquet contains facet {facet.max()}, but the mesh of "
            "the workpiece "
            f"has facets 0 to {len(surface.corners) - 1}: check that it is the mesh of this run"
        )
    point = sampled.rows[POINT].to_numpy()
    parts = np.array_split(np.arange(len(facet)), 1 + len(facet) // _BLOCK_ROWS)
    off = np.concatenate([off_facet(point[part], surface.corners[facet[part]]) for part in parts])
    limit = _OFF_FACET * needed(case.workpiece, "workpiece").length_m
    worst = int(off.argmax())
    if off[worst] > limit:
        raise TableError(
            f"a contact point of facet {facet[worst]} is {off[worst]:.3g} m away from it, more than"
            f" {limit:.3g} m: facet numbers and mesh do not match"
        )
    return float(off[worst])


# --- facets ----------------------------------------------------------------------------------


def facet_table(sampled: Sampled, surface: Surface, events: pd.DataFrame) -> pd.DataFrame:
    """The sums of each facet, one row per facet in the order of their numbers."""
    rows, count = sampled.rows, len(surface.corners)
    facet = rows["facet_id"].to_numpy()
    peak = np.zeros(count)
    np.maximum.at(peak, facet, rows["normal_force_n"])
    samples = np.bincount(facet, rows["contacts"], count).astype(np.int64)
    names = [name for name in (*AMOUNTS, *WORKPIECE, *BODY_IMPULSE) if name in rows]
    sums = {name: np.bincount(facet, rows[name], count) for name in names}
    errors = {f"{name}_se": standard_errors(sampled, name, count) for name in _UNCERTAIN}
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
            "mean_pressure_pa": sums["normal_impulse_n_s"]
            / (area * sampled.frames * sampled.interval_s),
            "force_slide_pa": sums["force_slide_n_m"] / (area * sampled.path_m),
            "friction_work_pa": sums["friction_work_j"] / (area * sampled.path_m),
        }
    )


def patches(surface: Surface, size_m: float) -> Ints:
    """The patch of each facet, (N,): those that lie in a cube of this size and face the same way.

    Single facets are hit by chance: a map of them shows the mesh instead of the load.
    """
    cells, faced = np.floor(surface.centres / size_m), np.round(surface.normals)
    _, group = np.unique(np.column_stack([cells, faced]), axis=0, return_inverse=True)
    return np.asarray(group.ravel(), dtype=np.int64)


def standard_errors(sampled: Sampled, name: str, count: int) -> Floats:
    """The standard errors of a sum of each facet, (count,), with `SLOW_WAVES` degrees of freedom.

    As `slow_error` of the series of each facet, which need not be held for that.
    """
    frame, facet, amount = (
        sampled.rows[column].to_numpy() for column in ("frame", "facet_id", name)
    )
    waves = slow_waves(sampled.frames)
    squares = [np.bincount(facet, amount * wave[frame], count) ** 2 for wave in waves]
    return np.asarray(np.sqrt(sampled.frames * np.mean(squares, axis=0)))


def _axes(name: str, unit: str, vectors: Floats) -> dict[str, Floats]:
    return {f"{name}_{axis}{unit}": column for axis, column in zip("xyz", vectors.T, strict=True)}


def as_polydata(surface: Surface) -> Any:
    """The facets as PyVista's mesh, in their order."""
    import pyvista as pv

    points, at = np.unique(surface.corners.reshape(-1, 3), axis=0, return_inverse=True)
    return pv.PolyData(points, faces=np.insert(at.reshape(-1, 3), 0, 3, axis=1).ravel())
