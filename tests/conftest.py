"""What the tests of both packages share."""

import copy
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

# Before numpy is imported: threads that wait for work of small matrices take the cores of others.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Two MPI ranks on a core that is shared: the one that waits lets the other go on.
os.environ.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")

import jinja2
import pytest
import yaml
from hypothesis import settings
from made_study import Load, Made, put
from paths import ROOT, SMALL_STUDY
from tiny_run_files import write_tiny_run

from dragdeck.cases.case import Case
from dragdeck.project import Project
from dragdeck.study.yaml import read_yaml
from dragdeck.sweep.cases import load_cases

# The first example may import scipy, and another process may have the core: no test is timed.
settings.register_profile("explore", deadline=None)
# The same examples every time; `pytest --hypothesis-profile explore` draws new ones.
settings.register_profile("repeat", derandomize=True, deadline=None)
settings.load_profile("repeat")

ON_DEMAND = {
    "slurm": "start a Slurm",
    "audit": "compute tables again from raw outputs",
    "long": "take minutes, and the pages' long commands,",
}
"""Markers of tests that run only when their option is given."""


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update", action="store_true", help="write golden decks and schemas anew")
    for name, what in ON_DEMAND.items():
        parser.addoption(f"--{name}", action="store_true", help=f"run the tests that {what} too")
    parser.addoption("--attacks", action="store_true", help="all attacks instead of a sample")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("numprocesses", None):
        _longest_files_first(items)
    for name in ON_DEMAND:
        skipped = pytest.mark.skip(reason=f"give --{name}")
        for item in items:
            if item.get_closest_marker(name) and not config.getoption(f"--{name}"):
                item.add_marker(skipped)


LONGEST = ("attacks/test_damage", "workflow/test_windows", "workflow/test_superposed", "workflow")
"""Files to begin with, from the longest on; the first makes what all attacks share."""


def _longest_files_first(items: list[pytest.Item]) -> None:
    """Let no process begin with a long file when the others have nothing left to do."""
    marked = {
        item.path
        for item in items
        for mark in item.iter_markers()
        if mark.name in ("slow", "engine")
    }

    def place(item: pytest.Item) -> tuple[int, bool]:
        known = [number for number, name in enumerate(LONGEST) if f"tests/{name}" in str(item.path)]
        return min(known, default=len(LONGEST)), item.path not in marked

    items.sort(key=place)


@pytest.fixture(scope="session", autouse=True)
def compiled_once() -> Iterator[None]:
    """Let each of the project's templates be compiled once, and not for each input script."""
    shipped = {file.read_text() for file in (ROOT / "templates").iterdir()}
    known: dict[tuple[Any, ...], Any] = {}
    compile_anew: Callable[..., Any] = jinja2.Environment.compile

    def compiled(self: jinja2.Environment, source: Any, *names: Any, **options: Any) -> Any:
        if source not in shipped:
            return compile_anew(self, source, *names, **options)
        key = type(self), source, names[0]
        if key not in known:
            known[key] = compile_anew(self, source, *names, **options)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jinja2.Environment, "compile", compiled)
        yield


@pytest.fixture
def small() -> dict[str, Any]:
    """The small study as plain data, free to change."""
    return copy.deepcopy(read_yaml(SMALL_STUDY))


@pytest.fixture
def project(tmp_path: Path) -> Project:
    """An empty project with the real templates and meshes."""
    for name in ("templates", "meshes"):
        (tmp_path / name).symlink_to(ROOT / name)
    (tmp_path / "studies").mkdir()
    return Project(tmp_path)


@pytest.fixture
def inside(project: Project, monkeypatch: pytest.MonkeyPatch) -> Project:
    """The same project, as the working folder."""
    monkeypatch.chdir(project.root)
    return project


WriteStudy = Callable[..., Path]


@pytest.fixture
def write_study(project: Project) -> WriteStudy:
    """Write a study into the project and return its file."""

    def write(data: dict[str, Any], name: str = "small") -> Path:
        file = project.studies / name / "study.yaml"
        file.parent.mkdir(exist_ok=True)
        file.write_text(yaml.safe_dump(data, sort_keys=False))
        return file

    return write


@pytest.fixture
def load(small: dict[str, Any], write_study: WriteStudy) -> Load:
    """Load the cases of the small study with these fields changed, by their dotted names."""

    def loaded(changes: Mapping[str, Any] | None = None) -> list[Case]:
        put(small, changes or {})
        return load_cases(write_study(small))

    return loaded


@pytest.fixture
def made(load: Load) -> Made:
    """The one case of the small study with these fields changed, by their dotted names."""

    def only(changes: Mapping[str, Any] | None = None) -> Case:
        (case,) = load(changes)
        return case

    return only


@pytest.fixture
def case(load: Load) -> Case:
    """The one case of the small study."""
    (only,) = load()
    return only


@pytest.fixture
def tiny_run(tmp_path: Path) -> Path:
    """Folder of a process run with four particles, without its tables.

    The workpiece, a cylinder of 5 mm, moves along +x from the bowl's axis at 0.1 mm/s
    from step 20 to 100, a step being 1 ms. Particle 1 touches it, particle 2 touches
    particle 1 and the bowl's side: a straight chain at z = 30 mm whose three
    contacts share the overlap ``40 um + workpiece_x`` equally and carry 100 N/mm of
    it: (4 N + 1e5 N/m workpiece_x) / 3. The workpiece holds particle 1 up, the side particle 2.
    Particle 4 lies on particle 3 and that on the floor. Nothing touches the workpiece at
    step 0; the forces in ``workpiece_contacts`` are 5 % above the applied ones.
    Samples count from step 40 on.
    """
    return write_tiny_run(tmp_path / "tiny")
