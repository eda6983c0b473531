"""The forecast of the stable step, against numbers that runs of another scene had."""

from dataclasses import replace

import pytest
from paths import ROOT

from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.outlook.measured import StableStepLaw, stable_step_law
from dragdeck.outlook.stable_step import (
    check_timestep,
    stable_fraction,
    stable_step_cautions,
    stable_step_note,
)
from dragdeck.scenes.dimensionless import describe
from dragdeck.study.model import Fidelity
from dragdeck.sweep.cases import load_cases


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
    assert law.largest_fraction(kappa, 0.86, 0.15 / 3.27, number) == pytest.approx(
        fraction, rel=0.15
    )


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


def test_damping_softness_and_equal_radii_shorten_the_stable_step() -> None:
    law = StableStepLaw(stiffness=69, damping=46, spread=-1.3, scatter=0.04, largest=0.1, runs=1)
    fractions = {
        (kappa, e): law.largest_fraction(kappa, e, 0.05)
        for kappa in (500, 50_000)
        for e in (0.4, 0.95)
    }
    assert fractions[500, 0.4] < fractions[500, 0.95] < fractions[50_000, 0.95]
    assert fractions[500, 0.4] < fractions[50_000, 0.4] < fractions[50_000, 0.95]
    assert law.largest_fraction(500, 0.95, 0.0) < law.largest_fraction(500, 0.95, 0.1)


def test_the_stable_step_of_a_case_depends_on_its_own_modulus() -> None:
    assert stable_fraction(paper(1e-4, 0.5)) < stable_fraction(paper(1e-2, 0.5))
