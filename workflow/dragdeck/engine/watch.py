"""The watch over a running engine: what ends it, and what is done meanwhile."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from dragdeck.engine.checkpoints import drop_old_checkpoints, name_whole_checkpoints
from dragdeck.engine.log import Sample, breach, thermo_samples
from dragdeck.engine.reports import shown_bytes
from dragdeck.engine.space import SPARE_BYTES, free_bytes, size_of
from dragdeck.physics.run_limits import RunLimits
from dragdeck.records.run import AcceptanceCheck

SCREEN_BYTES = 16_000_000
"""No run prints as much, unless it repeats one message without end."""

_KEPT_BYTES = 100_000
"""How much is kept of a screen that was cut."""

_SURE_FRACTION = 0.02
"""Of a run: what it wrote until then says nothing about the rest."""


class LimitMet(Exception):
    """A running engine went past a limit of its scene."""

    def __init__(self, check: AcceptanceCheck) -> None:
        self.check = check
        super().__init__(check.seen)


class EngineEnded(Exception):
    """The watch ended an engine that can go on later: says why, and what to do first."""

    def __init__(self, why: str, remedy: str) -> None:
        self.why, self.remedy = why, remedy
        super().__init__(why)


@dataclass
class Watcher:
    """Looks after one part of a run, each time it is called.

    It names the checkpoints that are whole and deletes old ones. It ends a run that goes past a
    limit of its scene with `LimitMet`; one that writes nothing for a long time, prints without
    end, or would fill its disk with `EngineEnded`.

    Attributes
    ----------
    folder, screen : Path
        Of the run, and the file that takes what the engine prints.
    files : sequence of Path
        The outputs of the part.
    thermo : Path or None
        The one with a row now and then.
    columns : sequence of str
        Its columns.
    first, last : int, int or None
        Steps from which to which the part runs.
    particles, ranks : int
    limits : RunLimits or None
    patience_s : float
        How long the engine may write nothing.
    """

    folder: Path
    screen: Path
    files: Sequence[Path]
    thermo: Path | None
    columns: Sequence[str]
    first: int
    last: int | None
    particles: int
    ranks: int
    limits: RunLimits | None
    patience_s: float
    _place: int = field(default=0, init=False)
    _newest: Sample | None = field(default=None, init=False)
    _written: int = field(default=0, init=False)
    _written_s: float = field(default=0.0, init=False)
    _sizes: dict[str, int] = field(default_factory=dict, init=False)

    def __call__(self, seconds: float) -> None:
        """Look at what the engine has written since the last look."""
        self._end_endless_output()
        self._end_standstill(seconds)
        name_whole_checkpoints(self.folder, self.particles, self.ranks, self._sizes)
        samples = self._new_samples()
        check = breach(samples, self.limits) if self.limits is not None else None
        if check is not None:
            raise LimitMet(check)
        self._end_before_the_disk_is_full()
        drop_old_checkpoints(self.folder)

    def _new_samples(self) -> list[Sample]:
        """The whole thermo rows that came since the last look."""
        if self.thermo is None or not self.thermo.is_file():
            return []
        with self.thermo.open("rb") as stream:
            stream.seek(self._place)
            new, end, _ = stream.read().rpartition(b"\n")
        self._place += len(new) + len(end)
        samples = thermo_samples(new.decode("ascii", errors="replace").splitlines(), self.columns)
        self._newest = samples[-1] if samples else self._newest
        return samples

    def _end_endless_output(self) -> None:
        size = size_of(self.screen)
        if size > SCREEN_BYTES:
            raise EngineEnded(
                f"LIGGGHTS printed {shown_bytes(size)}, far more than any normal run",
                f"read the beginning in {self.screen.name}; the rest was cut",
            )

    def _end_standstill(self, seconds: float) -> None:
        written = sum(size_of(file) for file in (self.screen, *self.files))
        if written != self._written:
            self._written, self._written_s = written, seconds
        elif seconds - self._written_s > self.patience_s:
            raise EngineEnded(
                f"LIGGGHTS produced no output for {seconds - self._written_s:.0f} s",
                "find the cause, or allow more time with --patience",
            )

    def _end_before_the_disk_is_full(self) -> None:
        free, needed = free_bytes(self.folder), SPARE_BYTES + self._still_to_write()
        if free < needed:
            raise EngineEnded(
                f"the disk is nearly full: {shown_bytes(free)} are free, and the run still needs "
                f"{shown_bytes(needed)}",
                "free disk space",
            )

    def _still_to_write(self) -> float:
        """What the rest of the run will write if it goes on as it did."""
        if self._newest is None or self.last is None:
            return 0.0
        done, left = self._newest.step - self.first, self.last - self._newest.step
        sure = done > _SURE_FRACTION * (done + left)
        return self._written * left / done if sure else 0.0


def cut_screen(screen: Path) -> None:
    """Keep the beginning of a screen that was printed without end."""
    if size_of(screen) > SCREEN_BYTES:
        with screen.open("r+b") as stream:
            stream.truncate(_KEPT_BYTES)
            stream.seek(0, 2)
            stream.write(b"\n[cut: LIGGGHTS printed without end]\n")
