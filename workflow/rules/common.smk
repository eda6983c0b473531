# What the rules share: the call's settings, and the study with its runs as `WORK` (dragdeck.rules).
import os
import signal
import sys
from functools import cache, partial
from pathlib import Path
from shlex import join, quote

import yaml
from snakemake.scheduling.job_scheduler import JobScheduler

from dragdeck.cases.ranks import CORES_VARIABLE, cores_here
from dragdeck.engine.reports import say, shown_bytes
from dragdeck.engine.space import free_bytes
from dragdeck.outlook.runs import plan_in_words
from dragdeck.outlook.timestep import largest_of_case
from dragdeck.project import (
    OUTCOMES,
    PLACES,
    POINTS,
    WINDOWS,
    by_run,
    project_here,
    run_path,
    scaling_of,
    ENGINE_RUN,
    FURTHER_WORKPIECE,
    RECORD,
    RUNNERS,
    of_run,
    deck_files,
    tables_of,
)
from dragdeck.records.figures import figures_of
from dragdeck.rules import of_whole_run
from dragdeck.calls import add_records, or_stop, checked_settings, home_of
from dragdeck.scenes.process import SCENES
from dragdeck.shipped import own_or_shipped
from dragdeck.snakemake_lock import hold_lock
from dragdeck.snakemake_timers import look_again_once
from dragdeck.source_hash import source_hash
from dragdeck.study.check import warnings
from dragdeck.study.yaml import read_yaml
from dragdeck.workflow_rounds import WorkflowInRounds


def locking_call():
    """The arguments of this call; none of a job within one, or of one that makes no files."""
    idle = {"-n", "--dry-run", "--dryrun", "--lint", "--nolock"} & set(sys.argv)
    return "" if idle or not workflow.is_main_process else join(sys.argv[1:])


hold_lock(Path(".snakemake"), say, locking_call())
look_again_once(JobScheduler)
PROJECT = or_stop(project_here)
CONFIG_FILE = own_or_shipped(PROJECT.root, "config/config.yaml")
or_stop(read_yaml, CONFIG_FILE)


configfile: CONFIG_FILE


# Runs have no more ranks than the cores that this call was given; with a queue, than a node has.
if workflow.is_main_process and workflow.local_exec and workflow.resource_settings.cores:
    given = min(workflow.resource_settings.cores, or_stop(cores_here))
    os.environ[CORES_VARIABLE] = str(given)

SCHEMA = yaml.safe_load(Path(workflow.source_path("../schemas/config.schema.yaml")).read_text())
TYPED = workflow.config_settings.config_args or []
config.update(checked_settings(config, SCHEMA["properties"], TYPED))
STUDY, FIDELITY, PLAN, COLOURS = (
    config.get(key, "") for key in ("study", "fidelity", "plan", "colours")
)
PLAN, VALIDATION = PLAN or "default", PLAN or "paper"
STUDIES = list(filter(None, config.get("studies", "").split(","))) or [STUDY]
STUDY = STUDIES[0]


def made(checkpoint, **wildcards):
    """The file that a checkpoint makes; it is made first."""
    return getattr(checkpoints, checkpoint).get(**wildcards).output[0]


def shown(file, caption, category, figure="report", run="all"):
    """A result for the report of Snakemake, with a caption and under a category."""
    labels = {"run": run, "figure": figure}
    return report(file, caption=f"../report/{caption}.rst", category=category, labels=labels)


WORK = WorkflowInRounds(PROJECT, STUDY, FIDELITY, PLAN, VALIDATION, made)
CASES = WORK.cases
home_of_study = cache(partial(home_of, idle=not locking_call()))
HOME = home_of_study(STUDY)

for NAME in STUDIES:
    MESSAGES = [text for case in WORK.of(NAME).cases for text in map(str, warnings(case.study))]
    for WARNING in dict.fromkeys([*MESSAGES, *or_stop(list, WORK.of(NAME).other_engines())]):
        logger.warning(f"warning: {NAME}: {WARNING}")


wildcard_constraints:
    study="[A-Za-z0-9._-]+",
    studies="[A-Za-z0-9._+-]+",
    run="[A-Za-z0-9._-]+",
    round="[1-9][0-9]*",


def home(wildcards):
    """A file that is newer than what was copied here of a study."""
    return home_of_study(wildcards.study)


INTERRUPTED = []


def interrupted(number, frame):
    """Note that the user stopped the workflow, and stop it as ever."""
    INTERRUPTED.append(number)
    signal.default_int_handler(number, frame)


def reported(jobs):
    """The studies whose report is among jobs."""
    return [job.wildcards.study for job in jobs if job.rule.name == "write_report"]


def tell_numbers(study):
    """Say where the report is, with its main numbers; nothing if there is none."""
    said = shell("dragchain step numbers results/{study}/report 2> /dev/null || true", read=True)
    if said.strip():
        logger.info(said.rstrip(), extra={"shown": True})
