"""The acceptance check of the time step: on made frames, and on LIGGGHTS."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bowls import bowl_of_run
from made_run import Raw
from made_scenes import rendered
from made_study import Made

from dragdeck.cases.case import Case
from dragdeck.decks.outputs import particles
from dragdeck.engine.acceptance import check_run
from dragdeck.engine.reports import silent
from dragdeck.engine.run_folder import run_to_outcome
from dragdeck.physics.packing import Bed
from dragdeck.project import Project
from dragdeck.records.run import AcceptanceCheck, CaseFile, RunPart, RunRecord
from dragdeck.scenes.process import PROCESS

OUTPUT = particles(10, 10, 40, walls=())
RADIUS = 3e-3


def frame(step: int, overlap_m: float, ranks: int) -> bytes:
    """Two particles on the floor, far from each other, dumped by some ranks."""
    rows = np.zeros((2, len(OUTPUT.columns)))
    names = [column.name for column in OUTPUT.columns]
    rows[:, names.index("x_m")] = -0.01, 0.01
    rows[:, names.index("z_m")] = RADIUS - overlap_m
    rows[:, names.index("radius_m")] = RADIUS
    return Raw.binary(step, rows, len(names), ranks)


def checked(
    folder: Path, overlaps: Sequence[float], ranks: int = 1, code: str = "stable_timestep",
    screen: str = "", **changes: Any,
) -> AcceptanceCheck:  # fmt: skip
    """A check of a run in two parts with a frame for each overlap."""
    folder.mkdir(exist_ok=True)
    law = {"modulus_pa": 4e7, "shear_pa": 1e7, "restitution": 0.9, "friction": 0.3}
    case = {
        "schema": 2, "study_name": "a", "title": "A", "scene": "process", "run": "a",
        "versions": {}, "files": {},
        "timestep_s": 2e-4, "rayleigh_time_s": 1e-4, "gravity_m_s2": 9.81,
        "fidelity": {
            "name": "a", "youngs_modulus_scale": 1.0, "timestep_fraction": 2.0, "ranks": ranks,
            "filling_timestep_fraction": 0.2, "speed_factor": 1.0, "skin_m": 1e-3,
        },
        "media": {
            "count": 2, "radius_mean_m": RADIUS, "radius_std_m": 0.0, "density_kg_m3": 2500.0
        },
        "bowl": bowl_of_run(0.05), "assumptions": [],
        "contact_moduli": {"particle": law, "bowl": law}, **changes,
    }  # fmt: skip
    (folder / "case.json").write_text(json.dumps(case))
    (folder / "screen.2.txt").write_text(screen)
    frames = [frame(10 * n + 10, overlap, ranks) for n, overlap in enumerate(overlaps)]
    for part, some in ((1, frames[:2]), (2, frames[2:])):
        (folder / f"particles.{part}.bin").write_bytes(b"".join(some))
    parts = [RunPart(part=part, checkpoint=None, from_step=20 * part - 20) for part in (1, 2)]
    inputs, outputs = CaseFile.read(folder / "case.json"), {"particles": OUTPUT.as_part()}
    checks = check_run(folder, inputs, outputs, 0, parts, ranks)
    return next(check for check in checks if check.code == code)


def number(check: AcceptanceCheck) -> float:
    return float(check.seen.split()[2])


LIGHT, HEAVY = 1e-8, 1e-4


@pytest.mark.parametrize("ranks", [1, 2])
def test_the_median_of_all_parts_counts(tmp_path: Path, ranks: int) -> None:
    light = checked(tmp_path, [LIGHT, HEAVY, LIGHT, LIGHT], ranks)
    assert (light.code, light.passed, light.limit) == ("stable_timestep", True, "1")
    assert light.seen.endswith("of the contacts, median of 4 frames")
    heavy = checked(tmp_path, [HEAVY, LIGHT, HEAVY, HEAVY], ranks)
    assert not heavy.passed
    assert number(light) < 1 < number(heavy)


def test_what_it_says_is_stable_is(tmp_path: Path) -> None:
    check = checked(tmp_path, [HEAVY] * 4)
    factor = float(check.limit.removeprefix("1; ").split()[0])
    assert factor < 0.5
    assert number(checked(tmp_path, [HEAVY] * 4, timestep_s=0.95 * factor * 2e-4)) < 1


def test_particles_that_leave_through_the_top_are_said_to_do_so(tmp_path: Path) -> None:
    screen = "  orthogonal box = (-0.1 -0.1 0) to (0.1 0.1 0.35)\nERROR: Lost atoms 2 -> 1\n"
    for gap, words in ((0.3, False), (0.36, True)):
        check = checked(tmp_path, [LIGHT] * 3 + [-gap], code="no_engine_error", screen=screen)
        assert (check.passed, check.reason) == (False, "lost_particles")
        assert ("2 particles fly through the open top" in check.seen) == words
        assert ("bowl.lid_m" in check.seen) == words


def test_an_accepted_step_passes_and_says_so(tmp_path: Path) -> None:
    check = checked(tmp_path, [HEAVY] * 4, unsafe_timestep="to see it break")
    assert check.passed
    assert number(check) > 1
    assert check.limit == "1; exceeded on purpose: to see it break"
    fine = checked(tmp_path, [LIGHT] * 4, unsafe_timestep="to see it break")
    assert (fine.passed, fine.limit) == (True, "1")


@pytest.mark.parametrize("overlap", [np.nan, np.inf])
def test_a_frame_that_is_no_packing_fails(tmp_path: Path, overlap: float) -> None:
    assert not checked(tmp_path, [LIGHT, overlap, overlap, overlap]).passed


@pytest.mark.engine
def test_the_engine_at_a_stable_and_at_an_unstable_step(
    small: dict[str, Any], project: Project, made: Made
) -> None:
    """Every other check passes at the unstable step: nothing else sees it."""
    small["motion"]["path"]["revolutions"] = 0.05
    stable, unstable = (
        outcome(made({"fidelities.quick.timestep_fraction": fraction}), project)
        for fraction in (0.5, 1.05)
    )
    assert (stable.state, unstable.state) == ("complete", "failed")
    (failed,) = (check for check in unstable.checks if not check.passed)
    (passed,) = (check for check in stable.checks if check.code == failed.code)
    assert failed.code == "stable_timestep"
    assert number(passed) < 0.8 < 1.05 < number(failed)


def outcome(case: Case, project: Project) -> RunRecord:
    """The record of a case's process; its filling is run if it was not before."""
    filling = rendered(case, project)
    run_to_outcome(filling, filling / "outcome.json", silent)
    process = rendered(case, project, PROCESS, Bed(0.055, 0.065))
    run_to_outcome(process, process / "outcome.json", silent)
    return RunRecord.read(process / "outcome.json")
