"""What is said of a time step before a run."""

import math
import re
from dataclasses import replace
from typing import Any

import pytest
from made_study import Made
from paths import ROOT

from dragdeck.cases.bed import particle_material, smallest_radius
from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.outlook.timestep import (
    check_timestep,
    expected_error,
    outlook,
    safe_fraction,
    settling_cautions,
    stable_fraction,
    stable_step_cautions,
    stable_step_note,
    step_cautions,
    timestep_notes,
)
from dragdeck.physics.contact_mechanics import effective_modulus, rayleigh_time
from dragdeck.records.stability import RestitutionErrors, StableStepLaw, stable_step_law
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.numbers import describe
from dragdeck.scenes.process import PROCESS, SCENES
from dragdeck.scenes.workpiece import workpiece_radius
from dragdeck.study.fidelity import Fidelity
from dragdeck.sweep.cases import load_cases

TABLE = RestitutionErrors(
    steps_per_contact=(5.0, 50.0), median=(1e-2, 1e-4), ordinary_worst=(1e-1, 1e-3),
    worst=(3e-1, 3e-3), peak_force_worst=(1e-1, 1e-3), runs=(9, 9),
)  # fmt: skip


@pytest.mark.parametrize(
    ("steps", "error"),
    [(5.0, 1e-1), (50.0, 1e-3), (math.sqrt(250.0), 1e-2), (2.0, 1e-1), (500.0, 1e-3)],
)
def test_errors_are_interpolated_on_logarithmic_scales(steps: float, error: float) -> None:
    assert expected_error(steps, 0.9, TABLE) == pytest.approx(error, rel=1e-9)
    assert expected_error(steps, 0.2, TABLE) == pytest.approx(3 * error, rel=1e-9)


def test_what_lies_outside_of_the_measured_range_is_said(case: Case) -> None:
    for step, outside in ((1e-6, False), (1e-3, True)):
        for pair in outlook(case, PROCESS, step):
            assert pair.measured is not outside
            assert ("outside the measured range" in str(pair)) is outside


def test_unlike_bodies_are_looked_at_too(case: Case) -> None:
    pairs = {pair.bodies: pair for pair in outlook(case, PROCESS, 1e-5)}
    assert len(pairs) == 3
    like, bowl, workpiece = (
        pairs[f"particle on {name}"] for name in ("particle", "bowl", "workpiece")
    )
    smallest = rayleigh_time(particle_material(case.study), smallest_radius(case.study), 1e-3)
    assert workpiece.limiting == "particle"
    assert workpiece.rayleigh_fraction == pytest.approx(1e-5 / smallest, rel=1e-12)
    # Johnson 1985, eq. 11.24: a plane doubles m and R, and steel is stiffer
    ceramic, steel = (case.study.materials[name] for name in ("ceramic", "steel"))
    stiffer = effective_modulus(ceramic, steel) / effective_modulus(ceramic, ceramic)
    ratio = bowl.steps_per_contact / like.steps_per_contact
    assert ratio == pytest.approx((2**2 / 2 / stiffer**2) ** 0.2, rel=1e-12)


def test_the_body_with_the_smaller_rayleigh_time_limits(small: dict[str, Any], made: Made) -> None:
    """A stiff, light and thin workpiece is faster than a particle."""
    shape = {"kind": "cylinder", "radius_m": 0.0005, "facet_size_m": 0.0005}
    small["workpiece"] = {"material": "light", "shape": shape}
    small["materials"]["light"] = {
        "youngs_modulus_pa": 300e9, "poissons_ratio": 0.2, "density_kg_m3": 1000,
    }  # fmt: skip
    case = made({"pairs.ceramic-light": {"restitution": 0.6, "friction": 0.3}})
    pairs = {pair.bodies: pair for pair in outlook(case, PROCESS, 1e-6)}
    workpiece = pairs["particle on workpiece"]
    known = rayleigh_time(case.study.materials["light"], workpiece_radius(case), 1e-3)
    assert workpiece.limiting == "workpiece"
    assert workpiece.rayleigh_fraction == pytest.approx(1e-6 / known, rel=1e-12)


def test_strong_damping_has_its_own_safe_step(made: Made) -> None:
    case = made()
    ordinary, _ = safe_fraction(case, FILLING)
    damped = made({"pairs.ceramic-steel.restitution": 0.1})
    assert safe_fraction(damped, FILLING)[0] < ordinary


def paper(scale: float, fraction: float) -> Case:
    (case,) = load_cases(ROOT / "studies/uhlmann2015/study.yaml")
    fidelity = Fidelity(youngs_modulus_scale=scale, timestep_fraction=fraction)
    return replace(case, study=case.study.model_copy(update={"fidelity": fidelity}))


