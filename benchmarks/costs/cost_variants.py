"""What each thing that a deck leaves out would cost: the variants of ``variants.yaml``.

A variant is the standard deck of a study with one thing changed. It is timed side by side with
the deck it is compared with; `cost_timing` does the timing.
"""

import copy
import math
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, Literal

import yaml
from jinja2 import StrictUndefined
from jinja2.nativetypes import NativeEnvironment

from dragdeck.cases.case import Case
from dragdeck.physics.contact_mechanics import ENGINE_SOFTEST_PA
from dragdeck.scenes.process import process_scene
from dragdeck.study.base import Model
from dragdeck.sweep.cases import settle_case

SceneName = Literal["process", "drop_test", "filling"]
Names = Mapping[str, Any]

_PARAMETERS = ("youngs_modulus_scale", "timestep_fraction", "speed_factor")
_EXPRESSIONS = NativeEnvironment(undefined=StrictUndefined)


class Variant(Model):
    """A deck to be timed, as the head of ``variants.yaml`` explains it."""

    name: str
    scene: SceneName
    what: str
    fields: Mapping[str, Any] = {}
    blocks: Mapping[str, str] = {}
    outputs: tuple[str, ...] = ()
    contact_columns: int = 0
    base: str = "standard"
    unit: Literal["per_step", "per_second"] = "per_second"
    own_bed: bool = False
    when: str = "true"

    @property
    def changes_fields_alone(self) -> bool:
        """Whether study fields say all its change."""
        return bool(self.fields) and not (self.blocks or self.outputs or self.contact_columns)

    @property
    def parameter(self) -> str | None:
        """The fidelity parameter that is all its change, if it is one."""
        changed = [name.removeprefix("fidelity.") for name in self.fields]
        alone = len(changed) == 1 and self.changes_fields_alone
        return changed[0] if alone and changed[0] in _PARAMETERS else None

    @property
    def level(self) -> float | None:
        """The value of that parameter."""
        return float(self.fields[f"fidelity.{self.parameter}"]) if self.parameter else None

    def filled(self, names: Names) -> "Variant":
        """The variant with the values of its expressions."""
        own = {"what": _filled(self.what, names), "fields": _filled(self.fields, names)}
        return self.model_copy(update=own)


class _VariantsFile(Model):
    names: dict[str, str]
    bases: dict[str, dict[str, Any]]
    variants: dict[str, dict[str, Any]]
    beds: dict[str, dict[str, str]]


@cache
def _file() -> _VariantsFile:
    text = Path(__file__).with_name("variants.yaml").read_text(encoding="utf-8")
    return _VariantsFile.model_validate(yaml.safe_load(text))


BASES: Mapping[str, Variant] = {
    name: Variant(name=name, base=name, **own) for name, own in _file().bases.items()
}
"""What variants are compared with, by name."""

BEDS: Mapping[str, Mapping[str, str]] = _file().beds
"""Blocks of the decks that bring the workpiece in, and a bed to rest."""


def _filled(value: Any, names: Names) -> Any:
    """A value with its expressions, wherever they stand in it, evaluated."""
    if isinstance(value, Mapping):
        return {name: _filled(own, names) for name, own in value.items()}
    if isinstance(value, str) and "{{" in value:
        return _EXPRESSIONS.from_string(value).render(names)
    return value


def _evaluated(expression: str, names: Names) -> Any:
    return _EXPRESSIONS.compile_expression(expression, undefined_to_none=False)(**names)


def _names(base: Case) -> Names:
    """What expressions may use."""
    names: dict[str, Any] = {
        "study": base.study,
        "deck": process_scene(base).deck,
        "pi": math.pi,
        "engine_softest_pa": ENGINE_SOFTEST_PA,
    }
    for name, expression in _file().names.items():
        names[name] = _evaluated(expression, names)
    return names


def standard_case(case: Case) -> Case:
    """The case whose decks are the standard: its modulus and step, one rank, speed as it is.

    It has no restart points, because a short arc would have one or none by
    chance, and one impact in its drop. It neither continues a softer run nor has windows.
    """
    data = copy.deepcopy(case.study.model_dump(mode="json", exclude_unset=True))
    data["fidelity"] = case.study.chosen_fidelity().model_dump(
        mode="json", exclude_unset=True, exclude={"soft_start", "windows"}
    )
    values = {
        "fidelity.ranks": 1,
        "fidelity.speed_factor": 1.0,
        "outputs.n_checkpoints": 0,
        "drop_test.impacts": 1,
    }
    return settle_case(case.file, data, values, {})


def variant_case(base: Case, variant: Variant) -> Case:
    """The standard case with a variant's fields."""
    data = base.study.model_dump(mode="json", exclude_unset=True)
    return settle_case(base.file, data, variant.fields, {})


def bed_case(base: Case, variant: Variant) -> Case:
    """The case whose bed, with its workpiece in it, a variant is dragged through."""
    return variant_case(base, variant) if variant.own_bed else base


def variants(base: Case) -> list[Variant]:
    """All variants that the study of a standard case allows and does not have itself."""
    names, found = _names(base), []
    for name, own in _file().variants.items():
        scene = BASES[own.get("base", "standard")].scene
        variant = Variant(name=name, scene=scene, **own)
        if _evaluated(variant.when, names):
            variant = variant.filled(names)
            same = variant.changes_fields_alone and variant_case(base, variant).study == base.study
            found += [] if same else [variant]
    return found
