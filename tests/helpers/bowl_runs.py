"""A process on LIGGGHTS beside its filling, and whether its files are accepted."""

from pathlib import Path
from typing import Any

import yaml
from paths import ROOT

from dragchain import write_tables
from dragdeck.decks.outputs import load_outputs
from dragdeck.decks.render import write_run
from dragdeck.decks.templates import environment
from dragdeck.engine.acceptance import check_run
from dragdeck.engine.reports import silent
from dragdeck.engine.run_folder import run
from dragdeck.project import Project
from dragdeck.records.run import CaseFile, RunPart
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import PROCESS
from dragdeck.scenes.scene import read_bed
from dragdeck.sweep.cases import load_cases


def process_of(folder: Path, study: dict[str, Any], template: str = "") -> Path:
    """The folder of a process that is to be run, beside its finished filling.

    Parameters
    ----------
    folder : Path
        That of the project, empty.
    study : dict
    template : str
        The study's own of the process.
    """
    for name in ("templates", "meshes"):
        (folder / name).symlink_to(ROOT / name)
    file = folder / "studies/small/study.yaml"
    own = file.parent / "templates"
    own.mkdir(parents=True)
    file.write_text(yaml.safe_dump(study))
    if template:
        (own / "process.in.j2").write_text(template)
    project, (case,) = Project(folder), load_cases(file)
    templates = environment(project.templates, own)
    filling, process = (project.run_folder(case, scene) for scene in (FILLING, PROCESS))
    write_run(FILLING.build(case, None), filling, templates)
    run(filling, silent)
    write_tables(filling)
    write_run(PROCESS.build(case, read_bed(filling / "tables/packing.json")), process, templates)
    return process


def accepted(process: Path) -> None:
    """Fail unless the files of a run pass; there is no screen output."""
    whole = RunPart(part=1, checkpoint=None, from_step=0)
    inputs, outputs = CaseFile.read(process / "case.json"), load_outputs(process)
    checks = {check.code: check for check in check_run(process, inputs, outputs, 0, [whole], 1)}
    failed = {code: check.seen for code, check in checks.items() if not check.passed}
    assert not {*failed} - {"ended", "ranks"}, failed
    assert {"particles_kept", "stable_timestep", "within_limits"} <= {*checks}
