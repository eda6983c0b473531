"""What the models of a study file share: numbers as YAML writes them, and plain values."""

import re
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, JsonValue

Json = Mapping[str, JsonValue]
"""Plain data, as JSON has it."""

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
"""Names of studies, plans, materials and fidelities: they become parts of paths and commands."""

STUDY_FILE = "study.yaml"

NAME_LIMIT = "up to 64 letters (a-z), digits, '.', '_' and '-', the first a letter or digit"

DECIMAL = re.compile(r"[-+]?((0|[1-9]\d*)(\.\d*)?|\.\d+)([eE][-+]?\d+)?", re.ASCII)
"""How a number may be written."""

_LONGEST_LINE = 300


def _number(value: object) -> object:
    """Accept ``5e6``, which YAML 1.1 reads as text; refuse truth values, ``0300`` and ``1:30``."""
    if isinstance(value, bool):
        raise ValueError("a number is required, not true or false")
    if isinstance(value, str):
        if DECIMAL.fullmatch(value.replace(",", ".")) and value.count(",") == 1:
            raise ValueError(
                f"{value!r} has a comma: write {value.replace(',', '.')} with a decimal point"
            )
        if not DECIMAL.fullmatch(value):
            raise ValueError(
                f"{value!r} is text, not a number: write it as 300, 0.5 or 5e6, without a unit"
            )
        return float(value)
    return value


def _one_line(text: str) -> str:
    if len(text) > _LONGEST_LINE or not text.isprintable():
        raise ValueError(
            f"must be one line of at most {_LONGEST_LINE} characters, none of them a control "
            "character"
        )
    return text


def _name(text: str) -> str:
    if not NAME.fullmatch(text):
        raise ValueError(f"a name has {NAME_LIMIT}")
    return text


def _material_name(text: str) -> str:
    if "-" in text:
        raise ValueError(
            "the name of a material must not contain '-', which separates the materials of a pair"
        )
    return _name(text)


Line = Annotated[str, AfterValidator(_one_line)]
"""Free text in one line."""

Name = Annotated[str, AfterValidator(_name)]
MaterialName = Annotated[str, AfterValidator(_material_name)]


def _whole(value: object) -> object:
    number = _number(value)
    if isinstance(number, float) and number.is_integer():
        return int(number)
    return number


def _distinct(values: Any) -> Any:
    """Refuse an entry that stands in a list twice, however it is written."""
    if twice := [value for place, value in enumerate(values) if value in values[:place]]:
        raise ValueError(f"{twice[0]} is given twice: remove one")
    return values


Distinct = AfterValidator(_distinct)
"""Of a list in which no entry may stand twice."""

Number = Annotated[float, BeforeValidator(_number), Field(allow_inf_nan=False)]
Positive = Annotated[Number, Field(gt=0)]
NonNegative = Annotated[Number, Field(ge=0)]
Whole = Annotated[int, BeforeValidator(_whole)]


class Model(BaseModel):
    """A part of a study: unknown keys are refused, values never change."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    def plain(self) -> dict[str, JsonValue]:
        """The values as plain data, without those that are absent.

        Runs are named by it: a new field that says nothing at its default renames no run.
        """
        absent = self.absent()
        return {name: _plain(value) for name, value in self if name not in absent}

    def absent(self) -> set[str]:
        """Fields whose value says that there is nothing: None, or what the field excludes."""
        return {
            name
            for name, field in type(self).model_fields.items()
            if (value := getattr(self, name)) is None
            or (field.exclude_if is not None and field.exclude_if(value))
        }


def flat(data: Json, prefix: str = "") -> Json:
    """Nested mappings as one mapping of dotted names."""
    values: dict[str, JsonValue] = {}
    for key, value in data.items():
        if isinstance(value, Mapping):
            values.update(flat(value, f"{prefix}{key}."))
        else:
            values[f"{prefix}{key}"] = value
    return values


def without_fields(data: Json, *fields: str) -> dict[str, JsonValue]:
    """Nested mappings without some fields, by their dotted names."""
    kept = {key: value for key, value in data.items() if key not in fields}
    for key, value in kept.items():
        inner = [name.removeprefix(f"{key}.") for name in fields if name.startswith(f"{key}.")]
        if inner and isinstance(value, Mapping):
            kept[key] = without_fields(value, *inner)
    return kept


def _plain(value: Any) -> JsonValue:
    """A value of a model as JSON has it."""
    if isinstance(value, Model):
        return value.plain()
    if isinstance(value, Mapping):
        return {str(name): _plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    plain: JsonValue = value
    return plain
