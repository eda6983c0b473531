# What the rules share: the study, its cases, the paths of its runs.
import json
import os
import re
import signal
import sys
from functools import cache
from pathlib import Path
from shlex import join, quote

import yaml
from jsonschema import Draft202012Validator
from snakemake.exceptions import WorkflowError

from dragdeck.campaigns.restitution_drops import record_file
from dragdeck.cases.ranks import CORES_VARIABLE, cores_here
from dragdeck.decks.templates import environment, template_files
from dragdeck.errors import DragdeckError, choices
from dragdeck.outlook.runs import expected_runs, plan_in_words
from dragdeck.outlook.timestep import largest_of_case
from dragdeck.project import (
    OUTCOMES,
    PLACES,
    POINTS,
    WINDOWS,
    Project,
    by_folder,
    by_run,
    run_path,
    study_files,
    study_templates,
)
from dragdeck.scenes.lead import FIRST_WINDOWS, led, with_leads, windows_of
from dragdeck.scenes.registry import SCENES
from dragdeck.engine.reports import say, shown_bytes
from dragdeck.engine.space import free_bytes
from dragdeck.snakemake_lock import hold_lock
from dragdeck.source_hash import source_hash
from dragdeck.study.check import warnings
from dragdeck.study.yaml import read_yaml
from evidence.stability.points import bed_settings
from evidence.verification.suite import suite_of


def locking_call():
    """The arguments of this call; none of a job within one, or of one that makes no files."""
    idle = {"-n", "--dry-run", "--dryrun", "--lint", "--nolock"} & set(sys.argv)
    return "" if idle or not workflow.is_main_process else join(sys.argv[1:])


hold_lock(Path(".snakemake"), say, locking_call())


def explained(function, *arguments):
    """The value of a function; what is wrong with its input ends the workflow."""
    try:
        return function(*arguments)
    except DragdeckError as error:
        raise WorkflowError(str(error))


explained(read_yaml, Path("config/config.yaml"))


configfile: "config/config.yaml"


# Runs have no more ranks than the cores that this call was given; with a queue, than a node has.
if workflow.is_main_process and workflow.local_exec and workflow.resource_settings.cores:
    given = min(workflow.resource_settings.cores, explained(cores_here))
    os.environ[CORES_VARIABLE] = str(given)

SCHEMA = yaml.safe_load(Path(workflow.source_path("../schemas/config.schema.yaml")).read_text())


def check_settings():
    """Refuse unknown keys and unfit values of config/config.yaml and --config."""
    for key, value in config.items():
        text = config[key] = "" if value is None else str(value)
        known = SCHEMA["properties"].get(key)
        if known is None:
            problem, limit = "unknown key", choices(str(key), SCHEMA["properties"])
        elif not Draft202012Validator(known).is_valid(text):
            problem, limit = known["title"], known["description"]
        else:
            continue
        raise WorkflowError(f"--config {key}={text}: {problem}\n  limit:  {limit}")


check_settings()
PROJECT = Project(Path(workflow.basedir))
STUDY, FIDELITY, PLAN, STABILITY_MAP, COLOURS = (
    config.get(key, "") for key in SCHEMA["properties"]
)
PLAN, VALIDATION = PLAN or "default", PLAN or "paper"
explained(PROJECT.plan_file, PLAN)
CASES = explained(PROJECT.cases, STUDY, FIDELITY or None)

for WARNING in dict.fromkeys(text for case in CASES for text in map(str, warnings(case.study))):
    logger.warning(f"warning: {STUDY}: {WARNING}")


wildcard_constraints:
    study="[A-Za-z0-9._-]+",
    run="[A-Za-z0-9._-]+",


RECORD = {place: "outcome.json" if place in OUTCOMES else "run.json" for place in PLACES}

# A run of LIGGGHTS, and a further workpiece of one: its number follows the run's name.
ENGINE_RUN = "[A-Za-z0-9._-]+-[0-9a-f]{8}"
FURTHER_WORKPIECE = f"{ENGINE_RUN}[.][0-9]+"


