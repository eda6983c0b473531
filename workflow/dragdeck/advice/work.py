"""The CPU time that filling and process of a case take at some settings."""

import math
from dataclasses import dataclass

import numpy as np

from dragdeck.cases.bed import bed_timestep, expected_surface
from dragdeck.cases.case import Case, of_each_workpiece
from dragdeck.records.tradeoff import TradeoffRecord
from dragdeck.scenes.filling import FILLING, expected_time
from dragdeck.scenes.lead import covered_fraction, window_fraction
from dragdeck.scenes.motion import plunge_point
from dragdeck.scenes.workpiece import FACET_STEP_S, PARTICLE_STEPS_PER_S, workpiece_facets
from dragdeck.study.model import Fidelity, Study


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
        way = math.dist(plunge_point(motion), motion.path.start_point)
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
        start, entry = study.at_start(), covered_fraction(study)
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
            steps += windows * self._steps(stiffer, window_fraction(study) * drag_s)
        return steps

    def cpu_time(self, fidelity: Fidelity, windows: int = 0) -> float:
        """CPU time of all runs with some settings, s: only ratios of it count."""
        filled = self.study.model_copy(update={"fidelity": fidelity}).at_filling()
        filling = self.filling_s / bed_timestep(filled, "filling_timestep_fraction")
        count, of_facets = self.study.sphere_count, self.facets * FACET_STEP_S
        return filling * count / FILLING.particle_steps_per_s + self.steps(fidelity, windows) * (
            count / PARTICLE_STEPS_PER_S + of_facets
        )

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
