"""Both packages have the error of an extrapolation: it is the same."""

import math

import numpy as np
import pytest
from made_tradeoff import made_stiffness, made_tradeoff

from dragchain.tradeoff.stiffness_law import ScaledRuns, StiffnessLaw, extrapolate
from dragdeck.advice import options
from dragdeck.cases.case import Case
from dragdeck.outlook.measured import MeasuredLaw
from dragdeck.scenes.dimensionless import describe
from dragdeck.study.model import Tolerance


@pytest.mark.parametrize("rate", [-0.1, 0.0, 0.25, 1.0])
@pytest.mark.parametrize("scale", [0.5, 0.03, 1e-3, 1e-4])
def test_both_have_the_same_law(case: Case, rate: float, scale: float) -> None:
    made = made_stiffness(case).laws["workpiece_contacts"]
    known = made.law.model_copy(update={"rate": rate})
    law = StiffnessLaw(**known.model_dump())
    numbers = describe(case)
    run = ScaledRuns(
        numbers["stiffness_number"], numbers["inertial_number"],
        numbers["particle_friction"], np.array([scale]), np.array([0.0]), 15.0,
    )  # fmt: skip
    expected = extrapolate(law, run, np.array([1e-4]))
    mean, se = MeasuredLaw(**{**dict(made), "law": known}).effect(numbers, scale)
    assert mean == pytest.approx(-expected.logarithm, rel=1e-9)
    assert se == pytest.approx(expected.law_se, rel=1e-9)


def test_the_advisor_expects_the_error_that_the_tables_have(case: Case) -> None:
    record = made_stiffness(case)
    tradeoff = made_tradeoff(case).model_copy(update={"stiffness": record})
    asked = Tolerance(tolerance=0.1, quantity="workpiece_contacts")
    known = record.laws["workpiece_contacts"]
    found = list(options.extrapolated_options(case, tradeoff, asked))
    assert len(found) >= 2
    for option in found:
        scale = option.fidelity.youngs_modulus_scale
        _, expected = known.effect(describe(case), scale)
        assert option.error is not None
        assert option.error.se == pytest.approx(expected)
        assert option.error.bound == pytest.approx(math.expm1(2.0 * expected))
