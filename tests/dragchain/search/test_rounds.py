"""The rounds of a search, with a closed form and noise in place of LIGGGHTS."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from made_study import Load
from pages import stands_alone

from dragchain.search import report, rounds
from dragchain.search.proposals import Responses, Trials, best_place, propose, spread_places
from dragchain.search.report import advance, at_bounds
from dragchain.search.rounds import SearchedStudy, read_findings
from dragdeck.errors import InputError
from dragdeck.project import Project
from dragdeck.study.search import SearchPoint, SearchRecord

SD, LIMIT = np.array([0.05, 0.02]), 0.7
BEST = np.array([0.6333, 0.0667])
"""By Lagrange's condition on the line of the limit."""


def truth(place: np.ndarray) -> np.ndarray:
    """A bowl with its minimum at (0.7, 0.2), beyond the limit on the sum."""
    x, y = place
    return np.array([4 * (x - 0.7) ** 2 + 2 * (y - 0.2) ** 2 + 0.3, x + y])


def trials(count: int, gone: Any = lambda place: False) -> Trials:
    rng = np.random.default_rng(5)
    places = spread_places(count, 2, 1)
    values = np.array([truth(one) + SD * rng.normal(size=2) for one in places])
    values[[bool(gone(one)) for one in places]] = np.nan
    ends = np.array([-np.inf, -np.inf]), np.array([np.inf, LIMIT])
    return Trials(places, values, np.tile(SD, (count, 1)), *ends)


# --- the model -----------------------------------------------------------------------------------


def test_the_best_place_is_that_of_the_model_within_the_limit() -> None:
    known = trials(30)
    found = best_place(known, lambda place: True)
    assert found is not None
    np.testing.assert_allclose(found, BEST, atol=0.12)
    mean, error = Responses(known).predict(found[None])
    assert abs(mean[0] - truth(found)) == pytest.approx([0, 0], abs=3 * error[0].max())
    assert error[0, 0] < SD[0]  # it knows that neighbours have noise of their own
    other = best_place(known, lambda place: place[1] > 0.3)
    assert other is not None and other[1] > 0.3


def test_where_no_limit_holds_the_most_probable_place_is_taken() -> None:
    known = trials(12)
    out = Trials(known.places, known.values, known.errors, known.low, np.array([np.inf, -9.0]))
    best, tried = best_place(out, lambda place: True), propose(out, 1)
    assert best is not None
    assert best.sum() < 0.3 and tried.sum() < 0.3


@pytest.mark.slow
def test_proposals_follow_from_the_trials_and_keep_off_what_was_refused() -> None:
    known = trials(14, gone=lambda place: place[0] > 0.6)
    first = propose(known, 3)
    assert (propose(known, 3) == first).all()
    assert first[0] < 0.75
    assert Responses(known).allowed(first[None])[0] > math.log(0.2)


# --- rounds --------------------------------------------------------------------------------------

SEARCH = {
    "vary": {"motion.speed_m_s": [0.01, 0.03], "motion.immersion_depth_m": [0.005, 0.015]},
    "objective": {"quantity": "friction_work"},
    "limits": [{"quantity": "drag_mean", "at_most": LIMIT}],
    "runs": 9, "start": 6, "at_once": 2, "confirm": "full",
}  # fmt: skip
CHANGES = {"search": SEARCH, "sweep": {"seed": [1, 2, 3]}}


class StandIn:
    """Runs that are a formula; `missing`: how many settings still have none."""

    def __init__(self) -> None:
        self.runs: list[str] = []
        self.missing = 0

    def __call__(self, studied: SearchedStudy, point: SearchPoint) -> Any:
        if self.missing:
            return None
        names = [folder.name for folder in studied.folders(point.values)]
        self.runs += [name for name in names if name not in self.runs]
        noise = [np.random.default_rng(int(name[-8:], 16)).normal(size=2) for name in names]
        stiff = 0.1 if "fidelity" in point.values else 0.0
        return truth(studied.place(point.values)) + SD * np.array(noise) + [stiff, 0.0]


def points_of(studied: SearchedStudy) -> tuple[SearchPoint, ...]:
    return SearchRecord.read(studied.record).points


def search(studied: SearchedStudy, engine: StandIn) -> list[str]:
    said = []
    while not said or said[-1] != "complete":
        said.append(advance(studied, engine))
        assert len(said) < 20
    return said


