"""What laws of removal read of a run: the action of sliding and of impacts, and that along edges.

An action is what a law multiplies by its coefficient (`dragdeck.study.removal`). It is per process
time: a workpiece that is f times as fast takes 1/f of the time for the same path.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from dragchain.errors import TableError
from dragchain.loading.contact_events import POINT, SLIP, find_events
from dragchain.loading.document import Loading, Quantiles
from dragchain.loading.edges import EdgeBands, edge_bands
from dragchain.loading.samples import TOUCHED, Sampled, patches, sample, standard_errors
from dragchain.loading.summary import event_quantiles
from dragchain.run.case import study_of
from dragchain.run.kinematics import needed
from dragchain.run.workpiece import Surface
from dragchain.statistics.correlated import estimates
from dragchain.statistics.estimate import Estimate
from dragchain.tables.by_step import read_table
from dragdeck.decks.outputs import TOUCHES, load_outputs
from dragdeck.documents import Document
from dragdeck.parts import Part
from dragdeck.physics.contact_mechanics import sphere_mass
from dragdeck.records.case import CaseOfRun
from dragdeck.study.removal import LAWS, Law, Wearing, impact_angle

WEAR_FILE = Path("tables") / "wear.json"

TOUCH_QUANTITIES: Mapping[str, tuple[str, float]] = {
    "touch_normal_m_s": ("normal velocity at first touch (mm/s)", 1e3),
    "touch_tangential_m_s": ("tangential velocity at first touch (mm/s)", 1e3),
    "impact_angle_rad": ("angle of impact from the surface (degrees)", 180 / np.pi),
    "peak_normal_force_n": ("peak normal force (N)", 1.0),
    "peak_pressure_pa": ("peak Hertz pressure (MPa)", 1e-6),
    "duration_s": ("duration (ms)", 1e3),
    "sliding_m": ("sliding distance (µm)", 1e6),
    "friction_work_j": ("friction work (µJ)", 1e6),
}
"""Columns of events whose distribution is told: label with unit, and factor from SI."""


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
    patch : tuple of int
        Number of the patch of each facet.
    patch_w_m2, patch_se_w_m2 : tuple of float
        By facet: the same per area, a mean over its patch, and its standard error, W/m2.
    impact_share : Estimate
        Part of it from the law of impact, or else from contact events of the type impact.
    touches : TouchesOfRun or None
    edges : EdgeBands or None
        None if the workpiece has no sharp edge below the settled surface.
    """

    remedy = "make it with: ./run dragchain loading"

    run: str
    area_m2: tuple[float, ...]
    immersed: tuple[bool, ...]
    action_w: Estimate
    patch: tuple[int, ...]
    patch_w_m2: tuple[float, ...]
    patch_se_w_m2: tuple[float, ...]
    impact_share: Estimate
    touches: TouchesOfRun | None
    edges: EdgeBands | None


def compute_wear(
    run_dir: Path, case: CaseOfRun, sampled: Sampled, surface: Surface, loading: Loading
) -> tuple[Wear | None, pd.DataFrame | None]:
    """What laws of removal read of a run, and its contact events from first touch if written.

    None of a run without a law of removal and first touches.

    Raises
    ------
    TableError
        If ``touches.parquet`` is missing or has no contact, or the law reads impacts and the run
        has not written first touches.
    """
    removal = study_of(case).removal
    if removal is None and TOUCHES[1] not in load_outputs(run_dir):
        return None, None
    factor, size = case.fidelity.speed_factor, case.media.radius_mean_m
    immersion = needed(case.workpiece, "workpiece").immersion_depth_m
    group, touched = patches(surface, size), None
    of_laws, part, events = acting(run_dir, case, sampled)
    if part is not None and events is not None:
        begun = np.bincount(events["frame"], minlength=part.frames).astype(np.float64)[:, None]
        per_s = estimates(begun, lambda means: means / (factor * part.interval_s))[0]
        touched = TouchesOfRun(
            events=len(events),
            time_s=part.frames * part.interval_s,
            interval_s=part.interval_s,
            per_s=per_s,
            quantities={name: event_quantiles(events[name]) for name in TOUCH_QUANTITIES},
        )
    impact = removal is not None and removal.laws[-1].impact
    actions = [_action(law, surface, group, factor * law.interval_s) for law in of_laws]
    total, density, error = zip(*actions, strict=True)
    share = loading.types["impact"].fraction_of["force_slide_n_m"]
    wear = Wear(
        run=case.run,
        area_m2=tuple(surface.areas.tolist()),
        immersed=tuple((surface.centres[:, 2] <= immersion).tolist()),
        action_w=_sum(total),
        patch=tuple(group.tolist()),
        patch_w_m2=tuple(np.sum(density, axis=0)[group].tolist()),
        patch_se_w_m2=tuple(np.linalg.norm(error, axis=0)[group].tolist()),
        impact_share=_share(total[-1], total[:-1]) if impact else share,
        touches=touched,
        edges=edge_bands(sampled, surface, immersion, size, factor * sampled.interval_s),
    )
    return wear, None if events is None else events.drop(columns=["frame", "slid_m", *POINT])


