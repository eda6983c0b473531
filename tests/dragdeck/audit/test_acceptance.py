"""A run that an acceptance check of dragdeck rejects has the finding that belongs to it."""

import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_args

import numpy as np
import pytest
from audit_decks import FOLDER
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
THERMO = "step time_s n_particles kinetic_energy_j rotational_energy_j fastest_particle_m_s"
FORCE = "step time_s force_x_n fastest_particle_m_s"
CASE = json.loads((FOLDER / "case.json").read_text()) | {"bowl": bowl_of_run(0.025)}
ENDED = "Loop time of 1.0 on 1 procs for 60 steps\nDRAGDECK SETTLED: energy ratio 1e-06\n"
ENDED += "DRAGDECK END\n"
DATA = "\nAtoms\n\n" + "".join(f"{n} 1 {2 * R} {DENSITY} 0 0 0\n" for n in (1, 2))


def accepted_run() -> SimpleNamespace:
    """Two particles that rest on the floor of the bowl, in six frames."""
    frames = np.zeros((len(STEPS), 2, len(COLUMNS)))
    frames[:, :, 0] = 1, 2
    frames[:, :, X] = -0.01, 0.01
    frames[:, :, Z], frames[:, :, RADIUS], frames[:, :, VX] = R - 1e-7, R, 0.1
    screen = "  1 by 1 by 1 MPI processor grid\n{table}" + ENDED
    return SimpleNamespace(frames=[*frames], screen=screen)


def write(folder: Path, run: SimpleNamespace) -> None:
    """What such a run leaves in its folder, and its scripts."""
    golden = {name: (ROOT / "tests/golden" / f"{name}.in.liggghts").read_text()
              for name in ("filling", "process")}  # fmt: skip
    texts = {"in.filling": golden["filling"], "in.process": golden["process"]}
    texts |= {
        "particles.data": DATA,
        "workpiece.stl": (FOLDER / "plate.stl").read_text(),
        "case.json": json.dumps(CASE),
    }
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
    outputs = {"particles": PARTICLES.as_part()}
    for name, columns, file in (("thermo", THERMO, "thermo"), ("workpiece_force", FORCE, "force")):
        outputs[name] = output_of_run(
            name, "print", columns.split(), 10, 10, 60, pattern=f"{file}.{{part}}.txt"
        )
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


def spoil(run: SimpleNamespace, what: str | int, value: str | float, begin: int = 3) -> None:
    """Change words of the screen, or a column of the first particle; column 0: lose the second."""
    if isinstance(what, str):
        run.screen = run.screen.replace(what, value)
    elif what:
        for rows in run.frames[begin:]:
            rows[0, what] = value
    else:
        run.frames[begin:] = [rows[:1] for rows in run.frames[begin:]]


CASES: dict[str, tuple[tuple[Any, ...], set[tuple[str, str]]]] = {
    "ended": ((ENDED, ""), {("DK208", "log")}),
    "no_engine_error": (("DRAGDECK END", "ERROR: Bad\nDRAGDECK END"), {("DK208", "log")}),
    "at_rest": (("SETTLED", "NOT SETTLED"), {("DK206", "log")}),
    "steady_bed": ((VX, 0.25, 4), {("DK206", "dump")}),
    "stable_timestep": ((Z, 0.93 * R, 0), {("DK204", "dump")}),
    "particles_kept": ((0, 0), {("DK203", "dump"), ("DK203", "log")}),
    "finite_numbers": ((VX, math.nan), {("DK203", "dump"), ("DK208", "log")}),
    "within_limits": ((VX, 4.0), {("DK202", "dump")}),
    "none_thrown": ((VX, 2.7, 5), {("DK202", "dump")}),
    "packing_in_bowl": ((Z, -2 * R), {("DK203", "dump")}),
}
UNSEEN = {"output_complete", "packing_whole", "ranks", "neighbour_builds"}
"""Not rejected by what dumps and log contain; docs/reference/audit.md says why."""


@pytest.mark.parametrize("code", CASES)
def test_a_rejected_run_has_the_finding_that_belongs_to_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], code: str
) -> None:
    change, expected = CASES[code]
    run = accepted_run()
    write(tmp_path, run)
    after = "--after", str(tmp_path / "in.filling")
    assert rejecting(tmp_path) == set()
    assert audited(tmp_path / "in.process", capsys, *after) == set()
    spoil(run, *change)
    write(tmp_path, run)
    assert code in rejecting(tmp_path)
    assert expected <= audited(tmp_path / "in.process", capsys, *after)


def test_every_acceptance_check_is_judged_and_named() -> None:
    page = (ROOT / "docs/reference/audit.md").read_text()
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
