"""What the rules of the workflow share: a study, its cases, and the paths and options of its runs.

Rules name patterns of paths by `of_run` and `tables_of`, and ask a `Workflow` for the rest. What
they pass as wildcards is anything with the attributes of `Wildcards`.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from functools import cache, partial
from importlib.util import find_spec
from itertools import chain
from pathlib import Path
from shlex import quote
from typing import Any, Protocol, Self

from snakemake_interface_common.exceptions import WorkflowError

from dragdeck import project as projects
from dragdeck.calls import V, _stop, or_stop
from dragdeck.cases.case import Case, digest
from dragdeck.decks import RUN_FILE
from dragdeck.decks.templates import template_files
from dragdeck.engine.status import lacks_output, other_engines
from dragdeck.errors import InputError
from dragdeck.outlook.runs import StudyRun, expected_runs
from dragdeck.scenes.lead import FIRST_WINDOWS, whole_drag, windows_of, with_lead, with_leads
from dragdeck.scenes.process import PROCESS, SCENES
from dragdeck.study.calibration import measurements
from dragdeck.study.recorded import recorded_file
from dragdeck.study.search import RECORD


class Wildcards(Protocol):
    """What a rule knows of a run or of a round, as far as its paths have it."""

    study: str
    run: str
    round: str


def _folder_of(package: str) -> Path:
    """The folder of a package of this project."""
    spec = find_spec(package)
    assert spec is not None and spec.origin is not None
    return Path(spec.origin).parent


FromRun = Callable[[Wildcards], V]
"""A parameter or an input of a rule for runs."""


def of_whole_run(place: str, file: str) -> FromRun[str]:
    """A file of the run that a further workpiece shares."""
    return lambda wildcards: (
        f"{projects.run_path(wildcards.study, place, wildcards.run.rpartition('.')[0])}/{file}"
    )


class Workflow:
    """What a call of Snakemake works on.

    Parameters
    ----------
    project : Project
    study, fidelity, plan, validation : str
        Names; that of the fidelity is empty for the study's own.
    made : callable
        The file that a checkpoint makes, by its name and wildcards, once it was made.

    Raises
    ------
    WorkflowError
        The study or the plan cannot be used.
    """

    def __init__(
        self,
        project: projects.Project,
        study: str,
        fidelity: str,
        plan: str,
        validation: str,
        made: Callable[..., str],
    ) -> None:
        or_stop(project.plan_file, plan)
        self.project, self.study, self.fidelity = project, study, fidelity
        self.plan, self.validation, self.made = plan, validation, made
        self.read_cases()
        self.points_of = cache(partial(or_stop, project.points, study))
        self.points_by_run = cache(self._points_by_run)
        self.templates_of = cache(self._templates_of)
        self._others: dict[str, Self] = {}

    def read_cases(self) -> None:
        """Read the cases of the study; those of a search become more."""
        read = partial(or_stop, self.project.cases, self.study, self.fidelity or None)
        self.cases: list[Case] = read()
        searched = (self.project.results(self.study) / RECORD).is_file()
        self.tried: list[Case] = read(failed=True) if searched else self.cases
        self.runs_of = cache(self._runs_of)
        self.digest = cache(self._digest)
        self.packings_of = cache(self._packings_of)

    def of(self, study: str) -> Self:
        """The same with another study."""
        if study == self.study:
            return self
        if study not in self._others:
            others = (self.fidelity, self.plan, self.validation, self.made)
            self._others[study] = type(self)(self.project, study, *others)
        return self._others[study]

    # --- paths -----------------------------------------------------------------------------

    def of_study(self, folder: str, file: str) -> str:
        """Path of a file about the study as a whole."""
        return f"results/{self.study}/{folder}/{file}"

    def of_tradeoff(self, file: str) -> str:
        """Path of a file of the report on a plan's points."""
        return self.of_study(f"tradeoff/{Path(self.plan).stem}", file)

    @property
    def advice(self) -> str:
        """Path of the advice of the study."""
        return f"results/{self.study}/advice.json"

    def every_folder(self, place: str) -> list[str]:
        """The folder of every run of the study's cases."""
        return [
            projects.run_path(self.study, place, run)
            for run in projects.by_folder(self.cases, projects.PLACES[place])
        ]

    def every(self, place: str, *files: str) -> list[str]:
        """Files of every run of the study's cases."""
        return [f"{folder}/{file}" for folder in self.every_folder(place) for file in files]

    def every_table(self, place: str) -> list[str]:
        """The tables of every run of the study's cases."""
        return self.every(place, *(f"tables/{name}" for name in projects.PLACES[place].tables))

    @property
    def report(self) -> list[str]:
        """Paths of the report of the study; the last one marks that it is complete."""
        names = ("report.html", "summary.csv", "summary.parquet", "summary.xlsx", "complete")
        return [self.of_study("report", name) for name in names]

    def of_report(self) -> list[str]:
        """What the report of the study is made of."""
        runs = [[*self.every(name, "run.json", "tables/findings.json"), *self.every_table(name)]
                for name in SCENES]  # fmt: skip
        tables = ("loading", "quantities", "extrapolated")
        of_process = ("network.html", *(f"tables/{name}.json" for name in tables))
        return [
            *chain.from_iterable(runs),
            *self.every("process", *of_process),
            *self.needed_advice,
        ]

    def every_point(self, place: str, file: str, plan: str = "") -> list[str]:
        """One file of every run of a plan, that of the trade-off if no other is named."""
        runs = self.points_by_run(projects.PLACES[place].name, plan or self.plan)
        return [f"{projects.run_path(self.study, place, run)}/{file}" for run in runs]

    def relative(self, file: Path) -> str:
        """Path from the project, where the workflow runs; other paths stay as they are."""
        root = self.project.root
        return str(file.relative_to(root) if file.is_relative_to(root) else file)

    # --- templates and other inputs --------------------------------------------------------

    def _templates_of(self, scene: str) -> list[str]:
        """Every template that a scene's deck is made of."""
        templates = or_stop(self.project.templates_of, self.cases[0])
        return [self.relative(file) for file in or_stop(template_files, templates, scene)]

    def templates_of_study(self, scene: str) -> Callable[[Wildcards], list[str]]:
        """The same of the study of a run."""
        return lambda wildcards: self.of(wildcards.study).templates_of(scene)

    def page_templates(self, *names: str, package: str = "dragchain") -> list[str]:
        """The templates of a page, with those that all pages are made of."""
        shared = [_folder_of("dragchain") / f"report/{name}.html.j2" for name in ("page", "macros")]
        return [str(file) for file in (*(_folder_of(package) / name for name in names), *shared)]

    def page_files(self, pattern: str) -> list[str]:
        """The files of this pattern that pages of dragchain are made of."""
        return sorted(map(self.relative, _folder_of("dragchain").glob(pattern)))

    @property
    def windows_record(self) -> str:
        """The record that windows are judged with."""
        return self.relative(_folder_of("dragdeck") / "data/windows.json")

    def if_measured(self, part: str, *files: str) -> list[str]:
        """Files in the folder of the calibration, if the study has this part of it."""
        known = self.cases[0].study.calibration
        asked = part == "record" if known is None else getattr(known, part) is not None
        return [self.of_study("calibration", file) for file in files] if asked else []

    def drop_record(self, _: object = None) -> str | list[str]:
        """The measured drop test of the study; nothing if it has measured angles only."""
        case = self.cases[0]
        record = or_stop(measurements, case.study.calibration, case.file).record
        if record is None:
            return []
        return self.relative(or_stop(recorded_file, record, case.file, "calibration.record"))

    @property
    def whole_study(self) -> str:
        """Hash of all that the study says, with what it takes from others, but for its sweep."""
        return digest(self.cases[0].study.plain())

    def signal_file(self) -> list[str]:
        """The measured force signal of the study, if it names one."""
        signal = or_stop(projects.signal_file, self.cases[0])
        return [self.relative(signal)] if signal else []

    def signal_option(self) -> str:
        """How to name that signal on the command line."""
        return " ".join(f"--signal {quote(file)}" for file in self.signal_file())

    def crate_inputs(self) -> list[str]:
        """Study files, templates and meshes of all scenes."""
        files = map(self.relative, or_stop(projects.study_files, self.cases))
        templates = (file for scene in SCENES for file in self.templates_of(scene))
        return list(dict.fromkeys([*files, *templates]))

    # --- cases and runs --------------------------------------------------------------------

    def _points_by_run(self, scene: str, plan: str, leads: bool = False) -> dict[str, Case]:
        """A case of a plan for each run of a scene; those that lead to others too, if asked."""
        kind, cases = SCENES[scene], self.points_of(plan).of(SCENES[scene])
        return projects.by_run(with_leads(cases) if leads and kind.needs_bed else cases, kind)

    def _runs_of(self, place: str) -> dict[str, Case]:
        """A case of the study for each folder of runs; of those that lead to others too."""
        scene, cases = projects.PLACES[place], self.tried
        if place == projects.WINDOWS:
            cases = [part for case in cases for part in (*windows_of(case), *whole_drag(case))]
        elif scene.needs_bed:
            cases = with_leads(cases)
        return projects.by_folder(cases, scene)

    def _origins(self, place: str) -> Iterator[tuple[str, dict[str, Case]]]:
        """Where cases of a folder's runs come from: how to name them, and by run."""
        scene = projects.PLACES[place]
        if place != projects.POINTS:
            yield self.fidelity_option, self.runs_of(place)
        for plan in (self.plan, self.validation):
            try:
                runs = self.points_by_run(scene.name, plan, leads=True)
            except WorkflowError:  # a plan that does not fit the study matters to its points alone
                if place == projects.POINTS:
                    raise
            else:
                yield f"--plan {plan}", runs

    def _origin(self, place: str, run: str) -> tuple[str, Case]:
        """How to name the cases among which a run is, and its case: a study's before a plan's."""
        for option, runs in self._origins(place):
            if run in runs:
                return option, runs[run]
        problem, remedy = "the study as it stands has no such run", "ask for a target of the study"
        _stop(InputError(problem, file=self.cases[0].file, value=f"{place}/{run}", remedy=remedy))

    def case_of(self, place: str, of: Wildcards) -> Case:
        """A case that a run belongs to."""
        return self.of(of.study)._origin(place, of.run)[1]

    def other_engines(self) -> Iterator[str]:
        """What to say of runs that another version of LIGGGHTS made than would now be called."""
        runs = (file for name in SCENES for file in self.every(name, RUN_FILE))
        return other_engines(self.project.root / file for file in runs)

    def check_raw_outputs(self, jobs: Iterable[Any]) -> None:
        """Refuse to make tables anew that cannot be made: Snakemake would delete them first."""
        makers = ("tabulate_", *(f"measure_{place}" for place in projects.OUTCOMES))
        tables = [job for job in jobs if job.rule.name.startswith(makers)]
        there = (self.project.root / job.output[0] for job in tables)
        runs = [file.parents[1] for file in there if file.is_file()]
        if lost := [self.relative(run) for run in runs if lacks_output(run)]:
            _stop(InputError(
                "tables are to be made anew of runs whose raw output was deleted",
                value=", ".join(lost), limit="an edit, or another version of dragdeck, asks for it",
                remedy="undo it, or move the folders of these runs away: they are run again then",
            ))  # fmt: skip

    def planned_runs(self, jobs: Iterable[Any]) -> list[StudyRun]:
        """The engine runs of Snakemake's jobs: what is expected of each, and how far it is.

        The first windows are among them, although a first round may choose the whole drag instead.
        """
        cases: dict[str, dict[Path, Case]] = {}
        for job in jobs:
            if job.rule.name in projects.RUNNERS:
                place, _ = projects.RUNNERS[job.rule.name]
                folder = self.project.root / Path(job.output[0]).parent
                cases.setdefault(place, {})[folder] = self.case_of(place, job.wildcards)
            elif job.rule.name == "judge_windows" and job.wildcards.round == "1":
                for window in windows_of(self.case_of("process", job.wildcards))[:FIRST_WINDOWS]:
                    folder = self.project.run_folder(window, PROCESS)
                    cases.setdefault(projects.WINDOWS, {})[folder] = window
        several = (
            expected_runs(projects.PLACES[place], folders) for place, folders in cases.items()
        )
        return [run.now() for runs in several for run in runs]

    # --- parameters of rules ---------------------------------------------------------------

    @property
    def fidelity_option(self) -> str:
        """How to name the fidelity on the command line."""
        return f"--fidelity {self.fidelity}" if self.fidelity else ""

    def digest_of(self, place: str) -> FromRun[str]:
        """Hash of what a run's files say."""
        return lambda wildcards: self.of(wildcards.study).digest(place, wildcards.run)

    def _digest(self, place: str, run: str) -> str:
        return projects.PLACES[place].digest(self._origin(place, run)[1])

    def ranks_of(self, place: str) -> int | FromRun[int]:
        """Number of LIGGGHTS processes of a run."""
        if projects.PLACES[place].single_particle:
            return 1
        return lambda wildcards: self.case_of(place, wildcards).ranks

    def cases_option(self, place: str) -> FromRun[str]:
        """How to name the cases among which a run is on the command line."""
        return lambda wildcards: self.of(wildcards.study)._origin(place, wildcards.run)[0]

    def of_its_bed(self, place: str, file: str) -> FromRun[str] | list[str]:
        """A file of the filling that a run starts from; none for a run that starts from none."""

        def name(wildcards: Wildcards) -> str:
            filling = SCENES["filling"].run_id(self.case_of(place, wildcards))
            return f"{projects.run_path(wildcards.study, 'filling', filling)}/{file}"

        return name if projects.PLACES[place].needs_bed else []

    def of_its_lead(self, place: str) -> FromRun[list[str]] | list[str]:
        """The record of the run from which a run goes on, if there is one."""

        def names(wildcards: Wildcards) -> list[str]:
            lead = with_lead(self.case_of(place, wildcards)).lead
            if lead is None:
                return []
            run = PROCESS.run_id(lead)
            return [f"{projects.run_path(wildcards.study, 'process', run)}/run.json"]

        return names if projects.PLACES[place].needs_bed else []

    @property
    def needed_advice(self) -> list[str]:
        """The advice of a study in which a case asks for a tolerance; nothing for another one."""
        return [self.advice] if any(case.requested for case in self.cases) else []

    def licence_option(self, _: object = None) -> str:
        """How to name the licence of the results on the command line, if the study states one."""
        licence = self.cases[0].study.licence
        return quote(f"--licence={licence}") if licence else ""

    def packings_option(self, wildcards: Wildcards) -> str:
        """How many of the cases differ from that of a process run in their packing alone."""
        (scene,) = _scene_texts([self.case_of("process", wildcards)])
        return f"--packings {max(1, self.of(wildcards.study).packings_of()[scene])}"

    def _packings_of(self) -> Counter[str]:
        """Number of packings by all that a study says but its seed."""
        return Counter(_scene_texts(self.cases))


def _scene_texts(cases: Iterable[Case]) -> Iterator[str]:
    """What the studies of cases say but their seeds."""
    for case in cases:
        yield case.study.model_copy(update={"seed": 0}).model_dump_json()
