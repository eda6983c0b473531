"""Streams over the raw outputs of a run, its parts merged.

An interrupted run resumes from its last checkpoint and writes new files, so that the parts of an
output may overlap. In an overlap, the later part is used.
"""

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dragdeck.decks.outputs import OutputOfRun
from dragdeck.dumps.frame import Columns, Frame
from dragdeck.dumps.reader import read_frames, read_prints
from dragdeck.errors import DumpError, TruncatedDumpError


def output_files(run_dir: Path | str, output: OutputOfRun) -> list[Path]:
    """Files of an output in the order of their part numbers.

    Parameters
    ----------
    run_dir : Path or str
        The run folder.
    output : OutputOfRun
        The output.

    Returns
    -------
    list of Path
        At least one file.

    Raises
    ------
    DumpError
        If there is none.
    """
    before, after = output.pattern.split("{part}")
    name = re.compile(re.escape(before) + r"([1-9][0-9]*)" + re.escape(after))
    matches = [(name.fullmatch(file.name), file) for file in Path(run_dir).iterdir()]
    parts = sorted((int(match.group(1)), file) for match, file in matches if match)
    if not parts:
        raise DumpError(
            Path(run_dir) / output.pattern,
            f"there is no file of the output {output.name}",
            remedy="run the case first, or remove the output from the study",
        )
    return [file for _, file in parts]


def iter_frames(run_dir: Path | str, output: OutputOfRun) -> Iterator[Frame]:
    """Read the frames of a ``dump custom`` or ``dump local`` of a run, its parts merged.

    Parameters
    ----------
    run_dir : Path or str
        The run folder.
    output : OutputOfRun
        The output, of kind ``custom`` or ``local``.

    Yields
    ------
    Frame
        With strictly increasing steps. At most one frame is in memory.

    Raises
    ------
    TruncatedDumpError
        If a file ends inside a frame that no later part covers.
    DumpError
        If a file is not such a dump, or its frames are not those that ``columns.json`` announces.
    """

    def read(file: Path) -> Iterator[_Piece]:
        for frame in read_frames([file], output):
            yield _Piece(frame.step, frame.step, frame.columns, frame.opening)

    pieces = _merged(run_dir, output, read)
    return (Frame(piece.first, piece.columns, piece.opening) for piece in pieces)


def iter_prints(run_dir: Path | str, output: OutputOfRun) -> Iterator[Columns]:
    """Read blocks of rows of a ``fix print`` output of a run, its parts merged.

    Parameters
    ----------
    run_dir : Path or str
        The run folder.
    output : OutputOfRun
        The output, of kind ``print``.

    Yields
    ------
    dict of str to (N,) ndarray
        Columns of up to 20,000 rows, with strictly increasing steps.

    Raises
    ------
    TruncatedDumpError, DumpError
        As in `iter_frames`.
    """

    def read(file: Path) -> Iterator[_Piece]:
        for columns in read_prints(file, output):
            yield _Piece(int(columns["step"][0]), int(columns["step"][-1]), columns)

    return (piece.columns for piece in _merged(run_dir, output, read))


@dataclass(frozen=True)
class _Piece:
    """What one read gives: a frame, or a block of rows from step to step."""

    first: int
    last: int
    columns: Columns
    opening: bool = False

    def before(self, limit: int | None) -> "_Piece | None":
        """Keep what comes before a step; None when nothing does."""
        if limit is None or self.last < limit:
            return self
        if self.first >= limit:
            return None
        keep = self.columns["step"] < limit
        columns = {name: values[keep] for name, values in self.columns.items()}
        return _Piece(self.first, int(columns["step"][-1]), columns)


_Reader = Callable[[Path], Iterator[_Piece]]


class _Schedule:
    """The steps at which an output must have frames."""

    def __init__(self, run_dir: Path | str, output: OutputOfRun) -> None:
        self.output = output
        self.file = Path(run_dir) / output.pattern
        self.next = output.first_step

    def check(self, piece: _Piece, file: Path) -> None:
        """Accept the steps of a piece, which must go on where the last one ended."""
        steps = piece.columns["step"] if self.output.kind == "print" else np.array([piece.first])
        period, last = self.output.period_steps, self.output.last_step
        if last is not None and piece.last > last:
            self._fail(file, f"has step {piece.last}", f"no step after {last}")
        if last is None:
            wrong = (steps < self.next) | ((steps - self.next) % period != 0)
            wanted = np.full(len(steps), self.next)
        else:
            wanted = self.next + period * np.arange(len(steps))
            wrong = steps != wanted
        if wrong.any():
            step, missing = int(steps[wrong][0]), int(wanted[wrong][0])
            self._fail(file, f"continues with step {step}", f"step {missing}")
        self.next = piece.last + period

    def finish(self) -> None:
        """Fail if frames are missing at the end."""
        last = self.output.last_step
        if last is not None and self.next <= last:
            self._fail(self.file, f"ends before step {self.next}", f"frames up to step {last}")
        if self.next == self.output.first_step:
            self._fail(self.file, "contains no frame", f"one from step {self.next} on")

    def _fail(self, file: Path, problem: str, expected: str) -> None:
        raise DumpError(
            file,
            f"{self.output.name} {problem}",
            expected=f"{expected}, according to columns.json",
            remedy="complete the run, then make the tables again",
        )


def _merged(run_dir: Path | str, output: OutputOfRun, read: _Reader) -> Iterator[_Piece]:
    files = output_files(run_dir, output)
    limits = _limits([None, *(_first_step(file, read) for file in files[1:])])
    schedule = _Schedule(run_dir, output)
    for file, limit in zip(files, limits, strict=True):
        try:
            for whole in read(file):
                piece = whole.before(limit)
                if piece is None:
                    break
                schedule.check(piece, file)
                yield piece
        except TruncatedDumpError:
            if limit is None or limit > schedule.next:
                raise
    schedule.finish()


def _first_step(file: Path, read: _Reader) -> int | None:
    """First whole step of a part, None if it holds none."""
    try:
        piece = next(read(file), None)
    except TruncatedDumpError:
        return None
    return None if piece is None else piece.first


def _limits(first_steps: Iterable[int | None]) -> list[int | None]:
    """Step from which on a later part counts, for each part."""
    limits: list[int | None] = []
    limit: int | None = None
    for first in reversed(list(first_steps)):
        limits.append(limit)
        if first is not None:
            limit = first if limit is None else min(limit, first)
    return limits[::-1]
