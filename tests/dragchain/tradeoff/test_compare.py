"""The comparison of a trade on measures whose effects are known."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tradeoff_files import BLOCK_M, VALUES, measures, write
from tradeoff_runs import BOTH, COARSE, FAILURE, FAST, REFERENCE, SOFT, SOFTNESS, contents

from dragchain.errors import TableError
from dragchain.tradeoff.compare import (
    Setting,
    Tradeoff,
    along,
    breaks,
    compare,
    error_table,
    largest_bound,
    read_runs,
    recommend,
    run_table,
)
from dragchain.tradeoff.findings import (
    choose,
    coverage,
    exceedance,
    gains,
    hub,
    reaches,
    softness,
    speed_up,
)


def made(folder: Path, found: list[dict[str, Any]]) -> Tradeoff:
    files = write(folder, found)
    return compare(*read_runs(files, files[0].parent))


@pytest.fixture
def tradeoff(tmp_path: Path) -> Tradeoff:
    return made(tmp_path, contents())


WITHIN = 0.03
"""Over four standard errors of a difference here, 3 % / sqrt(8 blocks) / sqrt(3 or so pairs)."""


def test_a_known_effect_is_found_and_resolved(tradeoff: Tradeoff) -> None:
    error = tradeoff.comparisons["drag_mean"].errors[Setting(*SOFT)]
    assert error.value == pytest.approx(0.1, abs=WITHIN) and error.significant
    assert error.ci95_low < error.value < error.ci95_high < error.ci95_low + 2.0 * WITHIN
    assert tradeoff.comparisons["drag_mean"].reference == pytest.approx(
        VALUES["drag_mean"], rel=0.03
    )
    assert tradeoff.comparisons["drag_std"].reference == pytest.approx(VALUES["drag_std"], rel=0.03)


def test_no_effect_is_not_resolved_and_its_bound_holds_the_interval(tradeoff: Tradeoff) -> None:
    error = tradeoff.comparisons["workpiece_contacts"].errors[Setting(*SOFT)]
    assert not error.significant and error.ci95_low < 0.0 < error.ci95_high
    assert abs(error.value) < error.bound <= max(-error.ci95_low, error.ci95_high)


def test_the_reference_has_no_error(tradeoff: Tradeoff) -> None:
    error = tradeoff.comparisons["drag_mean"].errors[tradeoff.reference]
    assert (error.value, error.bound, error.significant) == (0.0, 0.0, False)


def test_a_signed_quantity_counts_in_mean_drags(tradeoff: Tradeoff) -> None:
    own = tradeoff.comparisons["lateral_mean"]
    error = own.errors[Setting(*SOFT)]
    assert error.value == pytest.approx(SOFTNESS["lateral_mean"], abs=WITHIN) and error.significant
    assert own.reference == pytest.approx(VALUES["lateral_mean"], abs=0.05 * 2.6)


def test_costs_and_the_certified_choice(tradeoff: Tradeoff) -> None:
    assert tradeoff.cost(Setting(*SOFT)) == pytest.approx(0.1)
    assert recommend(tradeoff, "workpiece_contacts", 0.05) == Setting(*BOTH)
    assert recommend(tradeoff, "drag_mean", 0.05) == Setting(*COARSE)
    assert recommend(tradeoff, "drag_mean", 0.2) == Setting(*BOTH)
    assert recommend(tradeoff, "drag_mean", 1e-6) is None
    assert recommend(tradeoff, "no such quantity", 1.0) is None
    assert recommend(tradeoff, ["workpiece_contacts", "drag_mean"], 0.05) == Setting(*COARSE)


def test_a_tolerance_is_compared_with_the_bound(tradeoff: Tradeoff) -> None:
    bound = largest_bound(tradeoff, ["drag_mean"], Setting(*COARSE))
    error = tradeoff.comparisons["drag_mean"].errors[Setting(*COARSE)].value
    between = 0.5 * (abs(error) + bound)
    assert recommend(tradeoff, "drag_mean", between) is None
    assert recommend(tradeoff, "drag_mean", bound) == Setting(*COARSE)
    choice = choose(tradeoff, ["drag_mean"], between)
    assert choice.setting is None and choice.nearest == Setting(*COARSE)
    assert choice.bound == bound


def test_a_setting_with_one_run_or_a_failed_one_is_not_offered(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    found = [
        *contents(),
        measures((0.1, 0.2, 1.0), 1, rng, cpu_time_s=1.0),
        measures(BOTH, 4, rng, cpu_time_s=5.0, failure=FAILURE),
    ]
    tradeoff = made(tmp_path, found)
    assert recommend(tradeoff, "workpiece_contacts", 0.2) == Setting(*SOFT)
    table = run_table(tradeoff)
    assert table["failure"].tolist()[-1] == "every particle kept: 12 particles"
    assert table["complete"].sum() == len(found) - 1
    assert math.isnan(table["drag_mean"].iloc[-1])


def test_a_setting_that_only_failed_has_no_errors(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    found = contents() + [measures(FAST, seed, rng, failure=FAILURE) for seed in (1, 2)]
    tradeoff = made(tmp_path, found)
    assert Setting(*FAST) in tradeoff.settings()
    assert all(Setting(*FAST) not in own.errors for own in tradeoff.comparisons.values())
    assert not (error_table(tradeoff)["speed_factor"] == 5.0).any()


def test_the_longest_of_runs_that_differ_in_path_counts(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    long = [measures(REFERENCE, seed, rng, blocks=16) for seed in (1, 2)]
    files = write(tmp_path, contents() + long)
    runs, _, arc_m = read_runs(files, files[0].parent)
    own = [run for run in runs if run.setting == Setting(*REFERENCE)]
    lengths = sorted(run.measures["arc_m"] / BLOCK_M for run in own)
    assert lengths == pytest.approx([8, 8, 16, 16])
    assert arc_m == pytest.approx(8 * BLOCK_M)
    first = next(run for run in own if run.bed == "bed-1")
    assert first.values["drag_mean"] == np.mean(first.measures["blocks"]["drag_mean"][:8])


def test_a_quantity_that_is_missing_or_changes_sign_is_skipped(tmp_path: Path) -> None:
    found = contents()
    for content in found:
        content["blocks"]["chain_length"] = []
    found[1]["blocks"]["chain_count"] = [-1.0] * 8
    tradeoff = made(tmp_path, found)
    assert set(tradeoff.skipped) == {"chain_length", "chain_count"}
    assert "no run at the reference" in tradeoff.skipped["chain_length"]
    assert "changes its sign" in tradeoff.skipped["chain_count"]
    assert recommend(tradeoff, "chain_length", 1.0) is None


def test_a_combination_that_breaks_additivity_gets_an_error_of_its_own(tmp_path: Path) -> None:
    found = contents()
    for content in found:
        fidelity = content["fidelity"]
        if (fidelity["youngs_modulus_scale"], fidelity["timestep_fraction"]) == BOTH[:2]:
            content["blocks"]["workpiece_contacts"] = [
                2 * n for n in content["blocks"]["workpiece_contacts"]
            ]
    own = made(tmp_path, found).comparisons["workpiece_contacts"]
    assert own.additive and own.additivity < 0.05 and own.apart == [Setting(*BOTH)]
    assert own.errors[Setting(*BOTH)].value == pytest.approx(1.0, abs=2.0 * WITHIN)
    assert abs(own.errors[Setting(*SOFT)].value) < 0.1


def test_parameters_that_were_never_turned_alone_are_not_told_apart(tmp_path: Path) -> None:
    mixed = [one for one in contents() if _point(one) in (REFERENCE, BOTH)]
    own = made(tmp_path, mixed).comparisons["drag_mean"]
    assert not own.additive and math.isnan(own.additivity)
    assert own.errors[Setting(*BOTH)].value == pytest.approx(0.1, abs=WITHIN)


def test_a_step_that_changes_the_drag_breaks(tmp_path: Path) -> None:
    found = contents()
    for content in found:
        if _point(content) == COARSE:
            content["blocks"]["drag_mean"] = [0.8 * n for n in content["blocks"]["drag_mean"]]
    tradeoff = made(tmp_path, found)
    assert breaks(tradeoff, Setting(*COARSE))
    assert not breaks(tradeoff, Setting(*SOFT)) and not breaks(tradeoff, Setting(*REFERENCE))
    assert recommend(tradeoff, "workpiece_contacts", 0.5) != Setting(*COARSE)


def test_softness_alone_and_mixed_with_a_step(tmp_path: Path) -> None:
    tradeoff = made(tmp_path / "all", contents())
    alone = softness(tradeoff, tradeoff.comparisons["contact_force_mean"], 0.01)
    assert alone is not None and alone.mixed == "" and alone.verdict == "ruined"
    kept = softness(tradeoff, tradeoff.comparisons["workpiece_contacts"], 0.01)
    assert kept is not None and kept.verdict == "kept"
    confounded = [one for one in contents() if _point(one) in (REFERENCE, BOTH)]
    tradeoff = made(tmp_path / "few", confounded)
    mixed = softness(tradeoff, tradeoff.comparisons["contact_force_mean"], 0.01)
    assert mixed is not None and mixed.mixed == str(Setting(*BOTH))
    assert mixed.error.value == pytest.approx(-0.3, abs=WITHIN)


def _point(content: dict[str, Any]) -> tuple[float, ...]:
    fidelity = content["fidelity"]
    return tuple(
        fidelity[name] for name in ("youngs_modulus_scale", "timestep_fraction", "speed_factor")
    )


def test_gains_alone_and_together(tradeoff: Tradeoff) -> None:
    found = {(gain.base, gain.setting): gain for gain in gains(tradeoff)}
    reference = Setting(*REFERENCE)
    assert found[reference, Setting(*SOFT)].speed_up.ratio == pytest.approx(10.0)
    together = found[reference, Setting(*BOTH)]
    assert together.product == pytest.approx(25.0) and together.speed_up.ratio == pytest.approx(20)
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
    assert gain.speed_up.ratio == pytest.approx(40.0 / 60.0)


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
    assert gain.ratio == pytest.approx(10.0) and gain.ci95_low < gain.ratio < gain.ci95_high


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


def test_the_share_above_a_force_is_counted_from_above() -> None:
    counts = np.zeros(70, dtype=int)
    counts[[10, 20]] = 3, 1
    force, fraction, mean = exceedance(counts.tolist())
    assert fraction[10] == 1.0 and fraction[11] == 0.25 and fraction[21] == 0.0
    assert mean == pytest.approx((3 * force[10] + force[20]) / 4 * 10**0.05)


def test_the_coverage_of_the_plan_is_found_by_simulation(tradeoff: Tradeoff) -> None:
    found = coverage(tradeoff, "drag_mean", trials=60)
    assert found is not None and 0.85 < found < 1.0
    assert coverage(tradeoff, "drag_mean", trials=60) == found
    assert coverage(tradeoff, "no such quantity", trials=1) is None


def test_files_that_cannot_be_used_are_refused(tmp_path: Path) -> None:
    found = contents()
    files = write(tmp_path / "a", found)
    with pytest.raises(TableError, match="reference is not among"):
        read_runs(files, tmp_path)
    found[0]["schema"] = 99
    with pytest.raises(TableError, match="schema 99"):
        read_runs(write(tmp_path / "b", found), tmp_path)
    rng = np.random.default_rng(1)
    failed = write(tmp_path / "c", [measures(REFERENCE, 1, rng, failure=FAILURE)])
    with pytest.raises(TableError, match="no run of the trade is complete"):
        read_runs(failed, failed[0].parent)


def test_a_run_twice_as_long_counts_as_two_of_its_bed(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    found = [measures(REFERENCE, seed, rng) for seed in (1, 2, 3)]
    found += [measures(SOFT, seed, rng, effects=SOFTNESS, blocks=17) for seed in (1, 2, 3)]
    files = write(tmp_path, found)
    runs, _, _ = read_runs(files, files[0].parent)
    long = [run for run in runs if run.setting == Setting(*SOFT)]
    assert [len(run.stretches) for run in runs if run not in long] == [1, 1, 1]
    assert [len(run.stretches) for run in long] == [2, 2, 2]
    second = np.mean(long[0].measures["blocks"]["drag_mean"][8:16])
    assert long[0].further[0]["drag_mean"] == pytest.approx(second)
    assert "bed_height" not in long[0].further[0]


def test_long_runs_do_not_change_how_often_an_interval_holds_the_truth(tmp_path: Path) -> None:
    rng = np.random.default_rng(13)
    found = [measures(REFERENCE, seed, rng) for seed in (1, 2, 3, 4)]
    found += [measures(SOFT, seed, rng, blocks=17) for seed in (1, 2, 3, 4)]
    held = coverage(made(tmp_path, found), "drag_mean", trials=60)
    assert held is not None and 0.85 <= held <= 1.0


def test_what_is_written_is_no_setting(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    found = [measures(REFERENCE, 1, rng, inputs={"outputs.network_hz": 20.0})]
    found += [measures(REFERENCE, 2, rng, inputs={"outputs.network_hz": 100.0})]
    files = write(tmp_path, found)
    runs, reference, _ = read_runs(files, files[0].parent)
    assert {run.setting for run in runs} == {reference}
