"""Laws of removal, and what a study may say of them."""

import json
import math
from difflib import ndiff
from typing import Any

import numpy as np
import pytest
from made_study import Load
from paths import ROOT

from dragdeck.decks.render import deck_text
from dragdeck.decks.templates import environment
from dragdeck.errors import InputError
from dragdeck.scenes.process import PROCESS
from dragdeck.study.removal import LAWS, Removal, Wearing

TRIAL = {"mass_loss_kg": 2e-5, "time_s": 3600, "sd_kg": 2e-6}


def one(angle_deg: float, speed_m_s: float, radius_m: float = 163e-6) -> Wearing:
    """An impact of a particle of 2 mg."""
    angle = math.radians(angle_deg)
    numbers = (0.0, 2e-6, radius_m, speed_m_s * math.sin(angle), speed_m_s * math.cos(angle))
    return Wearing(*(np.array([number]) for number in numbers))


OKA = Removal(law="oka", coefficient_m2_n=1e-12, hardness_pa=2e9)
SINE_30 = 0.5 ** (0.71 * 2**0.14) * 2.0 ** (2.4 * 2**-0.94)


@pytest.mark.parametrize(
    ("law", "angle", "speed", "expected"),
    [
        ("finnie", 10.0, 0.5, 2e-6 * 0.25 * (math.sin(math.radians(20)) - 3 * 0.030153689607)),
        ("finnie", 60.0, 0.5, 2e-6 * 0.25 * 0.25 / 3),
        ("finnie", 90.0, 0.5, 0.0),
        ("oka", 90.0, 104.0, 2e-6 * 104.0**2),
        ("oka", 30.0, 104.0, 2e-6 * 104.0**2 * SINE_30),
        ("oka", 90.0, 1.04, 2e-6 * 104.0**2 * 0.01 ** (2.3 * 2**0.038)),
    ],
)
def test_an_impact_has_the_action_of_its_law(
    law: str, angle: float, speed: float, expected: float
) -> None:
    found = LAWS[law].action(one(angle, speed), OKA)
    assert found[0] == pytest.approx(expected, rel=1e-6, abs=1e-22)


def test_oka_depends_on_the_diameter_as_published() -> None:
    small, large = (LAWS["oka"].action(one(90, 10, r), OKA)[0] for r in (1e-4, 2e-4))
    assert large / small == pytest.approx(2**0.19)


def test_finnie_is_continuous_and_a_leaving_particle_removes_nothing() -> None:
    edge = math.degrees(math.atan(1 / 3))
    below, above = (LAWS["finnie"].action(one(edge + d, 1.0), OKA)[0] for d in (-1e-7, 1e-7))
    assert below == pytest.approx(above, rel=1e-6)
    for law in ("finnie", "oka"):
        assert LAWS[law].action(one(-20.0, 1.0), OKA)[0] == 0.0


