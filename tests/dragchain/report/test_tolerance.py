"""Whether cases reached the tolerance that was asked for."""

from pathlib import Path
from typing import Any

import pytest
from report_files import (
    ASKED,
    PICTURES,
    case_json,
    make_run,
    page_of,
    process_findings,
    write_measured,
    write_quantities,
)

from dragchain.report.cases import cases_of, read_study_runs
from dragchain.report.study_report import write_study_report
from dragchain.report.tolerance import answers
from dragchain.statistics.estimate import Estimate


def at_physical_modulus(case: dict[str, Any]) -> dict[str, Any]:
    return case | {"fidelity": case["fidelity"] | {"youngs_modulus_scale": 1.0}}


def test_the_report_says_whether_the_tolerance_is_reached(tmp_path: Path) -> None:
    case = at_physical_modulus(case_json("process", "workpiece-1", asked=ASKED))
    run = make_run(tmp_path / "results", case, process_findings(), PICTURES)
    write_study_report(tmp_path, [run])
    assert "4.0 % yes" in " ".join(page_of(tmp_path).words.split())


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