# --- paths ---------------------------------------------------------------------------


def of_run(place, file):
    """Path of a file of a run, as a pattern."""
    return f"{run_path('{study}', place, '{run}')}/{file}"


def tables_of(place, names):
    """Paths of tables of a run, as patterns."""
    return [of_run(place, f"tables/{name}") for name in names]


def of_study(folder, file):
    """Path of a file about the study as a whole."""
    return f"results/{STUDY}/{folder}/{file}"


def of_tradeoff(file):
    """Path of a file of the report on a plan's points."""
    return of_study(f"tradeoff/{Path(PLAN).stem}", file)


def every_folder(place):
    """The folder of every run of the study's cases."""
    return [run_path(STUDY, place, run) for run in by_folder(CASES, PLACES[place])]


def every(place, *files):
    """Files of every run of the study's cases."""
    return [f"{folder}/{file}" for folder in every_folder(place) for file in files]


def every_table(place):
    """The tables of every run of the study's cases."""
    return every(place, *(f"tables/{name}" for name in PLACES[place].tables))


WINDOWS_RECORD = "workflow/dragdeck/data/windows.json"


def relative(file):
    """Path from the project, where the workflow runs; other paths stay as they are."""
    return file.relative_to(PROJECT.root) if file.is_relative_to(PROJECT.root) else file


@cache
def templates_of(scene):
    """Every template that a scene's deck is made of."""
    templates = explained(environment, PROJECT.templates, study_templates(CASES[0]))
    return [str(relative(file)) for file in explained(template_files, templates, scene)]


def page_templates(*names, package="analysis/dragchain"):
    """The templates of a page, with those that all pages are made of."""
    shared = PROJECT.root / "analysis/dragchain/report"
    own = [PROJECT.root / package / name for name in names]
    return [str(file) for file in (*own, shared / "page.html.j2", shared / "macros.html.j2")]


def network_page_files():
    """What a page on the contact network is made of beside the data of its run."""
    folder = PROJECT.root / "analysis/dragchain/network_page"
    return [str(folder / name) for name in ("network.html.j2", "network.css", "network.js")]


# --- cases and runs ------------------------------------------------------------------


@cache
def points(plan=PLAN):
    """The points of a plan, the trade-off's if no other."""
    return explained(PROJECT.points, STUDY, plan)


@cache
def points_by_run(scene, plan=PLAN, leads=False):
    """A case of a plan for each run of a scene; those that lead to others too, if asked."""
    cases = points(plan).of(SCENES[scene])
    return by_run(with_leads(cases) if leads and SCENES[scene].needs_bed else cases, SCENES[scene])


def origins(place):
    """Where cases of a folder's runs come from: how to name them on the command line, and by run."""
    scene, own = PLACES[place], CASES
    if place == WINDOWS:
        own = [window for case in CASES for window in windows_of(case)]
    elif scene.needs_bed:
        own = with_leads(CASES)
    if place != POINTS:
        yield fidelity_option(), by_folder(own, scene)
    yield f"--plan {PLAN}", points_by_run(scene.name, leads=True)
    yield f"--plan {VALIDATION}", points_by_run(scene.name, VALIDATION, leads=True)


def origin_of(place, run):
    """How to name the cases among which a run is, and its case: a study's before a plan's."""
    return next((option, runs[run]) for option, runs in origins(place) if run in runs)


def case_of(place, run):
    """A case that a run belongs to."""
    _, case = origin_of(place, run)
    return case


def every_point(file, plan=PLAN):
    """One file of every process run of a plan."""
    return [f"{run_path(STUDY, POINTS, run)}/{file}" for run in points_by_run("process", plan)]


def every_packing(file):
    """One file of every run of the validation that differs from its first by the seed alone."""
    runs = points_by_run("process", VALIDATION)
    first = next(iter(runs.values())).study
    alike = [
        run
        for run, case in runs.items()
        if case.study.model_copy(update={"seed": first.seed}) == first
    ]
    return [f"{run_path(STUDY, POINTS, run)}/{file}" for run in alike]


