"""What ``case.json`` says of a run: its study, what differs from others, and its friction."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np
from pydantic import JsonValue

from dragchain.arrays import Floats
from dragchain.errors import TableError
from dragdeck.errors import DragdeckError
from dragdeck.records.bed import ClassOfRun
from dragdeck.records.case import CaseOfRun, load_case
from dragdeck.study.contact_law import FrictionLimit
from dragdeck.study.model import Study


def study_of(case: CaseOfRun) -> Study:
    """The study of a process run.

    Raises
    ------
    TableError
        The run is of another scene.
    """
    if case.study is None:
        raise TableError(f"{case.run}: a {case.scene} has no study in case.json, only a process")
    return case.study


def changed_inputs(
    inputs: Mapping[str, JsonValue], other: Mapping[str, JsonValue]
) -> dict[str, JsonValue]:
    """Inputs of a run that differ from another's, by dotted name, with the run's own values.

    A study without an optional value may leave its name out or write null: both are None here.
    """
    names = sorted({*inputs, *other})
    return {name: inputs.get(name) for name in names if inputs.get(name) != other.get(name)}


def friction_with(case: CaseOfRun, body: str) -> FrictionLimit:
    """What limits the friction of a particle with ``particle``, ``bowl`` or ``workpiece``.

    Raises
    ------
    TableError
        If ``case.json`` does not give it, or a template's contact law adds a force to the one
        that limits friction.
    """
    if case.added_forces:
        raise TableError(
            f"{case.run}: the contact law adds a force ({', '.join(case.added_forces)}), and "
            "LIGGGHTS limits friction by the force without it: tangential forces of contacts, "
            "friction work and chains cannot be told from the output; tables of the force "
            "on the workpiece, of energies and particles, and the raw output are not affected"
        )
    if body not in case.contact_moduli:
        raise TableError(f"{case.run}: case.json has no contact_moduli.{body}; render it again")
    wall = body != "particle"
    if not case.classes:
        return FrictionLimit(
            case.contact_moduli[body].friction, case.attractive.get(body, {}), wall
        )
    others = (body,) if wall else tuple(kind.name for kind in case.classes)
    names = {name for kind in case.classes for rows in kind.attractive.values() for name in rows}

    def table(value: Callable[[ClassOfRun, str], float]) -> Floats:
        values = np.array([[value(kind, other) for other in others] for kind in case.classes])
        return values[:, 0] if wall else values

    def of(name: str) -> Floats:
        return table(lambda kind, other: kind.attractive.get(other, {}).get(name, 0.0))

    friction = table(lambda kind, other: kind.contact_moduli[other].friction)
    spheres = {kind.first_id: kind.first_sphere for kind in case.bodies}
    first_ids = tuple(spheres.get(kind.first_id, kind.first_id) for kind in case.classes)
    return FrictionLimit(friction, {name: of(name) for name in names}, wall, first_ids)


def attracting(case: CaseOfRun) -> set[str]:
    """To what the contact law attracts particles: ``particle``, ``bowl``, ``workpiece``."""
    return set(case.attractive).union(*(kind.attractive for kind in case.classes))


def with_changes(run_dir: Path, case: CaseOfRun) -> CaseOfRun:
    """The case of a process run, with what templates change in the scripts of all its runs."""
    scripts = dict.fromkeys(case.changed_scripts)
    findings = dict.fromkeys(case.script_findings)
    for folder in upstream_folders(run_dir, case).values():
        with suppress(DragdeckError):  # whoever needs that run says what is wrong
            upstream = load_case(folder)
            scripts |= dict.fromkeys(upstream.changed_scripts)
            findings |= dict.fromkeys(upstream.script_findings)
    changes = {"changed_scripts": tuple(scripts), "script_findings": tuple(findings)}
    return case.model_copy(update=changes)


def upstream_folders(run_dir: Path, case: CaseOfRun) -> dict[str, Path]:
    """Folders of the filling and the drop test that a process run names, by scene."""
    results = run_dir.resolve().parent.parent
    return {scene: results / scene / run for scene, run in case.upstream.items()}
