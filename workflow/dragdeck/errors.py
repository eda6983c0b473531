"""Errors and warnings before, during and after a run."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Literal


class DragdeckError(Exception):
    """Base of every error that is raised on purpose."""


def rendered(problem: str, **details: object) -> str:
    """A problem, and below it what is known of it: a line for each detail that is not None."""
    known = {f"{name}:": detail for name, detail in details.items() if detail is not None}
    return "\n".join([problem, *(f"  {name:<7} {detail}" for name, detail in known.items())])


@dataclass(eq=False, repr=False)
class InputError(DragdeckError):
    """A study, mesh or template that cannot be used.

    Parameters
    ----------
    problem : str
        What is wrong, in one sentence without a full stop.
    file : Path or str, optional
        The file with the problem.
    field : str, optional
        The dotted field name, or ``line N``.
    value : object, optional
        The value of the field.
    limit : str, optional
        Accepted values.
    remedy : str, optional
        Instruction for the user.
    line : int, optional
        Line of the field in the file.

    Attributes
    ----------
    more : sequence of InputError
        Further problems of the same input; the message contains them all.
    """

    problem: str
    _: KW_ONLY
    file: Path | str | None = None
    field: str | None = None
    value: object = None
    limit: str | None = None
    remedy: str | None = None
    line: int | None = None

    def __post_init__(self) -> None:
        self.more: Sequence[InputError] = ()

    def __str__(self) -> str:
        return "\n".join([self._message(), *map(str, self.more)])

    def _message(self) -> str:
        file = self.file if self.line is None else f"{self.file}:{self.line}"
        where = ": ".join(str(part) for part in (file, self.field) if part is not None)
        problem = f"{where}: {self.problem}" if where else self.problem
        return rendered(problem, value=self.value, limit=self.limit, remedy=self.remedy)


class DocumentError(InputError):
    """A JSON document that is missing, damaged, or of another version."""


def together(errors: Iterable[InputError]) -> InputError:
    """Several errors as one that names them all, each once; it has the fields of the first."""
    every = {problem._message(): problem for error in errors for problem in (error, *error.more)}
    first, *more = every.values()
    first.more = more
    for problem in more:
        problem.more = ()
    return first


def near(word: str, known: Iterable[str]) -> str:
    """A question about the known word that a wrong one resembles; empty where none does."""
    names = sorted(known, key=len)
    longer = [name for name in names if name.startswith(f"{word}_")]
    likely = longer or get_close_matches(word, names, 1)
    return "".join(f"did you mean {name!r}? " for name in likely[:1])


def choices(word: str, known: Iterable[str]) -> str:
    """What may stand in place of a wrong word, as a limit."""
    names = list(known)
    return f"{near(word, names)}one of: {', '.join(names) or 'none here'}"


@dataclass(eq=False, repr=False)
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

    reason: str
    problem: str
    _: KW_ONLY
    value: str | None = None
    limit: str | None = None
    remedy: str | None = None

    def __str__(self) -> str:
        said = f"the record cannot be used ({self.reason}): {self.problem}"
        return rendered(said, value=self.value, limit=self.limit, remedy=self.remedy)

    def of_field(self, field: str, name: str) -> InputError:
        """The same as an error of the field of a study that names the record."""
        problem, value = f"({self.reason}) {self.problem}", self.value or name
        return InputError(problem, field=field, value=value, limit=self.limit, remedy=self.remedy)


class EngineError(DragdeckError):
    """LIGGGHTS is missing or too old, rejected the input script, or was stopped."""


class RejectedRunError(DragdeckError):
    """A run that did not pass the acceptance checks, or is not complete."""


@dataclass(eq=False, repr=False)
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

    file: Path
    problem: str
    _: KW_ONLY
    frame: int | None = None
    offset: int | None = None
    expected: str | None = None
    kept: str | None = None
    remedy: str | None = None

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


CautionCode = Literal[
    "class", "cohesion", "facets", "fidelity", "gap", "implausible", "mesh", "overlap", "ranks",
    "roughness", "size_ratio", "stable_timestep", "steps_per_contact", "thrown", "tilt", "trials",
    "with_bowl",
]  # fmt: skip
"""What a `Caution` is about."""


@dataclass(frozen=True)
class Caution:
    """A warning before a run.

    Attributes
    ----------
    code : CautionCode
    text : str
        One sentence with a remedy, for users.
    settings : mapping of str to float
        Fields of the fidelity and values that remove the cause, one warning at a time; empty
        if no setting does, because the warning is about the scene itself.
    """

    code: CautionCode
    text: str
    settings: Mapping[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        return self.text
