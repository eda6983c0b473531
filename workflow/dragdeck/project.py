"""Where things are: the project's folders and the paths of a run."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TypeVar

import jinja2

from dragdeck.advice.advise import resolve
from dragdeck.cases.case import Case, digest, of_each_workpiece
from dragdeck.decks.templates import commands_digest, environment, template_files
from dragdeck.errors import InputError, choices
from dragdeck.files import file_checksum
from dragdeck.outlook.timestep import check_timestep
from dragdeck.records.tradeoff import TradeoffRecord
from dragdeck.scenes.lead import FIRST_WINDOWS, LEAD, WHOLE_DRAG, with_lead, with_leads
from dragdeck.scenes.process import PROCESS, SCENES
from dragdeck.scenes.scene import SceneType
from dragdeck.scenes.workpiece import workpiece_length
from dragdeck.shipped import SHIPPED, own_or_shipped
from dragdeck.study.base import NAME, NAME_LIMIT
from dragdeck.study.check import validate
from dragdeck.study.model import Scaling, Study
from dragdeck.study.recorded import recorded_file
from dragdeck.study.search import RECORD as SEARCHED
from dragdeck.study.workpiece import MeshShape
from dragdeck.study.yaml import located, mesh_beside, read_study, study_folders
from dragdeck.sweep.cases import load_cases, searched_bounds, study_file
from dragdeck.sweep.plan import Plan, Points, plan_points

V = TypeVar("V")

POINTS = "points"
"""Folder of the process runs of a plan."""

WINDOWS = "windows"
"""Folder of the windows of process runs."""

PLACES: dict[str, SceneType] = {**SCENES, POINTS: PROCESS, WINDOWS: PROCESS}
"""The scene of each folder of runs of a study."""

_PLANS = "workflow/plans"
"""The plans: which points are run."""

OUTCOMES = (POINTS, WINDOWS)
"""Folders of runs of which one that fails is a finding, which others do without."""


def run_path(study: str, place: str, run: str) -> str:
    """Path of the folder of a run from the project's root."""
    return f"results/{study}/{place}/{run}"


RECORD = {place: "outcome.json" if place in OUTCOMES else "run.json" for place in PLACES}
"""How a run in each folder of runs ended."""

ENDED = "ended.json"
"""How a process run of a search ended, which goes on without those that fail."""

RUNNERS = {f"run_{place}": (place, file) for place, file in RECORD.items()}
RUNNERS["try_process"] = ("process", ENDED)
"""The rules that call LIGGGHTS: the folder of its runs, and their record."""

ENGINE_RUN = "[A-Za-z0-9._-]+-[0-9a-f]{8}"
"""A run of LIGGGHTS, as a pattern."""

FURTHER_WORKPIECE = f"{ENGINE_RUN}[.][0-9]+"
"""A further workpiece of one: its number follows the run's name."""


def of_run(place: str, file: str) -> str:
    """Path of a file of a run, as a pattern."""
    return f"{run_path('{study}', place, '{run}')}/{file}"


def tables_of(place: str, names: Iterable[str]) -> list[str]:
    """Paths of tables of a run, as patterns."""
    return [of_run(place, f"tables/{name}") for name in names]


def deck_files(place: str, inputs: Iterable[str]) -> list[str]:
    """Paths of what is written of a run before it starts, as patterns."""
    return [of_run(place, name) for name in ("in.liggghts", "case.json", "columns.json", *inputs)]