def acting(
    run_dir: Path, case: CaseOfRun, sampled: Sampled
) -> tuple[Sequence[Sampled], Sampled | None, pd.DataFrame | None]:
    """What the laws of removal of a run read, that of Archard if it has none.

    For each law that is added up its contacts with ``frame``, ``facet_id``, `POINT` and ``action``
    in J; and where they are written, contacts and events of first touches.

    Raises
    ------
    TableError
        As `compute_wear`.
    """
    laws = removal.laws if (removal := study_of(case).removal) else (LAWS["archard"],)
    law = laws[-1]
    names = ["frame", "facet_id", *POINT]
    sliding = replace(
        sampled, rows=sampled.rows[names].assign(action=sampled.rows["force_slide_n_m"])
    )
    if TOUCHES[1] not in load_outputs(run_dir):
        if law.impact:
            raise TableError(
                f"{run_dir}: the law of removal reads impacts, which the run has not written"
            )
        return [sliding], None, None
    part = sample(run_dir, case, TOUCHED)
    events = first_touches(run_dir, part, case)
    if not law.impact:
        return [sliding], part, events
    impacts = replace(part, rows=events[names].assign(action=impact_action(law, events, case)))
    return [sliding, impacts][-len(laws) :], part, events


def _action(
    sampled: Sampled, surface: Surface, group: Ints, seconds: float
) -> tuple[Estimate, Floats, Floats]:
    """The action of rows with ``frame``, ``facet_id`` and ``action`` at so many s between frames.

    In all, W, and of each patch with its standard error, W/m2.
    """
    rows, count = sampled.rows, int(group.max()) + 1
    at = group[rows["facet_id"].to_numpy()]
    per_patch = np.bincount(group, surface.areas) * sampled.frames * seconds
    errors = standard_errors(replace(sampled, rows=rows.assign(facet_id=at)), "action", count)
    series = sampled.per_frame(rows["action"])[:, None]
    total = estimates(series, lambda means: means / seconds)[0]
    return total, np.bincount(at, rows["action"], count) / per_patch, errors / per_patch


def _sum(parts: Sequence[Estimate]) -> Estimate:
    """The sum of independent estimates."""
    half = math.hypot(*(part.half_width for part in parts))
    return Estimate.around(math.fsum(part.value for part in parts), half)


def _share(estimate: Estimate, others: Sequence[Estimate]) -> Estimate:
    """The part of one of independent estimates in the sum of all."""
    if not others:
        return Estimate(1.0, 1.0, 1.0)
    rest = _sum(others)
    if not estimate.value or not rest.value:
        return Estimate(float(estimate.value > 0.0), math.nan, math.nan)
    half = math.hypot(estimate.relative_half_width, rest.relative_half_width)
    return Estimate(
        *(1 / (1 + rest.value / estimate.value * math.exp(half * s)) for s in (0, 1, -1))
    )


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
    radius = radius_of.loc[events["particle_id"]].to_numpy(np.float64)
    normal = first["normal_velocity_m_s"].to_numpy()
    tangential = np.linalg.norm(first[SLIP], axis=1)
    modulus = case.contact_moduli["workpiece"].modulus_pa / case.fidelity.youngs_modulus_scale
    pressure = np.cbrt(
        6 * events["peak_normal_force_n"].clip(lower=0) * modulus**2 / (np.pi**3 * radius**2)
    )
    touched = events.assign(
        **first[POINT].reset_index(drop=True),
        radius_m=radius,
        touch_normal_m_s=normal,
        touch_tangential_m_s=tangential,
        impact_angle_rad=impact_angle(normal, tangential),
        peak_pressure_pa=pressure,
    )
    return touched[touched["frame"] > 0].reset_index(drop=True)


def impact_action(law: Law, events: pd.DataFrame, case: CaseOfRun) -> Floats:
    """The action of an impact law of the study in each of (E,) events, J, times its weight."""
    radius = events["radius_m"].to_numpy()
    density = case.density_of(events["particle_id"].to_numpy(np.int64))
    wearing = Wearing(
        force_slide_n_m=events["force_slide_n_m"].to_numpy(),
        mass_kg=sphere_mass(radius, density),
        radius_m=radius,
        normal_m_s=events["touch_normal_m_s"].to_numpy(),
        tangential_m_s=events["touch_tangential_m_s"].to_numpy(),
    )
    removal = needed(study_of(case).removal, "removal")
    return (removal.impact_ratio or 1.0) * law.action(wearing, removal)


def touch_maps(events: pd.DataFrame, surface: Surface, time_s: float) -> dict[str, Floats]:
    """First touches on each facet, (M,) each: frequency, mean velocity, largest pressure."""
    facets = events.groupby("facet_id")
    touched = {
        "touches_per_m2_s": facets.size().astype(np.float64),
        "touch_normal_m_s": facets["touch_normal_m_s"].mean(),
        "peak_pressure_pa": facets["peak_pressure_pa"].max(),
    }
    every, per = range(len(surface.corners)), surface.areas * time_s
    maps = {key: mean.reindex(every, fill_value=0.0).to_numpy() for key, mean in touched.items()}
    return maps | {"touches_per_m2_s": maps["touches_per_m2_s"] / per}
