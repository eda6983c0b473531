"""The ways to a quantity at the physical modulus: what each is expected to give, and to cost."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from dragdeck.cases.bed import bed_timestep, expected_surface, full_stiffness_number
from dragdeck.cases.case import Case, of_each_workpiece
from dragdeck.records.tradeoff import TradeoffRecord
from dragdeck.records.windows import Known, WindowsRecord, softening
from dragdeck.scenes import lead as leads
from dragdeck.scenes.bed_space import particles_step_s
from dragdeck.scenes.filling import FILLING, expected_time
from dragdeck.scenes.workpiece import FACET_STEP_S, PARTICLE_STEPS_PER_S, workpiece_facets
from dragdeck.study.fidelity import Fidelity, Tolerance
from dragdeck.study.model import Study


@dataclass(frozen=True)
class Work:
    """What the filling and the process of a case take. Its drop test is the same at all settings.

    Attributes
    ----------
    study : Study
    tradeoff : TradeoffRecord
    filling_s, process_s, entry_s : float
        Simulated time, that of the process and of what goes before its drag at the study's own
        speed, s.
    facets : int
        Of all workpieces.
    """

    study: Study
    tradeoff: TradeoffRecord
    filling_s: float
    process_s: float
    entry_s: float
    facets: int

    @classmethod
    def of(cls, case: Case, tradeoff: TradeoffRecord) -> "Work":
        """Of a case; its own fidelity does not matter."""
        study, motion = case.study, case.study.motion
        way = math.dist(motion.plunge_point, motion.path.start_point)
        entry_s = (
            expected_surface(study) / motion.plunge_speed_m_s + way / motion.approach_speed_m_s
        )
        process_s = entry_s + motion.path_length_m / motion.nominal_speed_m_s + motion.ramp_s / 2
        facets = sum(workpiece_facets(workpiece) for workpiece in of_each_workpiece(case))
        return cls(study, tradeoff, expected_time(study), process_s, entry_s, facets)

    def steps(self, fidelity: Fidelity, windows: int = 0) -> float:
        """Time steps of process and windows, each counted as it costs at its modulus.

        Parameters
        ----------
        fidelity : Fidelity
        windows : int
            How many are run, if the settings have any.
        """
        study = self.study.model_copy(update={"fidelity": fidelity})
        start, entry = study.at_start(), leads.covered_fraction(study)
        drag_s = self.process_s - self.entry_s
        softer = self.entry_s + entry * drag_s
        steps = self._steps(start, softer) + self._steps(study, self.process_s - softer)
        if fidelity.windows is not None:
            stiff = fidelity.model_copy(
                update={
                    "youngs_modulus_scale": 1.0,
                    "timestep_fraction": fidelity.windows.timestep_fraction,
                }
            )
            stiffer = self.study.model_copy(update={"fidelity": stiff})
            steps += windows * self._steps(stiffer, leads.window_fraction(study) * drag_s)
        return steps

    def cpu_time(self, fidelity: Fidelity, windows: int = 0) -> float:
        """CPU time of all runs with some settings, s: only ratios of it count."""
        filled = self.study.model_copy(update={"fidelity": fidelity}).at_filling()
        filling = self.filling_s / bed_timestep(filled, "filling_timestep_fraction")
        count, of_facets = self.study.sphere_count, self.facets * FACET_STEP_S
        filling_s = filling * particles_step_s(count, FILLING.particle_steps_per_s)
        particles_s = particles_step_s(count, PARTICLE_STEPS_PER_S)
        return filling_s + self.steps(fidelity, windows) * (particles_s + of_facets)

    def _steps(self, study: Study, time_s: float) -> float:
        """Steps of a stretch of the process, each counted as it costs at its modulus."""
        chosen = study.chosen_fidelity()
        steps = time_s / bed_timestep(study, "timestep_fraction") / chosen.speed_factor
        return steps * step_cost(chosen.youngs_modulus_scale, self.tradeoff)


def step_cost(scale: float, tradeoff: TradeoffRecord) -> float:
    """Time of a step of the drag at a modulus scale, over that at the others that were timed.

    Soft particles have more contacts, and their steps cost more. Interpolated over
    logarithms; 1 where nothing was timed.

    Parameters
    ----------
    scale : float
        Factor on every Young's modulus.
    tradeoff : TradeoffRecord
    """
    timed = sorted(
        (cost.level, cost.per_step)
        for cost in tradeoff.costs
        if cost.parameter == "youngs_modulus_scale" and cost.level and cost.per_step
    )
    if not timed:
        return 1.0
    levels, logs = zip(*((level, math.log(time)) for level, time in timed), strict=True)
    return math.exp(np.interp(math.log(scale), np.log(levels), logs))


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
        CPU time relative to that of the plain run.
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
    front : float
        Particles that fit on the front of the workpiece.
    """

    work: Work
    soft: Fidelity
    stiff: Fidelity
    asked: Tolerance
    plain: float
    record: WindowsRecord
    front: float

    @cached_property
    def most(self) -> int:
        """How many windows there can be."""
        return leads.window_count(self._study)

    @property
    def of_other_scenes(self) -> Way:
        """The soft run alone, times the ratio of other scenes: an estimate, no measurement."""
        blocks, _ = self._blocks
        full = full_stiffness_number(self._study)
        difference = softening(full, self.soft.youngs_modulus_scale)
        half = self._largest(lambda known: known.soft_half_width(blocks, difference))
        return self._way("soft run times the ratio of other scenes", half, self.soft)

    def with_windows(self, count: int) -> Way:
        """The soft run and so many windows."""
        half = self._windows_half_width(count)
        return self._way(f"soft run and {count} windows", half, self.soft, count)

    def _windows_half_width(self, count: int) -> float:
        blocks, sample = self._blocks
        return self._largest(lambda known: known.windows_half_width(count, sample, blocks))

    @property
    def whole(self) -> Way:
        """The whole drag at the physical modulus, after a soft start."""
        blocks, _ = self._blocks
        half = self._largest(lambda known: known.whole_half_width(blocks))
        return self._way("whole drag after a soft start", half, self.stiff)

    def _way(self, name: str, half_width: float, fidelity: Fidelity, windows: int = 0) -> Way:
        cost = self.work.cpu_time(fidelity, windows) / self.plain
        return Way(name, windows, half_width, cost)

    @cached_property
    def enough_windows(self) -> Way | None:
        """With the fewest windows that are expected to do; None if none are."""
        for count in range(leads.FIRST_WINDOWS, self.most + 1):
            if self._windows_half_width(count) <= self.asked.tolerance:
                return self.with_windows(count)
        return None

    def __iter__(self) -> Iterator[Way]:
        yield self.of_other_scenes
        counts = {leads.FIRST_WINDOWS, self.most}
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
        return leads.counted_blocks(self._study)

    def _largest(self, half_width: Callable[[Known], float]) -> float:
        """The largest half-width of the quantities."""
        return self.record.widest(self.asked.quantities, self.front, half_width)
