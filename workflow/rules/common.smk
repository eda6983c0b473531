# What the rules share: the study, its cases, the paths of its runs.
from functools import cache
from pathlib import Path
from shlex import quote

from snakemake.exceptions import WorkflowError

from dragdeck.calibration import record_file
from dragdeck.errors import DragdeckError
from dragdeck.project import Project, by_run, study_templates
from dragdeck.render import environment, template_files
from dragdeck.sources import source_hash
from dragdeck.stability import largest_share
from dragdeck.verification import suite_of

PROJECT = Project(Path(workflow.basedir))
STUDY = config.get("study", "uhlmann2015")
FIDELITY = config.get("fidelity")
PLAN = config.get("plan", "default")
VALIDATION = config.get("plan", "paper")

try:
    CASES = PROJECT.cases(STUDY, FIDELITY)
except DragdeckError as error:
    raise WorkflowError(str(error))


wildcard_constraints:
    study="[A-Za-z0-9._-]+",
    run="[A-Za-z0-9._-]+",


def of_drop(file):
    """Path of a file of a drop test, as a pattern."""
    return f"results/{{study}}/drop/{{run}}/{file}"


def of_fill(file):
    """Path of a file of a fill, as a pattern."""
    return f"results/{{study}}/fill/{{run}}/{file}"


def of_process(file):
    """Path of a file of a process run, as a pattern."""
    return f"results/{{study}}/process/{{run}}/{file}"


def of_point(file):
    """Path of a file of a process run of a plan, as a pattern."""
    return f"results/{{study}}/points/{{run}}/{file}"


def of_trade(file):
    """Path of a file of the report on a trade."""
    return f"results/{STUDY}/trade-report/{Path(PLAN).stem}/{file}"


def checks_option(wildcards):
    """How to name the checks on other scenes on the command line, if they were made."""
    file = f"results/{STUDY}/trade-report/checks/checks.json"
    return f"--checks {file}" if (PROJECT.root / file).is_file() else ""


def of_validation(file):
    """Path of a file of the validation."""
    return f"results/{STUDY}/validation/{file}"


def of_scaling(file):
    """Path of a file of the study's scaling."""
    return f"results/{STUDY}/scaling/{file}"


def scaling_options(wildcards):
    """What the study's block scaling asks for, as options of the command line."""
    scaling = CASES[0].study.scaling
    if scaling is None:
        raise WorkflowError(
            f"{relative(CASES[0].file)}: scaling: a required key is missing\n"
            "  remedy: name the field to fit a power law over, see docs/scaling.md"
        )
    options = ["--field", scaling.field]
    if scaling.expected_exponent is not None:
        options += ["--expected", scaling.expected_exponent]
    if scaling.source is not None:
        options += ["--source", scaling.source]
    if scaling.within is not None:
        options += ["--within", *scaling.within]
    return " ".join(quote(str(option)) for option in options)


def of_experiment(run, file):
    """Path of a file of a run of the verification suite."""
    return f"results/verification/collide/{run}/{file}"


def page_templates(*names):
    """The templates of a page, with those that all pages are made of."""
    folder = PROJECT.root / "analysis/dragchain"
    return [str(folder / name) for name in (*names, "page.html.j2", "macros.html.j2")]


def of_report(file):
    """Path of a file of the study's report."""
    return f"results/{STUDY}/report/{file}"


ADVICE = f"results/{STUDY}/advice.json"


def asked_advice(wildcards):
    """The advice of a study in which a case asks for a tolerance; nothing for others."""
    return ancient([ADVICE] if any(case.asked for case in CASES) else [])


def advice_option(wildcards):
    """How to name the advice on the command line, if there is or will be one."""
    known = asked_advice(wildcards) or (PROJECT.root / ADVICE).is_file()
    return f"--advice {ADVICE}" if known else ""


def of_calibration(file):
    """Path of a file of the study's calibration."""
    return f"results/{STUDY}/calibration/{file}"


def drop_record(wildcards):
    """The measured drop test of the study."""
    try:
        return str(record_file(CASES[0]).relative_to(PROJECT.root))
    except DragdeckError as error:
        raise WorkflowError(str(error))


def fall_time(wildcards):
    """Free fall before the first impact of the drop test, s."""
    study = CASES[0].study
    return (2 * study.drop.height_m / study.gravity_m_s2) ** 0.5


def every_folder(scene):
    """The folder of every run of a scene."""
    return [f"results/{STUDY}/{scene}/{run}" for run in by_run(CASES, scene)]


def every(scene, file):
    """One file of every run of a scene."""
    return [f"{folder}/{file}" for folder in every_folder(scene)]


