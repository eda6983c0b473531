"""The counted contacts on a workpiece, with what each adds to the sums."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from dragchain.arrays import Floats, Ints
from dragchain.errors import TableError
from dragchain.loading.contact_events import AMOUNTS, POINT, SLIP, Thresholds, surfaces
from dragchain.run.case import Case, load_outputs
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
from dragchain.tables.by_step import read_groups

WORKPIECE = ("drag_impulse_n_s", "lateral_impulse_n_s", "vertical_impulse_n_s")
BODY = ("body_x_impulse_n_s", "body_y_impulse_n_s", "body_z_impulse_n_s")
"""Impulse on a workpiece that spins, in its own frame."""

_FORCE = ["force_x_n", "force_y_n", "force_z_n"]
_PLACE = ["point_x_m", "point_y_m", "point_z_m"]
_VELOCITY = ["slip_x_m_s", "slip_y_m_s", "slip_z_m_s"]
_REFERENCE = ["ref_x_m", "ref_y_m", "ref_z_m"]
_CONTACT = [
    *("step", "time_s", "particle_id", "facet_id", *_PLACE, *_FORCE, "normal_force_n"),
    *(
        "tangential_force_n",
        *_VELOCITY,
        "normal_velocity_m_s",
        "azimuth_rad",
        "depth_m",
        "in_statistics",
    ),
]

_KEPT = [
    *("frame", "time_s", "particle_id", "facet_id", "normal_force_n", "azimuth_rad", "depth_m"),
    *(*POINT, *SLIP, *WORKPIECE, *AMOUNTS),
    *("mobilisation", "mobilised", "normal_work_j", "workpiece_work_j"),
]
"""What is held of every contact."""

DRAWN = ["workpiece_z_m", "depth_m", "azimuth_rad", "force_slide_n_m"]
"""What is left of it for the picture, which needs memory itself."""


@dataclass(frozen=True)
class Sampled:
    """The counted contacts on a workpiece, with what each adds to the sums.

    Attributes
    ----------
    rows : DataFrame
        A contact with force: as `find_events` takes them, and `WORKPIECE` and
        ``workpiece_work_j``, the work that the workpiece does on the particle through it, seen from
        the bowl.
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

    def per_frame(self, weights: ArrayLike | None = None) -> Floats:
        """Sums of a weight of each row by frame, (frames,); numbers of rows if None."""
        sums = np.bincount(self.rows["frame"], weights, self.frames)
        return np.asarray(sums, dtype=np.float64)


# --- reading ---------------------------------------------------------------------------------


def sample(run_dir: Path, case: Case, limits: Thresholds) -> Sampled:
    """Read the counted contacts of a run, a row group at a time; see `Sampled`."""
    tables = run_dir / "tables"
    steps, interval_s = _counted_steps(run_dir, case)
    workpiece = _workpiece_at(tables / "workpiece_force.parquet", steps)
    parts = []
    for contacts in _read_contacts(tables / "workpiece_contacts.parquet", run_dir):
        contacts["frame"] = np.searchsorted(steps, contacts["step"])
        at = workpiece.reindex(contacts["step"])
        parts.append(_with_amounts(contacts, at, case, interval_s, limits))
    if not parts:
        raise TableError(
            f"{run_dir}: no particle touches the workpiece in the part of "
            "the drag that enters the statistics"
        )
    impulse = workpiece[["drag_n", "lateral_n", "vertical_n"]].to_numpy().sum(axis=0) * interval_s
    path = axis_speed(case) * interval_s * len(steps)
    return Sampled(pd.concat(parts, ignore_index=True), len(steps), interval_s, path, impulse)


def _workpiece_at(file: Path, steps: Ints) -> pd.DataFrame:
    """Place, heading and force of the workpiece at rising steps, by step."""
    names = ["step", "direction_rad", *_REFERENCE, "drag_n", "lateral_n", "vertical_n"]
    parts = (rows[np.isin(rows["step"], steps)] for rows in read_groups(file, names))
    workpiece = pd.concat(parts, ignore_index=True).set_index("step").reindex(steps)
    if workpiece.isna().any(axis=None):
        raise TableError(
            f"{file.parent}: workpiece_force.parquet lacks steps of workpiece_contacts.parquet;"
            " make both again with `dragchain tables`"
        )
    return workpiece


def _read_contacts(file: Path, run_dir: Path) -> Iterator[pd.DataFrame]:
    """Counted contacts with force, a row group at a time."""
    for contacts in read_groups(file, _CONTACT):
        loaded = contacts[_loaded(contacts)].reset_index(drop=True)
        if loaded[_VELOCITY].isna().any(axis=None):
            raise TableError(
                f"{file}: slip_x_m_s is missing: the output workpiece_particles of this older "
                "run contains no velocities; run the case again, then "
                f"dragchain tables {run_dir}"
            )
        if len(loaded):
            yield loaded


def _loaded(contacts: pd.DataFrame) -> pd.Series:
    """Which contacts count and carry force."""
    return contacts["in_statistics"] & (contacts[_FORCE] != 0.0).any(axis=1)


def _counted_steps(run_dir: Path, case: Case) -> tuple[Ints, float]:
    """The counted steps of ``workpiece_contacts`` and the time between two, s."""
    output = load_outputs(run_dir)["workpiece_contacts"]
    last = needed(output.last_step, "last_step of workpiece_contacts")
    steps = np.arange(output.first_step, last + 1, output.period_steps, dtype=np.int64)
    counted = counted_mask(steps, case)
    file = run_dir / "tables" / "workpiece_contacts.parquet"
    for rows in read_groups(file, ["step", "in_statistics"]):
        counted &= ~np.isin(steps, rows.loc[~rows["in_statistics"], "step"].unique())
    return steps[counted], output.period_steps * case.timestep_s


def _with_amounts(
    rows: pd.DataFrame, workpiece: pd.DataFrame, case: Case, interval_s: float, limits: Thresholds
) -> pd.DataFrame:
    """Add to each contact its contributions, and its point and slip in the body frame."""
    force, slip, point = (rows[names].to_numpy() for names in (_FORCE, _VELOCITY, _PLACE))
    normal, tangential = (rows[f"{name}_force_n"].to_numpy() for name in ("normal", "tangential"))
    reference = workpiece[_REFERENCE].to_numpy()
    heading = workpiece["direction_rad"].to_numpy()
    steps = rows["step"].to_numpy()
    rotation = workpiece_rotation(steps, heading, case)
    speed = np.linalg.norm(slip, axis=1)
    most = surfaces(case).friction * normal
    mobilisation = np.divide(tangential, most, out=np.full_like(most, np.inf), where=most > 0.0)
    mobilised = mobilisation >= limits.mobilised
    velocity = workpiece_velocity(steps, point, reference, case)
    velocity -= bowl_velocity(point, case)
    drag = workpiece_frame(force, heading) * interval_s
    in_body = {}
    if spins(case):
        in_body = dict(zip(BODY, (rotation.into(force) * interval_s).T, strict=True))
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
