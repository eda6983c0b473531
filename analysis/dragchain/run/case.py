"""What ``case.json`` says of a run: its inputs by dotted name, and the friction of its contacts."""

from collections.abc import Mapping
from pathlib import Path

from pydantic import JsonValue

from dragchain.errors import TableError
from dragdeck.physics.coulomb import FrictionLimit
from dragdeck.records.case import CaseOfRun


def changed_inputs(
    own: Mapping[str, JsonValue], other: Mapping[str, JsonValue]
) -> dict[str, JsonValue]:
    """Inputs of a run that differ from another's, by dotted name, with the run's own values.

    A study without an optional value may leave its name out or write null: both are None here.
    """
    names = sorted({*own, *other})
    return {name: own.get(name) for name in names if own.get(name) != other.get(name)}


def input_of(case: CaseOfRun, name: str) -> JsonValue:
    """An input of a run by its dotted name.

    Raises
    ------
    TableError
        If ``case.json`` does not give it.
    """
    if name not in case.inputs:
        raise TableError(f"{case.run}: case.json has no inputs.{name}; render the run again")
    return case.inputs[name]


def number_of(case: CaseOfRun, name: str) -> float:
    """An input of a run that must be a number; see `input_of`."""
    value = input_of(case, name)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TableError(f"{case.run}: case.json: inputs.{name} is {value!r}, not a number")
    return float(value)


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
    friction = case.contact_moduli[body].friction
    return FrictionLimit(friction, case.attractive.get(body, {}), wall=body != "particle")


def attracts(case: CaseOfRun) -> bool:
    """Whether the contact law attracts particles to the workpiece."""
    return "workpiece" in case.attractive


def upstream_folders(run_dir: Path, case: CaseOfRun) -> dict[str, Path]:
    """Folders of the filling and the drop test that a process run names, by scene."""
    results = run_dir.resolve().parent.parent
    return {scene: results / scene / run for scene, run in case.upstream.items()}
