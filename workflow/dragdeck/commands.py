"""What the commands of ``dragdeck`` do, and some of its steps."""

import os
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import jinja2
from pydantic import ValidationError
from rich.table import Table

from dragdeck import project as projects
from dragdeck.advice import forecast as forecasts
from dragdeck.advice.advise import advised_settings
from dragdeck.cases.bed import clump_of
from dragdeck.cases.case import Case
from dragdeck.cases.ranks import check_ranks, cores_here
from dragdeck.decks import render as rendering
from dragdeck.decks.templates import environment
from dragdeck.engine.process import LAUNCHER_VARIABLE, find_engine
from dragdeck.engine.reports import say
from dragdeck.engine.space import check_amount
from dragdeck.errors import DragdeckError, InputError, choices, together
from dragdeck.files import write_bytes
from dragdeck.outlook import timestep as timesteps
from dragdeck.outlook.explain import explanation, show
from dragdeck.outlook.explain import scene_lines as page_of_scene
from dragdeck.outlook.process import (
    bed_notes,
    dimensionless,
    not_corrected,
    reduced,
    workpiece_notes,
)
from dragdeck.outlook.runs import expected_runs, plan_in_words, written
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
from dragdeck.study.check import explained, warnings
from dragdeck.study.contact_law import coefficients, modelled
from dragdeck.study.recorded import recorded_file
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


def check(study: str, fidelity: str | None, verbose: bool) -> None:
    """Build every input script of a study and look for LIGGGHTS; run nothing."""
    try:
        _check(study, fidelity, verbose)
    except DragdeckError as wrong:
        say(f"dragdeck: {wrong}")
        count = 1 + len(wrong.more if isinstance(wrong, InputError) else ())
        errors = f"{count} error{'s' if count > 1 else ''}"
        raise DragdeckError(f"{study}: {errors}; it cannot be run") from None


def _check(study: str, fidelity: str | None, verbose: bool) -> None:
    project = projects.find_project(Path.cwd())
    every = project.cases(study, fidelity)
    findings = _Findings(environment(project.templates, projects.study_templates(every[0])))
    runs = [
        run
        for kind in SCENES.values()
        for run in expected_runs(
            kind, project.run_folders(every, kind), partial(findings.look, kind)
        )
    ]
    for varied, cases in projects.check_search(every[0].file).items():
        findings.look_at_bounds(f"search.vary.{varied}", cases)
    findings.show(verbose)
    if findings.errors:
        raise together(findings.errors)
    for line in _records(every[0]):
        print(f"  {line}")
    engine = find_engine()
    warned = f"{len(findings.warnings) or 'no'} warning{'' if len(findings.warnings) == 1 else 's'}"
    cost, *scenes = plan_in_words(runs, cores_here())
    print(*(f"  {line}" for line in scenes), sep="\n")
    print(f"{study}: no errors, {warned}; {len(every)} case(s), {cost}; LIGGGHTS {engine.version}")


def _records(case: Case) -> Iterator[str]:
    """How the files that a study names are read: measured forces, and a surface meshed anew."""
    from dragdeck.study.force_record import in_words

    study, file = case.study, case.file
    if deviation := remeshing(case):
        yield f"workpiece.shape: {deviation}"
    signal = study.reference.signal if study.reference else None
    if signal:
        record = recorded_file(signal.file, file, "reference.signal.file")
        yield f"reference.signal: {in_words(record, signal)}"
    if study.calibration and study.calibration.record:
        record = recorded_file(study.calibration.record, file, "calibration.record")
        yield f"calibration.record: {in_words(record)}"


