"""The watch over a running engine."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from dragdeck.engine.checkpoints import CHECKPOINTS_KEPT, checkpoint_files
from dragdeck.engine.limits import breach
from dragdeck.engine.log import read_samples
from dragdeck.engine.record import AcceptanceCheck
from dragdeck.physics.run_limits import RunLimits

Report = Callable[[str], None]


def say(line: str) -> None:
    """Tell the user something on the way."""
    print(line, file=sys.stderr, flush=True)


@dataclass(frozen=True)
class Progress:
    """Where a running engine is."""

    step: int
    steps: int | None
    steps_per_s: float

    def __str__(self) -> str:
        speed = f"{self.steps_per_s:,.0f} steps/s"
        if not self.steps or not self.steps_per_s:
            return f"step {self.step:,}, {speed}"
        left = (self.steps - self.step) / self.steps_per_s
        fraction = 100 * self.step / self.steps
        return (
            f"step {self.step:,} of {self.steps:,} ({fraction:.0f} %), {speed}, "
            f"{left // 60:.0f} min {left % 60:02.0f} s left"
        )


class LimitMet(Exception):
    """A running engine went past a limit of its scene."""

    def __init__(self, check: AcceptanceCheck) -> None:
        self.check = check
        super().__init__(check.seen)


class Watcher:
    """Reads how far a run is, reports it now and then, and deletes old checkpoints.

    A run that goes past a limit of its scene ends with `LimitMet`.

    Parameters
    ----------
    thermo : Path or None
        The part's ``thermo`` file.
    columns : sequence of str
        Its columns.
    first, last : int, int or None
        Steps from which to which the part runs.
    limits : RunLimits or None
    report : callable
        Gets a line about every `every_s` seconds.
    """

    def __init__(
        self,
        thermo: Path | None,
        columns: Sequence[str],
        first: int,
        last: int | None,
        limits: RunLimits | None,
        report: Report,
        every_s: float,
    ) -> None:
        self._file, self._columns, self._place = thermo, columns, 0
        self._first, self._last, self._limits = first, last, limits
        self._report, self._every_s, self._next = report, every_s, every_s

    def __call__(self, seconds: float) -> None:
        """Check the limits, and report now and then."""
        if self._file is None or not self._file.is_file():
            return
        self._check_limits(self._file)
        if seconds < self._next:
            return
        self._next = seconds + self._every_s
        for old in checkpoint_files(self._file.parent)[:-CHECKPOINTS_KEPT]:
            old.unlink()
        rows = self._file.read_text(errors="replace").splitlines()
        last = rows[-1].split() if rows else []  # the engine may not have written its header yet
        if last and last[0].isdigit():
            step = int(last[0])
            self._report(str(Progress(step, self._last, (step - self._first) / seconds)))

    def _check_limits(self, file: Path) -> None:
        """Look at the rows that came since the last look."""
        if self._limits is None:
            return
        with file.open("rb") as stream:
            stream.seek(self._place)
            new, end, _ = stream.read().rpartition(b"\n")
        self._place += len(new) + len(end)
        rows = new.decode("ascii", errors="replace").splitlines()
        check = breach(read_samples(rows, self._columns), self._limits)
        if check is not None:
            raise LimitMet(check)
