"""Stays of particles on the workpiece.

How long, how hard, and whether they hit, slide, roll or rest.

An event is a particle's uninterrupted stay: it carries force in consecutive samples,
and its passing from facet to facet does not end it. One sample without force
ends it. What happens between two samples is not seen.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.arrays import Floats, Ints
from dragchain.errors import TableError
from dragchain.run.kinematics import drag_surface_speed
from dragchain.tables.columns import vector
from dragdeck.physics.contact_mechanics import hertz_contact_time, sphere_mass
from dragdeck.records.case import CaseOfRun

IMPACT, SLIDING, ROLLING, RESTING = TYPES = ("impact", "sliding", "rolling", "resting")

AMOUNTS = (
    *("normal_impulse_n_s", "tangential_impulse_n_s", "relative_path_m", "sliding_m"),
    *("force_slide_n_m", "friction_work_j"),
)
"""What is summed over contacts and time; see docs/explanation/loading.md."""

POINT, SLIP = list(vector("workpiece", "m")), list(vector("workpiece_slip", "m_s"))


@dataclass(frozen=True)
class Thresholds:
    """The limits between the types of contact.

    Attributes
    ----------
    mobilised : float
        A contact slides in a sample if its tangential force is at least this
        fraction of friction coefficient times normal force.
    impact_times : float
        An impact lasts no longer than this many Hertz contact times of a mean
        particle that meets the workpiece at the workpiece's speed, or than one sample if that
        is longer.
    rest : float
        A particle rests if its mean speeds of sliding and rolling add up to less
        than this fraction of the workpiece's speed.
    slide_to_roll : float
        A particle slides if its mean speed of sliding is at least this multiple of
        that of rolling. It is 2 for a particle that slides without turning, and 0
        for one that rolls without slip.
    """

    mobilised: float = 0.99
    impact_times: float = 5.0
    rest: float = 0.1
    slide_to_roll: float = 1.0


LIMITS = Thresholds()
"""The limits of every run."""


def contact_time_s(case: CaseOfRun) -> float:
    """Time for which a mean particle that meets the workpiece at its speed touches it, s.

    It is that of an elastic impact on a plane; see `hertz_contact_time`.

    Raises
    ------
    TableError
        If ``case.json`` does not give its constants.
    """
    if "workpiece" not in case.contact_moduli:
        raise TableError(f"{case.run}: case.json has no contact_moduli.workpiece; render it again")
    contact, radius = case.contact_moduli["workpiece"], case.media.radius_mean_m
    mass = sphere_mass(radius, case.media.density_kg_m3)
    return float(hertz_contact_time(mass, radius, contact.modulus_pa, drag_surface_speed(case)))


def find_events(rows: pd.DataFrame, frames: int, interval_s: float) -> tuple[pd.DataFrame, Ints]:
    """Find the stays of particles on the workpiece.

    Parameters
    ----------
    rows : DataFrame
        N contacts with force: ``frame`` (0 to `frames` - 1), ``time_s``,
        ``particle_id``, ``facet_id``, ``normal_force_n``, `POINT` and `SLIP` in the
        workpiece's frame, ``mobilised``, `AMOUNTS`, and ``contacts``: 0 for those that are not
        counted, else 1.
    frames : int
        Number of frames.
    interval_s : float
        Time between frames, s.

    Returns
    -------
    events : DataFrame
        A row an event, in the order of time and particle. Sums are over all
        contacts of the particle; where it has several at once, paths follow the one
        with the largest normal force. ``slid_m`` is ``sliding_m`` of the contacts that count.
    event : (N,) ndarray of int64
        The event of each row.
    """
    order = np.lexsort((-rows["normal_force_n"], rows["frame"], rows["particle_id"]))
    particle, frame = (rows[name].to_numpy(np.int64)[order] for name in ("particle_id", "frame"))
    other = np.diff(particle) != 0
    leaves = np.r_[True, other | (np.diff(frame) > 1)][: len(rows)]
    chosen = np.r_[True, other | (np.diff(frame) != 0)][: len(rows)]
    rank = np.lexsort((particle[leaves], frame[leaves]))
    event, touch = np.empty((2, len(rows)), dtype=np.int64)
    event[order] = np.argsort(rank)[np.cumsum(leaves) - 1]
    touch[order] = np.cumsum(chosen) - 1
    strongest = order[chosen]
    heads = rows.iloc[order[leaves][rank]]
    events = _sums(rows, heads, event, event[strongest], touch, frames, interval_s)
    moves = rows[[*POINT, *SLIP]].iloc[strongest]
    for name, path in _paths(moves, event[strongest], interval_s).items():
        events[name] = np.bincount(path[0], path[1], len(events))
    rolled = events["rolling_m"] / (events["samples"] - 1).where(events["samples"] > 1)
    events["rolling_m_s"] = rolled / interval_s
    events["slid_m"] = np.bincount(event, rows["sliding_m"] * rows["contacts"], len(events))
    events["slide_to_roll"] = events["slid_m"] / (events["duration_s"] * events["rolling_m_s"])
    return events, event


def _sums(
    rows: pd.DataFrame,
    heads: pd.DataFrame,
    event: Ints,
    of_touch: Ints,
    touch: Ints,
    frames: int,
    interval_s: float,
) -> pd.DataFrame:
    """The columns of the events that need no paths.

    `heads` are the first rows of the events, the strongest if there are several; `touch` is the
    particle-and-frame of each row, and `of_touch` the event of each of those.
    """
    count = len(heads)
    begins = heads["frame"].to_numpy()
    samples = np.bincount(of_touch, minlength=count)
    peak = np.zeros(count)
    np.maximum.at(peak, of_touch, np.bincount(touch, rows["normal_force_n"], len(of_touch)))
    sums = {name: np.bincount(event, rows[name], count) for name in AMOUNTS}
    loaded = np.bincount(event, rows["normal_impulse_n_s"] * rows["mobilised"], count)
    impulse = sums["normal_impulse_n_s"]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = sums["tangential_impulse_n_s"] / impulse
        fraction = loaded / impulse
    return pd.DataFrame(
        {
            "event_id": np.arange(count),
            "particle_id": heads["particle_id"].to_numpy(),
            "facet_id": heads["facet_id"].to_numpy(),
            "frame": begins,
            "start_s": heads["time_s"].to_numpy(),
            "samples": samples,
            "duration_s": samples * interval_s,
            "complete": (begins > 0) & (begins + samples < frames),
            "azimuth_rad": heads["azimuth_rad"].to_numpy(),
            "depth_m": heads["depth_m"].to_numpy(),
            "peak_normal_force_n": peak,
            "mean_normal_force_n": impulse / (samples * interval_s),
            **sums,
            "tangential_over_normal": ratio,
            "mobilised_fraction": fraction,
        }
    )


def _paths(rows: pd.DataFrame, event: Ints, interval_s: float) -> dict[str, tuple[Ints, Floats]]:
    """Return event and length of each piece of path between two samples of an event.

    `rows` are sorted by particle and frame, one for each. The contact point moves by
    d over the workpiece's surface and by d - s over the particle's, s being the slip. The
    rolling distance is that of the mean, d - s / 2: zero where a particle turns on
    the spot or is carried along, and d where it rolls without slip (the rolling
    speed of Johnson 1985, section 8.1).
    """
    same = np.diff(event) == 0
    moved = np.diff(rows[POINT].to_numpy(), axis=0)[same]
    slip = rows[SLIP].to_numpy() * interval_s
    slipped = (0.5 * (slip[1:] + slip[:-1]))[same]
    of = event[1:][same]
    return {
        "contact_path_m": (of, np.linalg.norm(moved, axis=1)),
        "rolling_m": (of, np.linalg.norm(moved - 0.5 * slipped, axis=1)),
    }


def event_types(events: pd.DataFrame, case: CaseOfRun, interval_s: float) -> NDArray[np.str_]:
    """Name the type of each event, (E,).

    In this order: an impact is short, a resting particle moves little, a sliding one
    slides fast for what it rolls, and all else rolls. An event that begins before
    the first sample or ends after the last is no impact; if but one sample of it
    is seen, it passes for rolling.
    """
    longest = max(LIMITS.impact_times * contact_time_s(case), interval_s)
    speed = drag_surface_speed(case)
    sliding, rolling = events["slid_m"] / events["duration_s"], events["rolling_m_s"]
    short = events["complete"] & (events["duration_s"] <= longest * (1 + 1e-9))
    rests = sliding + rolling < LIMITS.rest * speed
    slides = sliding >= LIMITS.slide_to_roll * rolling
    return np.select([short, rests, slides], [IMPACT, RESTING, SLIDING], ROLLING)