@dataclass(frozen=True)
class Project:
    """A folder with ``studies/``; results go beside them. What it lacks is that of dragdeck."""

    root: Path

    @property
    def templates(self) -> Path:
        """The folder of templates."""
        return own_or_shipped(self.root, "templates")

    def templates_of(self, case: Case) -> jinja2.Environment:
        """The templates of a case: of its study, of those that it extends, and the project's."""
        folders = (folder / "templates" for folder in study_folders(case.file))
        return environment(self.templates, *folders)

    @property
    def studies(self) -> Path:
        """One folder a study."""
        return self.root / "studies"

    def cases(
        self,
        study: str,
        fidelity: str | None = None,
        tradeoff: TradeoffRecord | None = None,
        failed: bool = False,
    ) -> list[Case]:
        """The cases of a study, by its name; if asked, with those of a search that failed.

        Raises
        ------
        InputError
            No such study, or its file cannot be used.
        """
        file = study_file(self.studies, study)
        try:
            found_by = partial(resolve, tradeoff=tradeoff)
            cases = load_cases(file, fidelity, found_by, self.results(study) / SEARCHED, failed)
            check_search(file)
            for case in cases:
                _check_timesteps(case)
        except InputError as error:
            raise located(error) from None
        return self.with_left(study, cases)

    def with_left(self, study: str, cases: list[Case]) -> list[Case]:
        """Cases that know the runs they can use although the sweep names them otherwise now.

        Not of a digest that several cases share, or whose run has the case's name already.
        """
        runs = self.results(study).glob(f"*/*-{8 * '[0-9a-f]'}")
        there = {run.name for run in runs if run.parent.name in (PROCESS.name, WINDOWS)}
        parts = (part for case in cases for part in (with_lead(case).lead, case) if part and there)
        names = {PROCESS.run_id(part) for part in parts}
        used = Counter(name[-8:] for name in (*names, *(names & there)))
        left = {name[-8:]: name for name in sorted(there) if used[name[-8:]] < 2}
        return [replace(case, left=left) for case in cases] if left else cases

    def searched(self, study: str) -> Study:
        """A study with a search.

        Raises
        ------
        InputError
            It has none, or cannot be used.
        """
        self.cases(study)
        file = study_file(self.studies, study)
        valid = validate(read_study(file), file, whole=True)
        _needed(valid.search, "search", file)
        return valid

    def plan_file(self, plan: str) -> Path:
        """The file of a plan, which is known by its name or its path.

        Raises
        ------
        InputError
            There is no such plan.
        """
        name = f"{_PLANS}/{plan}.yaml"
        file = Path(plan) if plan.endswith(".yaml") else own_or_shipped(self.root, name)
        if not NAME.fullmatch(file.stem) or not file.is_file():
            folders = (self.root / _PLANS, SHIPPED / _PLANS)
            known = sorted({path.stem for folder in folders for path in folder.glob("*.yaml")})
            raise InputError(
                f"no such plan: {plan!a}",
                file=self.root / _PLANS,
                limit=f"{choices(plan, known)}; or the path of a .yaml file",
                remedy=f"choose one of these, or write one; its name has {NAME_LIMIT}",
            )
        return file

    def points(self, study: str, plan: str) -> Points:
        """The points of a plan for a study, both by name; a plan may be a path too.

        Raises
        ------
        InputError
            There is no such plan or study, or they do not fit together.
        """
        file = self.plan_file(plan)
        return plan_points(Plan.read(file), file, self.cases(study)[0], SCENES, resolve)

    def results(self, study: str) -> Path:
        """The results of a study."""
        return self.root / "results" / study

    def report(self, study: str) -> Path:
        """The page that a study's results end in."""
        return self.results(study) / "report" / "report.html"

    def state(self, cases: Sequence[Case]) -> str:
        """Hash of all that a report on cases shows of their study."""
        templates, signal = self.templates_of(cases[0]), signal_file(cases[0])
        scripts = {file for name in SCENES for file in template_files(templates, name)}
        texts = (file.read_text(encoding="utf-8") for file in scripts)
        return digest({
            **{name: [of.digest(case) for case in cases] for name, of in SCENES.items()},
            "scripts": [*sorted(map(commands_digest, texts))],
            "signal": [file_checksum(signal)] if signal else [],
        })  # fmt: skip

    def report_is_current(self, study: str, cases: Sequence[Case]) -> bool:
        """Whether the report is complete, and on the study and its templates as they stand."""
        mark = self.report(study).with_name("complete")
        with suppress(InputError):  # of a template or a signal
            return mark.is_file() and mark.read_text(encoding="utf-8").strip() == self.state(cases)
        return False

    def run_folders(
        self, cases: Iterable[Case], scene: SceneType, *, of_plan: bool = False
    ) -> dict[Path, Case]:
        """The folders of the engine runs of cases, each with its first case.

        Those from which they go on are among them, and the windows that are begun, or are the first
        where no whole drag is run instead.
        """
        runs = by_run(with_leads(cases) if scene.needs_bed else cases, scene).values()
        folders = {self.run_folder(case, scene, of_plan=of_plan): case for case in runs}
        windows = {folder: case for folder, case in folders.items() if case.rank_of_window}
        instead = [
            case.lead
            for folder, case in windows.items()
            if case.part == WHOLE_DRAG and folder.is_dir()
        ]
        left_out = {
            folder
            for folder, case in windows.items()
            if not folder.is_dir() and (case.rank_of_window > FIRST_WINDOWS or case.lead in instead)
        }
        return {folder: case for folder, case in folders.items() if folder not in left_out}

    def run_folder(self, case: Case, scene: SceneType, *, of_plan: bool = False) -> Path:
        """The folder of one engine run; windows and process runs of a plan stand apart."""
        place = scene.name
        if scene.needs_bed and case.rank_of_window:
            place = WINDOWS
        elif scene.needs_bed and of_plan and case.part != LEAD:
            place = POINTS
        return self.root / run_path(case.study_name, place, scene.run_id(case))


