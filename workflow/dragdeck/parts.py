"""Parts of JSON documents."""

from typing import Any

from pydantic import BaseModel, ConfigDict, Field


class Part(BaseModel):
    """A part of a document: values never change, and none is infinite or NaN."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False, populate_by_name=True)


def omitted(default: Any) -> Any:
    """A field of a part that is not written where it has its default."""
    return Field(default=default, exclude_if=lambda value: value == default)
