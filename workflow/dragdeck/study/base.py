"""What the models of a study file share: numbers as YAML writes them, and plain values."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, JsonValue

Json = Mapping[str, JsonValue]
"""Plain data, as JSON has it."""


def _number(value: object) -> object:
    """Accept ``5e6``, which YAML 1.1 reads as text; refuse truth values."""
    if isinstance(value, bool):
        raise ValueError("a truth value stands where a number belongs")
    if isinstance(value, str):
        try:
            return float(value)
        except ValueError:
            raise ValueError(f"{value!r} is text, not a number") from None
    return value


def _whole(value: object) -> object:
    number = _number(value)
    if isinstance(number, float) and number.is_integer():
        return int(number)
    return number


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
        """Fields whose value says that there is nothing: None, unless a model says more."""
        return {name for name in type(self).model_fields if getattr(self, name) is None}


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
