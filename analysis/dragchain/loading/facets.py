"""Load, sliding and friction work of each facet of the workpiece."""

from typing import Any

import numpy as np
import pandas as pd

from dragchain.arrays import Floats
from dragchain.errors import TableError
from dragchain.loading.contact_events import AMOUNTS, POINT
from dragchain.loading.samples import BODY, WORKPIECE, Sampled
from dragchain.run.case import Case
from dragchain.run.kinematics import needed
from dragchain.run.workpiece import Surface, off_facet
from dragchain.statistics.correlated import slow_waves

_OFF_FACET = 1e-5
"""Largest distance of a contact point from its facet over the workpiece's length: rounding."""

_BLOCK_ROWS = 100_000
"""Contacts that are held against their facets at once."""

LEAST_EVENTS = 25
"""With fewer contact events, the interval of a facet's load is too narrow."""

_UNCERTAIN = ("normal_impulse_n_s", "force_slide_n_m", "friction_work_j")
"""Sums of a facet that come with a standard error."""


def check_facets(sampled: Sampled, surface: Surface, case: Case) -> float:
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
    samples = np.bincount(facet, minlength=count)
    names = [name for name in (*AMOUNTS, *WORKPIECE, *BODY) if name in rows]
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


def standard_errors(sampled: Sampled, name: str, count: int) -> Floats:
    """The standard errors of a sum of each facet, (count,), with `SLOW_WAVES` degrees of freedom.

    As `slow_error` of the series of each facet, which need not be held for that.
    """
    frame, facet, amount = (sampled.rows[one].to_numpy() for one in ("frame", "facet_id", name))
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