@pytest.mark.slow
def test_a_search_finds_the_best_setting_and_resumes_as_if_never_stopped(
    load: Load, project: Project
) -> None:
    load(CHANGES)
    engine = StandIn()
    studied = SearchedStudy(project, "small")
    assert search(studied, engine) == ["round 1", "round 2", "round 3", "round 4", "complete"]
    points = points_of(studied)
    purposes = ["start"] * 6 + ["model"] * 3
    assert [one.purpose for one in points[:9]] == purposes
    full = points[-1]
    assert full.values["fidelity"] == "full" and full.purpose == "confirmation"
    place = studied.place(full.values)
    assert truth(place)[0] < 0.45 and truth(place)[1] < LIMIT + 0.05
    assert full.predicted == pytest.approx(truth(place)[0], abs=4 * (full.predicted_se or 0))
    # every run is one of an ordinary case, and none is there twice
    cases = project.cases("small")
    assert len(engine.runs) == len(set(engine.runs)) == len(cases) == 3 * len(points)
    assert {(case.settings["seed"], case.fidelity_name) for case in cases[-3:]} == {
        (seed, "full") for seed in (1, 2, 3)
    }
    # the search again, stopped in each round before its runs had ended
    studied.record.unlink()
    again, stopped = StandIn(), SearchedStudy(project, "small")
    while advance(stopped, again) != "complete":
        again.missing = 1
        before = stopped.record.read_bytes()
        assert advance(SearchedStudy(project, "small"), again) == "unfinished"
        assert stopped.record.read_bytes() == before
        again.missing = 0
    assert points_of(stopped) == points and again.runs == engine.runs
    # the page
    out = studied.record.parent
    page = (out / "search.html").read_text(encoding="utf-8")
    stands_alone(page)
    table = pd.read_csv(out / "points.csv")
    row = table.iloc[-1]
    values = engine(studied, full)
    assert row["friction_work"] == pytest.approx(values[:, 0].mean())
    assert row["friction_work_ci95_low"] < truth(place)[0] + 0.1 < row["friction_work_ci95_high"]
    assert "fidelity full" in page and "partly by chance" in page
    on = [name for name, at in zip(SEARCH["vary"], place, strict=True) if not 0.02 < at < 0.98]
    assert [text.split(" ")[0] for text in at_bounds(found_of(studied, engine), full)] == on
    assert ("lies on a bound" in page) == bool(on)
    # more runs continue it; another wish does not
    load(CHANGES | {"search": SEARCH | {"runs": 10}})
    assert advance(SearchedStudy(project, "small"), engine) == "round 5"
    assert [one.purpose for one in points_of(studied)[len(points) :]] == ["model"]
    load(CHANGES | {"search": SEARCH | {"start": 5}})
    with pytest.raises(InputError, match="the study has changed since this search began"):
        advance(SearchedStudy(project, "small"), engine)


def found_of(studied: SearchedStudy, engine: StandIn) -> rounds.SearchFindings:
    found = read_findings(studied, points_of(studied), engine)
    assert found is not None
    return found


def test_settings_that_are_refused_or_fail_are_infeasible(
    load: Load, project: Project, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A depth beyond the settled surface is refused before it is run; a run may be rejected."""
    deep = {**SEARCH["vary"], "motion.immersion_depth_m": [0.005, 0.08]}
    load(CHANGES | {"search": SEARCH | {"vary": deep}})
    studied, engine = SearchedStudy(project, "small"), StandIn()
    assert advance(studied, engine) == "round 1"
    points = points_of(studied)
    refused = [one for one in points if one.refused]
    assert 0 < len(refused) < len(points)
    assert all(one.values["motion.immersion_depth_m"] > 0.02 for one in refused)
    assert len(project.cases("small")) == 3 * (len(points) - len(refused))

    def fails(of: SearchedStudy, point: SearchPoint) -> Any:
        return "particles were lost" if point == points[-1] else engine(of, point)

    found = read_findings(
        studied, [*points[:-1], points[-1].model_copy(update={"refused": ""})], fails
    )
    assert found is not None
    known = [k for k, one in enumerate(found.points) if not one.refused]
    assert np.isfinite(found.means[known]).all() and math.isnan(found.errors[-1, 0])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"search.vary": {"motion.speed": [1, 2]}}, "unknown key"),
        ({"search.vary": {"media.material": [1, 2]}}, "media.material"),
        ({"search.vary": {"motion.speed_m_s": [0.03, 0.01]}}, "bounds.*must increase"),
        ({"search.vary": {"fidelity": [1, 2]}}, "no setting of the machine"),
        ({"search.vary": {}}, "search.vary.*0 entries"),
        ({"search.runs": 5}, "runs 5 is fewer than the 6 of the first round"),
        ({"search.objective": {"quantity": "minutes"}}, "no run has minutes.*removal"),
        ({"search.objective": {"quantity": "peak_pressure"}}, "first_touch_fraction"),
        ({"search.objective": {"quantity": "drag", "goal": "minimise"}}, "the value is unknown"),
        ({"search.objective": {"quantity": "drag_mean", "goal": "target"}}, "belongs to the goal"),
        (
            {"search.objective": {"quantity": "drag_mean", "heights_m": [0, 1]}},
            "heights_m has no meaning",
        ),
        ({"search.limits": [{"quantity": "drag_mean"}]}, "at_least, at_most or both"),
        ({"search.confirm": "fulll"}, "unknown fidelity 'fulll'"),
        ({"sweep": {"seed": [1]}}, "several packings"),
        ({"sweep.motion.speed_m_s": [0.1]}, "no other field"),
    ],
)
def test_a_search_that_cannot_be_is_refused(
    load: Load, changes: dict[str, Any], words: str
) -> None:
    block = json.loads(json.dumps(SEARCH))
    own = {"sweep": {"seed": [1, 2]}}
    for name, value in changes.items():
        first, _, last = name.partition(".")
        if first == "search":
            block[last] = value
        elif last:
            own["sweep"][last] = value
        else:
            own[first] = value
    with pytest.raises(InputError, match=f"(?s){words}"):
        load({**own, "search": block})


def test_a_study_without_search_says_how_to_ask(
    load: Load, project: Project, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    load()
    monkeypatch.setattr(report, "find_project", lambda _: project)
    with pytest.raises(InputError, match="search: a required key is missing"):
        report.write_round("small")
