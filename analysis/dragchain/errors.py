"""The errors of reading and analysing a run."""

from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

from dragdeck.errors import DragdeckError, rendered


class DumpError(DragdeckError):
    """A raw output whose content is not that announced in ``columns.json``.

    Parameters
    ----------
    file : Path
        The output file.
    problem : str
        What was found.
    frame : int, optional
        Number of the frame (of the data row in a ``fix print`` file), from 0.
    offset : int, optional
        Byte offset into the file at which the frame or the row starts.
    expected : str, optional
        What was expected instead.
    kept : str, optional
        Intact content before it.
    remedy : str, optional
        What the user can do.
    """

    def __init__(
        self,
        file: Path,
        problem: str,
        *,
        frame: int | None = None,
        offset: int | None = None,
        expected: str | None = None,
        kept: str | None = None,
        remedy: str | None = None,
    ) -> None:
        self.file = file
        self.problem = problem
        self.frame = frame
        self.offset = offset
        self.expected = expected
        self.kept = kept
        self.remedy = remedy
        super().__init__()

    def __str__(self) -> str:
        """Problem with its place, what was expected, and what is intact."""
        place = [f"{self.file}"]
        if self.frame is not None:
            place.append(f"frame {self.frame}")
        if self.offset is not None:
            place.append(f"byte {self.offset}")
        problem = f"{', '.join(place)}: {self.problem}"
        return rendered(problem, expected=self.expected, kept=self.kept, remedy=self.remedy)


class TruncatedDumpError(DumpError):
    """A raw output that ends inside a frame; the frames before it are intact."""


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


class RecordError(DragdeckError):
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
        said = f"the record cannot be used ({reason}): {problem}"
        super().__init__(rendered(said, value=value, limit=limit, remedy=remedy))
