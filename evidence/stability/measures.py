"""What is measured of a run of the map: contacts, energy, and deviations from the fine step."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dragchain.arrays import Floats
from dragchain.run.case import friction_with
from dragchain.run.kinematics import drag_phase
from dragchain.statistics.correlated import estimate_mean
from dragchain.statistics.estimate import NORMAL_QUANTILE, Estimate
from dragchain.tables.network_contacts import BODY_IDS, contact_rows
from dragchain.tables.run_folder import Run
from dragchain.tables.workpiece_contacts import WorkpieceFrames
from dragchain.tables.write import workpiece_force_rows
from dragdeck.decks import CASE_FILE
from dragdeck.dumps.frame import Frame
from dragdeck.engine.part import STATE_FILE
from dragdeck.physics.contact_mechanics import fall_energy, sphere_mass
from dragdeck.physics.contact_network import touching
from dragdeck.records.case import CaseOfRun
from dragdeck.records.run import RunRecord
from evidence.stability.network import Contacts, network_frequency, overlap_ratio
from evidence.stability.points import MapPoint
from evidence.stability.scenes import ImpactCase

PointRow = Mapping[str, float]
"""What a run showed. Every regime has ``overlap_ratio``, the largest overlap over the radius, and
``frequency_rad_s``, the largest eigenfrequency of its contact network; and names of `COLUMNS`."""

COLUMNS = (
    "restitution_mean",
    "restitution_low",
    "restitution_high",
    "peak_force_n",
    "height_m",
    "peak_energy_j",
    "rest_energy_ratio",
    "drag_mean_n",
    "drag_half_width_n",
    "energy_after_over_before",
    "frequency_rad_s",
)
"""Columns of the table of points with what was measured; each regime has some of them."""

# --- points with their runs --------------------------------------------------------------------


@dataclass(frozen=True)
class PointRun:
    """A point with its run, or why no input script could be written for it."""

    point: MapPoint
    folder: Path
    refused: str | None = None

    @cached_property
    def case(self) -> CaseOfRun | None:
        """What it models; None of a point that no deck could be written for."""
        file = self.folder / CASE_FILE
        kind = ImpactCase if self.point.regime == "impact" else CaseOfRun
        return kind.read(file) if file.is_file() else None

    @property
    def contact_time_s(self) -> float:
        """Elastic contact time of a single impact; NaN of all else."""
        return self.case.contact_time_s if isinstance(self.case, ImpactCase) else math.nan

    @cached_property
    def record(self) -> RunRecord | None:
        """How the run ended; None of a point that was not run."""
        file = self.folder / STATE_FILE
        return RunRecord.read(file) if file.is_file() else None

    @property
    def measurable(self) -> bool:
        """Whether the run came to its end.

        One whose contacts gain energy by the step counts, too: its energy says something.
        """
        if self.record is None:
            return False
        failed = {check.code for check in self.record.failed_checks}
        return self.record.complete or failed == {"stable_timestep"}

    @property
    def ended(self) -> Run | None:
        """The run folder; None of a run that did not come to its end."""
        return Run(self.folder, self.case) if self.case and self.measurable else None


# --- beds: one that settles, and one at rest under a load --------------------------------------

REST_FLOOR = 1e-7
"""Kinetic energy over N m g d below which a loaded bed is at rest whatever it did before."""

_LAST_SAMPLES = 50
"""Samples at the end of a resting bed's run whose mean energy counts: a quarter of them."""


def _measure_settled(run: Run, _point: MapPoint) -> PointRow:
    """A bed that settled, and its largest kinetic energy while it did."""
    *_, last = run.frames("particles")
    return {
        **_bed(run.case, last),
        "height_m": float(last.columns["z_m"].mean()),
        "peak_energy_j": float(_bed_energy(run).max()),
    }


def _measure_resting(run: Run, _point: MapPoint) -> PointRow:
    """A bed at rest, and its kinetic energy at the end over N m g d.

    Its contacts are those before the step under test begins.
    """
    first, *_, last = run.frames("particles")
    unit = _fall_energy(run.case, run.case.media.count)
    return {
        **_bed(run.case, first),
        "height_m": float(last.columns["z_m"].mean()),
        "rest_energy_ratio": float(_bed_energy(run)[-_LAST_SAMPLES:].mean()) / unit,
    }


def _bed(case: CaseOfRun, frame: Frame) -> PointRow:
    contacts = touching(frame.centres, frame.radii, case.bowl.walls)
    return {
        "overlap_ratio": overlap_ratio(frame.radii, contacts),
        "frequency_rad_s": network_frequency(case, frame.radii, contacts),
    }


def _fall_energy(case: CaseOfRun, particles: int) -> float:
    media = case.media
    return fall_energy(particles, media.density_kg_m3, media.radius_mean_m, case.gravity_m_s2)


def _bed_energy(run: Run) -> Floats:
    """Kinetic energy with that of the spins over time, J."""
    blocks = run.prints("thermo")
    return np.concatenate(
        [rows["kinetic_energy_j"] + rows["rotational_energy_j"] for rows in blocks]
    )


