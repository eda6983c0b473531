"""A workpiece that is dragged through a bed: mean force, energy, contacts."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from dragchain.contact_law.hertz import sphere_mass
from dragchain.run.case import Case, friction_with
from dragchain.run.kinematics import drag_phase, needed
from dragchain.statistics.correlated import estimate_mean
from dragchain.statistics.estimate import Estimate
from dragchain.tables.network_contacts import KINDS, contact_rows
from dragchain.tables.run_folder import Run
from dragchain.tables.workpiece_contacts import WorkpieceFrames
from dragchain.tables.write import workpiece_force_rows
from dragdeck.decks.case_file import CaseOfStudy
from dragdeck.dumps.frame import Frame
from evidence.stability import contacts as network
from evidence.stability.measured import Measured
from evidence.stability.points import PointRun

_NETWORK_FRAMES = 8
"""Frames of a reference whose networks are looked at; the stiffest counts."""

_PARTNER = {
    "particle-particle": network.PARTICLE,
    "particle-workpiece": network.WORKPIECE,
    "particle-floor": network.BOWL,
    "particle-side": network.BOWL,
}


@dataclass(frozen=True, kw_only=True)
class Dragged(Measured):
    """A drag.

    Attributes
    ----------
    drag_mean_n, drag_half_width_n : float
        Mean force along the motion and the half-width of its interval; infinite if it is not
        to be relied on.
    motion_ratio : float
        Median kinetic energy without spin, over that of all particles moving as the workpiece and
        one as after a fall through its diameter.
    """

    drag_mean_n: float
    drag_half_width_n: float
    motion_ratio: float

    def energy_ratio(self, reference: Self | None) -> float:
        """Needs no reference."""
        return self.motion_ratio

    def errors(self, reference: Self) -> Mapping[str, Estimate]:
        """The relative error of the mean drag, positive where it is stronger."""
        fine = abs(reference.drag_mean_n)
        error = (self.drag_mean_n - reference.drag_mean_n) / -fine
        half_width = math.hypot(self.drag_half_width_n, reference.drag_half_width_n)
        return {"mean drag": Estimate.around(error, half_width / fine)}


def measure_drag(point: PointRun, case: CaseOfStudy) -> Dragged:
    """Measure a drag."""
    run = Run.open(point.folder)
    blocks = [workpiece_force_rows(rows, run.case) for rows in run.prints("workpiece_force")]
    drag, counted = (
        np.concatenate([np.asarray(block[name]) for block in blocks])
        for name in ("drag_n", "in_statistics")
    )
    mean = estimate_mean(drag[counted])
    speed = point.point.number("workpiece_speed_m_s")
    overlap, frequency = _contacts(point, run, case)
    return Dragged(
        overlap_ratio=overlap,
        frequency_rad_s=frequency,
        drag_mean_n=mean.mean,
        drag_half_width_n=mean.ci95_high - mean.mean if mean.reliable else math.inf,
        motion_ratio=_median_motion_j(run) / _usual_motion_j(run.case, speed),
    )


def _median_motion_j(run: Run) -> float:
    """Median kinetic energy in the drag, without spin: nothing damps one about a normal."""
    blocks = list(run.prints("thermo"))
    step, motion = (
        np.concatenate([block[name] for block in blocks]) for name in ("step", "kinetic_energy_j")
    )
    return float(np.median(motion[step > drag_phase(run.case).start_step]))


def _usual_motion_j(case: Case, speed_m_s: float) -> float:
    media = case.media
    mass = sphere_mass(media.radius_mean_m, media.density_kg_m3)
    thrown = mass * case.gravity_m_s2 * 2.0 * media.radius_mean_m
    return media.count * 0.5 * mass * speed_m_s**2 + thrown


def _contacts(point: PointRun, run: Run, case: CaseOfStudy) -> tuple[float, float]:
    """Largest overlap over the radius of the drag, and frequency of the stiffest of some frames."""
    particles = {frame.step: frame for frame in run.frames("particles")}
    pairs = {frame.step: frame for frame in run.frames("contacts")}
    steps = np.array(sorted(pairs))
    every = steps[np.linspace(0, len(steps) - 1, min(len(steps), _NETWORK_FRAMES)).astype(int)]
    some = set(every.tolist() if point.point.reference else every[:1].tolist())
    largest = frequency = 0.0
    for on_workpiece in run.workpiece_pairs():
        if on_workpiece.step not in pairs:
            continue
        workpiece = on_workpiece.join(merge=False)  # both stiffnesses of an edge act
        frame = network.in_id_order(particles[on_workpiece.step])
        contacts = _engine_contacts(frame, pairs[on_workpiece.step], workpiece, run.case)
        largest = max(largest, contacts.overlap_ratio(network.radii(frame)))
        if on_workpiece.step in some:
            own = network.network_frequency(case, point.sticks, network.radii(frame), contacts)
            frequency = max(frequency, own)
    return largest, frequency


def _engine_contacts(
    frame: Frame, pairs: Frame, workpiece: WorkpieceFrames, case: Case
) -> network.Contacts:
    """The contacts of one frame as the engine wrote them, with bowl and workpiece."""
    bowl_radius = needed(case.bowl, "bowl").radius_m
    friction = friction_with(case, "media")
    walls = workpiece.workpiece, workpiece.bowl
    rows = contact_rows(frame, pairs, *walls, bowl_radius, friction)
    ids = np.asarray(frame.columns["particle_id"], dtype=np.int64)
    a = np.searchsorted(ids, rows.a_id)
    b = np.where(rows.b_id > 0, np.searchsorted(ids, rows.b_id), -1)
    partner = np.array([_PARTNER[kind] for kind in KINDS])[rows.kind]
    towards = rows.point_m - network.centres(frame)[a]
    normal = towards / np.linalg.norm(towards, axis=1, keepdims=True)
    hit = rows.overlap_m > 0.0
    return network.Contacts(a[hit], b[hit], partner[hit], normal[hit], rows.overlap_m[hit])
