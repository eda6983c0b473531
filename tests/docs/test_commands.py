"""Commands and examples run as the pages print them."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import trimesh
import yaml
from doc_pages import PAGES, fences, name_of
from entry import write_entry
from made_study import put
from paths import PROJECT, ROOT
from preloaded import environment, programs

from dragdeck.project import Project
from dragdeck.study.yaml import read_yaml

STUDY = "quickstart"
WAYPOINTS = "time_s,x_m,y_m\n0,0.02,0\n2,0,0.02\n5,-0.02,0\n"
"""A recorded path that examples name."""

SPEEDS = {"speed_m_s": 0.02, "plunge_speed_m_s": 0.2, "approach_speed_m_s": 0.2}
SHORT = {
    "media.count": 355,
    "bowl.radius_m": 0.03,
    "motion.path.revolutions": 0.28,
    "motion.path.radius_m": 0.0115,
    "motion.immersion_depth_m": 0.018,
    **{f"motion.{name}": v for name, v in SPEEDS.items()},
}
"""Fields of the study without `--long`: a quarter of the bed, a short path, a faster workpiece."""

pytestmark = [pytest.mark.engine, pytest.mark.slow]


def blocks_of(kind: str) -> list[tuple[Path, str]]:
    return [(page, text) for page in PAGES for info, text in fences(page) if info == kind]


SHELL, LONG, PYTHON, STUDIES = map(blocks_of, ("sh", "sh long", "python", "yaml"))


def numbered(pages: list[tuple[Path, str]]) -> list[str]:
    return [f"{name_of(page)}-{place}" for place, (page, _) in enumerate(pages)]


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project whose packages are those of this one."""
    folder = tmp_path_factory.mktemp("clone")
    for name in (*PROJECT, "benchmarks", "docs", "tests", "evidence"):
        if not (folder / name).exists():
            (folder / name).symlink_to(ROOT / name)
    shutil.copytree(ROOT / "studies", folder / "studies")
    own = write_entry(folder, ("cad", "crate", "docs", "notebook", "test"))
    for tool in Path(sys.executable).parent.iterdir():
        (own / tool.name).symlink_to(tool)
    return folder


@pytest.fixture(scope="module")
def clone(project: Path, pytestconfig: pytest.Config) -> Path:
    """The project, with preloaded programs, and the results of its first study.

    Without `--long` the study has a shorter path and a faster workpiece.
    """
    if not pytestconfig.getoption("--long"):
        study = project / "studies" / STUDY / "study.yaml"
        put(plain := read_yaml(study), SHORT)
        study.write_text(yaml.safe_dump(plain))
    for program in programs()[0].glob("[ds]*"):
        tool = project / ".venv/bin" / program.name
        tool.unlink(missing_ok=True)
        tool.symlink_to(program)
    runs(f"./run all --cores 1 --config study={STUDY}", project)
    return project


def runs(text: str, folder: Path) -> None:
    """The commands end without an error."""
    words = ["bash", "-euo", "pipefail", "-c", text]
    seen = environment()
    del seen["PYTHONPATH"]
    ran = subprocess.run(words, cwd=folder, env=seen, capture_output=True, text=True)
    assert ran.returncode == 0, f"{text}\n{ran.stdout[-2000:]}\n{ran.stderr[-2000:]}"


def calls(blocks: list[tuple[Path, str]]) -> list[str]:
    """Each line once, without comments."""
    text = re.sub(r"\\\n\s*", " ", "\n".join(text for _, text in blocks))
    lines = (re.sub(r"(^|\s)#.*", "", line).strip() for line in text.splitlines())
    return list(dict.fromkeys(line for line in lines if line))


@pytest.mark.parametrize("call", calls(SHELL))
def test_a_command_runs(clone: Path, call: str) -> None:
    runs(call, clone)


NOT_SNAKEMAKE = (
    *("dragdeck", "dragchain", "setup", "test", "docs", "web", "status", "open"),
    *(
        "compare",
        "search",
        "stability",
        "verify",
    ),  # they install packages first: tests/test_run_script.py
)


@pytest.mark.parametrize("call", calls(LONG))
def test_a_long_command_would_run(clone: Path, call: str, pytestconfig: pytest.Config) -> None:
    """Targets of Snakemake run dry; of other programs the help must know the command.

    With `--long` they run as they are printed, but for those that run tests: hours.
    """
    if pytestconfig.getoption("--long") and not call.startswith("./run test"):
        runs(call, clone)
        return
    match call.split():
        case ["./run", target, *_] if target not in NOT_SNAKEMAKE:
            runs(f"{call} --dry-run", clone)
        case ["snakemake", *_]:
            runs(f"{call} --dry-run --cores 1", clone)
        case ["./run", "dragdeck" | "dragchain" as program, command, *_]:
            runs(f"{program} {command} --help", clone)
        case ["./run", own, *_]:
            runs(f"./run --help | grep -F 'run {own}'", clone)
        case ["python", "-m", package, command, *_]:
            runs(f"python -m {package} {command} --help", clone)
        case ["python", script, *_]:
            runs(f"python {script} --help", clone)
        case _:
            pytest.fail(f"{call}: mark its block `sh elsewhere`")


@pytest.mark.parametrize("page", sorted({page for page, _ in PYTHON}), ids=name_of)
def test_the_python_of_a_page_runs(clone: Path, page: Path) -> None:
    script = clone / "example.py"
    script.write_text("\n".join(text for own, text in PYTHON if own == page))
    runs("python example.py", clone)


def write_bowl(file: Path) -> None:
    """The inner surface of a bowl, 90 mm wide and 60 mm high, in mm."""
    bowl = trimesh.creation.cylinder(radius=45, height=60, sections=48)
    bowl.apply_translation([0, 0, 30])
    bowl.update_faces(bowl.triangles[:, :, 2].min(axis=1) < 60)
    bowl.export(file)


@pytest.mark.parametrize(("page", "text"), STUDIES, ids=numbered(STUDIES))
def test_an_example_of_a_study_is_valid(project: Path, page: Path, text: str) -> None:
    example = yaml.safe_load(text)
    base = {} if "materials" in example and "motion" in example else {"extends": "uhlmann2015"}
    folder = project / "studies/example"
    folder.mkdir(exist_ok=True)
    (folder / "path.csv").write_text(WAYPOINTS)
    shutil.copy(project / "studies/measured_signal/force.csv", folder)
    write_bowl(folder / "bowl.stl")
    (folder / "study.yaml").write_text(yaml.safe_dump({**base, "title": "Example", **example}))
    assert Project(project).cases("example")


def test_only_known_kinds_of_code_are_on_the_pages() -> None:
    """A misspelt kind would not be run."""
    kinds = {info for page in PAGES for info, _ in fences(page)}
    known = {"sh", "sh long", "sh elsewhere", "python", "yaml", "text", "json", "csv", "markdown"}
    others = {kind for kind in kinds - known if not kind.startswith("{")}
    assert others <= {"jinja", "yaml fragment", "lammps", "bibtex", "python elsewhere"}
