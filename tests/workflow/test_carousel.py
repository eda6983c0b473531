"""Several workpieces in one run of LIGGGHTS, and through the workflow."""

import json
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
import pytest
import yaml
from paths import SMALL_STUDY
from snakemake_calls import copy_of_project, jobs, succeed

from dragchain import load_case
from dragchain.report.journal import write_journal_figures
from dragchain.run.kinematics import axis_speed, drag_phase
from dragdeck.records.case import CaseOfRun

pytestmark = [pytest.mark.engine, pytest.mark.slow]

COUNT = 3
RADIUS_M = 0.012
SPEED_M_S = 0.04
AMPLITUDE_M, HERTZ = 0.001, 6.0
REPORT = ("report", "--config", "study=small")


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the project in which the small study has three thin workpieces that spin."""
    data: dict[str, Any] = yaml.safe_load(SMALL_STUDY.read_text())
    data["workpiece"]["shape"] = {"kind": "cylinder", "radius_m": 0.002, "facet_size_m": 0.001}
    data["workpieces"] = {"count": COUNT}
    data["motion"] |= {
        "path": {"kind": "circle", "radius_m": RADIUS_M, "revolutions": 0.45},
        "speed_m_s": SPEED_M_S,
        "spin": {"rpm": 100},
        "oscillation": {"amplitude_m": AMPLITUDE_M, "frequency_hz": HERTZ, "ramp_s": 0.0},
    }
    folder = copy_of_project(tmp_path_factory.mktemp("carousel"), data)
    succeed(folder, *REPORT)
    return folder


@pytest.fixture(scope="module")
def workpieces(project: Path) -> list[Path]:
    """The folder of each, the first with the run's own output."""
    folders = sorted((project / "results/small/process").iterdir(), key=lambda file: file.name)
    assert [load_case(folder).output_of for folder in folders] == [None, *2 * [folders[0].name]]
    return folders


def in_drag(folder: Path) -> tuple[CaseOfRun, pd.DataFrame]:
    case = load_case(folder)
    force = pd.read_parquet(folder / "tables/workpiece_force.parquet")
    return case, force[force["step"] > drag_phase(case).start_step]


def test_each_goes_where_it_should(workpieces: list[Path]) -> None:
    """The analytic place of the reference point at each step, to 1e-9 m."""
    for number, folder in enumerate(workpieces):
        case, force = in_drag(folder)
        time = (force["step"] - drag_phase(case).start_step).to_numpy() * case.timestep_s
        way = axis_speed(case) * time  # the speed, rounded to whole steps
        angle = way / RADIUS_M + 2 * np.pi * number / COUNT
        place = np.column_stack([RADIUS_M * np.cos(angle), RADIUS_M * np.sin(angle)])
        assert np.abs(force[["ref_x_m", "ref_y_m"]] - place).to_numpy().max() < 1e-9
        height = force["ref_z_m"] - AMPLITUDE_M * np.sin(2 * np.pi * HERTZ * way / SPEED_M_S)
        assert np.ptp(height) < 1e-9


def test_the_contacts_of_each_are_its_own(workpieces: list[Path]) -> None:
    """They lie on its surface, and their forces add up to the one on it."""
    whole = []
    for folder in workpieces:
        closure = json.loads((folder / "tables/closure.json").read_text())
        assert closure["verdict"] == "pass"
        assert closure["max_relative"] < 1e-9
        _, force = in_drag(folder)
        contacts = pd.read_parquet(folder / "tables/workpiece_contacts.parquet")
        contacts = contacts[contacts["step"].isin(force["step"])]
        both = contacts.merge(force[["step", "ref_x_m", "ref_y_m"]], on="step")
        aside = np.hypot(both["point_x_m"] - both["ref_x_m"], both["point_y_m"] - both["ref_y_m"])
        assert 0 < aside.max() < 0.0021
        columns = [f"force_{axis}_n" for axis in "xyz"]
        total = contacts.groupby("step")[columns].sum()
        own = force.set_index("step")[columns].loc[total.index]
        np.testing.assert_allclose(total, own, atol=1e-9)
        whole.append(contacts[["step", "particle_id"]].drop_duplicates())  # tip and side
    assert not pd.concat(whole).duplicated().any()


def test_all_feel_the_same_drag(workpieces: list[Path], project: Path) -> None:
    table = pd.read_parquet(project / "results/small/report/summary.parquet")
    assert table["case"].tolist() == [f"quick_workpiece-{number}" for number in (1, 2, 3)]
    half = 0.5 * (table["drag_mean_ci95_high_n"] - table["drag_mean_ci95_low_n"])
    assert (table["drag_mean_n"] < -half).all()
    for first, second in ((0, 1), (0, 2), (1, 2)):
        apart = abs(table["drag_mean_n"][first] - table["drag_mean_n"][second])
        assert apart < 1.5 * np.hypot(half[first], half[second])


def test_the_load_of_each_is_on_its_own_facets(workpieces: list[Path]) -> None:
    """In the body frame, whose sums are those of the force on the workpiece."""
    for folder in workpieces:
        loading = json.loads((folder / "tables/loading.json").read_text())
        assert loading["closure"]["workpiece_relative_error"] < 0.05
        facets = pd.read_parquet(folder / "tables/facets.parquet")
        assert facets["normal_impulse_n_s"].sum() > 0


def test_the_report_compares_wake_and_fresh_bed(workpieces: list[Path], project: Path) -> None:
    table = pd.read_parquet(project / "results/small/report/summary.parquet")
    around = 2 * np.pi * RADIUS_M
    for folder, (_, row) in zip(workpieces, table.iterrows(), strict=True):
        case, force = in_drag(folder)
        assert case.workpiece is not None
        assert case.workpiece.wake_from_m == pytest.approx(around / COUNT)
        way = SPEED_M_S * (force["step"] - drag_phase(case).start_step) * case.timestep_s
        late = force[(way > around / COUNT) & force["in_statistics"]]
        assert row["drag_in_wake_mean_n"] == pytest.approx(late["drag_n"].mean())
    page = (project / "results/small/report/report.html").read_text()
    assert "Drag in the wake" in page


def test_figures_for_a_publication_in_three_formats(project: Path, workpieces: list[Path]) -> None:
    assert "draw_for_journal" in jobs(project, "figures", "--config", "study=small")
    files = write_journal_figures(workpieces[1])
    assert matplotlib.rcParams["svg.fonttype"] != "none"
    names = {file.stem for file in files}
    assert len(names) == 7
    assert {file.name for file in files} == {
        f"{name}.{ending}" for name in names for ending in ("svg", "pdf", "png")
    }
    for name in names:
        text = (workpieces[1] / f"figures/journal/{name}.svg").read_text()
        assert "</text>" in text and "effective samples" not in text


def test_nothing_is_made_again(project: Path) -> None:
    assert jobs(project, *REPORT) - {"report"} == set()