def planned_runs(jobs):
    """The engine runs of jobs: what is expected of each, and how far it is."""
    found, places = {}, {f"run_{place}": place for place in PLACES}
    for job in jobs:
        if place := places.get(job.rule.name):
            folder = PROJECT.root / Path(job.output[0]).parent
            found.setdefault(place, {})[folder] = case_of(place, job.wildcards.run)
    runs = (expected_runs(PLACES[place], folders) for place, folders in found.items())
    return [run.now() for several in runs for run in several]


def tell_numbers():
    """Say where the report is, with its main numbers; nothing if there is none."""
    said = shell("dragchain step numbers results/{STUDY}/report 2> /dev/null || true", read=True)
    if said.strip():
        logger.info(said.rstrip(), extra={"shown": True})


# --- parameters of rules, as functions of their wildcards ----------------------------


def digest_of(place):
    """Hash of what a run's files say."""
    return lambda wildcards: PLACES[place].digest(case_of(place, wildcards.run))


def ranks_of(place):
    """Number of LIGGGHTS processes of a run."""
    if PLACES[place].single_particle:
        return 1
    return lambda wildcards: case_of(place, wildcards.run).ranks


def cases_option(place):
    """How to name the cases among which a run is on the command line."""
    return lambda wildcards: origin_of(place, wildcards.run)[0]


def fidelity_option(wildcards=None):
    """How to name the fidelity on the command line."""
    return f"--fidelity {FIDELITY}" if FIDELITY else ""


def of_its_bed(place, file):
    """A file of the filling that a run starts from; none for a run that starts from none."""

    def name(wildcards):
        filling = SCENES["filling"].run_id(case_of(place, wildcards.run))
        return f"{run_path(wildcards.study, 'filling', filling)}/{file}"

    return name if PLACES[place].needs_bed else []


def of_whole_run(place, file):
    """A file of the run that a further workpiece shares."""
    return lambda wildcards: of_run(place, file).format(
        study=wildcards.study, run=wildcards.run.rpartition(".")[0]
    )


def of_its_lead(place):
    """The record of the run from which a run goes on, if there is one."""

    def names(wildcards):
        lead = led(case_of(place, wildcards.run)).lead
        run = lead and SCENES["process"].run_id(lead)
        return [f"{run_path(wildcards.study, 'process', run)}/run.json"] if lead else []

    return names if PLACES[place].needs_bed else []


# --- windows ----------------------------------------------------------------------


def round_file(wildcards, number):
    """The file of a round of windows of a run; the round is judged first."""
    run = {"study": wildcards.study, "run": wildcards.run}
    return checkpoints.judge_windows.get(**run, round=number).output[0]


def windows_of_round(wildcards):
    """The folders of the windows that a round judges: of those that the one before wanted."""
    wanted = FIRST_WINDOWS
    if before := round_before(wildcards):
        wanted = json.loads(Path(before).read_text())["wanted"]
    runs = [SCENES["process"].run_id(one) for one in windows_of_run(wildcards)[:wanted]]
    return [run_path(wildcards.study, WINDOWS, run) for run in runs]


def records_of_round(wildcards):
    """How the windows of a round ended."""
    return [f"{folder}/{RECORD[WINDOWS]}" for folder in windows_of_round(wildcards)]


def round_before(wildcards):
    """The file of the round before, if there is one."""
    number = int(wildcards.round)
    return round_file(wildcards, number - 1) if number > 1 else []


def windows_of_run(wildcards):
    """All windows that a run may have."""
    return windows_of(case_of("process", wildcards.run))


def last_round(wildcards):
    """The last round of windows of a run, if it has any."""
    if not windows_of_run(wildcards):
        return []
    number = 1
    while not json.loads(Path(file := round_file(wildcards, number)).read_text())["last"]:
        number += 1
    return file


