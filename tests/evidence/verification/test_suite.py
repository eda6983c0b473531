"""The verification suite: what it asks the engine for."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from paths import ROOT
from pydantic import ValidationError

from dragdeck.cases.case import Case, digest
from dragdeck.decks.render import deck_text
from dragdeck.decks.templates import environment
from dragdeck.project import Project
from dragdeck.study.model import Study
from evidence.verification.experiment import Experiment
from evidence.verification.impacts import Impacts, hertz_time
from evidence.verification.suite import suite_of


@pytest.fixture
def experiments(case: Case) -> dict[str, Experiment]:
    return dict(suite_of(case.study))


def of_test(experiments: dict[str, Experiment], name: str) -> list[Experiment]:
    return [experiment for experiment in experiments.values() if experiment.case.test == name]


def test_every_experiment_is_a_deck(experiments: dict[str, Experiment], project: Project) -> None:
    templates = environment(project.templates)
    for experiment in experiments.values():
        text = deck_text(experiment, templates)
        assert f"\nrun {experiment.steps}\n" in text
        assert text.count("wall/gran") == len(experiment.case.walls)
        limited = text.count("limitForce on")
        assert limited == (1 + len(experiment.case.walls) if experiment.case.limit_force else 0)
        last = next(out.last_step for out in experiment.deck.outputs if out.name == "bodies")
        assert last is not None
        assert experiment.steps - experiment.deck.outputs[1].period_steps < last <= experiment.steps


def test_the_runs_of_the_default_study_keep_their_names() -> None:
    """The digest in a name depends on all that its run does."""
    study = Project(ROOT).cases("uhlmann2015")[0].study
    assert digest(list(suite_of(study))) == "b20bef91"


def test_a_study_changes_its_own_series_and_no_other(case: Case) -> None:
    data: dict[str, Any] = case.study.model_dump()
    data["pairs"]["ceramic-steel"]["restitution"] = 0.5
    before, after = (set(suite_of(study)) for study in (case.study, Study.model_validate(data)))
    changed = {run.partition("-")[0] for run in before - after}
    assert changed == {"oblique_study", "time_step", "column"}


def test_no_two_particles_touch_at_the_start_but_in_the_column(
    experiments: dict[str, Experiment],
) -> None:
    for experiment in experiments.values():
        if experiment.case.test == "column":
            continue
        for first, second in itertools.combinations(experiment.case.bodies, 2):
            apart = math.dist(first.position_m, second.position_m)
            assert apart > first.radius_m + second.radius_m


def test_every_impact_begins_within_the_same_step(experiments: dict[str, Experiment]) -> None:
    for experiment in of_test(experiments, "oblique_angle"):
        for body in experiment.case.bodies:
            gap = body.position_m[2] - body.radius_m
            steps = gap / -body.velocity_m_s[2] / experiment.case.timestep_s
            assert steps == pytest.approx(10.4, rel=1e-6)


def test_each_restitution_is_a_type_of_its_own(experiments: dict[str, Experiment]) -> None:
    experiment = of_test(experiments, "restitution")[0]
    values = [entry.value for entry in experiment.case.contacts]
    size = len(experiment.case.types)
    table = next(
        table.values
        for table in experiment.deck.materials.law.tables
        if table.name == "restitution"
    )
    assert [table[at * size + size - 1] for at in range(size - 1)] == values
    assert np.allclose(np.reshape(table, (size, size)), np.reshape(table, (size, size)).T)


def test_two_equal_particles_touch_shorter_than_one_on_its_like(case: Case) -> None:
    steel = case.study.materials["steel"]
    plane = hertz_time(steel, 0.01, steel, None, 1.0)
    pair = hertz_time(steel, 0.01, steel, 0.01, 1.0)
    assert pair / plane == pytest.approx((0.5**2 / 0.5) ** 0.2)


def test_a_test_varies_one_thing() -> None:
    with pytest.raises(ValidationError, match="exactly one"):
        Impacts.model_validate(
            {"number": 1, "title": "t", "text": [], "partner": "plane", "radius_m": 1,
             "speed_m_s": 1, "vary": {"spin_m_s": [1], "angle_deg": [1]}, "series": []}
        )  # fmt: skip
