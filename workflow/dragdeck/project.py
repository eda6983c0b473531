"""Where things are: the project's folders and the paths of a run.

The grammar of result paths stands here and nowhere else.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from dragdeck.cases import Case, SceneName, load_cases, study_file
from dragdeck.errors import InputError


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

    def cases(self, study: str, fidelity: str | None = None) -> list[Case]:
        """The cases of a study, by its name.

        Raises
        ------
        InputError
            No such study, or its file cannot be used.
        """
        return load_cases(study_file(self.studies, study), fidelity)

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
