"""Which frames of an output are whole, and whether all parts together hold every promised step."""

import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dragdeck.arrays import Floats
from dragdeck.decks.outputs import OutputOfRun
from dragdeck.dumps.content import Cursor
from dragdeck.dumps.grammar import WholeFrames, frame_cells, whole_frames
from dragdeck.records.run import RunPart


@dataclass(frozen=True)
class Coverage:
    """What the parts of a run hold of an output.

    Attributes
    ----------
    steps : frozenset of int
        Of whole frames that count: no later part begins before them.
    gap : int or None
        The first promised step that is missing, of those up to the last one written or promised.
    problem : str
        Place and kind of the damage in the file of the last part; empty without.
    """

    steps: frozenset[int]
    gap: int | None
    problem: str

    @property
    def last(self) -> int | None:
        """The last step."""
        return max(self.steps, default=None)


def part_files(
    folder: Path, outputs: Mapping[str, OutputOfRun], parts: Sequence[RunPart]
) -> list[Path]:
    """The files that parts of a run write, there or not."""
    return [_file(folder, output, part) for output in outputs.values() for part in parts]


def _file(folder: Path, output: OutputOfRun, part: RunPart) -> Path:
    return folder / output.pattern.format(part=part.part)


def coverage(folder: Path, output: OutputOfRun, parts: Sequence[RunPart]) -> Coverage:
    """What the parts hold of an output; what a later part has written again counts once."""
    steps: set[int] = set()
    frames = WholeFrames()
    for part in parts:
        file = _file(folder, output, part)
        frames = whole_frames(file, output) if file.is_file() else WholeFrames()
        steps = {step for step in steps if step <= part.from_step}.union(frames.steps)
    return Coverage(frozenset(steps), _gap(steps, output), frames.problem)


def some_frames(
    folder: Path, output: OutputOfRun, parts: Sequence[RunPart], most: int
) -> Iterator[tuple[int, Floats]]:
    """Step and rows of so many frames of a dump at most, spread evenly, the last one included."""
    files = [file for file in part_files(folder, {"": output}, parts) if file.is_file()]
    ends = [(file, (0, *(end for _, end in whole_frames(file, output).ends))) for file in files]
    begins = [(file, begin) for file, places in ends for begin in places[:-1]]
    for number in np.linspace(0, len(begins) - 1, min(most, len(begins))).astype(int):
        file, begin = begins[number]
        with Cursor(file, output, begin) as at:
            step, cells = frame_cells(at)
        yield step, cells.T


def _gap(steps: set[int], output: OutputOfRun) -> int | None:
    last = output.last_step
    if last is None and output.period_steps == 1:  # the engine decides which steps it writes
        return None
    end = max(steps, default=output.first_step) if last is None else last
    wanted = range(output.first_step, end + 1, output.period_steps)
    return next((step for step in wanted if step not in steps), None)


def first_gap(folder: Path, outputs: Mapping[str, OutputOfRun], parts: Sequence[RunPart]) -> float:
    """The first step that some output lacks: a run can only go on from before it.

    Infinite where nothing is missing.
    """
    gaps = [coverage(folder, output, parts).gap for output in outputs.values()]
    return min((gap for gap in gaps if gap is not None), default=math.inf)


def cut_outputs(
    folder: Path, outputs: Mapping[str, OutputOfRun], parts: Sequence[RunPart], last: int
) -> list[str]:
    """Cut from each output what the next part will write again: all after a step, and damage.

    Returns
    -------
    list of str
        File, place and kind of each damage.
    """
    damaged = []
    for output in outputs.values():
        for part in parts:
            file = _file(folder, output, part)
            if file.is_file():
                frames = whole_frames(file, output)
                os.truncate(file, frames.length_to(last))
                damaged += [f"{file.name}, {frames.problem}"] if frames.problem else []
    return damaged
