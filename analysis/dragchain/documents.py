"""JSON documents: each is a model, checked when it is written and when it is read."""

import json
from pathlib import Path
from typing import ClassVar, Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from dragchain.errors import DocumentError
from dragchain.files import write_text

SCHEMA = 2
"""Version of the form of every document; 1 had other names (CHANGELOG.md)."""

OLDER = (
    "an older dragdeck wrote it, with names that CHANGELOG.md lists; run the study again, or"
    " read it with the version that wrote it"
)


class Part(BaseModel):
    """A part of a document: values never change, and none is infinite or NaN."""

    model_config = ConfigDict(frozen=True, allow_inf_nan=False, populate_by_name=True)


class Document(Part):
    """A JSON document.

    A key that a model does not name is left unread: the reading side names what it reads.
    """

    made_by: ClassVar[str] = "the command that makes it"
    """What to run if the file is not there."""

    version: int = Field(default=SCHEMA, alias="schema")

    @classmethod
    def read(cls, file: Path) -> Self:
        """Read a document.

        Raises
        ------
        DocumentError
            The file is missing, is not JSON, has another schema number, or a key is missing or
            has a value that cannot be: it names file, key and value.
        """
        try:
            text = file.read_text(encoding="utf-8")
            version = json.loads(text).get("schema")
        except FileNotFoundError:
            remedy = f"run `{cls.made_by}`"
            raise DocumentError(file, None, "there is no such file", remedy=remedy) from None
        except (ValueError, AttributeError, RecursionError) as error:
            remedy = f"delete it and run `{cls.made_by}` again"
            raise DocumentError(
                file, None, f"is not a JSON object: {error}", remedy=remedy
            ) from None
        if version != SCHEMA:
            problem = f"is {version!r}, this dragchain reads {SCHEMA}"
            raise DocumentError(file, "schema", problem, remedy=OLDER)
        try:
            return cls.model_validate_json(text, strict=True)
        except ValidationError as error:
            raise _explained(error, file) from None

    def write(self, file: Path) -> None:
        """Write the document; it appears under its name only once it is whole."""
        write_text(file, self.as_text())

    def as_text(self) -> str:
        """The document as the text of its file."""
        return self.model_dump_json(indent=1, by_alias=True) + "\n"


def _explained(error: ValidationError, file: Path) -> DocumentError:
    """The first problem of a document as an error that names file, key and value."""
    first = error.errors(include_url=False)[0]
    field = ""
    for part in first["loc"]:
        field += f"[{part}]" if isinstance(part, int) else f".{part}" if field else str(part)
    if first["type"] == "missing":
        problem = "is missing"
    else:
        said = first["msg"].removeprefix("Value error, ").removeprefix("Assertion failed, ")
        problem = f"is {first['input']!r}: {said}"
    remedy = "render and run it again with the dragdeck that belongs to this dragchain"
    return DocumentError(file, field or None, problem, remedy=remedy)
