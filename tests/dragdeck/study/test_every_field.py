"""What holds for every field of a study, found by walking its model."""

import copy
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import pytest

from dragdeck.errors import InputError
from dragdeck.study.check import validate
from dragdeck.study.model import Study
from dragdeck.study.plausible import implausible

SCHEMA = Study.model_json_schema()


@dataclass(frozen=True)
class Place:
    """A field: its dotted name, its type in the schema, and the kinds of blocks it needs."""

    name: str
    kind: str
    needs: Mapping[str, str]


def places(schema: Mapping[str, Any], name: str, needs: Mapping[str, str]) -> Iterator[Place]:
    """Every field below a part of the schema, blocks and entries of lists included."""
    if "$ref" in schema:
        schema = SCHEMA["$defs"][schema["$ref"].rpartition("/")[2]]
    for option in (*schema.get("anyOf", ()), *schema.get("oneOf", ())):
        yield from places(option, name, needs)
    if "type" in schema:
        yield Place(name, schema["type"], needs)
    kind = schema.get("properties", {}).get("kind", {}).get("const")
    inner = {**needs, f"{name}.kind": kind} if kind else needs
    entries = {
        **schema.get("properties", {}),
        **({"0": schema["items"]} if schema.get("items") else {}),
        **{str(number): item for number, item in enumerate(schema.get("prefixItems", ()))},
    }
    if isinstance(schema.get("additionalProperties"), Mapping):
        entries["some"] = schema["additionalProperties"]
    for key, part in entries.items():
        yield from places(part, f"{name}.{key}".lstrip("."), inner)


EVERY = [place for place in places(SCHEMA, "", {}) if place.name]
NUMBERS = sorted({place.name for place in EVERY if place.kind in ("number", "integer")})
WRONG = {
    "text": "some text",
    "a list": [1, "a", None, {}, 5, 6, 7, 8],
    "an empty list": [],
    "a block": {"unknown": 1},
    "an empty block": {},
    "a truth value": True,
    "a number": -1.5,
    "NaN": math.nan,
    "nothing": None,
}
INTERNAL = re.compile(
    r"Input should|NamedTuple|dictionary|instance|Extra inputs|Field required|discriminator|"
    r"pydantic|argument|tuple|integer|Value error|validator|\btag\b|\bNone\b(?! *[,\]])|"
    r"List should|literal\[|items after validation|\bstring\b"
)


def placed(data: dict[str, Any], name: str, value: object) -> None:
    """Set a field by its dotted name; a list gets the entry at its start, others stay."""
    *above, last = name.split(".")
    for part, key in zip(above, [*above[1:], last], strict=False):
        inner: Any = [None] * (int(key) + 1) if key.isdigit() else {}
        if isinstance(data, list):
            part = int(part)  # type: ignore[assignment]
            data[part] = data[part] if type(data[part]) is type(inner) else inner  # type: ignore[index]
        elif type(data.get(part)) is not type(inner):
            data[part] = inner
        data = data[part]  # type: ignore[assignment]
    data[int(last) if isinstance(data, list) else last] = value  # type: ignore[index]


def said(small: dict[str, Any], place: Place, value: object) -> str:
    """The message on a study with a wrong value; empty where it is accepted."""
    data = copy.deepcopy(small)
    for name, kind in place.needs.items():
        placed(data, name, kind)
    placed(data, place.name, value)
    try:
        validate(data, "study.yaml", whole=True)
    except InputError as error:
        return str(error)
    return ""


def test_the_walk_finds_the_fields_of_every_part() -> None:
    names = {place.name for place in EVERY}
    assert {"media.count", "motion.path.points.0.4", "fidelities.some.skin_m"} <= names
    assert {"workpieces.each.0.shape.edge_facet_size_m", "pairs.some.friction"} <= names
    assert len(names) > 120


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_type_is_refused_in_words_of_the_study(small: dict[str, Any], what: str) -> None:
    internal = {}
    for place in EVERY:
        message = said(small, place, WRONG[what])
        told = "\n".join(line for line in message.splitlines() if "  value:" not in line)
        if found := INTERNAL.search(told):
            internal[place.name] = (found.group(), told[:300])
    assert not internal


@pytest.mark.parametrize("field", NUMBERS)
def test_every_number_has_a_plausible_range(field: str) -> None:
    for value in (1e300, -1e300):
        refused = [error for error, refused in implausible({field: value}) if refused]
        assert [error.field for error in refused] == [field], (
            f"{field}: add a row with its limits to workflow/dragdeck/data/plausible.csv"
        )


@pytest.mark.parametrize(
    ("field", "value", "limit"),
    [
        ("fidelity.tolerance", 1e-9, "at least 0.0001"),
        ("fidelities.quick.timestep_fraction", 1e-12, "0.0001 to 2"),
        ("fidelities.quick.filling_timestep_fraction", 1e-12, "0.0001 to 1"),
        ("materials.steel.poissons_ratio", 0.49999, "-0.9 to 0.499"),
        ("drop_test.timestep_fraction", 1e-12, "0.0001 to 2"),
    ],
)
def test_a_number_that_cannot_be_meant_is_refused(
    small: dict[str, Any], field: str, value: float, limit: str
) -> None:
    if field.startswith("fidelity."):
        small["fidelity"] = {}
    message = said(small, Place(field, "number", {}), value)
    assert f"{field}: " in message and limit in message


def test_a_doubt_about_a_value_hides_no_contradiction(small: dict[str, Any]) -> None:
    """Above 2 m a transient is unusual, and here longer than the path."""
    message = said(small, Place("motion.transient_m", "number", {}), 100)
    assert "motion.transient_m: no path is left for the statistics" in message


@pytest.mark.parametrize(
    ("field", "entries"),
    [
        ("fidelity", {"tolerance": 0.1, "quantity": ["drag_mean", "drag_mean"]}),
        ("fidelity", {"youngs_modulus_scale": 0.1, "windows": {
            "tolerance": 0.1, "quantities": ["drag_mean", "drag_std", "drag_mean"]}}),
        ("sweep.seed", [1, 2, 1.0]),
        ("sweep.workpiece", [{"material": "steel"}, {"material": "steel"}]),
        ("assumptions", 2 * [{"field": "seed", "why": "any"}]),
        ("reference", {"source": "any", "signal": {
            "file": "any.csv", "low_pass_hz": 1, "column": ["fx_n", "fx_n"]}}),
        ("reference", {"source": "any", "signal": {
            "file": "any.csv", "low_pass_hz": 1, "column": "fx_n", "rest_s": [[0, 1], [0, 1.0]]}}),
        ("search", {"vary": {"seed": [1, 2]}, "objective": {"quantity": "drag_mean"},
                    "limits": 2 * [{"quantity": "drag_mean", "at_most": 5}]}),
    ],
)  # fmt: skip
def test_an_entry_that_is_given_twice_is_refused(
    small: dict[str, Any], field: str, entries: Any
) -> None:
    assert "is given twice: remove one" in said(small, Place(field, "", {}), entries)
