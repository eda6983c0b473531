"""Larger particles in the same scene: their sizes and number, and the gap that they need."""

from typing import Any

import pytest
from made_study import Made

from dragdeck.cases.bed import bed_volume, expected_surface
from dragdeck.errors import InputError
from dragdeck.scenes.fit import LEAST_GAP, ROOM_BELOW, ROOM_BESIDE, clearances, in_diameters
from dragdeck.scenes.process import PROCESS, process_scene
from dragdeck.scenes.process_cautions import process_cautions

ROOMY: dict[str, Any] = {
    "media.radius_mean_m": 1.5e-3, "media.radius_std_m": 1e-4, "media.count": 4000,
    "bowl.radius_m": 0.03,
}  # fmt: skip
"""A gap of 16 mm beside the workpiece, 5.3 diameters."""

TWO = {"shape": None, "radius_std_m": 0.0, "material": "ceramic"}
CLASSES: dict[str, Any] = {
    "media": {"mass_kg": 0.1, "count": None, "radius_mean_m": None, "radius_std_m": 0.0,
              "material": None, "classes": {
                  "fine": {**TWO, "fraction": 0.5, "radius_mean_m": 1.2e-3},
                  "coarse": {**TWO, "fraction": 0.5,
                             "sieve": [[0.002, 0.0], [0.003, 0.4], [0.004, 1.0]]}}},
    "bowl.radius_m": 0.03,
}  # fmt: skip


def test_sizes_grow_and_the_volume_stays(made: Made) -> None:
    true = made(ROOMY)
    case = made({"reduction": {"coarser": 1.5}})
    media, before = case.study.media, true.study.media
    assert media.radius_mean_m == pytest.approx(1.5 * 1.5e-3)
    assert media.radius_std_m == pytest.approx(1.5e-4)
    assert media.count == round(4000 / 1.5**3)
    assert bed_volume(case.study) == pytest.approx(bed_volume(true.study), rel=1e-3)
    assert case.study.motion == true.study.motion and case.study.bowl == true.study.bowl
    assert case.written.media == before
    assert PROCESS.run_id(case) != PROCESS.run_id(true)
    assert any(entry.field == "reduction.coarser" for entry in process_scene(case).case.assumptions)


def test_every_class_and_sieve_grows(made: Made) -> None:
    true = made(CLASSES)
    case = made({"reduction": {"coarser": 1.3}})
    fine, coarse = case.study.media.classes.values()
    assert fine.radius_mean_m == pytest.approx(1.3 * 1.2e-3)
    assert coarse.sieve is not None and coarse.sieve[2].diameter_m == pytest.approx(1.3 * 0.004)
    assert case.study.particle_count == pytest.approx(true.study.particle_count / 1.3**3, rel=0.01)
    assert expected_surface(case.study) == pytest.approx(expected_surface(true.study), rel=0.02)


def test_a_factor_of_one_is_the_true_size(made: Made) -> None:
    true = PROCESS.run_id(made(ROOMY))
    same = made({"reduction": {"coarser": 1}})
    assert PROCESS.run_id(same) == true and not same.study.assumptions


def test_the_gap_holds_enough_of_the_larger_particles(made: Made) -> None:
    largest = 16e-3 / 3e-3 / LEAST_GAP
    made({**ROOMY, "reduction": {"coarser": 0.98 * largest}})
    with pytest.raises(InputError) as refused:
        made({"reduction": {"coarser": 1.03 * largest}})
    assert refused.value.field == "reduction.coarser" and refused.value.file


@pytest.mark.parametrize("enough", [True, False])
@pytest.mark.parametrize(
    ("limiting", "bowl_m", "count"), [("beside", 0.03, 20_000), ("below", 0.04, 20_000)]
)
def test_little_room_for_larger_particles_is_said(
    made: Made, limiting: str, bowl_m: float, count: int, *, enough: bool
) -> None:
    scene = {"media.radius_mean_m": 1e-3, "media.count": count, "bowl.radius_m": bowl_m}
    true = made(scene)
    gaps = clearances(true, expected_surface(true.study))
    largest = {
        "beside": in_diameters(true, gaps.wall_m) / ROOM_BESIDE,
        "below": in_diameters(true, gaps.floor_m) / ROOM_BELOW,
    }
    assert min(largest, key=lambda side: largest[side]) == limiting
    case = made({**scene, "reduction": {"coarser": largest[limiting] * (0.95 if enough else 1.05)}})
    said = [caution for caution in process_cautions(case) if "reduction.coarser" in str(caution)]
    assert (not said) == enough
