"""Where things are: the project's folders and the paths of a run.

The grammar of result paths stands here and nowhere else.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from dragdeck.cases import Case, SceneName, load_cases, study_file
from dragdeck.errors import InputError
from dragdeck.plan import Points, plan_points, read_plan


@dataclass(frozen=True)
class Project:
    """A folder with ``templates/`` and ``studies/``; results go beside them."""

    root: Path

    @property
    def templates(self) -> Path:
        """The project's templates."""
        return self.root / "templates"

    @property
    def studies(self) -> Path:
        """One folder a study."""
        return self.root / "studies"

    @property
    def plans(self) -> Path:
        """The plans: which points are run."""
        return self.root / "workflow" / "plans"

    def cases(self, study: str, fidelity: str | None = None) -> list[Case]:
        """The cases of a study, by its name.

        Raises
        ------
        InputError
            No such study, or its file cannot be used.
        """
        return load_cases(study_file(self.studies, study), fidelity)

    def points(self, study: str, plan: str) -> Points:
        """The points of a plan for a study, both by name; a plan may be a path too.

        Raises
        ------
        InputError
            There is no such plan or study, or they do not fit together.
        """
        file = Path(plan) if plan.endswith(".yaml") else self.plans / f"{plan}.yaml"
        if not file.is_file():
            known = sorted(found.stem for found in self.plans.glob("*.yaml"))
            raise InputError(
                "no such plan",
                file=file,
                limit=f"one of: {', '.join(known)}; or the path of a .yaml file",
                remedy="choose one of these, or write one",
            )
        return plan_points(read_plan(file), file, self.cases(study)[0])

    def point_folder(self, case: Case) -> Path:
        """The folder of a process run of a plan."""
        return self.root / "results" / case.study_name / "points" / case.run_ids["process"]

    def run_folder(self, case: Case, scene: SceneName) -> Path:
        """The folder of one engine run."""
        return self.root / "results" / case.study_name / scene / case.run_ids[scene]

    def experiment_folder(self, group: str, run: str) -> Path:
        """The folder of a run of the `collide` scene, which belongs to no case of a study."""
        return self.root / "results" / group / "collide" / run


def find_project(start: Path) -> Project:
    """The project that a folder belongs to: the nearest with templates/ and studies/.

    Raises
    ------
    InputError
        There is none.
    """
    for folder in (start, *start.parents):
        if (folder / "templates").is_dir() and (folder / "studies").is_dir():
            return Project(folder)
    raise InputError(
        "not inside a dragdeck project",
        file=start,
        limit="a folder with templates/ and studies/",
        remedy="change into the project's folder",
    )


def study_templates(case: Case) -> Path:
    """A study's own templates; the folder need not exist."""
    return case.file.parent / "templates"


def by_run(cases: list[Case], scene: SceneName) -> dict[str, Case]:
    """One case for each run of a scene: cases that share a run appear once.

    Returns
    -------
    dict of str to Case
        In the order of the cases.
    """
    found: dict[str, Case] = {}
    for case in cases:
        found.setdefault(case.run_ids[scene], case)
    return found
