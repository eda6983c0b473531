"""JSON documents: each is a model, checked when it is written and when it is read."""

import json
from collections.abc import Iterable
from functools import partial
from pathlib import Path
from typing import ClassVar, Self

from pydantic import Field, ValidationError
from pydantic_core import ErrorDetails

from dragdeck.errors import DocumentError
from dragdeck.files import write_text
from dragdeck.parts import Part

SCHEMA = 2
"""Version of the form of every document; 1 had other names (CHANGELOG.md)."""


_MOST = 200
"""Characters of a wrong value in a message."""


class Document(Part):
    """A JSON document. A key that its model does not name is left unread."""

    remedy: ClassVar[str] = "make it again"
    """What to do where the file is missing, damaged, or another version's."""

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
        refused = partial(DocumentError, file=file, remedy=cls.remedy)
        try:
            text = file.read_text(encoding="utf-8")
            version = json.loads(text).get("schema")
        except FileNotFoundError:
            raise refused("there is no such file") from None
        except (ValueError, AttributeError, RecursionError) as error:
            raise refused(f"the file is not a JSON object: {error}") from None
        if version != SCHEMA:
            raise DocumentError(
                "the file was written by another version of dragdeck",
                file=file,
                field="schema",
                value=version,
                limit=str(SCHEMA),
                remedy=f"{cls.remedy}; or read it with the version that wrote it: CHANGELOG.md "
                "lists names that have changed",
            )
        try:
            return cls.model_validate_json(text, strict=True)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            problem, value = _said_of(first)
            raise refused(problem, field=_field(first["loc"]), value=value) from None

    def write(self, file: Path) -> None:
        """Write the document; it appears under its name only once it is whole."""
        write_text(file, self.as_text())

    def as_text(self) -> str:
        """The document as the text of its file."""
        return self.model_dump_json(indent=1, by_alias=True) + "\n"


def _said_of(error: ErrorDetails) -> tuple[str, str | None]:
    """What is wrong, and with what value."""
    if error["type"] == "missing":
        return "a required key is missing", None
    value = repr(error["input"])
    said = error["msg"].removeprefix("Value error, ").removeprefix("Assertion failed, ")
    return said, value if len(value) <= _MOST else f"{value[:_MOST]}..."


def _field(place: Iterable[int | str]) -> str | None:
    """The dotted name of a place in a document; None: the document as a whole."""
    name = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place)
    return name.removeprefix(".") or None
