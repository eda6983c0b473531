"""The errors of reading and analysing a run."""

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

from dragdeck.errors import DragdeckError

DragchainError = DragdeckError
"""Base of every error that is raised on purpose."""


def _joined(lines: list[str], remedy: str | None) -> str:
    if remedy is not None:
        lines.append(f"remedy: {remedy}")
    return "\n  ".join(lines)


class DocumentError(DragchainError):
    """A ``case.json`` or ``columns.json`` that cannot be used.

    Parameters
    ----------
    file : Path
        The file.
    field : str or None
        Dotted name of the offending key, None for the file as a whole.
    problem : str
        What is wrong, without a full stop.
    remedy : str, optional
        What the user can do.
    """

    def __init__(
        self, file: Path, field: str | None, problem: str, *, remedy: str | None = None
    ) -> None:
        self.file = file
        self.field = field
        self.problem = problem
        self.remedy = remedy
        where = f"{file}: {field}" if field is not None else f"{file}"
        super().__init__(_joined([f"{where}: {problem}"], remedy))


class TableError(DragchainError):
    """Raw outputs or tables that are missing, damaged or inconsistent with each other."""


_MOST = 30
"""More known names are listed only if none of them resembles the wrong one."""


class UnknownNameError(DragchainError):
    """An unknown name of a study, run, table or column.

    Parameters
    ----------
    problem : str
        What is wrong, with the name and without a full stop.
    name : str
        The name.
    known : iterable of str
        The names that exist.
    remedy : str, optional
        What the user can do.
    """

    def __init__(
        self, problem: str, name: str, known: Iterable[str], *, remedy: str | None = None
    ) -> None:
        self.known = tuple(known)
        near = [f"did you mean {one!r}?" for one in get_close_matches(name, self.known, 1)]
        every = [] if near and len(self.known) > _MOST else [f"known: {', '.join(self.known)}"]
        super().__init__(_joined([problem, *near, *every], remedy))


class ExportError(DragchainError):
    """An export that cannot be made, or not in this place."""


class SeriesError(DragchainError):
    """A series of samples without usable statistics."""


class RejectedRunError(DragchainError):
    """A run that did not pass the acceptance checks, or is not complete."""


class MissingRunsError(DragchainError):
    """Runs of a study that have no result; the report shows the others."""


class RecordError(DragchainError):
    """A measured record that cannot be used.

    Parameters
    ----------
    reason : str
        One word for what is wrong, for example ``clipped``.
    problem : str
        What is wrong, without a full stop.
    value, limit, remedy : str, optional
        What was found, what is accepted, what the user can do.
    """

    def __init__(
        self,
        reason: str,
        problem: str,
        *,
        value: str | None = None,
        limit: str | None = None,
        remedy: str | None = None,
    ) -> None:
        self.reason = reason
        self.problem = problem
        self.value = value
        self.limit = limit
        self.remedy = remedy
        lines = [f"the record cannot be used ({reason}): {problem}"]
        lines += [f"value:  {value}"] if value is not None else []
        lines += [f"limit:  {limit}"] if limit is not None else []
        super().__init__(_joined(lines, remedy))