def _bed_errors(row: PointRow, fine: PointRow) -> dict[str, Estimate]:
    """The relative error of the height; a settled bed's reference knows how heights scatter."""
    half_width = NORMAL_QUANTILE * math.sqrt(2.0) * fine.get("height_scatter", 0.0)
    return {"height": Estimate.around(row["height_m"] / fine["height_m"] - 1.0, half_width)}


def _settled_energy(row: PointRow, fine: PointRow | None) -> float:
    return row["peak_energy_j"] / fine["peak_energy_j"] if fine else math.nan


def _resting_energy(row: PointRow, fine: PointRow | None) -> float:
    floor = max(fine["rest_energy_ratio"], REST_FLOOR) if fine else math.nan
    return row["rest_energy_ratio"] / floor


# --- impacts, met at different moments within a step -------------------------------------------


def _measure_impacts(run: Run, _point: MapPoint) -> PointRow:
    """Mean, smallest and largest of the impacts of a run; speeds are over that of the impact."""
    assert isinstance(run.case, ImpactCase)
    impact = run.case.impact
    plate = impact.size_ratio == 0.0
    frames = [frame.by_particle() for frame in run.frames("particles")]
    first, last = frames[0], frames[-1]
    striking = slice(None) if plate else slice(0, None, 2)
    velocity = last.vectors("vx_m_s", "vy_m_s", "vz_m_s")
    speed = velocity if plate else velocity[0::2] - velocity[1::2]
    forces = (frame.vectors("force_x_n", "force_y_n", "force_z_n")[striking] for frame in frames)
    force = np.stack([np.linalg.norm(vectors, axis=1) for vectors in forces])
    overlap = max(float(_overlap(frame, plate).max()) for frame in frames)
    before, after = (
        _energy(frame, run.case.media.density_kg_m3).reshape(-1, 1 if plate else 2).sum(axis=1)
        for frame in (first, last)
    )
    radius = first.radii
    of_one = radius[: 1 if plate else 2]
    deepest = np.array([[0], [1]]), np.array([[0.0, 0.0, -1.0]]), np.array([overlap])
    touch = ("particle",)  # a plate is of the particles' material
    peaks = _spread("peak_force", force.max(axis=0))
    return {
        "overlap_ratio": overlap / float(radius.min()),
        "frequency_rad_s": network_frequency(run.case, of_one, deepest, touch)
        if overlap > 0.0
        else 0.0,
        **_spread("restitution", speed[:, 2] / impact.normal_speed_m_s),
        **peaks,
        "peak_force_n": peaks["peak_force_mean"],
        **_spread("tangential", speed[:, 0] / impact.speed_m_s),
        "energy_after_over_before": float((after / before).max()),
    }


def _spread(name: str, values: Floats) -> dict[str, float]:
    ends = {"mean": values.mean(), "low": values.min(), "high": values.max()}
    return {f"{name}_{end}": float(value) for end, value in ends.items()}


def _overlap(frame: Frame, plate: bool) -> Floats:
    centre, radius = frame.centres, frame.radii
    if plate:
        return np.asarray(radius - centre[:, 2])
    distance = np.linalg.norm(centre[0::2] - centre[1::2], axis=1)
    return np.asarray(radius[0::2] + radius[1::2] - distance)


def _energy(frame: Frame, density_kg_m3: float) -> Floats:
    """Kinetic energy of each particle, spin included, J."""
    radius = frame.radii
    mass = sphere_mass(radius, density_kg_m3)
    speed = (frame.vectors("vx_m_s", "vy_m_s", "vz_m_s") ** 2).sum(axis=1)
    spin = (frame.vectors("wx_rad_s", "wy_rad_s", "wz_rad_s") ** 2).sum(axis=1)
    return np.asarray(0.5 * mass * (speed + 0.4 * radius**2 * spin))


def _impact_errors(row: PointRow, fine: PointRow) -> dict[str, Estimate]:
    """Of all impacts the worst counts."""

    def worst(name: str, scale: float = 1.0) -> Estimate:
        ends = [(row[f"{name}_{end}"] - fine[f"{name}_mean"]) / scale for end in ("low", "high")]
        return Estimate.around(max(ends, key=abs), 0.0)

    return {
        "restitution": worst("restitution"),
        "peak force": worst("peak_force", fine["peak_force_mean"]),
        "tangential speed": worst("tangential"),
    }


def _impact_energy(row: PointRow, fine: PointRow | None) -> float:
    """Energy after over before, over what the reference has where its law itself gains."""
    gained = fine["energy_after_over_before"] if fine else 1.0
    return row["energy_after_over_before"] / max(1.0, gained)


# --- a workpiece that is dragged through a bed -------------------------------------------------

_NETWORK_FRAMES = 8
"""Frames of a reference whose networks are looked at; the stiffest counts."""


