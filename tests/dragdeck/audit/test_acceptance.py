"""A run that an acceptance check of dragdeck rejects has the finding that belongs to it."""

import json
import math
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_args

import numpy as np
import pytest
from audit_decks import PLATE
from bowls import bowl_of_run
from made_run import Raw, output_of_run
from made_scenes import rendered
from made_study import Made
from paths import ROOT

from dragdeck.cli import main
from dragdeck.decks.outputs import particles
from dragdeck.engine.acceptance import check_run
from dragdeck.engine.reports import silent
from dragdeck.engine.run_folder import run_to_outcome
from dragdeck.physics.packing import Bed
from dragdeck.project import Project
from dragdeck.records.run import CaseFile, CheckCode, RunPart, RunRecord
from dragdeck.scenes.process import PROCESS

R, DENSITY = 3e-3, 2500.0
STEPS = range(10, 70, 10)
PARTICLES = particles(10, 10, 60, walls=("floor", "side"))
COLUMNS = [column.name for column in PARTICLES.columns]
X, Z, VX, RADIUS = (COLUMNS.index(name) for name in ("x_m", "z_m", "vx_m_s", "radius_m"))
LAW = {"modulus_pa": 6e7, "shear_pa": 2e7, "restitution": 0.68, "friction": 0.3}
THERMO = "step time_s n_particles kinetic_energy_j rotational_energy_j fastest_particle_m_s"
FORCE = "step time_s force_x_n fastest_particle_m_s"
CASE = {
    "schema": 2, "study_name": "a", "title": "A", "scene": "process", "run": "a",
    "versions": {}, "files": {}, "assumptions": [],
    "timestep_s": 5.801e-5, "rayleigh_time_s": 9e-5, "gravity_m_s2": 9.81,
    "fidelity": {"name": "a", "youngs_modulus_scale": 1.0, "timestep_fraction": 0.6, "ranks": 1,
                 "filling_timestep_fraction": 0.2, "speed_factor": 1.0, "skin_m": 1e-3},
    "media": {"count": 2, "radius_mean_m": R, "radius_std_m": 0.0, "density_kg_m3": DENSITY},
    "bowl": bowl_of_run(0.025), "contact_moduli": {"particle": LAW, "bowl": LAW},
    "settled": {"energy_ratio": 1e-5, "highest_m": 0.05}, "thrown_m_s": 2.5,
    "steady": {"from_step": 0, "energy_drift": 0.1},
    "limits": {"n_particles": 2, "mean_kinetic_energy_j": 1e-3, "speed_m_s": 3.0, "why": "a"},
}  # fmt: skip
DATA = "\nAtoms\n\n" + "".join(f"{n} 1 {2 * R} {DENSITY} 0 0 0\n" for n in (1, 2))


def accepted_run() -> SimpleNamespace:
    """Two particles that rest on the floor of the bowl, in six frames."""
    frames = np.zeros((len(STEPS), 2, len(COLUMNS)))
    frames[:, :, 0] = 1, 2
    frames[:, :, X] = -0.01, 0.01
    frames[:, :, Z], frames[:, :, RADIUS], frames[:, :, VX] = R - 1e-7, R, 0.1
    screen = "  1 by 1 by 1 MPI processor grid\n{table}Loop time of 1.0 on 1 procs for 60 steps\n"
    screen += "DRAGDECK SETTLED: energy ratio 1e-06\nDRAGDECK END\n"
    return SimpleNamespace(frames=[*frames], screen=screen)


def write(folder: Path, run: SimpleNamespace) -> None:
    """What such a run leaves in its folder, and its scripts."""
    golden = {name: (ROOT / "tests/golden" / f"{name}.in.liggghts").read_text()
              for name in ("filling", "process")}  # fmt: skip
    texts = {"in.filling": golden["filling"], "in.process": golden["process"]}
    texts |= {"particles.data": DATA, "workpiece.stl": PLATE, "case.json": json.dumps(CASE)}
    table, thermo, force = "Step Atoms KinEng\n", f"{THERMO}\n", f"{FORCE}\n"
    for step, rows in zip(STEPS, run.frames, strict=True):
        speeds = rows[:, VX]
        energy = float((DENSITY * 2 / 3 * math.pi * R**3 * speeds**2).sum())
        table += f"{step} {len(rows)} {energy}\n"
        thermo += f"{step} 0.1 {len(rows)} {energy} 0 {speeds.max()}\n"
        force += f"{step} 0.1 0 {speeds.max()}\n"
    texts |= {"screen.1.txt": run.screen.format(table=table), "thermo.1.txt": thermo}
    texts["force.1.txt"] = force
    for name, text in texts.items():
        (folder / name).write_text(text)
    width = len(COLUMNS)
    dumped = [
        Raw.binary(n, rows.tolist(), width) for n, rows in zip(STEPS, run.frames, strict=True)
    ]
    (folder / "particles.1.bin").write_bytes(b"".join(dumped))


