"""A model with some of its values replaced."""

from typing import Any, TypeVar

from pydantic import BaseModel

M = TypeVar("M", bound=BaseModel)


def changed(model: M, **values: Any) -> M:
    """The model with these values, unchecked."""
    return model.model_copy(update=values)
