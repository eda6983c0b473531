"""What a number of a run says of the process, for all combinations of settings."""

import math
from typing import Any

import pytest
from report_files import case_json

from dragchain.quantities.basis import Basis, Correction, judge, notes
from dragchain.quantities.registry import REPORTED, Quantity
from dragchain.statistics.estimate import Estimate, student_quantile
from dragdeck.records.case import CaseOfRun
from dragdeck.records.windows import WindowsRecord

OWN = Estimate(10.0, 8.0, 12.0)
WINDOWS = Correction(Estimate(0.8, 0.6, 1.0), 5)
PLAIN = Quantity("contacts", "contacts")
ROBUST = Quantity("drag", "drag", "N", robust=True)
IMPULSE = Quantity("impulse", "impulse", "N s", time=1, robust=True)
RATE = Quantity("rate", "rate", "1/s", time=-1, robust=True)


def case(scale: float = 1.0, factor: float = 1.0, **more: Any) -> CaseOfRun:
    data = case_json("process", "run-1", **more)
    data["fidelity"] |= {"youngs_modulus_scale": scale, "speed_factor": factor}
    return CaseOfRun.model_validate(data)


@pytest.mark.parametrize(
    ("quantity", "settings", "windows", "basis", "value"),
    [
        (PLAIN, (1.0, 1.0), None, Basis.SIMULATED, 10.0),
        (PLAIN, (0.01, 1.0), WINDOWS, Basis.WINDOWS, 8.0),
        (PLAIN, (0.01, 1.0), None, Basis.NONE, None),
        (PLAIN, (1.0, 5.0), None, Basis.NONE, None),
        (PLAIN, (0.01, 5.0), None, Basis.NONE, None),
        (ROBUST, (0.01, 1.0), WINDOWS, Basis.WINDOWS, 8.0),
        (ROBUST, (0.01, 5.0), None, Basis.SIMULATED, 10.0),
        (IMPULSE, (1.0, 5.0), None, Basis.SCALED, 50.0),
        (IMPULSE, (0.01, 1.0), None, Basis.SIMULATED, 10.0),
        (RATE, (1.0, 5.0), None, Basis.SCALED, 2.0),
    ],
)
def test_the_basis_follows_from_all_settings(
    quantity: Quantity, settings: tuple[float, float], windows: Correction | None, basis: Basis,
    value: float | None,
) -> None:  # fmt: skip
    found = judge(quantity, OWN, case(*settings), windows)
    assert found.basis is basis
    assert (found.value and found.value.value) == pytest.approx(value)
    for name, setting in zip(("Young's modulus", "speed"), settings, strict=True):
        assert (name in found.reason) == (setting != 1.0 and basis is not Basis.WINDOWS)


def test_the_interval_of_a_value_from_windows_is_theirs() -> None:
    found = judge(PLAIN, Estimate(-10.0, -12.0, -8.0), case(0.01), WINDOWS)
    assert found.value is not None
    assert (found.value.ci95_low, found.value.ci95_high) == (-10.0, -6.0)
    assert found.run == Estimate(-10.0, -12.0, -8.0)
    assert found.rests_on == "from 5 windows at the physical Young's modulus"


@pytest.mark.parametrize(
    ("settings", "more", "remedy"),
    [
        ((0.01, 1.0), {}, "fidelity: {tolerance: 0.1} would measure"),
        ((0.01, 1.0), {"marks": ["state.1.restart"]}, "its windows do not give"),
        ((0.01, 5.0), {}, "higher speed is not measured"),
    ],
)
def test_what_is_not_available_says_what_would_help(
    settings: tuple[float, float], more: dict[str, Any], remedy: str
) -> None:
    made = case(*settings, **more)
    assert remedy in " ".join([judge(PLAIN, OWN, made, None).reason, *notes(made)])


def test_an_interval_that_is_not_known_stays_unknown() -> None:
    found = judge(IMPULSE, Estimate(10.0, math.nan, math.nan), case(1.0, 2.0), None)
    assert found.run.value == 20.0 and not found.run.known


