"""Both packages have the error of an extrapolation: it is the same."""

import math

import numpy as np
import pytest
from made_tradeoff import made_stiffness, made_tradeoff

from dragchain.tradeoff.stiffness_law import (
    UNIT,
    UNIT_FRICTION,
    UNIT_INERTIA,
    ScaledRuns,
    StiffnessLaw,
    extrapolate,
)
from dragdeck.advice import options
from dragdeck.cases.case import Case
from dragdeck.scenes.dimensionless import describe
from dragdeck.study.model import Tolerance


def test_the_advisor_expects_the_error_that_the_tables_have(case: Case) -> None:
    record = made_stiffness(case)
    tradeoff = made_tradeoff(case).model_copy(update={"stiffness": record})
    asked = Tolerance(tolerance=0.1, quantity="workpiece_contacts")
    found = list(options.extrapolated_options(case, tradeoff, asked))
    known, numbers = record.laws["workpiece_contacts"].law, describe(case)
    law = StiffnessLaw(
        known.rate,
        (0.6, 0.2, 0.1),
        known.covariance,
        known.amplitude_std,
        known.run_std,
        known.model_std,
    )
    assert len(found) >= 2
    for option in found:
        scale = option.fidelity.youngs_modulus_scale
        run = ScaledRuns(
            numbers["stiffness_number"], numbers["inertial_number"],
            numbers["particle_friction"], np.array([scale]), np.array([0.0]), 15.0,
        )  # fmt: skip
        expected = extrapolate(law, run, np.array([1e-4])).se
        assert option.error is not None
        assert option.error.se == pytest.approx(expected, rel=1e-4)
        assert option.error.bound == pytest.approx(math.expm1(2.0 * expected), rel=1e-4)


def test_both_write_laws_in_the_same_units() -> None:
    units = options.UNIT_STIFFNESS, options.UNIT_INERTIA, options.UNIT_FRICTION
    assert units == (UNIT, UNIT_INERTIA, UNIT_FRICTION)
