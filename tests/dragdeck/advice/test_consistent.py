"""Advised settings pass every check that a setting can fail."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from random_scenes import random_scenes

from dragdeck.advice.advise import consistent, resolve
from dragdeck.cases.case import Case
from dragdeck.errors import Caution
from dragdeck.outlook.timestep import (
    check_timestep,
    largest_of_case,
    settling_cautions,
    stable_step_cautions,
)
from dragdeck.scenes.filling_cautions import filling_cautions
from dragdeck.scenes.lead import with_leads
from dragdeck.scenes.process import PROCESS, SCENES
from dragdeck.scenes.process_cautions import process_cautions
from dragdeck.scenes.scene import SceneType
from dragdeck.study.fidelity import Fidelity
from dragdeck.sweep.cases import settle_case

FILE = Path("studies/random/study.yaml")


def with_fidelity(case: Case, fidelity: Fidelity) -> Case:
    return replace(case, study=case.study.model_copy(update={"fidelity": fidelity}))


def curable(case: Case) -> list[Caution]:
    found = [*filling_cautions(case), *settling_cautions(case), *process_cautions(case)]
    found += stable_step_cautions(case)
    return [one for one in found if one.settings]


def passes(case: Case, kind: SceneType) -> None:
    """Fail if a run of a scene is refused, or warns of what other settings would cure."""
    scene = kind.build(case, None)
    assert {one.code for one in scene.warnings} <= {"gap"}
    if kind.needs_bed:
        check_timestep(case)
    else:
        fraction = scene.deck.timestep_s / scene.case.rayleigh_time_s
        assert fraction <= largest_of_case(case, kind) * (1 + 1e-9)


def test_advised_settings_of_random_scenes_pass_every_check() -> None:
    kinds = set()

    @settings(max_examples=60)
    @given(random_scenes())
    def every_run_passes(data: dict[str, Any]) -> None:
        case = settle_case(FILE, data, {}, resolve=resolve)
        advised, chosen = case.advised, case.study.chosen_fidelity()
        assert advised is not None and 0 < advised.relative_cost <= advised.largest_cost
        for kind in SCENES.values():
            passes(case, kind)
        for run in [one for one in with_leads([case]) if one.rank_of_window <= 1]:
            passes(run, PROCESS)
        kinds.add("windows" if chosen.windows else "start" if chosen.soft_start else "plain")

    every_run_passes()
    assert kinds == {"windows", "start", "plain"}


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
    assert consistent(with_fidelity(case, fidelity)) == fidelity


def test_a_deep_bed_is_softened_less(small: dict[str, Any]) -> None:
    deep = settle_case(FILE, small, {"media.count": 3000, "bowl.height_m": 1.0})
    soft = with_fidelity(deep, Fidelity(youngs_modulus_scale=1e-4))
    (overlap,) = (one for one in curable(soft) if one.code == "overlap")
    scale = consistent(soft).youngs_modulus_scale
    assert scale == overlap.settings["youngs_modulus_scale"] > 1e-4