def check_search(file: Path) -> Mapping[str, Sequence[Case]]:
    """Refuse a search whose fields, bounds or parts of the surface no run could have.

    Returns
    -------
    mapping
        The cases at the bounds of each field; empty for a study without a search.
    """
    search = validate(read_study(file), file, whole=True).search
    if search is None:
        return {}
    bounds = searched_bounds(file, search)
    for field, cases in bounds.items():
        if len({digest(PROCESS.content(case)) for case in cases}) == 1:
            name = f"search.vary.{field}"
            raise InputError("no run depends on it", file=file, field=name, remedy="remove it")
    every = [case for cases in bounds.values() for case in cases]
    depth = max(case.study.motion.deepest_m for case in every)
    for name, measure in search.measures.items():
        if measure.heights_m is None:
            continue
        (low, high), length = measure.heights_m, max(map(workpiece_length, every))
        if low < 0 or low >= depth or high > length:
            limit = f"0 to {length:.4g} m, the height of the workpiece; the first below {depth:.4g}"
            raise InputError("no part of the surface that is immersed, or beyond the workpiece",
                             file=file, field=f"search.{name}.heights_m", value=[low, high],
                             limit=f"{limit} m, the largest immersion depth")  # fmt: skip
    return bounds


def _check_timesteps(case: Case) -> None:
    check_timestep(case)
    if case.study.chosen_fidelity().soft_start:
        check_timestep(replace(case, study=case.study.at_start()), "fidelity.soft_start")


def check_buildable(case: Case) -> None:
    """Refuse a case whose time step is not stable or of which a scene cannot be built.

    Raises
    ------
    InputError
        Names the field.
    """
    _check_timesteps(case)
    for scene in SCENES.values():
        scene.build(case, None)


def scaling_of(case: Case) -> Scaling:
    """The power law that a study asks for.

    Raises
    ------
    InputError
        It asks for none.
    """
    return _needed(case.study.scaling, "scaling", case.file)


def _needed(block: V | None, field: str, file: Path) -> V:
    if block is None:
        problem, remedy = "a required key is missing", "add this block: docs/howto/sweep.md"
        raise InputError(problem, file=file, field=field, remedy=remedy)
    return block


def find_project(start: Path) -> Project:
    """The project that a folder belongs to: the nearest with studies/.

    Raises
    ------
    InputError
        There is none.
    """
    for folder in (start, *start.parents):
        if (folder / "studies").is_dir():
            return Project(folder)
    remedy = "change into the project's folder, or make one: dragdeck init FOLDER"
    limit = "a folder with studies/"
    raise InputError("not inside a dragdeck project", file=start, limit=limit, remedy=remedy)


def project_here() -> Project:
    """The project whose root is the working folder, as of a call of Snakemake.

    Raises
    ------
    InputError
        It is not the root of a project.
    """
    project = find_project(Path.cwd())
    if project.root != Path.cwd():
        problem = "Snakemake does not work in the project's own folder"
        remedy = f"change into it, or add --directory {project.root}"
        raise InputError(problem, file=Path.cwd(), limit=str(project.root), remedy=remedy)
    return project


def signal_file(case: Case) -> Path | None:
    """The measured force signal of a case's study, if it names one."""
    signal = case.study.reference and case.study.reference.signal
    return recorded_file(signal.file, case.file, "reference.signal.file") if signal else None


def study_files(cases: Iterable[Case]) -> list[Path]:
    """What cases are described in: the folders of their studies, and meshes from elsewhere.

    Hidden files are left out.
    """
    files = set()
    for case in cases:
        for folder in study_folders(case.file):
            inside = (file for file in folder.rglob("[!.]*") if file.is_file())
            files |= {file for file in inside if "/." not in f"/{file.relative_to(folder)}"}
        shapes = [workpiece.study.workpiece.shape for workpiece in of_each_workpiece(case)]
        files |= {
            mesh_beside(case.file, shape.file) for shape in shapes if isinstance(shape, MeshShape)
        }
    return sorted(files)


def by_run(cases: Iterable[Case], scene: SceneType) -> dict[str, Case]:
    """One case for each run of a scene: cases that share a run appear once.

    Returns
    -------
    dict of str to Case
        In the order of the cases.
    """
    runs: dict[str, Case] = {}
    for case in cases:
        runs.setdefault(scene.run_id(case), case)
    return runs


def by_folder(cases: Iterable[Case], scene: SceneType) -> dict[str, Case]:
    """One case for each folder of results of a scene, by its name.

    Further workpieces of a run have folders of their own.
    """
    runs = by_run(cases, scene)
    if not scene.needs_bed:
        return runs
    return by_run(
        [workpiece for case in runs.values() for workpiece in of_each_workpiece(case)], scene
    )
