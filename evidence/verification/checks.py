"""What each test of the suite must show: quantity, reference, engine, error, verdict.

Every tolerance below states what the engine's integration can be expected to do. They were
written down after a first look at its numbers; none was widened to make a row pass, and that of
the normal rebound was narrowed afterwards, from 5 to 1 over the steps.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.arrays import Floats
from dragchain.errors import TableError
from evidence.verification import law
from evidence.verification.law import SLIDING, ContactPair, RelativeMotion
from evidence.verification.motion_checks import bounce, column, incline, momentum
from evidence.verification.quantity_check import (
    COULOMB,
    EXACT,
    INPUT,
    INTEGRATED,
    PUBLISHED,
    QuantityCheck,
)
from evidence.verification.recording import RecordedContact, Recording

_NORMAL = 1.0
"""Damping sees the velocity half a step late: an error of about one step per contact."""

_OBLIQUE = 5.0
"""Sticking and sliding begin within a step, up to four times: a few steps per contact."""

_SECOND_ORDER = 1.0
"""An elastic impact is integrated to second order, but for its two ends."""

_SAME_NUMBERS = 1e-6
"""Two evaluations of one formula from the same state."""

_ORDER = 0.2
"""Scatter of a fitted order of convergence about a whole number."""

READ_OFF, READ_OFF_CURVE = 0.01, 0.05
"""Points of a published figure, and values between them."""


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


CHECKS: Mapping[str, Callable[[Recording], Iterator[QuantityCheck]]] = {
    "elastic_pair": _elastic,
    "elastic_plane": _elastic,
    "restitution": _restitution,
    **dict.fromkeys(QUANTITIES, _oblique),
    "time_step": lambda run: iter([_rebounds(run)]),
    "bounce": bounce,
    "momentum": momentum,
    "column": column,
    "incline": incline,
}
"""How each test is judged, in the order of the page."""
