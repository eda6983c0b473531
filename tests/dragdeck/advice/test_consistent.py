"""Advised settings pass every check that a setting can fail."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from made_tradeoff import made_tradeoff, setting, with_settings
from random_scenes import random_scenes

from dragdeck.advice.advise import advise, resolve
from dragdeck.advice.options import Work, consistent, process_reference
from dragdeck.cases.bed import bed_timestep, skin
from dragdeck.cases.case import Case
from dragdeck.errors import Caution
from dragdeck.outlook.stable_step import check_timestep, stable_fraction, stable_step_cautions
from dragdeck.outlook.timestep import largest_of_case
from dragdeck.scenes.filling import filling_cautions
from dragdeck.scenes.fit import process_cautions
from dragdeck.scenes.registry import SCENES
from dragdeck.study.model import Fidelity, Tolerance
from dragdeck.sweep.cases import load_cases, settle_case

FILE = Path("studies/random/study.yaml")

Write = Callable[..., Path]


def with_fidelity(case: Case, fidelity: Fidelity) -> Case:
    return replace(case, study=case.study.model_copy(update={"fidelity": fidelity}))


def curable(case: Case) -> list[Caution]:
    found = [*filling_cautions(case), *process_cautions(case), *stable_step_cautions(case)]
    return [one for one in found if one.settings]


def test_advised_settings_of_random_scenes_pass_every_check() -> None:
    cured = []  # whether the scene would warn with the usual skin

    @settings(max_examples=250)
    @given(random_scenes())
    def passes(data: dict[str, Any]) -> None:
        case = settle_case(FILE, data, {}, resolve=resolve)
        check_timestep(case)
        for kind in SCENES.values():
            scene = kind.build(case, None)
            assert {one.code for one in scene.warnings} <= {"gap"}
            assert not any(one.settings for one in scene.warnings)
            fraction = scene.deck.timestep_s / scene.case.rayleigh_time_s
            assert fraction <= largest_of_case(case, kind) * (1 + 1e-9)
        advised = case.advised
        assert advised is not None
        assert advised.fallback or (advised.bound is not None and advised.bound <= advised.held_to)
        plain = case.study.chosen_fidelity().model_copy(update={"skin_m": None})
        cured.append(bool(curable(with_fidelity(case, plain))))

    passes()
    assert sum(cured) > 10


STEEL = {
    "materials.ceramic": {
        "youngs_modulus_pa": 210e9, "poissons_ratio": 0.3, "density_kg_m3": 7800,
    },
    "media.radius_mean_m": 1.5e-3, "media.radius_std_m": 0.0, "media.count": 3000,
    "pairs.ceramic-ceramic.friction": 0.15, "pairs.ceramic-steel.friction": 0.15,
    "workpiece.shape": {"kind": "cylinder", "radius_m": 0.002},
    "motion.path": {"kind": "line", "start_m": [-0.01, 0.0], "length_m": 0.02},
    "motion.speed_m_s": 0.03,
}  # fmt: skip
ROUGH = {
    "media.radius_mean_m": 2e-3, "media.radius_std_m": 0.18e-3, "media.count": 5000,
    "bowl.height_m": 0.3,
    "pairs.ceramic-ceramic.friction": 0.6, "pairs.ceramic-steel.friction": 0.45,
    "workpiece.shape": {"kind": "cylinder", "radius_m": 0.0015},
}  # fmt: skip


@pytest.mark.parametrize("scene", [STEEL, ROUGH], ids=["steel", "rough"])
def test_scenes_whose_advice_used_to_warn(small: dict[str, Any], scene: dict[str, Any]) -> None:
    asked = {"fidelity": {"tolerance": 0.2}}
    case = settle_case(FILE, small, scene | asked, resolve=resolve)
    assert case.study.chosen_fidelity().skin_m is not None
    assert not curable(case)


@pytest.mark.parametrize("scale", [1e-4, 1e-2, 1.0])
@pytest.mark.parametrize("fraction", [0.1, 0.5])
def test_settings_that_pass_are_left_as_they_are(case: Case, scale: float, fraction: float) -> None:
    fidelity = Fidelity(youngs_modulus_scale=scale, timestep_fraction=fraction, skin_m=1e-3)
    assert not curable(with_fidelity(case, fidelity))
    assert consistent(case, fidelity) == fidelity


def test_a_stiffer_modulus_and_a_shorter_step_are_paid_for(
    small: dict[str, Any], write_study: Write, case: Case
) -> None:
    small["media"]["count"], small["bowl"]["height_m"] = 3000, 1.0
    (deep,) = load_cases(write_study(small))
    soft = setting(1e-4, 0.6, 1.0, 1e-3, 0.01)
    soft_settings = {"youngs_modulus_scale": 1e-4, "timestep_fraction": 0.6}
    tradeoff = with_settings(made_tradeoff(deep), soft)
    work = Work.of(deep, tradeoff)
    whole = work.cpu_time(process_reference(deep, tradeoff).fidelity)
    chosen = advise(deep, Tolerance(tolerance=0.05), tradeoff).chosen
    scale = chosen.fidelity.youngs_modulus_scale
    (raw,) = (
        one
        for one in curable(with_fidelity(deep, Fidelity(youngs_modulus_scale=1e-4)))
        if one.code == "overlap"
    )
    assert scale == raw.settings["youngs_modulus_scale"] > 1e-4
    assert chosen.relative_cost == pytest.approx(work.cpu_time(chosen.fidelity) / whole)
    assert chosen.relative_cost > work.cpu_time(Fidelity(**soft_settings)) / whole
    long = setting(1e-4, 0.64, 1.0, 5e-4, 0.01)
    shorter = advise(deep, Tolerance(tolerance=0.05), with_settings(tradeoff, long)).chosen
    fraction = shorter.fidelity.timestep_fraction
    assert fraction < min(0.64, stable_fraction(with_fidelity(deep, shorter.fidelity)))
    assert shorter.relative_cost == pytest.approx(work.cpu_time(shorter.fidelity) / whole)


def test_a_skin_that_would_be_too_wide_gives_way_to_a_shorter_step(case: Case) -> None:
    coarse = Fidelity(youngs_modulus_scale=1e-4, filling_timestep_fraction=0.48, speed_factor=100)
    found = consistent(case, coarse)
    radius, study = case.study.media.radius_mean_m, with_fidelity(case, found).study
    assert found.skin_m == pytest.approx(0.3 * radius, rel=1e-2)
    assert found.timestep_fraction < coarse.timestep_fraction
    assert not curable(with_fidelity(case, found))
    assert skin(study) >= 2 * 100 * study.motion.plunge_speed_m_s * bed_timestep(
        study, "timestep_fraction"
    )
