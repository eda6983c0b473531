"""The suite as a whole: its file, and every experiment by its run id."""

from collections.abc import Iterator, Mapping
from importlib import resources
from pathlib import Path
from typing import Protocol

import yaml

from dragdeck.decks.render import write_run
from dragdeck.decks.templates import environment
from dragdeck.project import find_project, run_path, study_templates
from dragdeck.study.base import Model, Whole
from dragdeck.study.model import Study
from evidence.verification.collide import Experiment, collide_scene
from evidence.verification.impacts import Impacts
from evidence.verification.lab import Lab, Substance
from evidence.verification.single import Bounce, Column, Incline, Momentum


class Experiments(Protocol):
    """What every kind of test can do."""

    def experiments(self, name: str, lab: Lab) -> Iterator[Experiment]:
        """The runs of a test of that name."""


class SuiteFile(Model):
    """The content of ``suite.yaml``: the registry of tests."""

    materials: dict[str, Substance]
    steps_per_contact: Whole
    impacts: dict[str, Impacts]
    bounce: Bounce
    momentum: Momentum
    column: Column
    incline: Incline

    def tests(self) -> Mapping[str, Experiments]:
        """Every test by its name."""
        single = ("bounce", "momentum", "column", "incline")
        return {**self.impacts, **{name: getattr(self, name) for name in single}}

    def lab(self, study: Study) -> Lab:
        """Where the experiments for a study are made."""
        return Lab(self.materials, study, self.steps_per_contact)


def suite_file() -> SuiteFile:
    """Read the suite that comes with the package."""
    file = resources.files("evidence.verification").joinpath("suite.yaml")
    return SuiteFile.model_validate(yaml.safe_load(file.read_text(encoding="utf-8")))


def suite_of(study: Study) -> Mapping[str, Experiment]:
    """The experiments of the suite for a study, by run id."""
    file = suite_file()
    lab = file.lab(study)
    every = (one for name, test in file.tests().items() for one in test.experiments(name, lab))
    return {experiment.case.run: experiment for experiment in every}


def render_suite(study: str, fidelity: str | None) -> None:
    """Write the input files of the suite for the materials of a study."""
    project = find_project(Path.cwd())
    case = project.cases(study, fidelity)[0]
    templates = environment(project.templates, study_templates(case))
    for run, experiment in suite_of(case.study).items():
        folder = project.root / run_path(experiment.case.study, "collide", run)
        write_run(collide_scene(experiment), folder, templates)
