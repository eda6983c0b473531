"""Which files a study is described in."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from dragdeck.project import Project, study_files
from dragdeck.sweep.cases import load_cases


def test_files_of_a_study_are_those_of_its_folders_and_its_meshes(
    project: Project, small: dict[str, Any], write_study: Callable[..., Path]
) -> None:
    small["workpiece"]["shape"] = {"kind": "mesh", "file": "hex_bar.stl", "unit": "mm"}
    base = write_study(small)
    child = project.studies / "child" / "study.yaml"
    other = project.studies / "other" / "study.yaml"
    for file in (
        *(child, base.parent / "templates/process.in.j2", other),
        *(base.parent / ".hidden", base.parent / ".git/config", child.parent / "notes/.draft"),
    ):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("extends: small\n")
    assert study_files(load_cases(child)) == [
        project.root / "meshes/hex_bar.stl",
        child,
        base,
        base.parent / "templates/process.in.j2",
    ]
