"""The errors a user can meet before and after an engine run."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from pathlib import Path


class DragdeckError(Exception):
    """Base of every error that dragdeck raises on purpose."""


class InputError(DragdeckError):
    """A study, mesh or template that cannot be used.

    Parameters
    ----------
    problem : str
        What is wrong, in one sentence without a full stop.
    file : Path or str, optional
        Where it stands.
    field : str, optional
        The dotted field name, or ``line N``.
    value : object, optional
        The value found there.
    limit : str, optional
        What would be accepted.
    remedy : str, optional
        What the user can do.

    Attributes
    ----------
    line : int or None
        Line of the field in the file, where it is known.
    more : sequence of InputError
        Further problems of the same input; the message contains them all.
    """

    def __init__(
        self,
        problem: str,
        *,
        file: Path | str | None = None,
        field: str | None = None,
        value: object = None,
        limit: str | None = None,
        remedy: str | None = None,
    ) -> None:
        self.problem = problem
        self.file = file
        self.field = field
        self.value = value
        self.limit = limit
        self.remedy = remedy
        self.line: int | None = None
        self.more: Sequence[InputError] = ()
        super().__init__(problem)

    def __str__(self) -> str:
        return "\n".join([self._message(), *map(str, self.more)])

    def _message(self) -> str:
        file = self.file if self.line is None else f"{self.file}:{self.line}"
        where = ": ".join(str(part) for part in (file, self.field) if part is not None)
        lines = [f"{where}: {self.problem}" if where else self.problem]
        if self.value is not None:
            lines.append(f"  value:  {self.value}")
        if self.limit is not None:
            lines.append(f"  limit:  {self.limit}")
        if self.remedy is not None:
            lines.append(f"  remedy: {self.remedy}")
        return "\n".join(lines)


def together(errors: Iterable[InputError]) -> InputError:
    """Several errors as one that names them all, each once; it has the fields of the first."""
    first, *more = {str(error): error for error in errors}.values()
    first.more = (*first.more, *more)
    return first


def near(word: str, known: Iterable[str]) -> str | None:
    """The known word that a wrong one resembles, as a remedy; None where none does."""
    found = difflib.get_close_matches(word, list(known), n=1)
    return f"did you mean {found[0]!r}?" if found else None


class EngineError(DragdeckError):
    """The engine is missing, too old, refused the deck or was stopped."""


class RejectedRunError(DragdeckError):
    """A run ended, but what it left cannot be trusted."""
