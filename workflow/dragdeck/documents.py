"""JSON documents: each is a model, checked when it is written and when it is read."""

import json
from pathlib import Path
from typing import ClassVar, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from dragdeck.errors import InputError
from dragdeck.files import replace_text

SCHEMA = 2
"""Version of the form of every document; 1 had other names (CHANGELOG.md)."""


class Part(BaseModel):
    """A part of a document: values never change, and none is infinite or NaN."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False, populate_by_name=True)


class Document(Part):
    """A JSON document.

    A key that a model does not name is left unread: the reading side names what it reads.
    """

    remedy: ClassVar[str] = "make it again"
    """What to do where the file is missing or another version's."""

    version: int = Field(default=SCHEMA, alias="schema")

    @classmethod
    def read(cls, file: Path) -> Self:
        """Read a document.

        Raises
        ------
        InputError
            The file is missing, is not JSON, has another schema number, or a key is missing or
            has a value that cannot be: it names file, key and value.
        """
        try:
            text = file.read_text(encoding="utf-8")
            version = json.loads(text).get("schema")
        except FileNotFoundError:
            raise InputError("there is no such file", file=file, remedy=cls.remedy) from None
        except (ValueError, AttributeError, RecursionError):
            raise InputError(
                "the file is not a JSON object", file=file, remedy=cls.remedy
            ) from None
        if version != SCHEMA:
            raise InputError(
                "the file was written by another version of dragdeck",
                file=file,
                field="schema",
                value=version,
                limit=str(SCHEMA),
                remedy=cls.remedy,
            )
        try:
            return cls.model_validate_json(text, strict=True)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            field = ".".join(map(str, first["loc"]))
            missing = first["type"] == "missing"
            raise InputError(
                "a required key is missing" if missing else first["msg"],
                file=file,
                field=field or None,
                value=None if missing else first["input"],
                remedy=cls.remedy,
            ) from None

    def write(self, file: Path) -> None:
        """Write the document; it appears under its name only once it is whole."""
        file.parent.mkdir(parents=True, exist_ok=True)
        replace_text(file, self.as_text())

    def as_text(self) -> str:
        """The document as the text of its file."""
        return self.model_dump_json(indent=1, by_alias=True) + "\n"
