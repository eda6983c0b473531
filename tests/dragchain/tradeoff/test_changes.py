"""Softness by itself, and gains, on measures whose effects are known."""

import math
from pathlib import Path

import numpy as np
import pytest
from tradeoff_files import (
    BOTH,
    COARSE,
    REFERENCE,
    SOFT,
    SOFTNESS,
    WITHIN,
    contents,
    made,
    measures,
    point_of,
)

from dragchain.tradeoff.changes import gains, hub, softness, softness_by_level, speed_up
from dragchain.tradeoff.compare import Setting
from dragchain.tradeoff.outcome import Tradeoff


def test_softness_alone_and_mixed_with_a_step(tmp_path: Path) -> None:
    tradeoff = made(tmp_path / "all", contents())
    alone = softness(tradeoff, tradeoff.comparisons["contact_force_mean"], 0.01)
    assert alone is not None and alone.mixed == "" and alone.effect == "ruined"
    kept = softness(tradeoff, tradeoff.comparisons["workpiece_contacts"], 0.01)
    assert kept is not None and kept.effect == "kept"
    confounded = [one for one in contents() if point_of(one) in (REFERENCE, BOTH)]
    tradeoff = made(tmp_path / "few", confounded)
    mixed = softness(tradeoff, tradeoff.comparisons["contact_force_mean"], 0.01)
    assert mixed is not None and mixed.mixed == str(Setting(*BOTH))
    assert mixed.error.value == pytest.approx(-0.3, abs=WITHIN)


def test_gains_alone_and_together(tradeoff: Tradeoff) -> None:
    found = {(gain.base, gain.setting): gain for gain in gains(tradeoff)}
    reference = Setting(*REFERENCE)
    assert found[reference, Setting(*SOFT)].speed_up.value == pytest.approx(10.0)
    together = found[reference, Setting(*BOTH)]
    assert together.product == pytest.approx(25.0) and together.speed_up.value == pytest.approx(20)
    assert math.isnan(found[reference, Setting(*COARSE)].product)


def test_what_is_no_parameter_is_held_against_the_same_without_it(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    inputs = {"bowl.facet_size_m": 0.005}
    faceted = [
        measures(COARSE, seed, rng, effects=SOFTNESS, cpu_time_s=60.0, inputs=inputs)
        for seed in (1, 2, 3)
    ]
    tradeoff = made(tmp_path, contents() + faceted)
    (gain,) = (one for one in gains(tradeoff) if one.factors == ["other"])
    assert gain.base == Setting(*COARSE) and gain.setting.other == "bowl.facet_size_m 0.005"
    assert gain.errors["contact_force_mean"].value == pytest.approx(-0.3, abs=WITHIN)
    assert gain.speed_up.value == pytest.approx(40.0 / 60.0)


def test_the_hub_is_the_setting_most_others_are_near_to(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    near = [(0.1, 0.5, 1.0), (0.01, 0.8, 1.0), (0.01, 0.5, 5.0), BOTH, BOTH]
    found = contents() + [measures(point, 4, rng) for point in near]
    assert hub(made(tmp_path, found)) == Setting(*BOTH)


def test_a_gain_has_an_interval_from_the_scatter_of_costs(tmp_path: Path) -> None:
    found = contents()
    for content, cost in zip(found[:2], (90.0, 110.0), strict=True):
        content["cost"]["cpu_time_s"] = cost
    tradeoff = made(tmp_path, found)
    gain = speed_up(tradeoff, Setting(*SOFT), tradeoff.reference)
    assert gain.value == pytest.approx(10.0) and gain.ci95_low < gain.value < gain.ci95_high


def test_softness_ruins_what_it_was_made_to_ruin(tmp_path: Path) -> None:
    ((level, found),) = softness_by_level(made(tmp_path, contents())).items()
    assert level == 0.01
    effects = {name: one.effect for name, one in found.items() if one}
    assert effects["contact_force_mean"] == effects["lateral_mean"] == "ruined"
    assert effects["workpiece_contacts"] == effects["bed_height"] == "kept"
