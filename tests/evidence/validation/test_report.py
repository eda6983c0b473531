"""A validation on runs whose quantities are known."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from changed import changed
from pages import stands_alone
from tradeoff_files import VALUES, measures

from dragchain.quantities.document import MEASURED_FILE, RunQuantities
from dragchain.run.case import study_of
from dragchain.tradeoff.compare import read_plan_runs
from dragdeck.records.case import load_case
from dragdeck.study.reference import Drag, Reference
from evidence.validation.report import (
    Effect,
    Validation,
    packing_table,
    validation_of,
    write_validation,
)

PUBLISHED = Reference(
    source="a paper",
    experiment=Drag(drag_mean_n=-2.5, drag_std_n=0.5),
    simulation=Drag(drag_mean_n=-2.0),
)
FULL, SHORT_STEP, SOFT = (1.0, 0.64, 1.0), (1.0, 0.2, 1.0), (1e-3, 0.5, 1.0)


def write(folder: Path, content: dict[str, Any]) -> Path:
    run = RunQuantities.model_validate({**content, "run": folder.name})
    run = run.model_copy(update={"values_of_run": run.estimates({})})
    (folder / "tables").mkdir(parents=True)
    run.write(folder / MEASURED_FILE)
    return folder


@pytest.fixture
def folders(tmp_path: Path) -> list[Path]:
    """Four packings, a control that is 10 % up, and soft runs with and without a wider bowl."""
    rng = np.random.default_rng(1)

    def run(
        name: str, point: tuple[float, float, float], seed: int, up: float, **study: Any
    ) -> Path:
        effects = {"drag_mean": up}
        content = measures(point, seed, rng, effects=effects, study=study)
        return write(tmp_path / f"{name}-{seed}", content)

    runs = [run("packing", FULL, seed, 1.0) for seed in (1, 2, 3, 4)]
    runs.append(run("control", SHORT_STEP, 1, 1.1))
    for seed in (1, 2, 3):
        runs.append(run("soft", SOFT, seed, 1.05))
        runs.append(run("wide", SOFT, seed, 1.05 * 0.5, **{"bowl.radius_m": 0.08}))
    return runs


@pytest.fixture
def validation(tiny_run: Path, folders: list[Path]) -> Validation:
    case = load_case(tiny_run)
    case = changed(case, study=changed(study_of(case), reference=PUBLISHED))
    read = read_plan_runs([folder / MEASURED_FILE for folder in folders], folders[0])
    return validation_of(*read, case, "./run validate")


def test_the_mean_is_that_over_the_packings_at_the_reference(validation: Validation) -> None:
    means = {of.name: of.mean for of in validation.means}
    assert (validation.runs, validation.packings) == (11, 4)
    for name in ("drag_mean", "drag_std", "workpiece_contacts"):
        assert means[name].value == pytest.approx(VALUES[name], rel=0.03)
        assert means[name].contains(VALUES[name])


def test_the_comparison_has_the_sign_of_more_drag(validation: Validation) -> None:
    experiment, simulation = validation.comparison
    drag = next(of.mean for of in validation.means if of.name == "drag_mean")
    assert experiment.difference.value == pytest.approx(drag.value / -2.5 - 1)
    assert simulation.difference.value == pytest.approx(drag.value / -2.0 - 1)
    assert experiment.std_ratio is not None and simulation.std_ratio is None
    assert experiment.std_ratio.value == pytest.approx(VALUES["drag_std"] / 0.5, rel=0.03)


def test_effects_are_stated_against_what_they_change(validation: Validation) -> None:
    control, soft, wide = (
        effect for effect in validation.effects if effect.quantity == "drag_mean"
    )
    assert (control.timestep_fraction, control.field, control.runs) == (0.2, "", 1)
    assert (soft.youngs_modulus_scale, soft.field, soft.runs) == (1e-3, "", 3)
    assert (wide.field, wide.value, wide.runs) == ("bowl.radius_m", "0.08", 3)
    assert float(wide.reference_value) != 0.08

    def covers(effect: Effect, change: float) -> bool:
        return effect.ci95_low < change < effect.ci95_high

    assert covers(control, 0.1) and covers(soft, 0.05) and covers(wide, -0.5)
    assert wide.ci95_high < 0.0


def test_a_packing_has_its_own_values_with_their_intervals(folders: list[Path]) -> None:
    files = [folder / MEASURED_FILE for folder in reversed(folders)]
    runs, reference, _ = read_plan_runs(files, folders[0])
    table = packing_table(runs, reference)
    assert table["seed"].tolist() == [1, 2, 3, 4]
    low, high = (table[f"drag_mean_ci95_{end}"] for end in ("low", "high"))
    assert ((low < table["drag_mean"]) & (table["drag_mean"] < high)).all()
    assert (table["bed_height"] == 1.0).all()


def test_the_page_stands_alone(tiny_run: Path, folders: list[Path], tmp_path: Path) -> None:
    case = load_case(tiny_run)
    study = changed(study_of(case), reference=PUBLISHED)
    changed(case, study=study).write(folders[0] / "case.json")
    write_validation(tmp_path / "report", folders, "./run validate")
    assert stands_alone((tmp_path / "report/report.html").read_text()).images
