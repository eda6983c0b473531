"""Runs that go on from a softer run, on the real engine: soft start, windows, an interruption."""

import html
import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from snakemake_calls import copy_of_project, jobs, succeed
from soft_study import ASKED, COEFFICIENT_M2_N, study_with_windows

from dragchain.quantities.document import Extrapolated, RunQuantities
from dragchain.run.kinematics import axis_speed, drag_phase
from dragchain.windows.estimate import Round
from dragdeck.records.case import load_case
from dragdeck.records.windows import WindowsRecord

pytestmark = [pytest.mark.engine, pytest.mark.slow]

CLASSES = {
    "coarse": {"material": "ceramic", "fraction": 0.7, "radius_mean_m": 3.3e-3},
    "fine": {"material": "steel", "fraction": 0.3, "radius_mean_m": 2.6e-3},
}
MEDIA: dict[str, dict[str, Any]] = {
    "spheres": {},
    "mixture": {"media": {"count": 350, "classes": CLASSES},
                "pairs": {"steel-steel": {"restitution": 0.68, "friction": 0.2}}},
    "clumps": {"media": {"material": "ceramic", "count": 220, "radius_mean_m": 3.27e-3,
                         "shape": {"kind": "cylinder", "aspect": 1.2, "spheres": 2}}},
}  # fmt: skip


@pytest.fixture(
    scope="module",
    params=["spheres", *(pytest.param(name, marks=pytest.mark.long) for name in [*MEDIA][1:])],
)
def finished(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project in which the study was run with windows."""
    data, media = study_with_windows(), MEDIA[request.param]
    data |= {"media": media.get("media", data["media"])}
    data["pairs"] |= media.get("pairs", {})
    folder = copy_of_project(tmp_path_factory.mktemp("windows"), data)
    succeed(folder, "all", "--config", "study=small")
    return folder / "results/small"


def test_windows_are_run_until_the_tolerance_or_the_end(finished: Path) -> None:
    (run,) = (finished / "process").iterdir()
    rounds = sorted((run / "windows").iterdir())
    last = Round.read(rounds[-1])
    assert [Round.read(file).last for file in rounds] == [False] * (len(rounds) - 1) + [True]
    assert len(last.windows) == len(list((finished / "windows").iterdir())) == 3
    assert not last.tolerance.reached and last.tolerance.needed.packings > 1
    for name in ASKED:
        value = last.values[name]
        assert value.ci95_low < value.value < value.ci95_high
    known = WindowsRecord.shipped().quantities
    averaged = [name for name in ("coordination_number", "sliding_distance", "workpiece_contacts")
                if not known[name].slope]  # fmt: skip
    for name in averaged:  # the others follow the soft run, too
        of_windows = [of.values[name] for of in last.windows if not of.refused]
        assert last.values[name].value == pytest.approx(np.mean(of_windows))
    assert averaged


def test_the_report_takes_its_values_from_the_windows(finished: Path) -> None:
    (run,) = (finished / "process").iterdir()
    found = Extrapolated.read(run / "tables/extrapolated.json")
    summary = pd.read_parquet(finished / "report/summary.parquet")
    assert found.tolerance is not None and not found.tolerance.reached
    assert summary["extrapolated_drag_mean_n"][0] == pytest.approx(found.values["drag_mean"].value)
    measured = RunQuantities.read(run / "tables/quantities.json").values_of_run
    assert summary["drag_mean_n"][0] == pytest.approx(measured["drag_mean"].value)
    page = html.unescape((finished / "report/report.html").read_text())
    assert found.said in page.replace("\N{NO-BREAK SPACE}", " ")


def test_removal_is_that_of_the_windows(finished: Path) -> None:
    """The soft run has first touches, its windows none; the map has their sum."""
    (run,) = (finished / "process").iterdir()
    assert len(pd.read_parquet(run / "tables/touch_events.parquet"))
    assert not list(finished.glob("windows/*/touch*"))
    load = Extrapolated.read(run / "tables/extrapolated.json").values["force_slide"]
    measured = RunQuantities.read(run / "tables/quantities.json").values_of_run
    assert load.value != pytest.approx(measured["force_slide"].value, rel=1e-6)
    (file,) = (finished / "report").glob("*-removal.csv")
    facets = pd.read_csv(file)
    assert facets["corrected"].all()
    assert (facets["youngs_modulus_scale"] == 0.1).all()
    volume = facets["depth_m_s"] @ facets["area_m2"]
    expected = COEFFICIENT_M2_N * load.value * axis_speed(load_case(run))
    assert volume == pytest.approx(expected, rel=0.02)  # blocks leave out an end of the path


def test_a_window_is_where_the_course_is(finished: Path) -> None:
    for folder in (finished / "windows").iterdir():
        case = load_case(folder)
        force = pd.read_parquet(folder / "tables/workpiece_force.parquet")
        assert case.motion is not None and case.lead is not None
        since = (force.step - drag_phase(case).start_step) * case.timestep_s
        angle = since * case.motion.axis_speed_m_s / 0.010
        away = np.hypot(
            force.ref_x_m - 0.010 * np.cos(angle), force.ref_y_m - 0.010 * np.sin(angle)
        )
        lead = json.loads((finished / "process" / case.lead / "case.json").read_text())
        assert away.max() <= 0.5 * case.motion.axis_speed_m_s * lead["timestep_s"] + 1e-9


def test_a_window_counts_its_own_steps(finished: Path) -> None:
    for folder in (finished / "windows").iterdir():
        case = json.loads((folder / "case.json").read_text())
        own = case["phases"][-1]["end_step"] - case["entry_step"]
        assert json.loads((folder / "run.json").read_text())["steps"] == own > 0


def test_nothing_is_run_again(finished: Path) -> None:
    assert jobs(finished.parents[1], "all", "--config", "study=small") == set()
