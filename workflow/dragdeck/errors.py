"""The errors a user can meet before and after an engine run."""

from __future__ import annotations

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
        super().__init__(self._message())

    def _message(self) -> str:
        where = ": ".join(str(part) for part in (self.file, self.field) if part is not None)
        lines = [f"{where}: {self.problem}" if where else self.problem]
        if self.value is not None:
            lines.append(f"  value:  {self.value}")
        if self.limit is not None:
            lines.append(f"  limit:  {self.limit}")
        if self.remedy is not None:
            lines.append(f"  remedy: {self.remedy}")
        return "\n".join(lines)


class EngineError(DragdeckError):
    """The engine is missing, too old, refused the deck or was stopped."""


class RejectedRunError(DragdeckError):
    """A run ended, but what it left cannot be trusted."""