REFUSED = [
    ({"law": "archad", "coefficient_m2_n": 1e-15}, "no such law 'archad'.*archard"),
    ({"law": "archard"}, "either coefficient_m2_n, or calibrate"),
    ({"coefficient_m2_n": 1e-15, "calibrate": TRIAL}, "either coefficient_m2_n, or calibrate"),
    ({"coefficient_m2_n": 0}, "removal.coefficient_m2_n.*greater than 0"),
    ({"coefficient_m2_n": 1e-15, "sd_m2_n": 6e-16}, "sd_m2_n 6e-16 is half"),
    ({"calibrate": TRIAL, "sd_m2_n": 1e-16}, "sd_m2_n belongs to"),
    ({"calibrate": TRIAL | {"mass_loss_kg": 0}}, "mass_loss_kg.*greater than 0"),
    ({"calibrate": TRIAL | {"mass_loss_kg": -1e-5}}, "mass_loss_kg.*greater than 0"),
    ({"calibrate": TRIAL | {"sd_kg": 0}}, "sd_kg.*greater than 0"),
    ({"calibrate": TRIAL | {"time_s": 0}}, "time_s.*greater than 0"),
    ({"calibrate": TRIAL | {"sd_kg": 1e-5}}, "include zero"),
    ({"calibrate": []}, "removal.calibrate.*0 entries"),
    ({"calibrate": [TRIAL, TRIAL | {"time_s": ".nan"}]}, "removal.calibrate.1.time_s"),
    ({"law": "archard+oka", "calibrate": TRIAL, "hardness_pa": 2e9}, "impact_ratio is missing"),
    ({"law": "oka+finnie", "calibrate": TRIAL}, "one law of sliding and one of impact"),
    ({"law": "archard+archard", "calibrate": TRIAL}, "one law of sliding and one of impact"),
    ({"calibrate": TRIAL, "impact_ratio": 2.0}, "impact_ratio has no meaning"),
    ({"law": "oka", "calibrate": TRIAL}, "hardness_pa is missing"),
    ({"law": "finnie", "calibrate": TRIAL}, "removal.law.*no run writes them"),
    ({"calibrate": TRIAL | {"mass_loss_kg": 20, "sd_kg": 1}}, "did you mean 20 g"),
]


@pytest.mark.parametrize(("block", "message"), REFUSED)
def test_a_removal_that_cannot_be_is_refused(
    load: Load, block: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=f"(?s){message}"):
        load({"removal": block})


def test_a_tolerance_is_of_removal_by_sliding_alone(load: Load) -> None:
    law = {"law": "archard+finnie", "impact_ratio": 2.0, "coefficient_m2_n": 1e-15}
    study = {"fidelity": {"tolerance": 0.2, "quantity": ["force_slide"]},
             "outputs.first_touch_fraction": 0.1}  # fmt: skip
    with pytest.raises(InputError, match="a tolerance cannot be used here"):  # without the advisor
        load(study | {"removal": {"coefficient_m2_n": 1e-15}})
    with pytest.raises(InputError, match=r"(?s)fidelity\.quantity.*archard\+finnie"):
        load(study | {"removal": law})


@pytest.mark.parametrize(
    "several", [{"sweep": {"motion.speed_m_s": [0.01, 0.02]}}, {"workpieces": {"count": 2}}]
)
def test_a_trial_is_of_one_process(load: Load, several: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=r"(?s)removal.calibrate.*one process"):
        load(several | {"removal": {"calibrate": TRIAL}})


def test_no_run_depends_on_removal_but_its_case_says_it(load: Load) -> None:
    (plain,), (asked,) = load(), load({"removal": {"calibrate": TRIAL}})
    assert PROCESS.run_id(plain) == PROCESS.run_id(asked)
    assert PROCESS.digest(plain) != PROCESS.digest(asked)
    whole = json.loads(PROCESS.build(asked, None).case.as_text())
    assert whole["study"]["removal"]["calibrate"] == [TRIAL]
    assert "removal" not in json.loads(PROCESS.build(plain, None).case.as_text())


def test_first_touches_add_to_the_input_script_and_change_nothing_else(load: Load) -> None:
    (plain,), (asked,) = load(), load({"outputs.first_touch_fraction": 0.1})
    scenes = [PROCESS.build(case, None) for case in (plain, asked)]
    texts = [deck_text(scene, environment(ROOT / "templates")) for scene in scenes]
    added = [line for line in ndiff(*map(str.splitlines, texts)) if line[0] in "+-"]
    assert all("touch" in one or "# Run:" in one or "only particles" in one or "next step" in one
               or one == "+ " for one in added)  # fmt: skip
    assert sum("dump write_touch" in one for one in added) == 2, added
    drag = next(phase for phase in scenes[1].case.phases if phase.name == "drag")
    last = scenes[1].deck.outputs[-1]
    assert last.last_step == drag.end_step
    part = (drag.end_step - last.first_step) / (drag.end_step - drag.start_step)
    assert part == pytest.approx(0.1, abs=1e-3)
