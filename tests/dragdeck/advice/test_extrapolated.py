"""Settings whose results are extrapolated to the physical Young's modulus."""

import math
from typing import Any

import pytest
from made_tradeoff import made_stiffness, made_tradeoff, setting, with_settings

from dragdeck.advice.advise import OUTSIDE_FACTOR, Advice, advise
from dragdeck.advice.forecast import remarks
from dragdeck.advice.options import extrapolated_options, process_options
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
    assert found.chosen.extrapolated and [one.field for one in found.outside] == ["inertial number"]
    assert found.chosen.error is not None and found.chosen.error.bound <= found.held_to


def test_the_promise_is_about_the_value_that_the_report_shows(case: Case) -> None:
    """In the measured scene: the measured error, times the correction by the law."""
    tradeoff = with_laws(case)
    option = next(iter(process_options(case, tradeoff, Tolerance(tolerance=0.2))))
    raw = next(iter(process_options(case, made_tradeoff(case), Tolerance(tolerance=0.2))))
    assert option.fidelity == raw.fidelity and option.extrapolated and not raw.extrapolated
    assert tradeoff.stiffness is not None and option.error is not None and raw.error is not None
    scale = option.fidelity.youngs_modulus_scale
    effect, _ = tradeoff.stiffness.laws["drag_mean"].effect(describe(case), scale)
    assert 1 + option.error.value == pytest.approx((1 + raw.error.value) * math.exp(-effect))
    assert option.error.bound > abs(option.error.value)


def test_the_bound_vanishes_as_the_modulus_approaches_the_physical_one(case: Case) -> None:
    """So any tolerance has a reduced modulus; and the misfit of a soft one is not charged here."""
    made = with_laws(case)
    assert made.stiffness is not None
    known = made.stiffness.laws["drag_mean"]
    wild = known.law.model_copy(update={"misfit": [(1e-3, 0.5), (1e-2, 0.005)]})
    laws = {**made.stiffness.laws, "drag_mean": known.model_copy(update={"law": wild})}
    stiffness = made.stiffness.model_copy(update={"laws": laws})
    tradeoff = made.model_copy(update={"stiffness": stiffness})
    asked = Tolerance(tolerance=0.1)
    bounds = {
        one.fidelity.youngs_modulus_scale: one.error.bound
        for one in extrapolated_options(case, tradeoff, asked)
        if one.error is not None
    }
    stiff = sorted((scale for scale in bounds if scale >= 0.01), reverse=True)
    assert [bounds[scale] for scale in stiff] == sorted(bounds[scale] for scale in stiff)
    assert bounds[0.5] < 0.05 and bounds[0.01] < 0.3 < 1.0 < bounds[1e-3]
