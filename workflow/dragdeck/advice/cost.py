"""What settings cost beside each other: CPU time of the runs of a case."""

import math
from dataclasses import dataclass

import numpy as np

from dragdeck.cases.bed import bed_timestep
from dragdeck.cases.case import Case, of_each_workpiece
from dragdeck.outlook.measured import Tradeoff
from dragdeck.scenes.filling import FILLING, expected_surface, expected_time
from dragdeck.scenes.motion import plunge_point
from dragdeck.scenes.process import PROCESS
from dragdeck.scenes.workpiece import FACET_STEP_S, workpiece_mesh
from dragdeck.study.model import Fidelity, Study


@dataclass(frozen=True)
class Work:
    """What the filling and the process of a case take. Its drop test is the same at all settings.

    Attributes
    ----------
    study : Study
    tradeoff : Tradeoff
    filling_s, process_s : float
        Simulated time, that of the process at the study's own speed, s.
    facets : int
        Of all workpieces.
    """

    study: Study
    tradeoff: Tradeoff
    filling_s: float
    process_s: float
    facets: int

    @classmethod
    def of(cls, case: Case, tradeoff: Tradeoff) -> "Work":
        """Of a case; its own fidelity does not matter."""
        study, motion = case.study, case.study.motion
        way = math.dist(plunge_point(motion), motion.path.start_point)
        process_s = (
            expected_surface(study) / motion.plunge_speed_m_s
            + way / motion.approach_speed_m_s
            + motion.path_length_m / motion.axis_speed_m_s
        )
        facets = sum(len(workpiece_mesh(one).faces) for one in of_each_workpiece(case))
        return cls(study, tradeoff, expected_time(study), process_s, facets)

    def cpu_time(self, fidelity: Fidelity) -> float:
        """CPU time of both runs with some settings, s: only ratios of it count."""
        study = self.study.model_copy(update={"fidelity": fidelity})
        filling = self.filling_s / bed_timestep(study, "filling_timestep_fraction")
        process = self.process_s / bed_timestep(study, "timestep_fraction")
        process *= step_cost(fidelity.youngs_modulus_scale, self.tradeoff) / fidelity.speed_factor
        count = study.media.count
        of_facets = self.facets * FACET_STEP_S
        return filling * count / FILLING.particle_steps_per_s + process * (
            count / PROCESS.particle_steps_per_s + of_facets
        )


def step_cost(scale: float, tradeoff: Tradeoff) -> float:
    """Time of a step of the drag at a modulus scale, over that at the others that were timed.

    Soft particles have more contacts, and their steps cost more. Interpolated over
    logarithms; 1 where nothing was timed.

    Parameters
    ----------
    scale : float
        Factor on every Young's modulus.
    tradeoff : Tradeoff
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
