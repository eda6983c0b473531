"""Settings whose results are extrapolated to the physical Young's modulus."""

from typing import Any

import pytest
from made_tradeoff import made_stiffness, made_tradeoff, setting, with_settings

from dragdeck.advice.advise import OUTSIDE_FACTOR, Advice, advise
from dragdeck.advice.forecast import remarks
from dragdeck.cases.case import Case
from dragdeck.errors import InputError
from dragdeck.outlook.measured import Tradeoff
from dragdeck.scenes.dimensionless import describe
from dragdeck.study.model import Tolerance


def with_laws(case: Case, tradeoff: Tradeoff | None = None, **changes: Any) -> Tradeoff:
    laws = made_stiffness(case, **changes)
    return (tradeoff or made_tradeoff(case)).model_copy(update={"stiffness": laws})


def contacts(case: Case, tradeoff: Tradeoff, tolerance: float) -> Advice:
    return advise(case, Tolerance(tolerance=tolerance, quantity="workpiece_contacts"), tradeoff)


def elsewhere(case: Case) -> Tradeoff:
    """A trade-off whose measured scene is much deeper than the case."""
    scene = {**describe(case), "depth_to_particle": 50.0}
    return made_tradeoff(case, scene=scene)


def test_a_quantity_without_a_law_or_an_error_is_refused(case: Case) -> None:
    with pytest.raises(InputError, match="the error of this quantity was not measured") as caught:
        advise(case, Tolerance(tolerance=0.1, quantity="friction_work"), with_laws(case))
    assert "workpiece_contacts" in str(caught.value)


def test_the_softest_that_the_tolerance_allows_is_extrapolated(case: Case) -> None:
    found = {t: contacts(case, with_laws(case), t) for t in (0.1, 0.06, 0.001)}
    scales = {t: advice.chosen.fidelity.youngs_modulus_scale for t, advice in found.items()}
    assert scales[0.1] < scales[0.06] < scales[0.001] == 1
    assert [found[t].chosen.extrapolated for t in found] == [True, True, False]
    assert found[0.001].fallback is not None
    assert found[0.1].for_case.extrapolated
    assert "2 designed scenes" in found[0.1].source


def test_more_scatter_between_scenes_takes_a_stiffer_run(case: Case) -> None:
    calm, wild = (
        contacts(case, with_laws(case, amplitude_std=std), 0.1).chosen.fidelity
        for std in (0.02, 0.1)
    )
    assert calm.youngs_modulus_scale < wild.youngs_modulus_scale


def test_a_faster_workpiece_is_not_extrapolated(case: Case) -> None:
    fast = setting(1e-3, 0.6, 5.0, 0.002, None)
    found = contacts(case, with_laws(case, with_settings(made_tradeoff(case), fast)), 0.2)
    assert found.chosen.fidelity.speed_factor == 1


def test_no_run_is_softer_than_those_that_were_measured(case: Case) -> None:
    soft = setting(1e-6, 0.5, 1.0, 0.001, None)
    tradeoff = with_laws(case, with_settings(made_tradeoff(case), soft))
    here = describe(case)["stiffness_number"]
    number = here * contacts(case, tradeoff, 0.9).chosen.fidelity.youngs_modulus_scale ** (2 / 3)
    assert tradeoff.stiffness is not None
    assert number >= 0.98 * tradeoff.stiffness.lowest_stiffness_number


def test_designed_scenes_replace_the_assumption_outside_of_the_trade(case: Case) -> None:
    plain = advise(case, Tolerance(tolerance=0.1), elsewhere(case))
    assert (plain.held_to, bool(plain.outside)) == (0.1 * OUTSIDE_FACTOR, True)
    found = advise(case, Tolerance(tolerance=0.1), with_laws(case, elsewhere(case)))
    assert (found.held_to, list(found.outside)) == (0.1, [])
    assert found.chosen.extrapolated
    assert not any("assumption" in text for _, text in remarks(found, case.study))


def test_outside_of_the_designed_scenes_the_assumption_stays(case: Case) -> None:
    far = with_laws(case, elsewhere(case), inertial_number=1e3)
    found = advise(case, Tolerance(tolerance=0.1), far)
    assert found.held_to == 0.1 * OUTSIDE_FACTOR
    assert not found.chosen.extrapolated