@dataclass
class _Findings:
    """What `check` finds, each thing once with the cases or runs that it is about."""

    templates: jinja2.Environment
    errors: list[InputError] = field(default_factory=list)
    warnings: dict[str, dict[str, None]] = field(default_factory=dict)
    reduced: dict[str, dict[str, None]] = field(default_factory=dict)
    notes: dict[str, dict[str, None]] = field(default_factory=dict)

    def look(self, kind: SceneType, runs: Mapping[Path, Case]) -> StudyScene:
        """Build the scene of runs that differ in the seed alone."""
        case = next(iter(runs.values()))
        try:
            scene = _built(kind, case, None)
            used_templates = rendering.of_its_templates(
                rendering.deck_text(scene, self.templates), scene, self.templates
            )
            _check_tolerance(case, used_templates["changed_law"])
        except InputError as error:
            self.errors.append(error)
            raise
        more = (*_friction_unknown(used_templates), *used_templates["script_findings"])
        for text in (*map(str, scene.warnings), *more):
            self.warnings.setdefault(text, {})[case.name] = None
        notes = [reduced(case), not_corrected(case)] if kind.needs_bed else []
        notes.append(changed_in_words(used_templates["changed_scripts"]))
        notes.append(forecasts.ways_in_words(case, measured_tradeoff()) if kind.needs_bed else "")
        for text in filter(None, notes):
            self.reduced.setdefault(text, {})[case.name] = None
        lines = [f"time step: {scene.deck.timestep_s:.3g} s, about {scene.steps:,} steps"]
        lines += [f"{what}: {text}" for what, text in _expectations(case, kind, scene)]
        names = dict.fromkeys(f"{kind.name} {folder.name}" for folder in runs)
        self.notes.setdefault("\n  ".join(lines), {}).update(names)
        return scene

    def look_at_bounds(self, name: str, cases: Sequence[Case]) -> None:
        """Refuse a field of a search that cannot be varied; warn where a part of it cannot be."""
        refused = []
        for case in cases:
            try:
                projects.check_buildable(case)
            except InputError as error:
                refused.append(replace(error, field=f"{name}: {case.name}: {error.field}"))
        if len(refused) == len(cases):
            self.errors += refused[:1]
            return
        for problem in refused:
            text = f"{problem.field}: {problem.problem}; such a setting is not run, but infeasible"
            self.warnings[text] = {"search": None}

    def show(self, verbose: bool) -> None:
        """Print the warnings; and what is expected of every run, if that is asked for."""
        for text, names in self.warnings.items():
            print(f"warning: {_first(names)}: {text}")
        for text, names in self.reduced.items():
            print(f"note: {_first(names)}: {text}")
        for text, names in self.notes.items() if verbose else ():
            print(f"{_first(names)}\n  {text}")


def _check_tolerance(case: Case, changed_law: Sequence[str]) -> None:
    """Refuse a tolerance with a contact law of which no error is known.

    Raises
    ------
    InputError
        A template changes the contact law of a case whose settings follow from a tolerance.
    """
    if case.requested and changed_law:
        raise located(
            InputError(
                "the errors of settings are not known for the contact law of a template",
                file=case.file,
                field="fidelity.tolerance",
                value="; ".join(changed_law),
                limit="the contact law of the study: pairs and contact, without a template",
                remedy="name a fidelity, such as full, instead of a tolerance",
            )
        )


def _friction_unknown(changes: Mapping[str, Sequence[str]]) -> list[str]:
    """A warning that contacts of a run cannot be analysed, if a template adds a force."""
    added = changes["added_forces"]
    if not added:
        return []
    return [
        f"the contact law adds a force ({', '.join(added)}), so that the limit of friction does "
        "not follow from the contact force; tables of contacts, chains, loading and the report "
        "will be refused, force on the workpiece and raw output remain"
    ]


def _first(names: Iterable[str]) -> str:
    first, *others = names
    return first + (f" and {len(others)} more" if others else "")


def _built(kind: SceneType, case: Case, bed: Bed | None) -> StudyScene:
    """The scene of a case, with warnings about the study itself.

    Raises
    ------
    InputError
        It cannot be built, or has more ranks than there are cores; the error knows its line.
    """
    try:
        if not kind.single_particle and LAUNCHER_VARIABLE not in os.environ:
            check_ranks(case.ranks, case.file)
        scene = kind.build(case, bed)
        check_amount(*written(kind, scene))
    except InputError as error:
        error.file = error.file or case.file
        raise located(error) from None
    step = timesteps.stable_step_cautions if kind.needs_bed else timesteps.settling_cautions
    more = () if kind.single_particle else step(case)
    return replace(scene, warnings=[*warnings(case.study), *scene.warnings, *more])


def explain(study: str, fidelity: str | None, scene: str | None, verbose: bool) -> None:
    """Show what the input scripts of a study model and leave out, and what that would cost."""
    project = projects.find_project(Path.cwd())
    every = project.cases(study, fidelity)
    templates = environment(project.templates, projects.study_templates(every[0]))
    for kind in [_scene_type(scene)] if scene else SCENES.values():
        cases = list(projects.by_run(every, kind).values())
        for case in cases if verbose else cases[:1]:
            scripted = _as_scripted(_built(kind, case, None), templates)
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


def _expectations(case: Case, kind: SceneType, scene: StudyScene) -> list[tuple[str, str]]:
    """What is known of a scene's time step and bed before it is run."""
    notes = timesteps.timestep_notes(case, kind, scene)
    if kind.needs_bed:
        notes += [timesteps.stable_step_note(case), *workpiece_notes(case), *dimensionless(case)]
    return [*notes, *([] if kind.single_particle else bed_notes(case))]


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
        tables.append(forecasts.advised_case(case, advice, results))
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
    every = points.of(kind) if points else project.cases(study, fidelity)
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
    templates = environment(project.templates, projects.study_templates(case))
    built = _built(kind, case, _bed(kind, packing))
    changes = rendering.of_its_templates(rendering.deck_text(built, templates), built, templates)
    _check_tolerance(case, changes["changed_law"])
    for warning in (*built.warnings, *_friction_unknown(changes)):
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
            _built(SCENES["process"], case, None)
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