def _measure_drag(run: Run, point: MapPoint) -> PointRow:
    """Mean force along the motion with the half-width of its interval, and the energy.

    The half-width is infinite if it is not to be relied on. ``motion_ratio`` is the median kinetic
    energy without spin, over that of all particles moving as the workpiece and one as after a
    fall through its diameter.
    """
    blocks = [workpiece_force_rows(rows, run.case) for rows in run.prints("workpiece_force")]
    drag, counted = (
        np.concatenate([np.asarray(block[name]) for block in blocks])
        for name in ("drag_n", "in_statistics")
    )
    mean = estimate_mean(drag[counted])
    speed = point.number("workpiece_speed_m_s")
    return {
        **_drag_contacts(run, point.reference),
        "drag_mean_n": mean.mean,
        "drag_half_width_n": mean.ci95_high - mean.mean if mean.reliable else math.inf,
        "motion_ratio": _median_motion_j(run) / _usual_motion_j(run.case, speed),
    }


def _median_motion_j(run: Run) -> float:
    """Median kinetic energy in the drag, without spin: nothing damps one about a normal."""
    blocks = list(run.prints("thermo"))
    step, motion = (
        np.concatenate([block[name] for block in blocks]) for name in ("step", "kinetic_energy_j")
    )
    return float(np.median(motion[step > drag_phase(run.case).start_step]))


def _usual_motion_j(case: CaseOfRun, speed_m_s: float) -> float:
    media = case.media
    mass = sphere_mass(media.radius_mean_m, media.density_kg_m3)
    return media.count * 0.5 * mass * speed_m_s**2 + _fall_energy(case, 1)


def _drag_contacts(run: Run, reference: bool) -> PointRow:
    """Largest overlap of the drag, and frequency of the stiffest of some frames."""
    particles = {frame.step: frame for frame in run.frames("particles")}
    pairs = {frame.step: frame for frame in run.frames("contacts")}
    steps = np.array(sorted(pairs))
    every = steps[np.linspace(0, len(steps) - 1, min(len(steps), _NETWORK_FRAMES)).astype(int)]
    some = set(every.tolist() if reference else every[:1].tolist())
    largest = frequency = 0.0
    for on_workpiece in run.workpiece_pairs():
        if on_workpiece.step not in pairs:
            continue
        workpiece = on_workpiece.join(merge=False)  # both stiffnesses of an edge act
        frame = particles[on_workpiece.step].by_particle()
        contacts = _engine_contacts(frame, pairs[on_workpiece.step], workpiece, run.case)
        largest = max(largest, overlap_ratio(frame.radii, contacts))
        if on_workpiece.step in some:
            frequency = max(frequency, network_frequency(run.case, frame.radii, contacts))
    return {"overlap_ratio": largest, "frequency_rad_s": frequency}


def _engine_contacts(
    frame: Frame, pairs: Frame, workpiece: WorkpieceFrames, case: CaseOfRun
) -> Contacts:
    """The contacts of one frame as the engine wrote them, with bowl and workpiece."""
    walls = workpiece.workpiece, workpiece.bowl
    rows = contact_rows(frame, pairs, *walls, case.bowl.walls, friction_with(case, "particle"))
    ids = np.asarray(frame.columns["particle_id"], dtype=np.int64)
    of_wall = len(ids) + (rows.b_id == BODY_IDS["particle-workpiece"])
    others = np.where(rows.b_id > 0, np.searchsorted(ids, rows.b_id), of_wall)
    bodies, hit = np.stack([np.searchsorted(ids, rows.a_id), others]), rows.overlap_m > 0.0
    return bodies[:, hit], -rows.normal[hit], rows.overlap_m[hit]


def _drag_errors(row: PointRow, fine: PointRow) -> dict[str, Estimate]:
    """The relative error of the mean drag, positive where it is stronger."""
    size = abs(fine["drag_mean_n"])
    error = (row["drag_mean_n"] - fine["drag_mean_n"]) / -size
    half_width = math.hypot(row["drag_half_width_n"], fine["drag_half_width_n"])
    return {"mean drag": Estimate.around(error, half_width / size)}


# --- by regime ---------------------------------------------------------------------------------


class Measure(NamedTuple):
    """How a regime is measured.

    Attributes
    ----------
    row : callable
        Measures a run that came to its end.
    errors : callable
        Deviations of a row from that of the fine step, by the quantity's name.
    energy_ratio : callable
        Ratio of energies of a row and that of the fine step; NaN where that is needed.
    """

    row: Callable[[Run, MapPoint], PointRow]
    errors: Callable[[PointRow, PointRow], dict[str, Estimate]]
    energy_ratio: Callable[[PointRow, PointRow | None], float]


MEASURES: Mapping[str, Measure] = {
    "impact": Measure(_measure_impacts, _impact_errors, _impact_energy),
    "settle": Measure(_measure_settled, _bed_errors, _settled_energy),
    "column": Measure(_measure_resting, _bed_errors, _resting_energy),
    "drag": Measure(_measure_drag, _drag_errors, lambda row, _: row["motion_ratio"]),
}
