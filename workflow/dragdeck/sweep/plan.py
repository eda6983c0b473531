"""The points of a trade-off: which settings are run on a study's scenes, and how often.

A plan is a YAML file that fits any study: it names fields of the study file
and the values each shall take, alone or together with others, and always holds
the reference that errors are measured against.
"""

import copy
import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from dragdeck.cases.case import SAID_BY_NAME, Case
from dragdeck.errors import InputError
from dragdeck.scenes.scene import SceneType
from dragdeck.study.base import Positive, Whole
from dragdeck.study.model import Study
from dragdeck.sweep.cases import Resolve, beside_each_other, settle_case
from dragdeck.sweep.design import Design, Settings, Variation, check_number

_LEAST_COUNTED = 0.5
"""Smallest fraction of a point's path that the statistics use."""


class PlannedPoints(Variation):
    """Points that belong together, their packings and their path."""

    seeds: Annotated[Whole, Field(ge=1)] | None = None
    """number of seeds per point, starting with that of the study or scene; none: that of the
    plan"""
    arc: Positive | None = None
    """fraction of the study's path that is dragged; none: that of the plan"""


class Plan(Design[PlannedPoints]):
    """The design points of a trade-off."""

    arc: Positive = 1.0
    """fraction of the study's path that is dragged"""
    seeds: Annotated[Whole, Field(ge=1)] = 2
    """number of seeds (packings) per point"""
    scenes: dict[str, dict[str, Any]] = Field(default={"as it is": {}})
    """name of a scene: dotted field names and values that change the study, among them the first
    seed; every point is run in every scene"""
    cost_rounds: Annotated[Whole, Field(ge=0)] = 3
    """rounds in which optional features are timed; 0: none"""
    drop_test: dict[str, list[Any]] = Field(default_factory=dict)
    """dotted field name: values that are varied one at a time in the drop test"""


@dataclass(frozen=True)
class Points:
    """The cases of a plan.

    Attributes
    ----------
    processes : list of Case
        One for each process run.
    drops : list of Case
        One for each drop test.
    cost_rounds : int
        Rounds of timing what decks leave out.
    """

    processes: list[Case]
    drops: list[Case]
    cost_rounds: int

    def of(self, scene: SceneType) -> list[Case]:
        """The cases whose runs of a scene the plan needs."""
        return self.drops if scene.single_particle else self.processes


def plan_points(
    plan: Plan,
    plan_file: Path,
    base: Case,
    scenes: Mapping[str, SceneType],
    resolve: Resolve | None = None,
) -> Points:
    """The cases that a plan makes of a study.

    Parameters
    ----------
    plan : Plan
    plan_file : Path
        For error messages.
    base : Case
        A case of the study: its scene, its first seed and its path are kept.
    scenes : mapping
        That a case has, by name: cases with the same run in one are the same point.
    resolve : callable, optional
        Finds the settings of points that ask for a tolerance.

    Raises
    ------
    InputError
        A point names no field of a study, or one beyond its limits.
    """
    blocks = [plan.reference, *plan.points]
    packings = sum(block.count * (block.seeds or plan.seeds) for block in blocks)
    check_number(len(plan.scenes) * packings, plan_file)
    unlike_cases: dict[str, Case] = {}
    for scene, block in itertools.product(plan.scenes.values(), blocks):
        for settings in _settings(plan, block, base.written, scene):
            shown = {**scene, **_unnamed(settings)}
            case = _case(base, {**plan.base, **scene, **settings}, shown, plan_file, resolve)
            _check_counted(case, plan_file)
            unlike_cases.setdefault(scenes["process"].run_id(case), case)
    drops: dict[str, Case] = {}
    for settings in [
        {},
        *({field: value} for field, all_ in plan.drop_test.items() for value in all_),
    ]:
        case = _case(base, {**plan.base, **settings}, settings, plan_file, resolve)
        drops.setdefault(scenes["drop_test"].run_id(case), case)
    return Points(beside_each_other(unlike_cases.values()), list(drops.values()), plan.cost_rounds)


def _check_counted(case: Case, plan_file: Path) -> None:
    """Refuse a point whose path is mostly transient: the rest is too short for statistics."""
    motion = case.study.motion
    whole, counted = motion.path_length_m, motion.path_length_m - motion.uncounted_m
    if counted < _LEAST_COUNTED * whole:
        raise InputError(
            f"of the {1e3 * whole:.3g} mm of path of a point, {1e3 * counted:.3g} mm remain for "
            "the statistics",
            file=plan_file,
            field="arc",
            limit=f"at least {_LEAST_COUNTED:g} of the path",
            remedy="a larger arc in the plan, or a study with a longer path or a shorter transient",
        )


def _settings(
    plan: Plan, block: PlannedPoints, study: Study, scene: Settings
) -> Iterator[Settings]:
    """The fields that each point of a block sets in a scene, path and seed included."""
    field, length = _path_length(study)
    arc = {field: scene.get(field, length) * (block.arc or plan.arc)}
    for _, values in block.points():
        for number in range(block.seeds or plan.seeds):
            yield {**values, **arc, "seed": scene.get("seed", study.seed) + number}


def _unnamed(settings: Settings) -> Settings:
    """The fields to name a point by.

    Not those that the name of a fidelity without a name says already, nor what is written.
    """
    said = {"fidelity", *(f"fidelity.{name}" for name in SAID_BY_NAME)}
    return {
        field: value
        for field, value in settings.items()
        if field not in said and not field.startswith("outputs.")
    }


def _path_length(study: Study) -> tuple[str, float]:
    path = study.motion.path
    value: float = getattr(path, path.length_field)
    return f"motion.path.{path.length_field}", value


def _case(
    base: Case, values: Settings, shown: Settings, plan_file: Path, resolve: Resolve | None
) -> Case:
    """The base case with other values; fields below ``fidelity`` replace its name."""
    data = copy.deepcopy(base.written.model_dump(mode="json", exclude_unset=True))
    data["fidelity"] = {}
    return settle_case(base.file, data, values, shown, named_in=plan_file, resolve=resolve)
