"""MPI ranks of a run: never more than the cores that it was given."""

from dataclasses import replace

import pytest
from made_study import Made

from dragdeck.advice.advise import advised_settings, with_option
from dragdeck.cases.case import Case
from dragdeck.cases.ranks import CORES_VARIABLE
from dragdeck.records.tradeoff import measured_tradeoff
from dragdeck.study.model import Fidelity, Tolerance


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
