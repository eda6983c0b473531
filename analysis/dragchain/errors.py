"""The errors of reading and analysing a run."""

from collections.abc import Iterable
from difflib import get_close_matches

from dragdeck.errors import DragdeckError, rendered


class TableError(DragdeckError):
    """Raw outputs or tables that are missing, damaged or inconsistent with each other."""


_MOST = 30
"""More known names are listed only if none of them resembles the wrong one."""


class UnknownNameError(DragdeckError):
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
        near = get_close_matches(name, self.known, 1)
        every = None if near and len(self.known) > _MOST else ", ".join(self.known)
        asked = f"{problem}: did you mean {near[0]!r}?" if near else problem
        super().__init__(rendered(asked, known=every, remedy=remedy))


class ExportError(DragdeckError):
    """An export that cannot be made, or not in this place."""


class SeriesError(DragdeckError):
    """A series of samples without usable statistics."""


class MissingRunsError(DragdeckError):
    """Runs of a study that have no result; the report shows the others."""
