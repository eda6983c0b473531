"""What each test of the suite must show: quantity, reference, engine, error, verdict.

Every tolerance below states what the engine's integration can be expected to do. They were
written down after a first look at its numbers; none was widened to make a row pass, and that of
the normal rebound was narrowed afterwards, from 5 to 1 over the steps.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from dragchain.errors import TableError
from dragdeck.physics import contact_mechanics as mechanics
from evidence.verification import law
from evidence.verification.law import SLIDING, SPHERE, ContactPair, RelativeMotion
from evidence.verification.recording import RecordedContact, Recording

_NORMAL = 1.0
"""Damping sees the velocity half a step late: an error of about one step per contact."""

_OBLIQUE = 5.0
"""Sticking and sliding begin within a step, up to four times: a few steps per contact."""

_SECOND_ORDER = 1.0
"""An elastic impact is integrated to second order, but for its two ends."""

_SAME_NUMBERS = 1e-6
"""Two evaluations of one formula from the same state."""

_CONSERVED = 1e-9
"""Sums of thousands of steps in double precision."""

_BOUNCES = 0.01
"""Energy after 1,000 impacts: one such bounce of ceramic on steel loses half of it."""

_AT_REST = 1e-3
"""What is left of the motion of a column of particles after many of its periods."""

_FITTED = 0.01
"""Slope of a velocity that still carries the ringing of the contact."""

_ORDER = 0.2
"""Scatter of a fitted order of convergence about a whole number."""

READ_OFF, READ_OFF_CURVE = 0.01, 0.05
"""Points of a published figure, and values between them."""

EXACT = "exact formula"
INTEGRATED = "law integrated in small steps"
COULOMB = "Coulomb sliding of rigid bodies"
INPUT = "input restitution"
PUBLISHED = "published curve"

JUDGED = (EXACT, INTEGRATED)
"""References that are the same law: a difference is a failure."""

CheckVerdict = Literal["pass", "fail", "agrees", "differs"]
"""``pass`` or ``fail`` against the same law, ``agrees`` or ``differs`` against another one."""

CheckRows = Sequence[tuple[float, float, float]]
"""Rows of x, reference and engine."""


@dataclass(frozen=True)
class QuantityCheck:
    """A quantity of a run beside a reference.

    Attributes
    ----------
    quantity, against : str
    rows : rows of (x, reference, engine)
        What is judged; x is what varies in the test, NaN if nothing does.
    tolerance : float
    scale : float, optional
        To which errors are relative; None: the largest reference of the rows.
    series : str
        Name of the series, if not that of the run.
    """

    quantity: str
    against: str
    rows: CheckRows
    tolerance: float
    scale: float | None = None
    series: str = ""


# --- tables ---------------------------------------------------------------------------------


def check_rows(run: Recording, check: QuantityCheck) -> pd.DataFrame:
    """The rows of a comparison with their verdicts.

    Returns
    -------
    DataFrame
        One row per value. ``x_name`` and ``x`` are what varies in the test and its value (NaN if
        nothing does), ``scale`` is the largest absolute reference of the series, or 1 for a
        ratio, and ``error`` is that of the engine divided by it.
    """
    x, reference, engine = np.array(check.rows, dtype=np.float64).reshape(-1, 3).T
    size = check.scale or float(np.abs(reference).max(initial=0.0)) or 1.0
    error = np.abs(engine - reference) / size
    verdicts = ("pass", "fail") if check.against in JUDGED else ("agrees", "differs")
    return pd.DataFrame(
        {
            "number": run.case.number,
            "test": run.case.test,
            "series": check.series or series_name(run),
            "quantity": check.quantity,
            "x_name": run.case.vary,
            "x": x,
            "against": check.against,
            "reference": reference,
            "engine": engine,
            "scale": size,
            "error": error,
            "tolerance": check.tolerance,
            "verdict": np.where(error <= check.tolerance, *verdicts),
        }
    )


_BY_SERIES_AND_LIMIT = ("restitution", "oblique_study", "spin_plane", "time_step")
"""Tests that are run with and without the limit on attraction."""


def series_name(run: Recording) -> str:
    """Materials, and whether attraction is cut off where a test has both."""
    case = run.case
    limit = "limitForce on" if case.limit_force else "limitForce off"
    series = case.series.replace("_", " ")
    name = f"{series}, {limit}" if case.test in _BY_SERIES_AND_LIMIT else series
    steps = case.test in ("time_step", "bounce")
    return f"{name}, {case.steps_per_contact} steps a contact" if steps else name


ComparedRuns = Sequence[tuple[Recording, QuantityCheck]]
"""Comparisons, each with its run."""


def checks_by_test(runs: Sequence[Recording]) -> Mapping[str, ComparedRuns]:
    """All comparisons of all runs by their test, in the order of the tests.

    Raises
    ------
    TableError
        A run is of a test that the suite does not have.
    """
    for run in runs:
        if run.case.test not in CHECKS:
            raise TableError(f"{run.case.run}: the suite has no test {run.case.test!r}")
    checks = {}
    for test, check in CHECKS.items():
        of_test = [run for run in runs if run.case.test == test]
        checks[test] = [(run, row) for run in of_test for row in check(run)]
        if test == "time_step":
            checks[test] += _order_of_convergence(of_test)
    return {test: compared for test, compared in checks.items() if compared}


# --- single impacts -------------------------------------------------------------------------


@cache
def _published() -> pd.DataFrame:
    return pd.read_csv(Path(__file__).with_name("published.csv"), comment="#")


def published_curve(test: str, series: str, quantity: str) -> Floats:
    """Points of a published curve in order of x, (2, N); there may be none.

    ``published.csv`` holds points of the figures of Chung and Ooi (2011) that the authors of Kratos
    Multiphysics digitised for their own benchmarks (its ``DEMApplication``, folder
    ``paper_data``), rounded to four digits. They could not be compared with the paper here, so
    they are never judged.
    """
    table = _published()
    chosen = (table[["test", "series", "quantity"]] == [test, series, quantity]).all(axis=1)
    return table[chosen].sort_values("x")[["x", "y"]].to_numpy(np.float64).T


def _elastic(run: Recording) -> Iterator[QuantityCheck]:
    impact, contact = run.contact, run.contact.constants
    overlap = np.maximum(impact.overlap_m, 0.0)
    force = np.abs(run.force_n[:, impact.at, 2])
    speed, nan = impact.before.normal_m_s, math.nan
    peak = law.largest_overlap(contact, speed)
    strongest = float(law.hertz_force(contact, peak))
    for quantity, reference, engine in (
        ("overlap_m", peak, float(overlap.max())),
        ("force_n", strongest, float(force.max())),
        ("duration_s", law.elastic_time(contact, speed), impact.duration_s),
        ("rebound_over_approach", 1.0, impact.rebound),
    ):
        tolerance = _SECOND_ORDER / run.case.steps_per_contact
        yield QuantityCheck(quantity, EXACT, [(nan, reference, engine)], tolerance)
    hertz = law.hertz_force(contact, overlap)
    worst = float(np.abs(force - hertz).max())
    row = (nan, 0.0, worst)
    yield QuantityCheck("force_at_any_overlap_n", EXACT, [row], _SAME_NUMBERS, strongest)
    for value in published_curve(run.case.test, run.case.series, "force_n")[1]:
        row = (nan, float(value), float(force.max()))
        yield QuantityCheck("force_n", PUBLISHED, [row], READ_OFF)


def _rebounds(run: Recording) -> QuantityCheck:
    rows = [(impact.value, impact.constants.rebound, impact.rebound) for impact in run.contacts]
    tolerance = _NORMAL / run.case.steps_per_contact
    return QuantityCheck("rebound_over_approach", EXACT, rows, tolerance, 1.0)


def _time_step(run: Recording) -> Iterator[QuantityCheck]:
    yield _rebounds(run)


def _restitution(run: Recording) -> Iterator[QuantityCheck]:
    exact = _rebounds(run)
    yield exact
    if run.case.limit_force:
        entered = [
            (impact.value, impact.constants.restitution, impact.rebound) for impact in run.contacts
        ]
        yield replace(exact, against=INPUT, rows=entered)


Derived = Callable[[ContactPair, RelativeMotion, RelativeMotion], float]
"""A quantity of an impact, from its contact and the motions before and after it."""

_OBLIQUE_QUANTITIES: Mapping[str, Derived] = {
    "tangential_restitution": lambda _, before, after: after.tangential_m_s / before.tangential_m_s,
    "spin_rad_s": lambda _, before, after: after.spin_rad_s,
    "rebound_angle_deg": lambda contact, _, after: math.degrees(
        math.atan2(after.patch_m_s(contact), after.normal_m_s)
    ),
}
_SCALED: Mapping[str, Derived] = {
    "scaled_patch": lambda contact, _, after: (
        after.patch_m_s(contact) / (contact.friction * after.normal_m_s)
    ),
    "scaled_spin": lambda contact, before, after: (
        contact.particle.radius_m * after.spin_rad_s / (contact.friction * before.normal_m_s)
    ),
}
_SPUN: Mapping[str, Derived] = {
    "patch_restitution": lambda contact, before, after: (
        -after.patch_m_s(contact) / before.patch_m_s(contact)
    ),
    "recoil_tangent": lambda contact, _, after: after.patch_m_s(contact) / after.normal_m_s,
}
_SPUN_PAIR: Mapping[str, Derived] = {
    "tangential_m_s": lambda _, before, after: after.tangential_m_s,
    "spin_rad_s": lambda _, before, after: after.spin_rad_s,
}

QUANTITIES: Mapping[str, Mapping[str, Derived]] = {
    "oblique_angle": _OBLIQUE_QUANTITIES,
    "oblique_study": _OBLIQUE_QUANTITIES,
    "oblique_tangential": _SCALED,
    "spin_plane": _SPUN,
    "spin_pair": _SPUN_PAIR,
    "spin_pair_same": _SPUN_PAIR,
    "spin_unequal": _SPUN,
}
"""What the paper plots for each test of oblique and spinning impacts."""


def abscissa(impact: RecordedContact, quantity: str) -> float:
    """What the paper plots a quantity against: the angle, or a ratio of speeds."""
    contact, before, test = impact.constants, impact.before, impact.run.case.test
    patch = before.patch_m_s(contact)
    if test in ("oblique_angle", "oblique_study"):
        return impact.value
    if test == "oblique_tangential":
        return patch / (contact.friction * before.normal_m_s)
    if quantity == "recoil_tangent":
        return patch / before.normal_m_s
    if quantity == "patch_restitution":
        slip = SLIDING * contact.friction * (1 + contact.restitution)
        return slip * before.normal_m_s / patch
    return before.spin_rad_s


def _oblique(run: Recording) -> Iterator[QuantityCheck]:
    case, impacts = run.case, run.contacts
    tolerance = _OBLIQUE / case.steps_per_contact
    arm = max(_arm(impact) for impact in impacts)
    allowed = {INTEGRATED: tolerance, COULOMB: tolerance + arm, PUBLISHED: READ_OFF_CURVE}
    yield _rebounds(run)
    for quantity in QUANTITIES[case.test]:
        rows: dict[str, list[tuple[float, float, float]]] = {against: [] for against in allowed}
        for impact in impacts:
            engine, references = _derived(impact, quantity)
            for against, reference in references.items():
                rows[against].append((impact.value, reference, engine))
        scale = max(abs(reference) for _, reference, _ in rows[INTEGRATED])
        for against, row in rows.items():
            yield QuantityCheck(quantity, against, row, allowed[against], scale)


def _derived(impact: RecordedContact, quantity: str) -> tuple[float, dict[str, float]]:
    """A quantity of an impact, and its references as far as there are."""
    case, contact, before = impact.run.case, impact.constants, impact.before
    derive, at = QUANTITIES[case.test][quantity], abscissa(impact, quantity)
    known = {INTEGRATED: derive(contact, before, impact.integrated)}
    if impact.slid is not None:
        known[COULOMB] = derive(contact, before, impact.slid)
    curve = published_curve(case.test, case.series, quantity)
    if curve.shape[1] > 1 and curve[0, 0] <= at <= curve[0, -1]:
        known[PUBLISHED] = float(np.interp(at, *curve))
    return derive(contact, before, impact.after), known


def _arm(impact: RecordedContact) -> float:
    """Largest overlap over the radius: by half of it friction acts nearer to the centre."""
    contact = impact.constants
    return law.largest_overlap(contact, impact.before.normal_m_s) / contact.particle.radius_m


def _order_of_convergence(runs: Sequence[Recording]) -> Iterator[tuple[Recording, QuantityCheck]]:
    """The order at which the rebound approaches its exact value with limited force."""
    limited = [run for run in runs if run.case.limit_force]
    if len(limited) < 3:
        return
    errors = sorted(
        (run.case.steps_per_contact, abs(run.contact.rebound - run.contact.constants.rebound))
        for run in limited
    )
    name = f"{limited[-1].case.series}, limitForce on, all steps"
    order = [(math.nan, 1.0, fitted_order(errors))]
    check = QuantityCheck("order_of_convergence", EXACT, order, _ORDER, 1.0, series=name)
    yield limited[-1], check


def fitted_order(rows: Sequence[tuple[int, float]]) -> float:
    """Order of convergence: slope of log error over log step."""
    steps, errors = np.array(rows, dtype=np.float64).T
    return -float(np.polyfit(np.log(steps), np.log(errors), 1)[0])


# --- many impacts, rest, steady motion ------------------------------------------------------


def _bounce(run: Recording) -> Iterator[QuantityCheck]:
    impacts, energy = flight_energy(run)
    least = float(run.case.impacts or 0)
    yield QuantityCheck("impacts", EXACT, [(math.nan, least, min(float(impacts[-1]), least))], 0.0)
    worst = float(np.abs(energy - 1).max())
    yield QuantityCheck("energy_change", EXACT, [(math.nan, 0.0, worst)], _BOUNCES, 1.0)


def flight_energy(run: Recording) -> tuple[Ints, Floats]:
    """Impacts before each flight of a bouncing particle, and the relative energy of flight."""
    touching = (run.force_n[:, 0] != 0.0).any(axis=1)
    starts = np.flatnonzero(np.diff(touching.astype(np.int8)) == 1) + 1
    free = np.flatnonzero(~touching)
    speed = np.linalg.norm(run.velocity_m_s[free, 0], axis=1)
    return np.searchsorted(starts, free), (speed / speed[0]) ** 2


def _momentum(run: Recording) -> Iterator[QuantityCheck]:
    changes = [momentum_changes(contact) for contact in run.contacts]
    for at, quantity in enumerate(("linear_momentum_change", "angular_momentum_change")):
        sizes = [np.linalg.norm(change[at], axis=1) for change in changes]
        rows = [(c.value, 0.0, float(s.max())) for c, s in zip(run.contacts, sizes, strict=True)]
        yield QuantityCheck(quantity, EXACT, rows, _CONSERVED, 1.0)


def momentum_changes(contact: RecordedContact) -> tuple[Floats, Floats]:
    """Change of linear and angular momentum of a closed pair since the first frame, (T, 3).

    Over the sum of the sizes of its parts; angular momentum about the first common centre of mass.
    """
    run, partner = contact.run, contact.partner_at
    assert partner is not None
    at = [contact.at, partner]
    particles = [run.particle(row + 1) for row in at]
    mass = np.array([particle.mass_kg for particle in particles])[:, None]
    inertia = np.array([particle.inertia_kg_m2 for particle in particles])[:, None]
    linear = mass * run.velocity_m_s[:, at]
    centre = (mass * run.position_m[0, at]).sum(axis=0) / mass.sum()
    orbital = np.cross(run.position_m[:, at] - centre, linear)
    angular = orbital + inertia * run.spin_rad_s[:, at]
    size = np.linalg.norm(linear[0], axis=1).sum()
    turn = (np.linalg.norm(orbital[0], axis=1) + np.linalg.norm(angular[0], axis=1)).sum()
    total, spun = linear.sum(axis=1), angular.sum(axis=1)
    return (total - total[0]) / size, (spun - spun[0]) / turn


def _column(run: Recording) -> Iterator[QuantityCheck]:
    """Each contact of the column from the floor up carries the weight above it."""
    at_rest = slice(-len(run.time_s) // 5, None)
    gravity, bodies = math.hypot(*run.case.gravity_m_s2), len(run.case.bodies)
    rows, weights = [], []
    for at, contact in enumerate(run.contacts):
        above = range(at, bodies)
        weights.append(sum(run.particle(number + 1).mass_kg for number in above) * gravity)
        radius, modulus = contact.constants.radius_m, contact.constants.modulus_pa
        hertz = mechanics.hertz_overlap(weights[-1], radius, modulus)
        rows.append((at + 1.0, hertz, float(contact.overlap_m[at_rest].mean())))
    floor = run.wall_force_n["plane"][:, 0, 2]
    row = (math.nan, weights[0], float(floor[at_rest].mean()))
    yield QuantityCheck("floor_force_n", EXACT, [row], _AT_REST)
    yield QuantityCheck("overlap_m", EXACT, rows, _AT_REST)


def _incline(run: Recording) -> Iterator[QuantityCheck]:
    for at, quantity in enumerate(("acceleration_m_s2", "spin_up_rad_s2")):
        rows = [
            (contact.value, incline_reference(contact)[at], incline_slopes(contact)[at])
            for contact in run.contacts
        ]
        yield QuantityCheck(quantity, EXACT, rows, _FITTED)
    gravity = math.hypot(*run.case.gravity_m_s2) * math.cos(_angle(run))
    force = run.wall_force_n["plane"][_steady(run)]
    rows = [
        (
            contact.value,
            contact.constants.particle.mass_kg * gravity,
            float(force[:, contact.at, 2].mean()),
        )
        for contact in run.contacts
    ]
    yield QuantityCheck("normal_force_n", EXACT, rows, _FITTED)


def _angle(run: Recording) -> float:
    return math.radians(run.case.angle_deg or 0.0)


def _steady(run: Recording) -> slice:
    """Frames in which a particle on an incline rolls or slips steadily."""
    return slice(len(run.time_s) // 2, None)


def incline_reference(contact: RecordedContact) -> tuple[float, float]:
    """Acceleration of a particle down the incline and of its spin, m/s2 and rad/s2.

    It rolls without slip up to tan(angle) = 7/2 of the friction, and slips beyond.
    """
    constants, size = contact.constants, math.hypot(*contact.run.case.gravity_m_s2)
    angle = _angle(contact.run)
    normal, drive = size * math.cos(angle), size * math.sin(angle)
    friction = min(drive / SLIDING, constants.friction * normal)
    return drive - friction, -friction / (SPHERE * constants.particle.radius_m)


def incline_slopes(contact: RecordedContact) -> tuple[float, float]:
    """The same, fitted to the second half of the run."""
    run, half = contact.run, _steady(contact.run)
    time = run.time_s[half]
    velocity = float(np.polyfit(time, run.velocity_m_s[half, contact.at, 0], 1)[0])
    return velocity, -float(np.polyfit(time, run.spin_rad_s[half, contact.at, 1], 1)[0])


CHECKS: Mapping[str, Callable[[Recording], Iterator[QuantityCheck]]] = {
    "elastic_pair": _elastic,
    "elastic_plane": _elastic,
    "restitution": _restitution,
    **dict.fromkeys(QUANTITIES, _oblique),
    "time_step": _time_step,
    "bounce": _bounce,
    "momentum": _momentum,
    "column": _column,
    "incline": _incline,
}
"""How each test is judged, in the order of the page."""
