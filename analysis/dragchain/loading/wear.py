"""What laws of removal read of a run: the action of sliding and of impacts, and that along edges.

An action is what a law multiplies by its coefficient (`dragdeck.study.removal`). It is per process
time: a workpiece that is f times as fast takes 1/f of the time for the same path.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from dragchain.errors import TableError
from dragchain.loading.contact_events import POINT, SLIP, find_events
from dragchain.loading.document import Loading, Quantiles
from dragchain.loading.samples import TOUCHED, Sampled, patches, sample, standard_errors
from dragchain.loading.summary import quantiles
from dragchain.run.kinematics import needed
from dragchain.run.workpiece import Surface
from dragchain.statistics.correlated import estimates
from dragchain.statistics.estimate import Estimate, EstimateColumns
from dragchain.tables.by_step import read_table
from dragdeck.decks.outputs import TOUCHES, load_outputs
from dragdeck.documents import Document, Part
from dragdeck.records.case import CaseOfRun
from dragdeck.study.removal import LAWS, Law, Wearing

FILE = Path("tables") / "wear.json"

FEATURE_DEG = 30.0
"""Facets that meet at a convex edge with a larger angle between their normals make a sharp edge."""

_BANDS = (0.0, 0.0625, 0.125, 0.25, 0.5, 1.0)
"""Edges of the bands along sharp edges, in mean radii of a particle."""

_SPREAD = 400_000
"""Points that are strewn over a surface to tell the area of bands."""

TOUCH_QUANTITIES: Mapping[str, tuple[str, float]] = {
    "touch_normal_m_s": ("normal velocity at first touch (mm/s)", 1e3),
    "touch_tangential_m_s": ("tangential velocity at first touch (mm/s)", 1e3),
    "impact_angle_rad": ("angle of impact from the surface (degrees)", 180 / np.pi),
    "peak_normal_force_n": ("peak normal force (N)", 1.0),
    "peak_pressure_pa": ("peak Hertz pressure (MPa)", 1e-6),
    "duration_s": ("duration (ms)", 1e3),
    "sliding_m": ("sliding distance (\N{MICRO SIGN}m)", 1e6),
    "friction_work_j": ("friction work (\N{MICRO SIGN}J)", 1e6),
}
"""What a report tells of contact events: label with unit, and factor from SI."""


class TouchesOfRun(Part):
    """Contact events whose first touch was written.

    Attributes
    ----------
    events : int
        Those that begin in the sampled part of the drag.
    time_s, interval_s : float
        Simulated time of that part, and between two samples.
    per_s : Estimate
        Events per process time.
    quantities : mapping of Quantiles
        Distributions over the events; see `TOUCH_QUANTITIES`.
    """

    events: int
    time_s: float
    interval_s: float
    per_s: Estimate
    quantities: Mapping[str, Quantiles]


class EdgeBands(Part):
    """Action of sliding in bands along the sharp edges of the immersed workpiece.

    Attributes
    ----------
    length_m : float
        Length of all of them.
    angle_rad : float
        Mean interior angle.
    distance_m : tuple of float
        Edges of the bands.
    area_m2 : tuple of float
        Of the surface in each band.
    action_w : EstimateColumns
        Per process time in each band, W.
    """

    length_m: float
    angle_rad: float
    distance_m: tuple[float, ...]
    area_m2: tuple[float, ...]
    action_w: EstimateColumns


class Wear(Document):
    """The content of ``wear.json``.

    Attributes
    ----------
    area_m2 : tuple of float
        Of each facet.
    immersed : tuple of bool
        Whether a facet's centre is below the settled surface.
    action_w : Estimate
        Of the law of the study on the whole workpiece per process time, W: of laws that are added
        up, each times its coefficient over that of the study. Without a law that of Archard.
    patch_w_m2, patch_se_w_m2 : tuple of float
        By facet: the same per area, a mean over its patch, and its standard error, W/m2.
    impact_share : Estimate
        Part of it from the law of impact, or else from contact events of the type impact.
    touches : TouchesOfRun or None
    edges : EdgeBands or None
        None if the workpiece has no sharp edge below the settled surface.
    """

    remedy = "make it with: dragchain loading"

    run: str
    area_m2: tuple[float, ...]
    immersed: tuple[bool, ...]
    action_w: Estimate
    patch_w_m2: tuple[float, ...]
    patch_se_w_m2: tuple[float, ...]
    impact_share: Estimate
    touches: TouchesOfRun | None
    edges: EdgeBands | None


def asks_for_wear(run_dir: Path, case: CaseOfRun) -> bool:
    """Whether a run has a law of removal, or has written first touches."""
    return case.removal is not None or TOUCHES[1] in load_outputs(run_dir)


def compute_wear(
    run_dir: Path, case: CaseOfRun, sampled: Sampled, surface: Surface, loading: Loading
) -> tuple[Wear, pd.DataFrame | None]:
    """What laws of removal read of a run, and its contact events from first touch if written.

    Raises
    ------
    TableError
        If ``touches.parquet`` is missing or has no contact.
    """
    factor, size = case.fidelity.speed_factor, case.media.radius_mean_m
    immersion = needed(case.workpiece, "workpiece").immersion_depth_m
    loads = sampled.rows[["frame", "facet_id"]].assign(action=sampled.rows["force_slide_n_m"])
    sampled_actions = {False: replace(sampled, rows=loads)}
    touched = events = None
    laws = case.removal.laws if case.removal else [LAWS["archard"]]
    if TOUCHES[1] in load_outputs(run_dir):
        part = sample(run_dir, case, TOUCHED)
        events = first_touches(run_dir, part, case)
        touched = _touches(part, events, factor)
        for law in laws:
            if law.impact:
                rows = events[["frame", "facet_id"]].assign(action=impact_action(law, events, case))
                sampled_actions[True] = replace(part, rows=rows)
    group = patches(surface, size)
    each = [_action(sampled_actions[law.impact], surface, group, factor) for law in laws]
    total, density, error = (list(part) for part in zip(*each, strict=True))
    share = loading.types["impact"].fraction_of["force_slide_n_m"]
    if laws[-1].impact:
        share = _share(total[-1], total[:-1])
    wear = Wear(
        run=case.run,
        area_m2=tuple(surface.areas.tolist()),
        immersed=tuple((surface.centres[:, 2] <= immersion).tolist()),
        action_w=_sum(total),
        patch_w_m2=tuple(np.sum(density, axis=0)[group].tolist()),
        patch_se_w_m2=tuple(np.linalg.norm(error, axis=0)[group].tolist()),
        impact_share=share,
        touches=touched,
        edges=_edge_bands(sampled, surface, immersion, size, factor),
    )
    return wear, None if events is None else events.drop(columns="frame")


def _action(
    sampled: Sampled, surface: Surface, group: Ints, factor: float
) -> tuple[Estimate, Floats, Floats]:
    """The action of rows with ``frame``, ``facet_id`` and ``action`` per process time.

    In all, W, and of each patch with its standard error, W/m2.
    """
    rows, count, seconds = sampled.rows, int(group.max()) + 1, factor * sampled.interval_s
    at = group[rows["facet_id"].to_numpy()]
    per_patch = np.bincount(group, surface.areas) * sampled.frames * seconds
    errors = standard_errors(replace(sampled, rows=rows.assign(facet_id=at)), "action", count)
    series = sampled.per_frame(rows["action"])[:, None]
    total = estimates(series, lambda means: means / seconds)[0]
    return total, np.bincount(at, rows["action"], count) / per_patch, errors / per_patch


def _sum(parts: Sequence[Estimate]) -> Estimate:
    """The sum of independent estimates."""
    halves = ((one.ci95_high - one.ci95_low) / 2 for one in parts)
    return Estimate.around(math.fsum(one.value for one in parts), math.hypot(*halves))


def _share(one: Estimate, others: Sequence[Estimate]) -> Estimate:
    """The part of one of independent estimates in the sum of all."""
    if not others:
        return Estimate(1.0, 1.0, 1.0)
    rest = _sum(others)
    half = math.hypot(one.relative_half_width, rest.relative_half_width)
    return Estimate(*(1 / (1 + rest.value / one.value * math.exp(half * s)) for s in (0, 1, -1)))


# --- first touch ---------------------------------------------------------------------------------


def first_touches(run_dir: Path, part: Sampled, case: CaseOfRun) -> pd.DataFrame:
    """Contact events with the velocity at first touch, but those that the first sample truncates.

    The velocity is that of the particle's surface against the workpiece's at the contact point.
    The peak pressure is that of Hertz (1882) at the physical Young's modulus for the peak force,
    ``(6 F E^2 / (pi^3 R^2))^(1/3)``.
    """
    events, event = find_events(part.rows, part.frames, part.interval_s)
    rows = part.rows
    order = np.lexsort((-rows["normal_force_n"], rows["frame"], event))
    first = rows.iloc[order[np.diff(event[order], prepend=-1) > 0]]
    particles = read_table(run_dir / "tables" / "particles.parquet", ["particle_id", "radius_m"])
    radius_of = particles.drop_duplicates("particle_id").set_index("particle_id")["radius_m"]
    radius = radius_of.reindex(events["particle_id"]).to_numpy(np.float64)
    if np.isnan(radius).any():
        raise TableError(f"{run_dir}: particles.parquet lacks particles of touches.parquet")
    normal = first["normal_velocity_m_s"].to_numpy()
    tangential = np.linalg.norm(first[SLIP], axis=1)
    modulus = case.contact_moduli["workpiece"].modulus_pa / case.fidelity.youngs_modulus_scale
    pressure = np.cbrt(
        6 * events["peak_normal_force_n"].clip(lower=0) * modulus**2 / (np.pi**3 * radius**2)
    )
    found = events.assign(
        radius_m=radius,
        touch_normal_m_s=normal,
        touch_tangential_m_s=tangential,
        impact_angle_rad=np.arctan2(np.maximum(normal, 0.0), tangential),
        peak_pressure_pa=pressure,
    )
    return found[found["frame"] > 0].reset_index(drop=True)


def impact_action(law: Law, events: pd.DataFrame, case: CaseOfRun) -> Floats:
    """The action of an impact law of the study in each of (E,) events, J, times its weight."""
    radius = events["radius_m"].to_numpy()
    density = case.density_of(events["particle_id"].to_numpy(np.int64))
    wearing = Wearing(
        force_slide_n_m=events["force_slide_n_m"].to_numpy(),
        mass_kg=density * 4 / 3 * np.pi * radius**3,
        radius_m=radius,
        normal_m_s=events["touch_normal_m_s"].to_numpy(),
        tangential_m_s=events["touch_tangential_m_s"].to_numpy(),
    )
    removal = needed(case.removal, "removal")
    return removal.weight(law) * law.action(wearing, removal)


def _touches(part: Sampled, events: pd.DataFrame, factor: float) -> TouchesOfRun:
    begun = np.bincount(events["frame"], minlength=part.frames).astype(np.float64)[:, None]
    seconds = factor * part.interval_s
    return TouchesOfRun(
        events=len(events),
        time_s=part.frames * part.interval_s,
        interval_s=part.interval_s,
        per_s=estimates(begun, lambda means: means / seconds)[0],
        quantities={name: quantiles(events[name]) for name in TOUCH_QUANTITIES},
    )


def touch_maps(events: pd.DataFrame, surface: Surface, time_s: float) -> dict[str, Floats]:
    """First touches on each facet, (M,) each: frequency, mean velocity, largest pressure."""
    count, facet = len(surface.corners), events["facet_id"].to_numpy()
    number = np.bincount(facet, minlength=count)
    speed = np.bincount(facet, events["touch_normal_m_s"], count) / np.maximum(number, 1)
    pressure = np.zeros(count)
    np.maximum.at(pressure, facet, events["peak_pressure_pa"])
    return {
        "touches_per_m2_s": number / (surface.areas * time_s),
        "touch_normal_m_s": np.where(number > 0, speed, 0.0),
        "peak_pressure_pa": pressure,
    }


# --- edges ---------------------------------------------------------------------------------------


class SharpEdges(NamedTuple):
    """E convex sharp edges: ends, (E, 2, 3) in m, and interior angles, (E,) in rad."""

    ends_m: Floats
    angle_rad: Floats

    @property
    def lengths_m(self) -> Floats:
        """Lengths, (E,)."""
        return np.asarray(np.linalg.norm(self.ends_m[:, 1] - self.ends_m[:, 0], axis=1))

    def distance(self, points_m: Floats, spacing_m: float) -> Floats:
        """Distance of (N, 3) points from the nearest edge, which is cut into such pieces, (N,)."""
        from scipy.spatial import KDTree

        number = np.maximum(2, np.ceil(self.lengths_m / spacing_m).astype(np.int64))
        parts = [
            begin + np.linspace(0.0, 1.0, count)[:, None] * (end - begin)
            for (begin, end), count in zip(self.ends_m, number, strict=True)
        ]
        return np.asarray(KDTree(np.concatenate(parts)).query(points_m)[0])


def sharp_edges(surface: Surface, highest_m: float) -> SharpEdges:
    """The convex edges of a surface at which facets meet at more than `FEATURE_DEG`.

    Only those below a height.
    """
    points, at = np.unique(surface.corners.reshape(-1, 3), axis=0, return_inverse=True)
    facets = at.reshape(-1, 3)
    pairs = np.sort(np.stack([facets, np.roll(facets, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    _, edge, count = np.unique(pairs, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(edge.ravel(), kind="stable")
    order = order[count[edge.ravel()[order]] == 2].reshape(-1, 2)
    one, other = (order // 3).T
    normals, centres = surface.normals, surface.centres
    turn = np.arccos(np.einsum("ij,ij->i", normals[one], normals[other]).clip(-1.0, 1.0))
    convex = np.einsum("ij,ij->i", centres[other] - centres[one], normals[one]) < 0.0
    ends = points[pairs[order[:, 0]]]
    low = ends[:, :, 2].max(axis=1) <= highest_m
    sharp = convex & low & (turn > np.radians(FEATURE_DEG))
    return SharpEdges(ends[sharp], np.pi - turn[sharp])


def strewn(surface: Surface, count: int = _SPREAD) -> tuple[Floats, Ints]:
    """Points at random over a surface, (count, 3), and their facets; always the same ones."""
    random = np.random.default_rng(0)
    facet = random.choice(len(surface.areas), count, p=surface.areas / surface.areas.sum())
    root, along = np.sqrt(random.random(count)), random.random(count)
    weights = np.stack([1 - root, root * (1 - along), root * along], axis=1)
    return np.einsum("ij,ijk->ik", weights, surface.corners[facet]), facet


def _edge_bands(
    sampled: Sampled, surface: Surface, highest_m: float, radius_m: float, factor: float
) -> EdgeBands | None:
    edges = sharp_edges(surface, highest_m)
    if not len(edges.ends_m):
        return None
    limits = radius_m * np.array(_BANDS)
    spacing, count = limits[1] / 5, len(_BANDS) - 1
    points, _ = strewn(surface)
    spread = np.histogram(edges.distance(points, spacing), limits)[0]
    away = edges.distance(sampled.rows[POINT].to_numpy(np.float64), spacing)
    band = np.searchsorted(limits, away, side="right") - 1
    sums = np.zeros((sampled.frames, count + 1))
    np.add.at(sums, (sampled.rows["frame"], band), sampled.rows["force_slide_n_m"])
    seconds = factor * sampled.interval_s
    found = estimates(sums[:, :count], lambda means: means / seconds)
    lengths = edges.lengths_m
    return EdgeBands(
        length_m=float(lengths.sum()),
        angle_rad=float(np.average(edges.angle_rad, weights=lengths)),
        distance_m=tuple(limits.tolist()),
        area_m2=tuple((spread * surface.areas.sum() / len(points)).tolist()),
        action_w=EstimateColumns.of(found),
    )
