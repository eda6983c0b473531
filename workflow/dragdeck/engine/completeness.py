"""Whether the outputs of all parts of a run hold every step that the deck promises."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from dragdeck.decks.outputs import OutputOfRun
from dragdeck.engine.frames import WholeFrames, whole_frames
from dragdeck.engine.record import RunPart


@dataclass(frozen=True)
class Coverage:
    """What the parts of a run hold of an output.

    Attributes
    ----------
    steps : frozenset of int
        Of whole frames that count: no later part begins before them.
    gap : int or None
        The first promised step that is missing, of those up to the last one written or promised.
    """

    steps: frozenset[int]
    gap: int | None

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
    for part in parts:
        steps = {step for step in steps if step <= part.from_step}
        file = _file(folder, output, part)
        if file.is_file():
            steps |= set(whole_frames(file, output).steps)
    return Coverage(frozenset(steps), _gap(steps, output))


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


def cut_damage(
    folder: Path, outputs: Mapping[str, OutputOfRun], parts: Sequence[RunPart]
) -> list[Path]:
    """Cut from each output what follows its last whole frame: the next part writes it again.

    Returns
    -------
    list of Path
        The files that were cut.
    """
    found: dict[Path, WholeFrames] = {}
    for output in outputs.values():
        for part in parts:
            file = _file(folder, output, part)
            if file.is_file():
                found[file] = whole_frames(file, output)
    for file, frames in found.items():
        if frames.damaged:
            os.truncate(file, frames.length)
    return [file for file, frames in found.items() if frames.damaged]
