"""The command `check`: every input script of a study, built and looked at."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import jinja2

from dragdeck import project as projects
from dragdeck.advice import forecast as forecasts
from dragdeck.cases.case import Case
from dragdeck.cases.ranks import cores_here
from dragdeck.decks import render as rendering
from dragdeck.engine.process import find_engine
from dragdeck.engine.reports import say
from dragdeck.errors import DragdeckError, InputError, RecordError, together
from dragdeck.outlook import timestep as timesteps
from dragdeck.outlook.built import built_scene, friction_unknown, refuse_tolerance
from dragdeck.outlook.process import (
    bed_notes,
    dimensionless,
    not_corrected,
    reduced,
    workpiece_notes,
)
from dragdeck.outlook.runs import expected_runs, plan_in_words
from dragdeck.records.run import changed_in_words
from dragdeck.records.tradeoff import measured_tradeoff
from dragdeck.scenes.process import SCENES
from dragdeck.scenes.scene import SceneType, StudyScene
from dragdeck.scenes.workpiece import remeshing
from dragdeck.study.bowls.mesh import MeshBowl
from dragdeck.study.recorded import recorded_file
from dragdeck.study.yaml import located


def check_study(study: str, fidelity: str | None, verbose: bool) -> None:
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
    findings = _Findings(project.templates_of(every[0]))
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
    """How the files that a study names are read: measured forces, surfaces and where they are."""
    from dragdeck.study.force_record import in_words, read_record

    study, file = case.study, case.file
    if deviation := remeshing(case):
        yield f"workpiece.shape: {deviation}"
    if isinstance(study.bowl, MeshBowl) and study.bowl.aside:
        yield f"bowl.file: {study.bowl.aside}"
    signal = study.reference.signal if study.reference else None
    if signal:
        record = recorded_file(signal.file, file, "reference.signal.file")
        yield f"reference.signal: {in_words(record, signal)}"
    if study.calibration and study.calibration.record:
        field, name = "calibration.record", study.calibration.record
        record = recorded_file(name, file, field)
        try:
            read_record(record)
        except RecordError as error:
            raise located(replace(error.of_field(field, name), file=file)) from None
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
            scene = built_scene(kind, case, None)
            used_templates = rendering.of_its_templates(
                rendering.deck_text(scene, self.templates), scene, self.templates
            )
            refuse_tolerance(case, used_templates["changed_law"])
        except InputError as error:
            self.errors.append(error)
            raise
        more = (*friction_unknown(used_templates), *used_templates["script_findings"])
        cases = dict.fromkeys(other.name for other in runs.values())
        for text in (*map(str, scene.warnings), *more):
            self.warnings.setdefault(text, {}).update(cases)
        notes = [reduced(case), not_corrected(case)] if kind.needs_bed else []
        notes.append(changed_in_words(used_templates["changed_scripts"]))
        notes.append(forecasts.ways_in_words(case, measured_tradeoff()) if kind.needs_bed else "")
        for text in filter(None, notes):
            self.reduced.setdefault(text, {}).update(cases)
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


def _first(names: Iterable[str]) -> str:
    first, *others = names
    return first + (f" and {len(others)} more" if others else "")


def _expectations(case: Case, kind: SceneType, scene: StudyScene) -> list[tuple[str, str]]:
    """What is known of a scene's time step and bed before it is run."""
    notes = timesteps.timestep_notes(case, kind, scene)
    if kind.needs_bed:
        notes += [timesteps.stable_step_note(case), *workpiece_notes(case), *dimensionless(case)]
    return [*notes, *([] if kind.single_particle else bed_notes(case))]
