"""MPI ranks of a run: never more than the cores that it was given."""

from dataclasses import replace

import pytest
from made_study import Made

from dragdeck.advice.advise import advised_settings, with_option
from dragdeck.cases.case import Case
from dragdeck.cases.ranks import CORES_VARIABLE, auto_ranks
from dragdeck.physics.domain_split import FilledBowl, split
from dragdeck.records.tradeoff import measured_tradeoff
from dragdeck.study.bowls.annulus import AnnulusBowl
from dragdeck.study.bowls.cylinder import CylinderBowl
from dragdeck.study.fidelity import Fidelity, Tolerance


@pytest.mark.parametrize(("cores", "ranks"), [("1", 1), ("2", 2), ("8", 2)])
def test_the_default_of_two_ranks_is_one_on_a_single_core(
    case: Case, monkeypatch: pytest.MonkeyPatch, cores: str, ranks: int
) -> None:
    monkeypatch.setenv(CORES_VARIABLE, cores)
    study = case.study.model_copy(update={"fidelity": Fidelity()})
    assert replace(case, study=study).ranks == ranks


@pytest.mark.parametrize("cores", ["1", "8"])
def test_advised_runs_of_a_small_bowl_have_one_rank(
    made: Made, monkeypatch: pytest.MonkeyPatch, cores: str
) -> None:
    monkeypatch.setenv(CORES_VARIABLE, cores)
    case = made({"bowl.radius_m": 0.028})
    for tolerance in (0.001, 0.5):
        found = advised_settings(case, Tolerance(tolerance=tolerance), measured_tradeoff())
        assert replace(case, study=with_option(case.study, found.chosen)).ranks == 1


@pytest.mark.parametrize("core_m", [0.1, 0.14])
def test_a_ring_is_split_evenly_among_the_ranks_that_it_gets(core_m: float) -> None:
    ring = AnnulusBowl(
        kind="annulus", material="steel", radius_m=0.2, core_radius_m=core_m, height_m=0.1
    )
    assert (
        ring.container.hollow
        and not CylinderBowl(material="steel", radius_m=0.2, height_m=0.1).container.hollow
    )
    filled = FilledBowl(100_000, ring.container, 0.05, (0.205, 0.205), -0.003, 0.2, 0.006)
    got = {auto_ranks(10**9, 1, cores, column=True) for cores in range(1, 65)}
    assert all(split(ranks, filled).most_over_mean < 1.25 for ranks in got)
    assert all(split(ranks, filled).most_over_mean > 1.3 for ranks in (16, 36, 64))
    assert auto_ranks(10**9, 1, 64) == 64
