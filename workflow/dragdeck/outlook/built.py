"""The scene of a case with all that is known of it, as commands show and write it."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace

from dragdeck.cases.case import Case
from dragdeck.cases.ranks import check_ranks
from dragdeck.engine.process import LAUNCHER_VARIABLE
from dragdeck.engine.space import check_amount
from dragdeck.errors import InputError
from dragdeck.outlook import timestep as timesteps
from dragdeck.outlook.runs import written
from dragdeck.physics.packing import Bed
from dragdeck.scenes.scene import SceneType, StudyScene
from dragdeck.study.check import warnings
from dragdeck.study.yaml import located


def refuse_tolerance(case: Case, changed_law: Sequence[str]) -> None:
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


def friction_unknown(changes: Mapping[str, Sequence[str]]) -> list[str]:
    """A warning that contacts of a run cannot be analysed, if a template adds a force."""
    added = changes["added_forces"]
    if not added:
        return []
    return [
        f"the contact law adds a force ({', '.join(added)}), so that the limit of friction does "
        "not follow from the contact force; tables of contacts, chains, loading and the report "
        "will be refused, force on the workpiece and raw output remain"
    ]


def built_scene(kind: SceneType, case: Case, bed: Bed | None) -> StudyScene:
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
    more = timesteps.step_cautions(case, kind)
    return replace(scene, warnings=[*warnings(case.study), *scene.warnings, *more])
