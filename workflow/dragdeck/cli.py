"""The ``dragdeck`` command."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from dragdeck import __version__
from dragdeck.cases import SCENES, Case, SceneName
from dragdeck.errors import DragdeckError, InputError
from dragdeck.project import Project, by_run, find_project, study_templates
from dragdeck.scenes import Bed, Scene, drop_scene, fill_scene, process_scene

if TYPE_CHECKING:
    from dragdeck.advice import Advice
    from dragdeck.speed import Speed


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; errors of the user's go to standard error without a traceback."""
    options = _parser().parse_args(arguments)
    try:
        options.action(options)
    except DragdeckError as error:
        print(f"dragdeck: {error}", file=sys.stderr)
        return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="dragdeck", description="Decks and runs for LIGGGHTS.")
    parser.add_argument("--version", action="version", version=f"dragdeck {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    check = commands.add_parser("check", help="check a study and the engine, run nothing")
    check.set_defaults(action=_check)
    explain = commands.add_parser("explain", help="what the decks model, leave out and cost")
    explain.set_defaults(action=_explain)
    cases = commands.add_parser("cases", help="list the cases of a study and their runs")
    cases.set_defaults(action=_cases)
    render = commands.add_parser("render", help="write the deck of one run")
    render.set_defaults(action=_render)
    verify = commands.add_parser("verify", help="write the decks of the verification suite")
    verify.set_defaults(action=_verify)
    for command in (check, explain, cases, render, verify):
        command.add_argument("study", help="name of a folder in studies/")
        command.add_argument("--fidelity", help="instead of the study's own")
    cases.add_argument("--plan", help="the points of this trade's plan instead")
    explain.add_argument("scene", nargs="?", choices=SCENES, help="one scene only")
    render.add_argument("scene", choices=SCENES)
    render.add_argument("run", help="run id, as `dragdeck cases` lists it")
    render.add_argument("--plan", help="the run is a point of this trade's plan")
    render.add_argument("--fill-table", type=Path, help="fill.json of the settled bed (process)")

    advise = commands.add_parser("advise", help="settings for a tolerance, their error and cost")
    advise.set_defaults(action=_advise)
    advise.add_argument("study", help="name of a folder in studies/")
    advise.add_argument("--fidelity", help="instead of the study's own")
    advise.add_argument("--tolerance", type=float, help="instead of the study's own")
    advise.add_argument("--quantity", help="what the tolerance is about")
    advise.add_argument("--quick", action="store_true", help="do not measure the engine's speed")

    fields = commands.add_parser("fields", help="print the fields of a study file as a page")
    fields.set_defaults(action=_fields)
    drops = commands.add_parser("drops", help="run the drops that a calibration needs")
    drops.set_defaults(action=_drops)
    drops.add_argument("study", help="name of a folder in studies/")
    drops.add_argument("set", choices=("sweep", "confirm", "trials"))
    drops.add_argument("--fidelity", help="instead of the study's own")
    drops.add_argument("--out", type=Path, required=True, metavar="DIR", help="their folder")
    drops.add_argument("--fit", type=Path, help="result.json of the fit (confirm)")
    drops.add_argument("--count", type=int, default=10, help="number of trials")
    drops.add_argument("--seed", type=int, default=1, help="seed of the trials")
    batch = commands.add_parser("stability", help="run one regime of the stability map")
    batch.set_defaults(action=_stability)
    batch.add_argument("regime", help="impact, settle, beds, column or drag")
    batch.add_argument("--map", type=Path, required=True, help="the points: a map.yaml")
    costs = commands.add_parser("costs", help="time what each thing left out would cost")
    costs.set_defaults(action=_costs)
    costs.add_argument("study", help="name of a folder in studies/")
    costs.add_argument("--fidelity", help="instead of the study's own")
    costs.add_argument("--rounds", type=int, default=3, help="how often each deck is timed")
    costs.add_argument(
        "--seconds", type=float, metavar="S", help="drag of the standard deck that is timed"
    )
    costs.add_argument("--only", nargs="+", default=[], metavar="NAME", help="these variants only")
    costs.add_argument("--out", type=Path, required=True, metavar="FILE", help="costs.json")

    run = commands.add_parser("run", help="run the deck in a folder, or go on with it")
    run.set_defaults(action=_run)
    run.add_argument("folder", type=Path)
    run.add_argument("--outcome", type=Path, metavar="FILE", help="a failed run is an outcome too")
    run.add_argument("--again", action="store_true", help="start anew, even if it failed before")
    run.add_argument(
        "--every", type=float, default=10.0, metavar="S", help="seconds between reports"
    )
    return parser


def scene_of(case: Case, scene: SceneName, bed: Bed | None = None) -> Scene:
    """Build a scene of a case; `bed` matters to a process only."""
    if scene == "drop":
        return drop_scene(case)
    if scene == "fill":
        return fill_scene(case)
    return process_scene(case, bed)


def _expectations(case: Case, name: SceneName, scene: Scene) -> list[tuple[str, str]]:
    """What is known of a scene's time step and bed before it is run."""
    from dragdeck.advice import breaking_note
    from dragdeck.outlook import notes as bed_notes
    from dragdeck.stability import notes

    found = [*notes(case, name, scene), *(breaking_note(case) if name == "process" else [])]
    return found if name == "drop" else [*found, *bed_notes(case)]


def _check(options: argparse.Namespace) -> None:
    from dragdeck.engine import find_engine
    from dragdeck.render import deck_text, environment

    project = find_project(Path.cwd())
    cases = project.cases(options.study, options.fidelity)
    templates = environment(project.templates, study_templates(cases[0]))
    warnings: dict[str, None] = {}
    for name in SCENES:
        for run_id, case in by_run(cases, name).items():
            scene = scene_of(case, name)
            deck_text(scene, templates)
            print(f"{name} {run_id}: time step {scene.deck.timestep_s:.3g} s")
            for what, text in _expectations(case, name, scene):
                print(f"  {what}: {text}")
            warnings.update(dict.fromkeys(f"{case.name}: {text}" for text in scene.warnings))
    for warning in warnings:
        print(f"warning: {warning}")
    print(f"{options.study}: {len(cases)} case(s) can be run; LIGGGHTS {find_engine().version}")


def _explain(options: argparse.Namespace) -> None:
    from dragdeck.explain import expected_cost, explanation, show

    project = find_project(Path.cwd())
    cases = project.cases(options.study, options.fidelity)
    names: tuple[SceneName, ...] = (options.scene,) if options.scene else SCENES
    runs = [(case, name) for name in names for case in by_run(cases, name).values()]
    results = project.root / "results" / options.study
    scenes = ((case, name, scene_of(case, name)) for case, name in runs)
    show(
        explanation(
            scene,
            expected_cost(scene, results / name),
            _expectations(case, name, scene),
        )
        for case, name, scene in scenes
    )


def _advise(options: argparse.Namespace) -> None:
    from pydantic import ValidationError

    from dragdeck.advice import advise, measured_trade
    from dragdeck.explain import show
    from dragdeck.forecast import advice_json, forecast, own_option, question, roles, tables
    from dragdeck.study import explained

    project = find_project(Path.cwd())
    cases = list(by_run(project.cases(options.study, options.fidelity), "process").values())
    results, trade = project.root / "results" / options.study, measured_trade()
    try:
        asked = [question(case, options.tolerance, options.quantity) for case in cases]
    except ValidationError as error:
        raise explained(error, "command line") from None
    advices = [advise(case, wanted) for case, wanted in zip(cases, asked, strict=True)]
    quick = options.quick or all(wanted.quantity == "restitution" for wanted in asked)
    speed = None if quick else _speed(project, cases[0], advices[0])
    found = []
    for case, advice in zip(cases, advices, strict=True):
        own = own_option(case, advice.asked, trade)
        rows = [forecast(case, *row, speed, results) for row in roles(advice, own)]
        found.append((advice, rows))
        show(tables(case, advice, rows, own))
    _keep(results / "advice.json", advice_json(cases[0], found, speed))


def _speed(project: Project, case: Case, advice: Advice) -> Speed:
    """The speed of this machine at the advised settings."""
    import tempfile

    from dragdeck.advice import with_option
    from dragdeck.render import environment
    from dragdeck.speed import calibrate

    chosen = replace(case, study=with_option(case.study, advice.chosen))
    templates = environment(project.templates, study_templates(case))
    with tempfile.TemporaryDirectory(prefix="dragdeck-") as folder:
        return calibrate(chosen, Path(folder), templates, lambda line: print(line, file=sys.stderr))


def _keep(file: Path, content: object) -> None:
    """Write a JSON file where that is possible; what was printed counts without it."""
    from dragdeck.render import replace_text

    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        replace_text(file, json.dumps(content, indent=1, allow_nan=False) + "\n")
    except OSError as error:
        print(f"not written: {error}", file=sys.stderr)


def _fields(options: argparse.Namespace) -> None:
    from dragdeck.fields import page

    print(page(), end="")


def _cases(options: argparse.Namespace) -> None:
    from rich.table import Table

    from dragdeck.explain import show

    project = find_project(Path.cwd())
    table = Table("case", *SCENES)
    if options.plan is None:
        cases = project.cases(options.study, options.fidelity)
    else:
        cases = project.points(options.study, options.plan).processes
    for case in cases:
        table.add_row(case.name, *(case.run_ids[scene] for scene in SCENES))
    show([table])


def _render(options: argparse.Namespace) -> None:
    from dragdeck.render import environment, write_run

    project = find_project(Path.cwd())
    runs, folder = _runs(project, options)
    case = _case_of_run(runs, options)
    scene = scene_of(case, options.scene, _bed(options))
    for warning in scene.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    templates = environment(project.templates, study_templates(case))
    write_run(scene, folder(case), templates)


def _verify(options: argparse.Namespace) -> None:
    from dragdeck.render import environment, write_run
    from dragdeck.scenes.collide import collide_scene
    from dragdeck.verification import suite_of

    project = find_project(Path.cwd())
    case = project.cases(options.study, options.fidelity)[0]
    templates = environment(project.templates, study_templates(case))
    for run, experiment in suite_of(case.study).items():
        folder = project.experiment_folder(experiment.group, run)
        write_run(collide_scene(experiment), folder, templates)


def _runs(
    project: Project, options: argparse.Namespace
) -> tuple[dict[str, Case], Callable[[Case], Path]]:
    """The runs of a study's cases, or of a plan's points, and where each has its folder."""
    scene: SceneName = options.scene
    if options.plan is None:
        cases = project.cases(options.study, options.fidelity)
        return by_run(cases, scene), lambda case: project.run_folder(case, scene)
    points = project.points(options.study, options.plan)
    if scene == "process":
        return by_run(points.processes, scene), project.point_folder
    cases = points.drops if scene == "drop" else points.processes
    return by_run(cases, scene), lambda case: project.run_folder(case, scene)


def _case_of_run(runs: dict[str, Case], options: argparse.Namespace) -> Case:
    if options.run not in runs:
        raise InputError(
            f"no {options.scene} run of this name",
            file=f"studies/{options.study}",
            value=options.run,
            limit=f"one of: {', '.join(runs)}",
            remedy="list them with: dragdeck cases",
        )
    return runs[options.run]


def _bed(options: argparse.Namespace) -> Bed | None:
    """The settled bed; a process deck is never written on a guess."""
    if options.scene != "process":
        return None
    if options.fill_table is None:
        raise InputError(
            "a process needs the settled bed",
            field="--fill-table",
            remedy="give the fill.json that dragchain made of the fill",
        )
    measured = json.loads(options.fill_table.read_text(encoding="utf-8"))
    return Bed(surface_m=measured["fill_height_m"], top_m=measured["top_m"])


def _drops(options: argparse.Namespace) -> None:
    from dragdeck.calibration import confirmation, run_drops, sweep, trials
    from dragdeck.render import environment

    project = find_project(Path.cwd())
    case = project.cases(options.study, options.fidelity)[0]
    if options.set == "sweep":
        drops = list(sweep(case.study))
    elif options.set == "trials":
        drops = list(trials(case.study, options.count, options.seed))
    elif options.fit is not None:
        fitted = json.loads(options.fit.read_text(encoding="utf-8"))
        values = (fitted[name]["restitution"] for name in ("fit", "fit_full"))
        drops = list(confirmation(case.study, *values))
    else:
        raise InputError("nothing to confirm", field="--fit", remedy="give the fit's result.json")
    templates = environment(project.templates, study_templates(case))
    run_drops(case, drops, options.out, templates, lambda line: print(line, file=sys.stderr))


def _stability(options: argparse.Namespace) -> None:
    from dragdeck.stability_map import run_batch

    def report(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    project = find_project(Path.cwd())
    study = project.studies / "stability" / "study.yaml"
    results = project.root / "results" / "stability"
    run_batch(study, options.map, options.regime, results, project.templates, report)


def _costs(options: argparse.Namespace) -> None:
    from dragdeck.costs_run import SECONDS, measure

    def report(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    project = find_project(Path.cwd())
    case = project.cases(options.study, options.fidelity)[0]
    results = project.root / "results" / options.study
    seconds = SECONDS if options.seconds is None else options.seconds
    measure(
        case,
        results,
        project.templates,
        options.out,
        report,
        rounds=options.rounds,
        seconds=seconds,
        only=options.only,
    )


def _run(options: argparse.Namespace) -> None:
    from dragdeck.runner import outcome, run

    def report(line: str) -> None:
        print(line, file=sys.stderr, flush=True)

    if options.outcome is not None:
        outcome(options.folder, options.outcome, report, every_s=options.every)
    else:
        run(options.folder, report, again=options.again, every_s=options.every)


if __name__ == "__main__":
    sys.exit(main())