def test_a_step_that_was_accepted_though_unstable_is_said_to_be() -> None:
    text = " ".join(notes(case(unsafe_timestep="to see it break")))
    assert "may be unstable" in text and "to see it break" in text
    assert "no effect" not in text


@pytest.mark.parametrize(("scale", "inertial", "said"), [
    (1e-3, 2.4, True), (1e-3, 0.3, False), (1.0, 2.4, False),
])  # fmt: skip
def test_soft_contacts_of_a_fast_drag_are_said_to_be_wrong_by_more(
    scale: float, inertial: float, said: bool
) -> None:
    text = " ".join(notes(case(scale, numbers={"inertial_number": inertial})))
    assert ("1.7 times as many contacts" in text) is said


DRAG, CONTACTS = (
    next(quantity for quantity in REPORTED if quantity.name == name)
    for name in ("drag_mean", "workpiece_contacts")
)
NUMBERS = {"numbers": {"stiffness_number": 64_000.0}}
CIRCLE = {"path": {"kind": "circle", "radius_m": 0.02}, "speed_m_s": 0.01, "plunge_at_m": [0, 0]}
SHAKEN = {"kind": "vibration", "amplitude_m": [0, 0, 1e-3], "frequency_hz": 25}


def test_other_scenes_give_an_estimate_beside_the_value_of_a_soft_run() -> None:
    """At E x 0.001 and a stiffness number of 64,000 the ratio has a power of 1.118 - 0.354."""
    drag = judge(DRAG, Estimate(-2.0, -2.2, -1.8), case(1e-3, **NUMBERS), None)
    known = WindowsRecord.shipped().quantities["drag_mean"]
    assert drag.value == drag.run == Estimate(-2.0, -2.2, -1.8)
    assert drag.estimated is not None and drag.other_scenes is not None
    difference = (1.0 / 0.64) ** 0.25 - (1.0 / 64.0) ** 0.25
    assert drag.estimated.value == pytest.approx(-2.0 * math.exp(known.per_softness * difference))
    half = math.hypot(0.1, student_quantile(known.scenes - 2) * known.per_softness_std * difference)
    ends = drag.estimated.ci95_low, drag.estimated.ci95_high
    assert ends == pytest.approx([drag.estimated.value * math.exp(sign * half) for sign in (1, -1)])


@pytest.mark.parametrize(
    ("quantity", "settings", "more"),
    [
        (DRAG, (1.0, 1.0), NUMBERS),  # nothing to estimate
        (DRAG, (1e-3, 2.0), NUMBERS),
        (DRAG, (1e-3, 1.0), {}),  # a softness that is not known
        (DRAG, (1e-3, 1.0), NUMBERS | {"added_forces": ["cohesion sjkr2"]}),
        (DRAG, (1e-3, 1.0), NUMBERS | {"attractive": {"particle": {"cohesion_j_m3": 1e5}}}),
        (DRAG, (1e-3, 1.0), NUMBERS | {"study": {"compound": {"density_kg_m3": 1000.0}}}),
        (DRAG, (1e-3, 1.0), NUMBERS | {"motion": {**CIRCLE, "bowl": SHAKEN}}),
        (DRAG, (1e-3, 1.0), NUMBERS | {"changed_law": ["pair_style gran model hooke"]}),
        (CONTACTS, (1e-3, 1.0), NUMBERS),  # differs from scene to scene
        (PLAIN, (1e-3, 1.0), NUMBERS),
    ],
)
def test_other_scenes_give_no_estimate_where_they_are_no_measure(
    quantity: Quantity, settings: tuple[float, float], more: dict[str, Any]
) -> None:
    assert judge(quantity, OWN, case(*settings, **more), None).estimated is None


def test_a_value_from_windows_needs_no_estimate() -> None:
    assert judge(DRAG, OWN, case(1e-3, **NUMBERS), WINDOWS).estimated is None
