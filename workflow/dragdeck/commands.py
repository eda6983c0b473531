"""What the commands of ``dragdeck`` do, and some of its steps."""

import shutil
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import jinja2
from pydantic import ValidationError
from rich.table import Table

from dragdeck import project as projects
from dragdeck.advice import forecast as forecasts
from dragdeck.advice.advise import advised_settings
from dragdeck.cases.bed import clump_of
from dragdeck.cases.case import Case
from dragdeck.decks import render as rendering
from dragdeck.engine.reports import say
from dragdeck.errors import DragdeckError, InputError, choices, together
from dragdeck.files import write_bytes
from dragdeck.outlook.built import built_scene, friction_unknown, refuse_tolerance
from dragdeck.outlook.explain import explanation, show
from dragdeck.outlook.explain import scene_lines as page_of_scene
from dragdeck.outlook.process import reduced
from dragdeck.physics.packing import Bed
from dragdeck.preview.layout import layout
from dragdeck.preview.picture import picture, small_picture
from dragdeck.records.advice import AdviceFile
from dragdeck.records.run import changed_in_words
from dragdeck.records.tradeoff import TradeoffRecord, measured_tradeoff
from dragdeck.scenes.lead import with_leads
from dragdeck.scenes.process import SCENES
from dragdeck.scenes.scene import SceneType, StudyScene, read_bed
from dragdeck.scenes.workpiece import remeshing
from dragdeck.script.commands import contact_laws
from dragdeck.study.check import explained
from dragdeck.study.contact_law import coefficients, modelled
from dragdeck.study.yaml import located
from dragdeck.sweep.cases import new_study


def _scene_type(name: str) -> SceneType:
    """A scene by its name.

    Raises
    ------
    InputError
        There is none of this name.
    """
    if name not in SCENES:
        raise InputError("no such scene", value=name, limit=f"one of: {', '.join(SCENES)}")
    return SCENES[name]


def explain(study: str, fidelity: str | None, scene: str | None, verbose: bool) -> None:
    """Show what the input scripts of a study model and leave out, and what that would cost."""
    project = projects.find_project(Path.cwd())
    every = project.cases(study, fidelity)
    templates = project.templates_of(every[0])
    for kind in [_scene_type(scene)] if scene else SCENES.values():
        cases = list(projects.by_run(every, kind).values())
        for case in cases if verbose else cases[:1]:
            scripted = _as_scripted(built_scene(kind, case, None), templates)
            if verbose:
                show([explanation(scripted, measured_tradeoff())])
            else:
                width = min(100, shutil.get_terminal_size().columns)
                print(*page_of_scene(scripted, len(cases), width), sep="\n")
    if not verbose:
        print("For every run, with reasons and costs: --verbose")


def _as_scripted(scene: StudyScene, templates: jinja2.Environment) -> StudyScene:
    """A scene with what its input script models, whatever the study says."""
    text = rendering.deck_text(scene, templates)
    changed = rendering.changed_scripts(text, scene, templates)
    if not changed:
        return scene
    there = set().union(*map(modelled, contact_laws(text)))
    modelling = scene.modelling(there, {row.words for row in coefficients().values() if row.model})
    told = {changed_in_words(changed): "docs/howto/input_scripts.md"}
    return replace(modelling, models={**told, **modelling.models})


def preview(study: str, fidelity: str | None, case: str | None) -> None:
    """Draw one case of a study, also one that `check` refuses."""
    project = projects.find_project(Path.cwd())
    every = project.cases(study, fidelity)
    chosen = _case_named(every, case)
    try:
        scene = layout(chosen)
    except InputError as error:
        raise located(error) from None
    file = project.results(study) / "preview.png"
    title = [f"{study}, case {chosen.name}", remeshing(chosen) or "", reduced(chosen, 1)]
    write_bytes(file, picture(scene, "\n".join(filter(None, title))))
    print(f"{study}: case {chosen.name}" + (f", one of {len(every)} (--case)" if every[1:] else ""))
    print(file)


def draw_set_up(study: str, fidelity: str | None) -> None:
    """Draw the first case of a study for its report."""
    project = projects.find_project(Path.cwd())
    scene = layout(project.cases(study, fidelity)[0])
    write_bytes(project.results(study) / "set_up.png", small_picture(scene))


def _case_named(cases: list[Case], name: str | None) -> Case:
    """The case of this name, or the first.

    Raises
    ------
    InputError
        There is none of this name.
    """
    named = {case.name: case for case in reversed(cases)}
    if name is None:
        return cases[0]
    if name not in named:
        raise InputError("no such case", field="--case", value=name, limit=choices(name, named))
    return named[name]


def new(study: str, base: str) -> None:
    """Make the folder of a study that extends another."""
    file = new_study(projects.find_project(Path.cwd()).studies, study, base)
    say(f"{file}: edit it, then run: ./run dragdeck check {study}")


def cases(study: str, fidelity: str | None, plan: str | None) -> None:
    """List the cases of a study, or the points of a plan, with their runs."""
    project = projects.find_project(Path.cwd())
    every = project.points(study, plan).processes if plan else project.cases(study, fidelity)
    table = Table("case", *SCENES)
    for case in every:
        table.add_row(case.name, *(kind.run_id(case) for kind in SCENES.values()))
    show([table])


