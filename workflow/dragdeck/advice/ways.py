"""The ways to a quantity at the physical modulus: what each is expected to give, and to cost."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

from dragdeck.advice.work import Work
from dragdeck.records.windows import Known, WindowsRecord
from dragdeck.scenes.lead import FIRST_WINDOWS, counted_blocks, window_count
from dragdeck.study.model import Fidelity, Study, Tolerance


@dataclass(frozen=True)
class Way:
    """A way to quantities at the physical modulus.

    Attributes
    ----------
    name : str
    windows : int
        Of the way; 0 if it has none.
    half_width : float
        Expected relative half-width of the 95 % interval, the largest of the quantities; infinite
        where other scenes say nothing of one.
    relative_cost : float
        CPU time over that of the plain run.
    """

    name: str
    windows: int
    half_width: float
    relative_cost: float


@dataclass(frozen=True)
class Ways:
    """What is known of the ways of a case.

    Attributes
    ----------
    work : Work
    soft, stiff : Fidelity
        Of the soft run with its windows, and of the whole drag at the physical modulus.
    asked : Tolerance
    plain : float
        CPU time of the plain run, as `Work.cpu_time`.
    record : WindowsRecord
        Of other scenes.
    """

    work: Work
    soft: Fidelity
    stiff: Fidelity
    asked: Tolerance
    plain: float
    record: WindowsRecord

    @cached_property
    def most(self) -> int:
        """How many windows there can be."""
        return window_count(self._study)

    @property
    def of_other_scenes(self) -> Way:
        """The soft run alone, times the ratio of other scenes: an estimate, no measurement."""
        blocks, _ = self._blocks
        half = self._largest(lambda known: known.soft_half_width(blocks))
        return self._way("soft run times the ratio of other scenes", half, self.soft)

    def with_windows(self, count: int) -> Way:
        """The soft run and so many windows."""
        blocks, sample = self._blocks
        half = self._largest(lambda known: known.windows_half_width(count, sample, blocks))
        return self._way(f"soft run and {count} windows", half, self.soft, count)

    @property
    def whole(self) -> Way:
        """The whole drag at the physical modulus, after a soft start."""
        blocks, _ = self._blocks
        half = self._largest(lambda known: known.whole_half_width(blocks))
        return self._way("whole drag after a soft start", half, self.stiff)

    def _way(self, name: str, half_width: float, fidelity: Fidelity, windows: int = 0) -> Way:
        cost = self.work.cpu_time(fidelity, windows) / self.plain
        return Way(name, windows, half_width, cost)

    @property
    def enough_windows(self) -> Way | None:
        """With the fewest windows that are expected to do; None if none are."""
        ways = map(self.with_windows, range(FIRST_WINDOWS, self.most + 1))
        return next((way for way in ways if way.half_width <= self.asked.tolerance), None)

    def __iter__(self) -> Iterator[Way]:
        yield self.of_other_scenes
        counts = {FIRST_WINDOWS, self.most}
        if enough := self.enough_windows:
            counts.add(enough.windows)
        yield from map(self.with_windows, sorted(counts))
        yield self.whole

    @property
    def windows_pay(self) -> bool:
        """Whether windows are expected to cost no more than the whole drag.

        Where no way is expected to do, they show it at the least cost.
        """
        whole = self.whole
        if enough := self.enough_windows:
            return enough.relative_cost <= whole.relative_cost
        return whole.half_width > self.asked.tolerance

    @property
    def _study(self) -> Study:
        return self.work.study.model_copy(update={"fidelity": self.soft})

    @cached_property
    def _blocks(self) -> tuple[float, float]:
        """Blocks of the counted path, and of a window's sample."""
        return counted_blocks(self._study)

    def _largest(self, half_width: Callable[[Known], float]) -> float:
        """The largest half-width of the quantities."""
        known = [self.record.quantities.get(name) for name in self.asked.quantities]
        return max(half_width(of) if of else math.inf for of in known)
