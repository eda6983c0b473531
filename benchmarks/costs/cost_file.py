"""What was timed and what it says: ``rounds.json`` and ``costs.json``, and their statistics."""

from collections.abc import Mapping, Sequence

import numpy as np

from cost_variants import BASES, SceneName, Variant
from dragchain.statistics.estimate import Estimate, finite, mean_of
from dragdeck.documents import Document, Part
from dragdeck.records.tradeoff import CostEntry, Machine
from dragdeck.study.model import Fidelity


class Timing(Part):
    """What a stretch of steps took: processor time of all ranks, wall time of the loop, steps."""

    cpu_time_s: float
    wall_time_s: float
    steps: int

    def __sub__(self, other: "Timing") -> "Timing":
        return Timing(
            cpu_time_s=self.cpu_time_s - other.cpu_time_s,
            wall_time_s=self.wall_time_s - other.wall_time_s,
            steps=self.steps - other.steps,
        )

    def over(self, base: "Timing") -> tuple[float, float]:
        """Processor and wall time of a step over those of the base."""
        per_step = self.cpu_time_s / self.steps / (base.cpu_time_s / base.steps)
        return per_step, self.wall_time_s / self.steps / (base.wall_time_s / base.steps)


class TimedVariant(Timing):
    """A variant in one round, with its base.

    Attributes
    ----------
    inputs : str
        Hash of all that the timing depends on.
    measured : str
        Date.
    load_average_before : float
        Of the machine, before timing began.
    """

    name: str
    round: int
    inputs: str
    measured: str
    load_average_before: float
    base: Timing


class RoundsFile(Document):
    """``rounds.json``: every timing."""

    remedy = "move it away to time everything again"

    rows: Sequence[TimedVariant] = ()


class VariantCost(CostEntry):
    """The cost of a variant.

    Attributes
    ----------
    ratio, ci95_low, ci95_high, wall_ratio : float
        Count what `unit` says.
    against : str
        What it is compared with.
    per_step, per_second : float
        The same ratio in both units.
    """

    against: str
    per_second: float
    wall_ratio: float
    rounds: int
    steps: int
    timestep_s: float


class BaseCost(Part):
    """How fast a base is."""

    name: str
    scene: SceneName
    what: str
    timestep_s: float
    steps: int
    cpu_us_per_step: float
    steps_per_s: float


class TimedCosts(Document):
    """``costs.json``: what each variant costs, and how, when and where that was measured."""

    study: str
    fidelity: Fidelity
    particles: int
    seconds: float
    measured: str
    command: str
    versions: Mapping[str, str]
    machine: Machine
    load_average_before: float
    bases: Sequence[BaseCost]
    costs: Sequence[VariantCost]


def geometric(ratios: Sequence[float]) -> Estimate:
    """Geometric mean of ratios, one for each round, with its interval; NaN for one round."""
    return mean_of(np.log(ratios)).exp()


def cost(
    variant: Variant, rows: Sequence[TimedVariant], steps_s: Mapping[str, float]
) -> VariantCost:
    """The cost of a variant.

    Parameters
    ----------
    variant : Variant
    rows : sequence of TimedVariant
        Of all variants and rounds.
    steps_s : mapping of str to float
        Time step of every deck by name, s.
    """
    own = [row for row in rows if row.name == variant.name]
    steps_per_second = steps_s[variant.base] / steps_s[variant.name]
    factor = steps_per_second if variant.unit == "per_second" else 1.0
    cpu, wall = map(geometric, zip(*(row.over(row.base) for row in own), strict=True))
    return VariantCost(
        ratio=cpu.value * factor,
        ci95_low=finite(cpu.ci95_low * factor),
        ci95_high=finite(cpu.ci95_high * factor),
        name=variant.name,
        scene=variant.scene,
        what=variant.what,
        against=BASES[variant.base].what,
        unit=variant.unit,
        parameter=variant.parameter,
        level=variant.level,
        per_step=cpu.value,
        per_second=cpu.value * steps_per_second,
        wall_ratio=wall.value * factor,
        rounds=len(own),
        steps=own[0].steps,
        timestep_s=steps_s[variant.name],
    )


def base_cost(base: Variant, times: Sequence[Timing], timestep_s: float) -> BaseCost:
    """How fast a base is, from all its timings."""
    cpu = geometric([time.cpu_time_s / time.steps for time in times]).value
    wall = geometric([time.wall_time_s / time.steps for time in times]).value
    return BaseCost(
        name=base.name,
        scene=base.scene,
        what=base.what,
        timestep_s=timestep_s,
        steps=times[0].steps,
        cpu_us_per_step=1e6 * cpu,
        steps_per_s=1 / wall,
    )