_NUMBERS_OF_SPHERES = (2, 3, 4, 6, 8, 12, 16)
"""For which `shapes` lists errors, beside those of the study."""


def shapes(study: str, fidelity: str | None) -> None:
    """Show how far clumps of more and fewer spheres are from the bodies of a study's media."""
    project = projects.find_project(Path.cwd())
    media, tables = project.cases(study, fidelity)[0].study.media, []
    heads = ("spheres", "volume", "inertia", "surface, rms", "left out", "stands out")
    for name, part in media.parts.items():
        if part.shape is None:
            continue
        of_class = f"class {name}: " if name else ""
        table = Table(
            *heads, "smallest sphere", "cost",
            title=f"{of_class}{part.shape.kind}. Volume and inertia of the union relative to the "
            "body; lengths in radii of the sphere of equal volume; cost relative to spheres",
        )  # fmt: skip
        for count in sorted({*_NUMBERS_OF_SPHERES, part.shape.spheres}):
            try:
                clump = clump_of(part.shape.model_copy(update={"spheres": count}))
            except InputError as error:
                table.add_row(str(count), str(error.problem))
                continue
            lengths = clump.surface_rms, clump.left_out, clump.stands_out, clump.radii.min()
            table.add_row(
                f"{count}{' *' if count == part.shape.spheres else ''}",
                f"{100 * clump.volume_error:+.1f} %",
                f"{100 * clump.inertia_error:.1f} %",
                *(f"{length:.2f}" for length in lengths),
                f"{count / clump.timestep_radius:.1f}",
            )
        tables.append(table)
    if not tables:
        raise DragdeckError(f"{study}: all particles are spheres (media.shape is absent)")
    show(tables)


def advise(
    study: str,
    fidelity: str | None,
    tolerance: float | None,
    quantity: str | None,
    tradeoff: TradeoffRecord | None = None,
) -> None:
    """Show the settings for a tolerance, with their cost, and keep them."""
    project = projects.find_project(Path.cwd())
    tradeoff = tradeoff or measured_tradeoff()
    every = list(
        projects.by_run(project.cases(study, fidelity, tradeoff), SCENES["process"]).values()
    )
    results, tables = project.results(study), []
    try:
        asked = [forecasts.question(case, tolerance, quantity) for case in every]
    except ValidationError as error:
        raise explained(error, "command line") from None
    for case, wanted in zip(every, asked, strict=True):
        advice = advised_settings(case, wanted, tradeoff)
        tables.append(forecasts.advised_case(case, advice, results, tradeoff))
        show(forecasts.advice_tables(case, advice, tables[-1]))
    _keep(results / "advice.json", forecasts.advice_file(every[0], tables))


def _keep(file: Path, content: AdviceFile) -> None:
    """Write a file where that is possible; what was printed counts without it."""
    try:
        content.write(file)
    except OSError as error:
        say(f"not written: {error}")


def render(
    study: str, fidelity: str | None, plan: str | None, scene: str, run: str, packing: Path | None
) -> None:
    """Write the input files of one run, or the folder of a further workpiece of a run."""
    project = projects.find_project(Path.cwd())
    kind = _scene_type(scene)
    points = project.points(study, plan) if plan else None
    every = points.of(kind) if points else project.cases(study, fidelity, failed=True)
    runs = projects.by_folder(with_leads(every) if kind.needs_bed else every, kind)
    if run not in runs:
        raise InputError(
            f"no {scene} run of this name",
            file=f"studies/{study}",
            value=run,
            limit=f"one of: {', '.join(runs)}",
            remedy="list them with: ./run dragdeck cases",
        )
    case = runs[run]
    if not kind.needs_bed:
        _check_processes(case for case in every if kind.run_id(case) == run)
    templates = project.templates_of(case)
    built = built_scene(kind, case, _bed(kind, packing))
    changes = rendering.of_its_templates(rendering.deck_text(built, templates), built, templates)
    refuse_tolerance(case, changes["changed_law"])
    for warning in (*built.warnings, *friction_unknown(changes)):
        say(f"warning: {warning}")
    folder = project.run_folder(case, kind, of_plan=plan is not None)
    if case.number > 1:
        whole = project.run_folder(case.all_workpieces, kind, of_plan=plan is not None)
        rendering.write_workpiece(built, folder, case.number, whole, templates)
        return
    rendering.write_run(built, folder, templates)


def _check_processes(cases: Iterable[Case]) -> None:
    """Refuse a run before the process of cases of which none could run its process."""
    errors = []
    for case in cases:
        try:
            built_scene(SCENES["process"], case, None)
        except InputError as error:
            errors.append(error)
        else:
            return
    if errors:
        raise together(errors)


def _bed(kind: SceneType, packing: Path | None) -> Bed | None:
    """The settled bed; an input script is never written on a guess."""
    if not kind.needs_bed:
        return None
    if packing is None:
        raise InputError(
            f"the scene {kind.name} requires the settled packing",
            field="--packing",
            remedy="give the packing.json that ./run dragchain tables made of the filling",
        )
    return read_bed(packing)