MEASURED = [
    (1e-3, 0.2, 0.37), (1e-3, 0.5, 0.72), (1e-3, 0.64, 0.87), (1e-3, 0.8, 1.06), (1e-3, 1.0, 1.24),
    (1e-4, 0.5, 0.975), (1e-4, 0.64, 1.17), (1e-2, 0.5, 0.53), (1e-2, 1.2, 1.07), (1e-2, 1.5, 1.28),
]  # fmt: skip
"""Modulus scale, step and stability number of runs of uhlmann2015 (docs/evidence/stability.md)."""


@pytest.mark.parametrize(("scale", "fraction", "number"), MEASURED)
def test_the_law_gives_the_numbers_of_a_scene_it_was_not_fitted_to(
    scale: float, fraction: float, number: float
) -> None:
    law = stable_step_law()
    kappa = scale ** (2 / 3) * describe(paper(scale, fraction))["stiffness_number"]
    largest = law.largest_fraction(kappa, 0.86, 0.15 / 3.27, number)
    assert law.number(largest, kappa, 0.86, 0.15 / 3.27) == pytest.approx(number, rel=1e-12)
    assert largest == pytest.approx(fraction, rel=0.15)


@pytest.mark.parametrize(("scale", "fraction", "number"), MEASURED)
def test_runs_far_beyond_are_refused_and_runs_far_below_pass_without_a_warning(
    scale: float, fraction: float, number: float
) -> None:
    case = paper(scale, fraction)
    if number < 0.9:
        check_timestep(case)
        assert not list(stable_step_cautions(case))
        assert "is below" in stable_step_note(case)[1]
    if number > 1.05:
        with pytest.raises(InputError, match="not stable"):
            check_timestep(case)
        (caution,) = stable_step_cautions(case)
        cured = paper(scale, caution.settings["timestep_fraction"])
        assert not list(stable_step_cautions(cured))
        assert "NOT BELOW" in stable_step_note(case)[1]


@pytest.mark.parametrize(
    ("restitution", "fraction", "rests"), [(0.3, 0.25, True), (0.3, 0.5, False), (0.86, 0.45, True)]
)
def test_a_filling_that_may_never_rest_is_told(
    made: Made, restitution: float, fraction: float, rests: bool
) -> None:
    """Recorded fillings, about: docs/data/stability/settling.csv."""
    fields = {"pairs.ceramic-ceramic.restitution": restitution}
    step = "fidelities.quick.filling_timestep_fraction"
    cautions = list(settling_cautions(made({**fields, step: fraction})))
    assert (not cautions) == rests
    for caution in cautions:
        smaller = caution.settings["filling_timestep_fraction"]
        assert not list(settling_cautions(made({**fields, step: smaller})))


def test_damping_softness_and_equal_radii_shorten_the_stable_step() -> None:
    law = StableStepLaw(stiffness=69, damping=46, spread=-1.3, scatter=0.04, largest=0.1, runs=1)
    both, damped, softer, neither = (
        law.largest_fraction(kappa, e, 0.05) for kappa in (500, 50_000) for e in (0.4, 0.95)
    )
    assert both < damped < neither and both < softer < neither
    assert law.largest_fraction(500, 0.95, 0.0) < law.largest_fraction(500, 0.95, 0.1)


def test_the_stable_step_of_a_case_depends_on_its_own_modulus() -> None:
    assert stable_fraction(paper(1e-4, 0.5)) < stable_fraction(paper(1e-2, 0.5))


@pytest.mark.parametrize("kind", SCENES)
@pytest.mark.parametrize("fraction", [0.01, 0.2402, 0.3, 0.4803, 1.0])
def test_a_step_above_what_is_safe_is_always_warned_of(
    made: Made, kind: str, fraction: float
) -> None:
    """As the verdict of the notes says; of a drag, the note on the stable step."""
    block = {"drop_test": "drop_test.", "filling": "fidelities.quick.filling_"}
    field = block.get(kind, "fidelities.quick.")
    scene, case = SCENES[kind], made({f"{field}timestep_fraction": fraction})
    cautions = list(step_cautions(case, scene))
    notes = dict(timestep_notes(case, scene, scene.build(case, None)))
    if scene.needs_bed:
        assert bool(cautions) >= ("NOT BELOW" in stable_step_note(case)[1])
    else:
        assert len(cautions) == ("ABOVE" in notes["safe step"])
        for caution in cautions:
            numbers = map(float, re.findall(r"\d+\.?\d*", str(caution)))
            assert next(numbers) > next(numbers)
