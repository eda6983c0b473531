"""The wheel, projects outside of a clone, and the other ways to call the workflow."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest
import yaml
from paths import ROOT, SNAKEFILES
from preloaded import environment, plain_environment

from dragdeck import __version__
from dragdeck.cli import main
from dragdeck.project import Project

SOURCES = ("analysis", "config", "meshes", "profiles", "studies", "templates", "workflow")
FILES = ("LICENSE", "README.md", "MANIFEST.in", "pyproject.toml", "setup.py")
TOP_LEVEL = {"dragdeck", "dragchain", "snakemake_logger_plugin_dragdeck"}
STUDY = ("all", "--dry-run", "--cores", "1", "--config", "study=quickstart")


def call(folder: Path, *words: str, **settings: str) -> subprocess.CompletedProcess[str]:
    seen = {**plain_environment(), **settings}
    return subprocess.run(words, cwd=folder, env=seen, capture_output=True, text=True)


def snakemake(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return call(folder, "snakemake", *words, **environment())


# --- a wheel, installed ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel, built from a copy of the sources."""
    folder = tmp_path_factory.mktemp("sources")
    for name in SOURCES:
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in FILES:
        shutil.copy(ROOT / name, folder)
    made = call(
        folder, *(sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation"),
        *("--no-index", "--wheel-dir", "dist", "."),
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    (file,) = (folder / "dist").iterdir()
    return file


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The programs of an environment with the wheel; other packages are those of the tests."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder)
    packages = Path(sysconfig.get_path("purelib", vars={"base": str(folder)}))
    (packages / "others.pth").write_text(sysconfig.get_path("purelib") + "\n")
    python = str(folder / "bin/python")
    made = call(
        folder, *(sys.executable, "-m", "pip", "--python", python, "install", "--no-compile"),
        *("--no-deps", "--no-index", str(wheel)), PYTHONPATH="",
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    program = folder / "bin/snakemake"
    program.write_text(f'#!/bin/sh\nexec "{python}" -m snakemake "$@"\n')
    program.chmod(0o755)
    return folder / "bin"


def test_there_is_one_version() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    released = re.search(r"^## \[(\d.*)\] - (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.M)
    assert released is not None
    assert released.groups() == (citation["version"], citation["date-released"])
    assert citation["version"] == __version__


@pytest.mark.slow
def test_a_wheel_has_all_that_a_project_needs(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    assert {name.split("/")[0] for name in names if ".dist-info/" not in name} == TOP_LEVEL
    for pattern in ("templates/*", "meshes/*", "workflow/*.*", "workflow/plans/*", "config/*",
                    "workflow/rules/*", "workflow/report/*", "studies/quickstart/*"):  # fmt: skip
        files = [file.relative_to(ROOT) for file in ROOT.glob(pattern) if file.is_file()]
        assert files and names >= {f"dragdeck/share/{file}" for file in files}


@pytest.mark.slow
def test_a_study_runs_in_a_project_outside_of_a_clone(installed: Path, tmp_path: Path) -> None:
    path = {"PATH": f"{installed}{os.pathsep}{os.environ['PATH']}", "PYTHONPATH": ""}
    shipped = call(tmp_path, "dragdeck", "files", **path).stdout
    assert Path(shipped).is_relative_to(installed.parent)
    made = call(tmp_path, "dragdeck", "init", "a project", **path)
    assert made.returncode == 0 and "./run all" in made.stdout, made.stderr
    project = tmp_path / "a project"
    for study in ("quickstart", "cutter"):  # its own, and an example of dragdeck with a mesh
        call(project, "dragdeck", "new", f"my-{study}", "--from", study, **path)
        listed = call(project, "dragdeck", "cases", f"my-{study}", **path)
        assert listed.returncode == 0, listed.stderr
    for words in (("./run", *STUDY), ("snakemake", *STUDY)):
        planned = call(project, *words, **path)
        assert planned.returncode == 0, planned.stdout + planned.stderr
        assert "run_process" in planned.stdout
    shown = call(tmp_path, str(project / "run"), "--help", **path)
    assert shown.stdout.startswith("usage: ./run") and "setup" not in shown.stdout
    unknown = call(project, "./run", *STUDY, **{**path, "PATH": "/usr/bin:/bin"})
    assert unknown.returncode == 1 and "remedy: pip install dragdeck" in unknown.stderr


# --- a project ------------------------------------------------------------------------------


def test_nothing_is_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["init", str(tmp_path / "new/mine")]) == 0
    (tmp_path / "config").mkdir()
    (tmp_path / "config/config.yaml").write_text("study: mine\n")
    assert main(["init", str(tmp_path)]) == 1
    assert "value:  config/config.yaml\n" in capsys.readouterr().err
    assert {file.name for file in tmp_path.iterdir()} == {"new", "config"}
    assert (tmp_path / "config/config.yaml").read_text() == "study: mine\n"


@pytest.mark.slow
def test_a_study_runs_in_a_project_of_an_installed_clone(tmp_path: Path) -> None:
    """An editable installation has its packages in no folder of Python's path."""
    path = {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}", "PYTHONPATH": ""}
    assert main(["init", str(tmp_path / "project")]) == 0
    planned = call(tmp_path / "project", "./run", *STUDY, **path)
    assert planned.returncode == 0, planned.stdout + planned.stderr
    assert "run_process" in planned.stdout


def test_a_project_uses_what_it_has_and_the_rest_of_dragdeck(tmp_path: Path) -> None:
    project = Project(tmp_path)
    assert project.cases("quickstart")[0].file == ROOT / "studies/quickstart/study.yaml"
    assert project.templates == ROOT / "templates"
    assert project.plan_file("paper") == ROOT / "workflow/plans/paper.yaml"
    for name in ("studies/quickstart", "templates", "workflow/plans"):
        (tmp_path / name).mkdir(parents=True)
    study = tmp_path / "studies/quickstart/study.yaml"
    study.write_text("extends: uhlmann2015\n")
    plan = Path(shutil.copy(ROOT / "workflow/plans/paper.yaml", tmp_path / "workflow/plans"))
    assert project.cases("quickstart")[0].file == study
    assert project.templates == tmp_path / "templates"
    assert project.plan_file("paper") == plan


# --- calls of Snakemake ---------------------------------------------------------------------

IMPORTS = """
import sys
from snakemake.cli import main
try:
    main()
finally:
    print("imported:", *(name for name in sys.modules if name.split(".")[0] == "evidence"))
"""


@pytest.mark.slow
@pytest.mark.parametrize("snakefile", ["Snakefile", SNAKEFILES[1]])
def test_a_study_does_without_evidence(snakefile: str | Path) -> None:
    words = ("-c", IMPORTS, "--snakefile", str(snakefile), *STUDY, "--nolock")
    planned = call(ROOT, sys.executable, *words)
    assert "run_process" in planned.stdout, planned.stdout + planned.stderr
    assert planned.stdout.partition("imported:")[2].split() == []


@pytest.mark.slow
def test_a_snakefile_of_another_folder(tmp_path: Path) -> None:
    (tmp_path / "Snakefile").write_text(
        f'module finishing:\n    snakefile: "{SNAKEFILES[0]}"\n    config: config\n\n\n'
        "use rule * from finishing as finishing_*\n"
    )
    module = ("finishing_all", *STUDY[1:])
    directly = ("--snakefile", str(ROOT / "Snakefile"), *STUDY)
    refused = snakemake(tmp_path, *module)
    assert refused.returncode == 1
    assert "not inside a dragdeck project" in refused.stderr + refused.stdout
    (tmp_path / "studies").mkdir()
    for words in (module, directly):
        planned = snakemake(tmp_path, *words)
        assert planned.returncode == 0, planned.stdout + planned.stderr
        assert "run_process" in planned.stdout
    (tmp_path / "inside").mkdir()
    refused = snakemake(tmp_path / "inside", *directly)
    assert f"--directory {tmp_path}" in refused.stderr + refused.stdout