def rejecting(folder: Path) -> set[str]:
    """Codes of the checks that the run does not pass; there is no file of a packing."""
    thermo = output_of_run(
        "thermo", "print", THERMO.split(), 10, 10, 60, pattern="thermo.{part}.txt"
    )
    force = output_of_run(
        "workpiece_force", "print", FORCE.split(), 10, 10, 60, pattern="force.{part}.txt"
    )
    outputs = {"thermo": thermo, "workpiece_force": force, "particles": PARTICLES.as_part()}
    part = RunPart(part=1, checkpoint=None, from_step=0)
    checks = check_run(folder, CaseFile.read(folder / "case.json"), outputs, 0, [part], 1)
    return {str(check.code) for check in checks if not check.passed} - {"packing_whole"}


def audited(script: Path, capsys: pytest.CaptureFixture[str], *more: str) -> set[tuple[str, str]]:
    """Rules that the audit of a run of dragdeck finds, each with dump or log."""
    folder = script.parent
    words = ["--dump", str(folder / "particles.1.bin"), "--log", str(folder / "screen.1.txt")]
    main(["audit", str(script), *words, "--select", "DK2", "--format", "json", *more])
    findings = json.loads(capsys.readouterr().out)["findings"]
    return {(each["rule"], "log" if "screen" in each["file"] else "dump") for each in findings}


def cut(run: SimpleNamespace) -> None:
    run.screen = run.screen.partition("Loop time")[0]


def says(line: str) -> Callable[[SimpleNamespace], None]:
    def change(run: SimpleNamespace) -> None:
        run.screen += f"{line}\n"

    return change


def unsettled(run: SimpleNamespace) -> None:
    run.screen = run.screen.replace("SETTLED", "NOT SETTLED")


def moved(column: int, value: float, begin: int = 3) -> Callable[[SimpleNamespace], None]:
    def change(run: SimpleNamespace) -> None:
        for rows in run.frames[begin:]:
            rows[0, column] = value

    return change


def lost(run: SimpleNamespace) -> None:
    run.frames[3:] = [rows[:1] for rows in run.frames[3:]]


Case = tuple[Callable[[SimpleNamespace], None], set[tuple[str, str]]]
CASES: dict[str, Case] = {
    "ended": (cut, {("DK208", "log")}),
    "no_engine_error": (says("ERROR: Bad"), {("DK208", "log")}),
    "at_rest": (unsettled, {("DK206", "log")}),
    "steady_bed": (moved(VX, 0.25, 4), {("DK206", "dump")}),
    "stable_timestep": (moved(Z, 0.93 * R, 0), {("DK204", "dump")}),
    "particles_kept": (lost, {("DK203", "dump"), ("DK203", "log")}),
    "finite_numbers": (moved(VX, math.nan), {("DK203", "dump"), ("DK208", "log")}),
    "within_limits": (moved(VX, 4.0), {("DK202", "dump")}),
    "none_thrown": (moved(VX, 2.7, 5), {("DK202", "dump")}),
    "packing_in_bowl": (moved(Z, -2 * R), {("DK203", "dump")}),
}
UNSEEN = {"output_complete", "packing_whole", "ranks", "neighbour_builds"}
"""Not rejected by what dumps and log contain; docs/howto/audit.md says why."""


@pytest.mark.parametrize("code", CASES)
def test_a_rejected_run_has_the_finding_that_belongs_to_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], code: str
) -> None:
    spoil, expected = CASES[code]
    run = accepted_run()
    write(tmp_path, run)
    after = "--after", str(tmp_path / "in.filling")
    assert rejecting(tmp_path) == set()
    assert audited(tmp_path / "in.process", capsys, *after) == set()
    spoil(run)
    write(tmp_path, run)
    assert code in rejecting(tmp_path)
    assert expected <= audited(tmp_path / "in.process", capsys, *after)


def test_every_acceptance_check_is_judged_and_named() -> None:
    page = (ROOT / "docs/howto/audit.md").read_text()
    assert CASES.keys() | UNSEEN == set(get_args(CheckCode)) and not CASES.keys() & UNSEEN
    assert all(f"`{code}`" in page for code in CASES.keys() | UNSEEN)


@pytest.mark.engine
@pytest.mark.slow
@pytest.mark.parametrize(("fraction", "found"), [(0.5, set()), (1.05, {("DK204", "dump")})])
def test_runs_of_dragdeck(
    small: dict[str, Any], project: Project, made: Made, capsys: pytest.CaptureFixture[str],
    fraction: float, found: set[tuple[str, str]],
) -> None:  # fmt: skip
    small["motion"]["path"]["revolutions"] = 0.05
    case = made({"fidelities.quick.timestep_fraction": fraction})
    folders = []
    for scene in ((), (PROCESS, Bed(0.055, 0.065))):
        folders.append(folder := rendered(case, project, *scene))
        run_to_outcome(folder, folder / "outcome.json", silent)
    filling, process = (folder / "in.liggghts" for folder in folders)
    assert audited(filling, capsys) == set()
    assert audited(process, capsys, "--after", str(filling)) == found
    state = RunRecord.read(process.parent / "outcome.json").state
    assert state == ("failed" if found else "complete")