def windows_options(wildcards, input):
    """What the windows of a run are asked for, as options of the command line."""
    asked = case_of("process", wildcards.run).study.chosen_fidelity().windows
    quantities = " ".join(map(quote, asked.quantities))
    before = f"--before {input.before}" if input.before else ""
    return (
        f"--tolerance {asked.tolerance} --quantities {quantities} {before}"
        f" --most {len(windows_of_run(wildcards))}"
    )


ADVICE = f"results/{STUDY}/advice.json"


def asked_advice(place):
    """The advice of a study in which a case asks for a tolerance; nothing for other runs."""
    asked = any(case.asked for case in CASES)
    concerned = place != POINTS and not PLACES[place].single_particle
    return ancient([ADVICE] if asked and concerned else [])


def advice_option(wildcards):
    """How to name the advice on the command line, if there is or will be one."""
    known = asked_advice("process") or (PROJECT.root / ADVICE).is_file()
    return f"--advice {ADVICE}" if known else ""


# --- calibration ------------------------------------------------------------------


def drop_record(wildcards):
    """The measured drop test of the study."""
    return str(relative(explained(record_file, CASES[0])))


def fall_time(wildcards):
    """Free fall before the first impact of the drop test, s."""
    study = CASES[0].study
    return (2 * study.drop_test.height_m / study.gravity_m_s2) ** 0.5


def calibration_inputs():
    """What the drops of a calibration are made from: the study and the drop's templates."""
    return [str(relative(CASES[0].file)), *templates_of("drop_test")]


# --- verification -----------------------------------------------------------------


def of_experiment(run, file):
    """Path of a file of a run of the verification suite."""
    return f"{run_path('verification', 'collide', run)}/{file}"


# --- stability map ----------------------------------------------------------------


def stability_templates():
    """Every template that a deck of the stability map could use."""
    files = sorted(PROJECT.templates.glob("*.j2"))
    return [str(file.relative_to(PROJECT.root)) for file in files]


def stability_beds():
    """Folders of the fillings that columns and drags start from; none without a map."""
    file = PROJECT.root / STABILITY_MAP
    names = explained(bed_settings, file) if file.is_file() else []
    return [run_path("stability", "filling", name) for name in names]


def beds_of_regime(wildcards):
    """Columns and drags start from settled beds."""
    wanted = wildcards.regime in ("column", "drag")
    return [f"{bed}/tables/packing.json" for bed in STABILITY_BEDS] if wanted else []


# --- trade-off --------------------------------------------------------------------


def every_drop_point(file):
    """One file of every drop test of the trade-off."""
    return [f"{run_path(STUDY, 'drop_test', run)}/{file}" for run in points_by_run("drop_test")]


# --- scaling ----------------------------------------------------------------------


def scaling_options(wildcards):
    """What the study's block scaling asks for, as options of the command line."""
    scaling = CASES[0].study.scaling
    if scaling is None:
        raise WorkflowError(
            f"{relative(CASES[0].file)}: scaling: a required key is missing\n"
            "  remedy: name the field to fit a power law over, see docs/howto/sweep.md"
        )
    options = ["--field", scaling.field]
    if scaling.expected_exponent is not None:
        options += ["--expected", scaling.expected_exponent]
    if scaling.source is not None:
        options += ["--source", scaling.source]
    if scaling.fit_range is not None:
        options += ["--fit-range", *scaling.fit_range]
    return " ".join(quote(str(option)) for option in options)


# --- crate ------------------------------------------------------------------------


def crate_inputs():
    """Study files, templates and meshes of all scenes."""
    files = explained(study_files, CASES)
    templates = (file for scene in SCENES for file in templates_of(scene))
    return list(dict.fromkeys([*(str(relative(file)) for file in files), *templates]))


def licence_option(wildcards=None):
    """How to name the licence of the results on the command line, if the study states one."""
    licence = CASES[0].study.licence
    return quote(f"--licence={licence}") if licence else ""
