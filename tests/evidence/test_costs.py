"""What options cost: the design and its cases, statistics, two options on the engine."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from dragdeck.cases.case import Case
from dragdeck.engine.reports import silent
from dragdeck.errors import InputError
from dragdeck.project import Project
from dragdeck.records.run import RunRecord
from dragdeck.sweep.cases import load_cases
from evidence.__main__ import main
from evidence.costs import CostOption, cost, geometric, time_options, timed_options

SECONDS = 0.05


def cases(case: Case) -> dict[str, Case]:
    return {name: of.case for name, of in timed_options(case, SECONDS, silent).items()}


def test_the_interval_of_known_ratios() -> None:
    """Logarithms 0, 1, 2: mean 1, standard error 1 / sqrt(3), t of 2 degrees 4.30265."""
    mean = geometric([1.0, math.e, math.e**2])
    half = 4.302652730 / math.sqrt(3)
    assert mean.value == pytest.approx(math.e)
    assert math.log(mean.ci95_high) == pytest.approx(1 + half)


def record(cpu_time_s: float, wall_time_s: float, steps: int) -> RunRecord:
    return RunRecord(
        state="complete", inputs="", started="", engine_version="3.8.0", ranks=1,
        cpu_time_s=cpu_time_s, wall_time_s=wall_time_s, steps=steps,
    )  # fmt: skip


def test_a_cost_counts_steps_or_seconds() -> None:
    """Twice the steps in 6 s and 1.5 s against 1 s: 3 and 0.75 a step, their mean is 1.5."""
    base = record(1.0, 1.0, 100)
    pairs = [(record(6.0, 0.5, 200), base), (record(1.5, 0.5, 200), base)]
    own = {"fidelity.timestep_fraction": 0.2}
    step, second = (
        cost(CostOption(name="", what="", unit=unit), own, pairs, (0.5e-5, 1e-5), "standard")
        for unit in ("per_step", "per_second")
    )
    assert step.ratio == step.per_step == second.per_step == pytest.approx(1.5)
    assert second.ratio == second.per_second == step.per_second == pytest.approx(3.0)
    assert (step.wall_ratio, second.wall_ratio) == pytest.approx((0.25, 0.5))
    assert step.ci95_low is not None and step.ci95_low < 0.75
    assert second.ci95_low == pytest.approx(2 * step.ci95_low)
    assert (step.parameter, step.level, step.rounds) == ("timestep_fraction", 0.2, 2)
    unnamed = CostOption(name="", what="")
    alone = cost(unnamed, {"bowl.facet_size_m": 1}, pairs[:1], (1, 1), "standard")
    assert (alone.ci95_low, alone.ci95_high, alone.parameter) == (None, None, None)


def test_every_option_is_the_standard_case_with_other_fields(case: Case) -> None:
    by_name = cases(case)
    standard = by_name["standard"].study
    motion = standard.motion
    assert motion.nominal_speed_m_s * SECONDS == pytest.approx(motion.path_length_m)
    assert standard.chosen_fidelity().ranks == 1
    for name, option in by_name.items():
        assert (option.study == standard) == (name == "standard")
    wide = case.study.workpiece.shape.facet_size_m
    assert by_name["workpiece_wide_facets"].study.workpiece.shape.facet_size_m == 2 * wide
    assert by_name["fewer_particles"].study.media.count == 3 * case.study.media.count // 4
    rest = by_name["rotating_bowl"].study.motion
    assert rest.nominal_speed_m_s * SECONDS == pytest.approx(rest.path_length_m)


def test_an_option_that_the_study_has_itself_or_cannot_have_is_left_out(
    made: Any, case: Case
) -> None:
    assert set(cases(case)) - set(cases(made({"bowl.facet_size_m": 0.005}))) == {"bowl_facets"}
    line = {"kind": "line", "start_m": [-0.005, 0.0], "direction_deg": 0, "length_m": 0.01}
    assert "rotating_bowl" not in cases(made({"motion.path": line}))


def test_a_measurement_is_not_overwritten(case: Case, inside: Project, capsys: Any) -> None:
    (inside.root / "costs.json").write_text("kept")
    assert main(["costs", case.study_name, "--out", "costs.json"]) == 1
    assert "there already" in capsys.readouterr().err
    assert (inside.root / "costs.json").read_text() == "kept"


def test_no_round_is_nothing_to_time(case: Case, project: Project, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--rounds: nothing to time"):
        time_options(case, project.templates_of(case), tmp_path / "costs.json", silent, rounds=0)


TWO = """base: {fidelity.ranks: 1, fidelity.speed_factor: 1.0, outputs.n_checkpoints: 0}
reference: {name: standard, what: the standard case}
points:
  - {name: restart_points, what: restart points, with: {outputs.n_checkpoints: 50}}
  - {name: "step_{}", what: "step {}", unit: per_step, vary: {fidelity.timestep_fraction: [0.2]}}
"""


@pytest.mark.engine
def test_two_options_on_the_engine(
    small: dict[str, Any], write_study: Any, project: Project, tmp_path: Path
) -> None:
    small["media"]["count"] = 120
    small["bowl"]["radius_m"] = 0.02
    small["workpiece"]["shape"]["radius_m"] = 0.0035
    small["motion"]["path"]["radius_m"] = 0.008
    small["motion"]["immersion_depth_m"] = 0.01
    (case,) = load_cases(write_study(small))
    design = tmp_path / "two.yaml"
    design.write_text(TWO)

    templates = project.templates_of(case)

    def time_them(out: Path, rounds: int) -> dict[str, Any]:
        time_options(case, templates, out, silent, rounds=rounds, seconds=0.08, design=design)
        document: dict[str, Any] = json.loads(out.read_text())
        return document

    first = time_them(tmp_path / "costs.json", 1)
    runs = {file: file.read_text() for file in (tmp_path / "costs").glob("*/*/run.json")}
    second = time_them(tmp_path / "again.json", 2)
    assert len(runs) == 3 + 1 and all(file.read_text() == text for file, text in runs.items())
    assert second["versions"]["engine"].startswith("3.")
    points, step = second["costs"]
    assert (points["name"], step["name"]) == ("restart_points", "step_0.2")
    assert points["steps"] == second["base"]["steps"]
    assert step["per_second"] == pytest.approx(
        step["per_step"] * second["base"]["timestep_s"] / step["timestep_s"], rel=1e-4
    )
    for entry in second["costs"]:
        assert entry["ci95_low"] < entry["ratio"] < entry["ci95_high"]
        assert entry["rounds"] == 2
    assert first["costs"][0]["ci95_low"] is None
