# What the rules share: the study, its cases, the paths of its runs.
from pathlib import Path

from snakemake.exceptions import WorkflowError

from dragdeck.errors import DragdeckError
from dragdeck.project import Project, by_run, study_templates
from dragdeck.render import template_files
from dragdeck.sources import source_hash

PROJECT = Project(Path(workflow.basedir))
STUDY = config.get("study", "uhlmann2015")
FIDELITY = config.get("fidelity")

try:
    CASES = PROJECT.cases(STUDY, FIDELITY)
except DragdeckError as error:
    raise WorkflowError(str(error))

RUN = "results/{study}/{scene}/{run}/"
DROP = RUN.replace("{scene}", "drop")
FILL = RUN.replace("{scene}", "fill")
PROCESS = RUN.replace("{scene}", "process")
REPORT = "results/{study}/report/"


wildcard_constraints:
    study="[A-Za-z0-9._-]+",
    scene="drop|fill|process",
    run="[A-Za-z0-9._-]+",


def every(scene, file):
    """One file of every run of a scene."""
    return [
        (RUN + file).format(study=STUDY, scene=scene, run=run) for run in by_run(CASES, scene)
    ]


def case_of(scene, run):
    """A case that a run belongs to."""
    return by_run(CASES, scene)[run]


def deck_inputs(wildcards):
    """The study file and every template that its decks could use."""
    case = CASES[0]
    return [
        str(path.relative_to(PROJECT.root))
        for path in (case.file, *template_files(PROJECT.templates, study_templates(case)))
    ]


def fidelity_option(wildcards):
    """How to name the fidelity on the command line."""
    return f"--fidelity {FIDELITY}" if FIDELITY else ""


def ranks(scene):
    """Number of engine processes of a run, as a function of its wildcards."""
    return lambda wildcards: case_of(scene, wildcards.run).study.chosen_fidelity().ranks
