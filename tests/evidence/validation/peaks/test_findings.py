"""Findings on chains that cause peaks, and on chains that do not."""

import math
from dataclasses import replace

import numpy as np
import pytest
from peak_runs import COUNT, findings, made_run

from dragchain.errors import TableError
from evidence.validation.peaks.averages import lifetimes
from evidence.validation.peaks.findings import Findings, study, study_of
from evidence.validation.peaks.lifetimes import lives
from evidence.validation.peaks.runs import averaged, peak_rows, peak_table
from evidence.validation.peaks.settings import SETTINGS, Definition
from evidence.validation.peaks.tests import BuiltIn, PeakTest, near_any
from evidence.validation.peaks.verdicts import judge

pytestmark = pytest.mark.slow  # its data take seconds to make


def verdicts(findings: Findings) -> dict[str, str]:
    return {row.statement: row.verdict for row in findings.statements}


def supported(findings: Findings) -> set[str]:
    free = {row.statement: row.by_definition["free_path"] for row in findings.statements}
    return {statement for statement, judged in free.items() if judged.supported}


def test_chains_that_make_the_peaks_are_found() -> None:
    made = findings(11, 3.0)
    found = verdicts(made)
    assert found["presence"] == found["dominance"] == "confirmed"
    assert {"presence", "dominance", "coverage", "reverse"} <= supported(made)
    assert "orientation" not in supported(made)


def test_chains_that_have_nothing_to_do_with_the_peaks_are_not_found() -> None:
    made = findings(12, 0.0)
    assert not supported(made) and "confirmed" not in verdicts(made).values()


def test_chains_that_weaken_at_peaks_contradict_their_presence() -> None:
    assert verdicts(findings(13, -3.0))["presence"] == "contradicted"


def test_a_chain_that_follows_the_peak_does_not_lead_it() -> None:
    rng = np.random.default_rng(14)
    runs = []
    for _ in range(4):
        run = made_run(rng, 3.0)
        delayed = np.roll(run.chain(0, "bottleneck_over_mean"), 10)
        late = run.chains[0].assign(bottleneck_over_mean=delayed)
        runs.append(replace(run, chains=(late,) * len(SETTINGS)))
    found = study_of(runs, COUNT).findings
    order = next(test for test in found.tests if test.descriptor == "order" and test.default)
    assert order.effect < 0.0 and order.p_claimed > 0.95
    lag = found.lags.curves["free_path"]["bottleneck_over_mean"].peak_lag_s
    assert lag == pytest.approx(0.1, abs=0.03)


def test_slow_peaks_are_not_those_of_a_vibration() -> None:
    time_s = np.arange(0.0, 10.0, 1e-3)
    slow = np.sin(2 * np.pi * time_s / 2.0)
    shaken = slow + 0.8 * np.sin(2 * np.pi * time_s / 3.3e-3)
    found = peak_table(time_s, -averaged(time_s, shaken), time_s[::10], 0.3)
    # what is left of the vibration, 2 %, moves the top of so slow a wave by less than 0.1 s
    assert found["process_time_s"].to_numpy() == pytest.approx([0.5, 2.5, 4.5, 6.5, 8.5], abs=0.1)
    inside = slice(25, -25)
    assert averaged(time_s, slow)[inside] == pytest.approx(slow[inside], abs=0.002)


def test_holm_counts_only_the_claims_at_the_default_thresholds() -> None:
    found = study_of([made_run(np.random.default_rng(15), 1.0)], COUNT).findings
    family = [test for test in found.tests if not math.isnan(test.p_holm)]
    assert all(test.default and test.claim and test.peaks == "all" for test in family)
    assert found.limits.family == len(family) == 40  # no claim of existence: there always is one
    # one packing has no interval over packings
    assert all(math.isnan(test.ci95_low) for test in found.tests)
    again = Findings.model_validate_json(found.as_text(), strict=True)
    assert again.as_text() == found.as_text()


def test_a_built_in_test_alone_proves_nothing() -> None:
    def tests(definition: Definition, built_in: BuiltIn, effect: float, p: float) -> list[PeakTest]:
        return [
            PeakTest(
                peaks="all", definition=definition, thresholds=str(at), default=at == 0,
                statement="dominance", descriptor="fraction", label="fraction", claim=1,
                built_in=built_in, effect=effect, ci95_low=effect - 0.1, ci95_high=effect + 0.1,
                p_claimed=p, p_two_sided=p, p_holm=p,
            )
            for at in range(3)
        ]  # fmt: skip

    held = [*tests("widest_path", "value", 2.0, 1e-3), *tests("free_path", "value", 2.0, 1e-3)]
    row = next(
        one
        for one in judge([*held, *tests("free_path", "none", 0.0, 0.5)])
        if one.statement == "dominance"
    )
    held_by, none = row.by_definition["widest_path"], row.by_definition["peters"]
    assert (held_by.verdict, held_by.supported) == ("not confirmed", True)
    assert held_by.built_in == "value"
    assert row.verdict == "contradicted"
    assert (none.verdict, none.supported, none.tests) == ("not confirmed", False, ())


def test_a_peak_row_ranks_its_chain() -> None:
    run = made_run(np.random.default_rng(16), 3.0)
    table = peak_rows([run])
    assert len(table) == len(run.peaks) * len(SETTINGS)
    first = table.iloc[0]
    strength = run.chain(0, "bottleneck_over_mean")
    assert first["rank"] == pytest.approx((strength < strength[first["frame"]]).mean())


def test_lives_that_are_cut_off_count_as_longer_than_seen() -> None:
    run = made_run(np.random.default_rng(17), 1.0)
    particles = [[1]] * 100 + [[2]] * 20 + [[3]] * 280
    chains = run.chains[0].assign(**vars(lives(particles, run.time_s)))
    found = lifetimes([replace(run, chains=(chains,) * len(SETTINGS))], 0)
    assert found.lives == 3 and found.truncated == 2
    # one known end of three lives: 2/3 last longer, and no median can be told
    assert found.survival.fraction[0] == pytest.approx(2 / 3)
    assert math.isnan(found.median_s)


def test_no_run_is_refused() -> None:
    with pytest.raises(TableError, match="no folder of a run"):
        study([])


def test_near_any_includes_its_reach() -> None:
    times = np.array([0.0, 0.25, 0.5, 1.0])
    assert near_any(times, np.array([0.25, 0.9]), 0.25).tolist() == [True, True, True, True]
    assert near_any(times, np.array([1.0]), 0.25).tolist() == [False, False, False, True]
    assert near_any(times, np.array([]), 1.0).tolist() == [False] * 4
