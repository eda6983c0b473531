"""What a run was expected to cost, beside what it did."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from report_files import (
    ASKED,
    PICTURES,
    case_json,
    make_run,
    process_findings,
    write_measured,
    write_quantities,
)

from dragchain.report.cases import cases_of, read_study_runs
from dragchain.report.cost_check import answers, prediction_for, read_advice
from dragchain.report.study_report import write_study_report
from dragchain.run.case import study_of
from dragchain.statistics.estimate import Estimate
from dragdeck.errors import DocumentError
from dragdeck.records.advice import OptionEntry
from dragdeck.records.case import CaseOfRun


def option(**more: Any) -> dict[str, Any]:
    """The option whose settings and inputs are those of `case_json`."""
    settings = {
        "youngs_modulus_scale": 0.01, "timestep_fraction": 0.77, "speed_factor": 1.0, "ranks": 2,
    }  # fmt: skip
    return {
        "role": "advised", "settings": settings | more,
        "inputs": study_of(CaseOfRun.model_validate(case_json("process", "workpiece-1"))).inputs(),
        "steps": {"filling": 80_000, "process": 150_000},
        "steps_per_s": {"filling": 4000.0, "process": 3000.0},
        "wall_time_s": {"filling": 20.0, "process": 50.0},
        "source": "a short run of this study, 2 ranks",
        "drop_timestep_fraction": None, "error": None, "relative_cost": 1.0,
    }  # fmt: skip


def advice_file(folder: Path, *options: dict[str, Any], schema: int = 2) -> Path:
    file = folder / "advice.json"
    case = {"case": "any", "run": "any", "asked": ASKED, "options": list(options)}
    content = {"study": "any", "date": "any", "versions": {}, "speed": None, "cases": [case]}
    file.write_text(json.dumps({"schema": schema, **content}))
    return file


@pytest.fixture
def run(tmp_path: Path) -> Path:
    case = at_physical_modulus(case_json("process", "workpiece-1", asked=ASKED))
    return make_run(tmp_path / "results", case, process_findings(), PICTURES)


def test_the_report_compares_cost_and_tolerance(run: Path, tmp_path: Path) -> None:
    file = advice_file(tmp_path, option(ranks=1), option(youngs_modulus_scale=1.0))
    write_study_report(tmp_path, [run], file)
    text = re.sub(r"<[^>]+>", " ", (tmp_path / "report.html").read_text(encoding="utf-8"))
    words = " ".join(text.split())
    assert "150 000 160 000 3000 2100 50 76 1.52 a short run" in words
    assert "4.0 % yes" in words


def at_physical_modulus(case: dict[str, Any]) -> dict[str, Any]:
    return case | {"fidelity": case["fidelity"] | {"youngs_modulus_scale": 1.0}}


@pytest.mark.parametrize(
    "other",
    [
        option(), option(youngs_modulus_scale=1.0, timestep_fraction=0.5),
        option(youngs_modulus_scale=1.0, speed_factor=2.0),
        option(youngs_modulus_scale=1.0, ranks=1),
        option(youngs_modulus_scale=1.0) | {"inputs": {"seed": 2}},
    ],
)  # fmt: skip
def test_a_prediction_of_other_settings_is_not_compared(run: Path, other: dict[str, Any]) -> None:
    case = CaseOfRun.read(run / "case.json")
    wrong, right = (
        OptionEntry.model_validate(entry) for entry in (other, option(youngs_modulus_scale=1.0))
    )
    assert prediction_for(case, [wrong]) is None
    assert prediction_for(case, [wrong, right]) == right


def test_each_asked_quantity_has_an_answer(tmp_path: Path) -> None:
    quantities = ["drag_mean", "chain_count", "contact_force_mean"]
    case = case_json("process", "stiff", asked={**ASKED, "quantities": quantities})
    folder = make_run(tmp_path, at_physical_modulus(case), process_findings(), PICTURES)
    write_measured(folder, chain_count=Estimate.around(40.0, 4.0))
    drag, chains, forces = answers(cases_of([read_study_runs(folder)])[0])
    assert drag.value == Estimate.around(-2.5, 0.1) and drag.half_width == pytest.approx(0.04)
    assert chains.half_width == pytest.approx(0.1)
    assert [one.reached for one in (drag, chains, forces)] == ["yes", "no", "not known"]


def test_a_case_of_several_packings_is_judged_by_its_mean(tmp_path: Path) -> None:
    """Its interval is that of single runs over the root of their number."""
    studies = []
    for seed in range(4):
        asked = {**ASKED, "tolerance": 0.06}
        case = case_json("process", f"run-{seed}", {"seed": seed}, asked=asked)
        folder = make_run(tmp_path, case, process_findings(), PICTURES)
        write_quantities(folder, corrected=0.8)
        studies.append(read_study_runs(folder))
    alone, together = (answers(cases_of(some)[0])[0] for some in (studies[:1], studies))
    assert alone.half_width == pytest.approx(0.1) and alone.reached == "no"
    assert together.half_width == pytest.approx(0.05) and together.reached == "yes"


def test_a_missing_or_foreign_advice_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match="dragdeck advise"):
        read_advice(tmp_path / "advice.json")
    with pytest.raises(DocumentError, match=r"schema: .*another version"):
        read_advice(advice_file(tmp_path, schema=1))
