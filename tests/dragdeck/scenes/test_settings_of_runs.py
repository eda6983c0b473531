"""``case.json`` of a run states the settings of that run, not those of the process beside it."""

from typing import Any

import pytest
from made_study import Made

from dragdeck.physics.contact_mechanics import effective_modulus
from dragdeck.scenes.bed_space import expected_bed
from dragdeck.scenes.drop_test import drop_scene
from dragdeck.scenes.filling import filling_scene
from dragdeck.scenes.process import PROCESS

QUICK = {
    "youngs_modulus_scale": 0.01, "timestep_fraction": 0.5, "filling_timestep_fraction": 0.3,
    "speed_factor": 4.0, "ranks": 2,
}  # fmt: skip


@pytest.fixture
def fast(made: Made) -> Any:
    return made({"fidelities.quick": QUICK})


def test_the_drop_test_states_its_own_modulus_and_step(fast: Any) -> None:
    """It runs at the physical modulus and 2 % of the Rayleigh time, whatever the process does."""
    drop = drop_scene(fast).case
    assert drop.fidelity.youngs_modulus_scale == 1.0
    assert drop.fidelity.timestep_fraction == fast.study.drop_test.timestep_fraction
    assert (drop.fidelity.speed_factor, drop.fidelity.ranks) == (1.0, 1)
    materials, media = fast.study.materials, fast.study.media.material
    plate = materials[fast.study.workpiece.material]
    physical = effective_modulus(materials[media], plate, 1.0)
    assert drop.contact_moduli["workpiece"].modulus_pa == pytest.approx(physical)


def test_the_filling_states_its_own_step_and_no_speed(fast: Any) -> None:
    filling = filling_scene(fast).case.fidelity
    assert filling.timestep_fraction == 0.3
    assert (filling.youngs_modulus_scale, filling.speed_factor) == (0.01, 1.0)


def test_the_process_states_what_was_chosen(fast: Any) -> None:
    process = PROCESS.build(fast, expected_bed(fast.study)).case.fidelity
    assert (process.youngs_modulus_scale, process.timestep_fraction) == (0.01, 0.5)
    assert (process.speed_factor, process.ranks) == (4.0, 2)