@cache
def points(plan=PLAN):
    """The points of a plan, the trade's if no other."""
    try:
        return PROJECT.points(STUDY, plan)
    except DragdeckError as error:
        raise WorkflowError(str(error))


@cache
def points_by_run(scene, plan=PLAN):
    """A case of a plan for each run of a scene."""
    return by_run(points(plan).drops if scene == "drop" else points(plan).processes, scene)


def plan_of(scene, run):
    """The plan that a run belongs to."""
    return PLAN if run in points_by_run(scene) else VALIDATION


def point(run):
    """The case of a process run of a plan."""
    return points_by_run("process", plan_of("process", run))[run]


def every_point(file, plan=PLAN):
    """One file of every process run of a plan."""
    return [f"results/{STUDY}/points/{run}/{file}" for run in points_by_run("process", plan)]


def every_fill(file):
    """One file of every run of the validation that differs from its first by the seed alone."""
    runs = points_by_run("process", VALIDATION)
    first = next(iter(runs.values())).study
    alike = [
        run
        for run, case in runs.items()
        if case.study.model_copy(update={"seed": first.seed}) == first
    ]
    return [f"results/{STUDY}/points/{run}/{file}" for run in alike]


def every_drop_point(file):
    """One file of every drop test of the trade."""
    return [f"results/{STUDY}/drop/{run}/{file}" for run in points_by_run("drop")]


def safe_step(case):
    """Largest step of a process over the Rayleigh time that is known to be safe."""
    lowest = min(pair.restitution for pair in case.study.pairs.values())
    return largest_share("process", lowest)


def case_of(scene, run):
    """A case that a run belongs to: one of the study's, or else one of a plan's points."""
    return by_run(CASES, scene).get(run) or points_by_run(scene, plan_of(scene, run))[run]


def templates_of(scene):
    """Every template that a scene's deck is made of."""
    try:
        templates = environment(PROJECT.templates, study_templates(CASES[0]))
        return [str(relative(file)) for file in template_files(templates, scene)]
    except DragdeckError as error:
        raise WorkflowError(str(error))


def calibration_inputs():
    """What the drops of a calibration are made from: the study and the drop's templates."""
    return [str(relative(CASES[0].file)), *templates_of("drop")]


def relative(file):
    """Path from the project, where the workflow runs; other paths stay as they are."""
    return file.relative_to(PROJECT.root) if file.is_relative_to(PROJECT.root) else file


def digest_of(scene):
    """Hash of what a run's files say, as a function of its wildcards."""
    return lambda wildcards: case_of(scene, wildcards.run).digest(scene)


def fidelity_option(wildcards):
    """How to name the fidelity on the command line."""
    return f"--fidelity {FIDELITY}" if FIDELITY else ""


def case_option(scene):
    """How to name the cases among which a run is, as a function of its wildcards."""

    def option(wildcards):
        if wildcards.run in by_run(CASES, scene):
            return fidelity_option(wildcards)
        return f"--plan {plan_of(scene, wildcards.run)}"

    return option


def ranks(scene):
    """Number of engine processes of a run, as a function of its wildcards."""
    return lambda wildcards: case_of(scene, wildcards.run).ranks


def fill_of(wildcards, file):
    """A file of the fill that a process run starts from."""
    fill = case_of("process", wildcards.run).run_ids["fill"]
    return f"results/{wildcards.study}/fill/{fill}/{file}"


def bed_of_point(wildcards, file):
    """A file of the fill that a point of a plan starts from."""
    fill = point(wildcards.run).run_ids["fill"]
    return f"results/{wildcards.study}/fill/{fill}/{file}"


def of_every_run(wildcards):
    """All that the report reads."""
    return [
        *every("process", "run.json"),
        *every("process", "tables/figures.json"),
        *every("process", "tables/closure.json"),
        *every("process", "tables/removal.json"),
        *every("fill", "run.json"),
        *every("fill", "tables/fill.json"),
        *every("fill", "tables/figures.json"),
        *every("drop", "run.json"),
        *every("drop", "tables/impacts.parquet"),
        *every("drop", "tables/figures.json"),
    ]


def stability_templates():
    """Every template that a deck of the stability map could use."""
    files = sorted(PROJECT.templates.glob("*.j2"))
    return [str(file.relative_to(PROJECT.root)) for file in files]


def beds_of_regime(wildcards):
    """Columns and drags start from settled beds."""
    wanted = wildcards.regime in ("column", "drag")
    return ["results/stability/points/beds.json"] if wanted else []
