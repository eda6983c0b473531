"""Which files a study is described in, and which folders its runs have."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from made_study import put
from soft_study import study_with_windows

from dragdeck.project import Project, study_files
from dragdeck.scenes.lead import FIRST_WINDOWS, whole_drag, windows_of
from dragdeck.scenes.process import PROCESS
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


SETTINGS = {"youngs_modulus_scale": 1e-3, "timestep_fraction": 0.64, "ranks": 1}
SOFT = {
    "youngs_modulus_scale": 0.1, "timestep_fraction": 0.5,
    "soft_start": {"youngs_modulus_scale": 0.01, "timestep_fraction": 0.4},
}  # fmt: skip
WINDOWS = study_with_windows()
SEEDS, SPEED = {"sweep": {"seed": [1, 2]}}, "motion.speed_m_s"


@pytest.mark.parametrize(
    ("before", "after", "same"),
    [
        ({}, SEEDS, 1),
        (SEEDS, {"sweep": {}, "seed": 2}, 1),
        (SEEDS, {"sweep": {"seed": [3, 2], SPEED: [0.05]}}, 1),
        (SEEDS, SEEDS, 2),
        ({"fidelity": "quick"}, {"fidelity": SETTINGS}, 1),
        ({"fidelity": SOFT}, {"fidelity": SOFT, **SEEDS}, 2),
        ({}, {"sweep": {"seed": [2, 3]}}, 0),
        ({}, {"sweep": {"drop_test.impacts": [3, 4]}}, 0),
        (WINDOWS, WINDOWS | SEEDS, 4),
    ],
)
def test_a_run_is_used_again_whatever_the_sweep_calls_it(
    project: Project,
    small: dict[str, Any],
    write_study: Callable[..., Path],
    before: dict[str, Any],
    after: dict[str, Any],
    same: int,
) -> None:
    """Not where several cases have a process of the same content."""

    def folders(changes: dict[str, Any]) -> set[Path]:
        put(small, {SPEED: 0.05})
        write_study(small | changes)
        return set(project.run_folders(project.cases("small"), PROCESS))

    first = folders(before)
    for folder in first:
        folder.mkdir(parents=True)
    second = folders(after)
    assert len(first & second) == same
    for folder in second - first:
        folder.mkdir()
    assert folders(after) == second


def test_windows_are_not_expected_beside_the_whole_drag(
    project: Project, small: dict[str, Any], write_study: Callable[..., Path]
) -> None:
    windows = {"tolerance": 0.1, "quantities": ["drag_mean"], "most": 6}
    small["fidelity"] = {"youngs_modulus_scale": 0.01, "ranks": 1, "windows": windows}
    small["motion"]["path"]["revolutions"] = 1
    write_study(small)
    cases = project.cases("small")
    (drag,) = whole_drag(cases[0])
    assert len(project.run_folders(cases, PROCESS)) == 1 + FIRST_WINDOWS
    begun = project.run_folder(windows_of(cases[0])[0], PROCESS)
    for folder in (begun, project.run_folder(drag, PROCESS)):
        folder.mkdir(parents=True)
    expected = {project.run_folder(run, PROCESS) for run in (cases[0], drag)} | {begun}
    assert {*project.run_folders(cases, PROCESS)} == expected
