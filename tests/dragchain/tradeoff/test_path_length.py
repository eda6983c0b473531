"""What a run knows along its path, on measures whose effects are known."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tradeoff_files import REFERENCE, SOFT, contents, made, measures

from dragchain.tradeoff.compare import compare_quantity
from dragchain.tradeoff.outcome import Tradeoff
from dragchain.tradeoff.path_length import along, reaches


def test_reach_falls_with_the_root_of_the_path(tradeoff: Tradeoff) -> None:
    (reach,) = (one for one in reaches(tradeoff) if one.quantity.name == "drag_mean")
    assert reach.at(4.0 * reach.arc_m) == pytest.approx(0.5 * reach.halfwidth)
    assert reach.at(reach.path_m(0.05)) == pytest.approx(0.05)
    assert reach.seeds(reach.halfwidth / 2.01) == 5
    assert "bed_height" not in [one.quantity.name for one in reaches(tradeoff)]


def test_a_drift_along_the_path_is_seen(tmp_path: Path) -> None:
    found = contents(noise=0.01)
    growth = 1.0 + 0.05 * np.arange(8)
    for content in found:
        blocks = content["blocks"]
        blocks["workpiece_contacts"] = list(growth * blocks["workpiece_contacts"])
        blocks["drag_std"] = list(growth**2 * blocks["drag_std"])
        blocks["lateral_mean"] = list(2.6 * growth + blocks["lateral_mean"])
    tradeoff = made(tmp_path, found)
    seen = {name: along(tradeoff, own.quantity) for name, own in tradeoff.comparisons.items()}
    for name, drift in (
        ("drag_mean", 0.0),
        ("workpiece_contacts", 0.2 / 1.175),
        ("drag_std", (math.sqrt(1.275**2 + 0.0031) - math.sqrt(1.075**2 + 0.0031)) / 1.18),
        ("lateral_mean", 0.2),
    ):
        own = seen[name]
        assert own is not None and own.runs == len(found)
        assert own.drift == pytest.approx(drift, abs=0.02)
        assert (own.drift > own.drift_halfwidth) == (drift > 0.0)


def coverage(tradeoff: Tradeoff, trials: int = 60) -> float:
    """How often an interval of the mean drag holds the truth in simulated runs without effects.

    The runs have the settings, beds and scatter of the trade-off and are compared as it was.
    """
    own = tradeoff.comparisons["drag_mean"]
    beds = list(dict.fromkeys(run.bed for run in tradeoff.runs))
    number = [beds.index(run.bed) for run in tradeoff.runs for _ in run.stretches]
    rng = np.random.default_rng(0)
    held: list[bool] = []
    for _ in range(trials):
        scatter = math.sqrt(own.bed_fraction) * rng.standard_normal(len(beds))[number]
        scatter += math.sqrt(1.0 - own.bed_fraction) * rng.standard_normal(len(number))
        values = iter(np.exp(own.run_std * scatter).tolist())
        again = []
        for run in tradeoff.runs:
            stretches = [{"drag_mean": next(values)} for _ in run.stretches]
            again.append(replace(run, stretches=stretches))
        errors = compare_quantity(own.quantity, again, tradeoff.reference).errors
        held += [
            not error.significant for one, error in errors.items() if one != tradeoff.reference
        ]
    return float(np.mean(held))


def test_intervals_hold_the_truth_in_simulations(tradeoff: Tradeoff) -> None:
    assert 0.85 < coverage(tradeoff) < 1.0


def test_long_runs_do_not_change_how_often_an_interval_holds_the_truth(tmp_path: Path) -> None:
    rng = np.random.default_rng(13)
    found = [measures(REFERENCE, seed, rng) for seed in (1, 2, 3, 4)]
    found += [measures(SOFT, seed, rng, blocks=17) for seed in (1, 2, 3, 4)]
    assert 0.85 <= coverage(made(tmp_path, found)) <= 1.0
