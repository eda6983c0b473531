"""The page of a trade-off on measures whose effects are known."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from pages import stands_alone
from tradeoff_files import BOTH, FAILURE, contents, measures, write, write_drop

from dragchain.cli import main as dragchain
from dragchain.tradeoff.outcome import compare_drops
from dragdeck.records.tradeoff import TradeoffRecord

pytestmark = pytest.mark.slow  # its data take seconds to make

COSTS = [
    {"name": "plain", "scene": "process", "what": "the <plain> deck", "ratio": 2.0,
     "ci95_low": 1.9, "ci95_high": 2.1},
]  # fmt: skip


def drops(folder: Path) -> list[Path]:
    return [
        write_drop(folder / "fine", 0.02, [0.9, 0.88, 0.86], 100.0),
        write_drop(folder / "coarse", 0.1, [0.909, 0.88, 0.86], 20.0),
        write_drop(folder / "coarser", 0.2, [0.9, 0.99, 0.86], 10.0),
    ]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tradeoff")
    rng = np.random.default_rng(9)
    found = [
        *contents(),
        measures((0.01, 0.8, 1.0), 1, rng, cpu_time_s=3.0, failure=FAILURE),
        measures((1.0, 0.2, 5.0), 1, rng, cpu_time_s=20.0),
        measures(BOTH, 1, rng, study={"bowl.facet_size_m": 0.005}),
    ]
    files = write(folder / "runs", found)
    costs = folder / "costs.json"
    costs.write_text(json.dumps({"schema": 2, "costs": COSTS}))
    arguments = ["step", "tradeoff", "--out", folder / "out", "--reference", files[0].parents[1]]
    arguments += ["--costs", costs, "--plan", "long", "--command", "made"]
    arguments += ["--drops", *drops(folder / "drops"), "--", *files]
    assert dragchain([str(word) for word in arguments]) == 0
    return folder / "out"


@pytest.fixture(scope="module")
def summary(made: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((made / "tradeoff.json").read_text())
    return content


def words_of(page: Path) -> str:
    return " ".join(stands_alone(page.read_text()).words.split())


def test_the_page_says_what_to_choose_and_what_is_not_significant(made: Path) -> None:
    words = words_of(made / "report.html")
    assert "E x 0.01, 50 % of Rayleigh (20 times cheaper than the reference" in words
    assert "no particle lost: 12" in words
    assert "not significant" in words and "+0.0 %" not in words


def test_the_file_for_the_advisor(summary: dict[str, Any]) -> None:
    record = TradeoffRecord.model_validate(summary)
    assert (record.plan, record.runs, record.measured) == ("long", 16, "2026-01-04")
    assert summary["scene"] == {"inertial_number": 0.004, "particles": 1422}
    (cost,) = summary["costs"]
    assert COSTS[0].items() <= cost.items()
    parameters = {"youngs_modulus_scale": 1.0, "timestep_fraction": 0.2, "speed_factor": 1.0}
    assert summary["reference"] == parameters
    wall = 4 * 100 + 3 * (10 + 40 + 5) + 3 + 20 + 100
    assert summary["engine_hours"] == pytest.approx(wall / 3600, rel=1e-5)
    assert summary["quantities"]["drag_mean"]["reference"] == pytest.approx(-2.6, rel=0.03)


def test_settings_for_the_advisor_change_the_fidelity_alone(summary: dict[str, Any]) -> None:
    settings = {(one["youngs_modulus_scale"], one["timestep_fraction"], one["speed_factor"]): one
                for one in summary["settings"]}  # fmt: skip
    assert len(settings) == len(summary["settings"]) == 6
    own = settings[BOTH]
    assert (own["seeds"], own["runs"], own["failed"]) == (3, 3, 0)
    assert own["relative_cost"] == pytest.approx(0.05)
    failed = settings[0.01, 0.8, 1.0]
    assert (failed["failed"], failed["errors"]) == (1, {})


def test_drops_are_compared_with_the_finest(summary: dict[str, Any], tmp_path: Path) -> None:
    assert [row["timestep_fraction"] for row in summary["drop_test"]] == [0.02, 0.1, 0.2]
    assert summary["drop_test"][1]["restitution_error"] == pytest.approx(0.01)  # the worst impact
    assert summary["drop_test"][1]["relative_cost"] == pytest.approx(0.2)
    found = compare_drops(drops(tmp_path))
    assert found[1].bound == pytest.approx(0.01) and found[2].bound == pytest.approx(0.125)
    assert compare_drops([]) == []


def test_tables_and_figure_are_there(made: Path) -> None:
    assert (made / "figures" / "pareto.png").read_bytes().startswith(b"\x89PNG")
    runs, errors = (pd.read_csv(made / f"{name}.csv") for name in ("runs", "errors"))
    assert len(runs) == len(pd.read_parquet(made / "runs.parquet")) == 16
    assert {"ci95_low", "ci95_high", "bound", "relative_cost"} <= set(errors)


def test_a_page_of_a_single_setting(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    files = write(tmp_path / "runs", [measures((1.0, 0.2, 1.0), n, rng) for n in (1, 2, 3)])
    words = ["step", "tradeoff", "--out", tmp_path / "out", "--reference", files[0].parents[1]]
    words += ["--command", "made", "--"]
    assert dragchain([str(word) for word in [*words, *files]]) == 0
    assert "no setting has two complete runs" in words_of(tmp_path / "out/report.html")
