"""The uncertainty of an input in the mean drag, by the measured scaling laws."""

from pathlib import Path

import pytest
from report_files import PICTURES, case_json, make_run, page_of, process_findings

from dragchain.report.study_report import write_study_report
from dragchain.report.uncertain_inputs import uncertain_inputs
from dragchain.run.case import study_of
from dragchain.scaling.document import read_scalings
from dragdeck.records.case import AssumptionOfRun, CaseOfRun

FRICTION = "pairs.ceramic-steel.friction"


def assumed(field: str, value: object, std: float | None) -> AssumptionOfRun:
    return AssumptionOfRun.model_validate(
        {"field": field, "value": value, "why": "measured", "std": std}
    )


@pytest.mark.parametrize(
    ("field", "law"), [(FRICTION, 3), ("pairs.steel-ceramic.friction", 3), ("motion.speed_m_s", 2)]
)
def test_the_exponent_of_a_law_carries_the_uncertainty_on(field: str, law: int) -> None:
    known = read_scalings()[law]
    value = known.levels[1].x
    study = study_of(CaseOfRun.model_validate(case_json("process", "workpiece-1")))
    (row,) = uncertain_inputs([assumed(field, value, value / 4)], study)
    exponent = known.fit.exponent
    assert row.drag.value == pytest.approx(abs(exponent.value) / 4)
    assert row.drag.ci95_low == pytest.approx(max(0.0, exponent.ci95_low) / 4)
    assert row.drag.ci95_high == pytest.approx(exponent.ci95_high / 4)


@pytest.mark.parametrize(
    ("field", "value", "std"),
    [
        (FRICTION, 0.3, None),  # nothing is known of it
        (FRICTION, 5.0, 0.1),  # beyond the levels of the law
        ("pairs.ceramic-ceramic.friction", 0.3, 0.1),  # no law
        (FRICTION, "none", 0.1),
    ],
)
def test_other_inputs_have_no_line(field: str, value: object, std: float | None) -> None:
    study = study_of(CaseOfRun.model_validate(case_json("process", "workpiece-1")))
    assert not list(uncertain_inputs([assumed(field, value, std)], study))


def test_the_report_says_it(tmp_path: Path) -> None:
    case = case_json("process", "workpiece-1")
    case["assumptions"] = [assumed(FRICTION, 0.3, 0.075).model_dump()]
    run = make_run(tmp_path / "results", case, process_findings(), PICTURES)
    write_study_report(tmp_path, [run])
    assert "0.3 ± 0.075" in page_of(tmp_path).words
