"""What runs of other scenes say of a value at the physical Young's modulus.

The ratio of a quantity at two moduli follows from how soft the particles are at both
(`dragdeck.records.windows.softness`), and differs from scene to scene by a few percent for some
quantities. A run with a reduced modulus then gives an estimate, which is no measurement.
"""

import math
from dataclasses import dataclass

from dragchain.quantities.registry import Quantity
from dragchain.run.case import attracting, study_of
from dragchain.statistics.estimate import Estimate, student_quantile
from dragdeck.records.case import CaseOfRun
from dragdeck.records.windows import UNKNOWN, WindowsRecord, softening


@dataclass(frozen=True)
class OtherScenes:
    """The ratio of the value at the physical modulus to that of a run.

    Attributes
    ----------
    log, log_std : float
        Its logarithm, and the standard deviation of that from scene to scene.
    scenes : int
        In which it was measured.
    """

    log: float
    log_std: float
    scenes: int

    def estimate(self, run: Estimate) -> Estimate:
        """The value at the physical modulus, from that of a run or of several packings.

        The interval is that of the product of the ratio and of the run's value, whose logarithms
        are independent.
        """
        between = student_quantile(self.scenes - 2) * self.log_std
        half = math.hypot(between, run.relative_half_width)
        value = run.value * math.exp(self.log)
        low, high = sorted((value * math.exp(-half), value * math.exp(half)))
        return Estimate(value, low, high, reliable=run.reliable)


def other_scenes(quantity: Quantity, case: CaseOfRun) -> OtherScenes | None:
    """What other scenes say of a quantity of a run; None if they say nothing.

    They are drags of dry spheres without cohesion, at the speed of the process.
    """
    scale, fidelity = case.fidelity.youngs_modulus_scale, case.fidelity
    known = WindowsRecord.shipped().quantities.get(quantity.name, UNKNOWN)
    number = case.numbers.get("stiffness_number")
    if scale == 1.0 or fidelity.speed_factor != 1.0 or not math.isfinite(known.per_softness_std):
        return None
    other_law = case.changed_law or case.added_forces or attracting(case)
    if number is None or other_law or _other_bed(case):
        return None
    difference = softening(number, scale)
    return OtherScenes(
        known.per_softness * difference, known.per_softness_std * difference, known.scenes
    )


def _other_bed(case: CaseOfRun) -> bool:
    """Whether it is wet, shaken or of clumps."""
    study = study_of(case)
    shaken = study.motion.bowl is not None and any(study.motion.bowl.reach_m)
    return study.compound is not None or shaken or study.sphere_count != study.particle_count
