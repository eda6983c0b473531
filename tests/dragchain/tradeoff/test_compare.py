"""The comparison of a trade-off on measures whose effects are known."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tradeoff_files import (
    BLOCK_M,
    BOTH,
    COARSE,
    FAILURE,
    FAST,
    REFERENCE,
    SOFT,
    SOFTNESS,
    VALUES,
    WITHIN,
    contents,
    made,
    measures,
    point_of,
    write,
)

from dragchain.errors import TableError
from dragchain.statistics.estimate import student_quantile
from dragchain.tradeoff.compare import Setting, read_plan_runs
from dragchain.tradeoff.outcome import Tradeoff, breaks, by_modulus, choose
from dragchain.tradeoff.report import errors_by_setting, run_table
from dragdeck.errors import DocumentError


def test_a_known_effect_is_found_and_resolved(tradeoff: Tradeoff) -> None:
    error = tradeoff.comparisons["drag_mean"].errors[Setting(*SOFT)]
    assert error.value == pytest.approx(0.1, abs=WITHIN) and error.significant
    # 13 runs less 4 combinations, less 4 packings that they share but one: 6 degrees of freedom
    half = student_quantile(6) * error.se / (1.0 + error.value)
    ends = [math.log1p(end) for end in (error.ci95_low, error.value, error.ci95_high)]
    assert np.diff(ends) == pytest.approx([half, half])
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
    assert choose(tradeoff, "workpiece_contacts", 0.05).setting == Setting(*BOTH)
    assert choose(tradeoff, "drag_mean", 0.05).setting == Setting(*COARSE)
    assert choose(tradeoff, "drag_mean", 0.2).setting == Setting(*BOTH)
    assert choose(tradeoff, "drag_mean", 1e-6).setting is None


def test_a_tolerance_is_compared_with_the_bound(tradeoff: Tradeoff) -> None:
    error, bound = (
        getattr(tradeoff.comparisons["drag_mean"].errors[Setting(*COARSE)], name)
        for name in ("value", "bound")
    )
    between = 0.5 * (abs(error) + bound)
    assert choose(tradeoff, "drag_mean", between).setting is None
    assert choose(tradeoff, "drag_mean", bound).setting == Setting(*COARSE)
    choice = choose(tradeoff, "drag_mean", between)
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
    assert choose(tradeoff, "workpiece_contacts", 0.2).setting == Setting(*SOFT)
    table = run_table(tradeoff)
    assert table["failure"].tolist()[-1] == "no particle lost: 12"
    assert table["complete"].sum() == len(found) - 1
    assert math.isnan(table["drag_mean"].iloc[-1])


def test_a_setting_that_only_failed_has_no_errors(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    found = contents() + [measures(FAST, seed, rng, failure=FAILURE) for seed in (1, 2)]
    tradeoff = made(tmp_path, found)
    assert Setting(*FAST) in tradeoff.settings()
    assert all(Setting(*FAST) not in own.errors for own in tradeoff.comparisons.values())
    assert not (errors_by_setting(tradeoff)["speed_factor"] == 5.0).any()


def written(folder: Path, content: list[dict[str, Any]]) -> Any:
    """Runs, reference and path of measures that were written; the first is the reference."""
    files = write(folder, content)
    return read_plan_runs(files, files[0].parents[1])


def test_the_longest_of_runs_that_differ_in_path_counts(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    long = [measures(REFERENCE, seed, rng, blocks=16) for seed in (1, 2)]
    runs, _, arc_m = written(tmp_path, contents() + long)
    own = [run for run in runs if run.setting == Setting(*REFERENCE)]
    lengths = sorted(run.measures.arc_m / BLOCK_M for run in own)
    assert lengths == pytest.approx([8, 8, 16, 16])
    assert arc_m == pytest.approx(8 * BLOCK_M)
    first = next(run for run in own if run.measures.bed == "bed-1")
    assert first.stretches[0]["drag_mean"] == np.mean(first.measures.blocks["drag_mean"][:8])


def test_a_quantity_that_is_missing_or_changes_sign_is_skipped(tmp_path: Path) -> None:
    found = contents()
    for content in found:
        content["blocks"]["chain_length"] = []
    found[1]["blocks"]["chain_count"] = [-1.0] * 8
    tradeoff = made(tmp_path, found)
    assert set(tradeoff.skipped) == {"chain_length", "chain_count"}
    assert "no run at the reference" in tradeoff.skipped["chain_length"]
    assert "changes its sign" in tradeoff.skipped["chain_count"]


def test_every_combination_has_an_error_of_its_own(tmp_path: Path) -> None:
    found = contents()
    for content in found:
        fidelity = content["fidelity"]
        if (fidelity["youngs_modulus_scale"], fidelity["timestep_fraction"]) == BOTH[:2]:
            content["blocks"]["workpiece_contacts"] = [
                2 * n for n in content["blocks"]["workpiece_contacts"]
            ]
    own = made(tmp_path, found).comparisons["workpiece_contacts"]
    assert own.errors[Setting(*BOTH)].value == pytest.approx(1.0, abs=2.0 * WITHIN)
    assert abs(own.errors[Setting(*SOFT)].value) < 0.1


def test_parameters_that_were_never_turned_alone_are_not_told_apart(
    tradeoff: Tradeoff, tmp_path: Path
) -> None:
    """A modulus stands for itself, or with as little else as was run."""
    assert by_modulus(tradeoff) == [Setting(*SOFT)]
    mixed = [one for one in contents() if point_of(one) in (REFERENCE, BOTH)]
    confounded = made(tmp_path / "few", mixed)
    own = confounded.comparisons["drag_mean"]
    assert not own.factors.additive
    assert own.errors[Setting(*BOTH)].value == pytest.approx(0.1, abs=WITHIN)
    assert by_modulus(confounded) == [Setting(*BOTH)]


def test_a_step_that_changes_the_drag_breaks(tmp_path: Path) -> None:
    found = contents()
    for content in found:
        if point_of(content) == COARSE:
            content["blocks"]["drag_mean"] = [0.8 * n for n in content["blocks"]["drag_mean"]]
    tradeoff = made(tmp_path, found)
    assert breaks(tradeoff, Setting(*COARSE))
    assert not breaks(tradeoff, Setting(*SOFT)) and not breaks(tradeoff, Setting(*REFERENCE))
    assert choose(tradeoff, "workpiece_contacts", 0.5).setting != Setting(*COARSE)


def test_files_that_cannot_be_used_are_refused(tmp_path: Path) -> None:
    found = contents()
    files = write(tmp_path / "a", found)
    with pytest.raises(TableError, match="reference is not among"):
        read_plan_runs(files, tmp_path)
    found[0]["schema"] = 99
    with pytest.raises(DocumentError, match=r"schema: .*another version"):
        read_plan_runs(write(tmp_path / "b", found), tmp_path)
    rng = np.random.default_rng(1)
    with pytest.raises(TableError, match="no run of the trade-off is complete"):
        written(tmp_path / "c", [measures(REFERENCE, 1, rng, failure=FAILURE)])


def test_a_run_twice_as_long_counts_as_two_of_its_bed(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    found = [measures(REFERENCE, seed, rng) for seed in (1, 2, 3)]
    found += [measures(SOFT, seed, rng, effects=SOFTNESS, blocks=17) for seed in (1, 2, 3)]
    runs, _, _ = written(tmp_path, found)
    long = [run for run in runs if run.setting == Setting(*SOFT)]
    assert [len(run.stretches) for run in runs if run not in long] == [1, 1, 1]
    assert [len(run.stretches) for run in long] == [2, 2, 2]
    second = np.mean(long[0].measures.blocks["drag_mean"][8:16])
    assert long[0].stretches[1]["drag_mean"] == pytest.approx(second)
    assert "bed_height" not in long[0].stretches[1]


def test_what_is_written_is_no_setting(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    found = [measures(REFERENCE, 1, rng, study={"outputs.network_hz": 20.0})]
    found += [measures(REFERENCE, 2, rng, study={"outputs.network_hz": 100.0})]
    runs, reference, _ = written(tmp_path, found)
    assert {run.setting for run in runs} == {reference}
