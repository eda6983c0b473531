"""The document of a scaling, ``scaling.json``: what the runs say of one field."""

from collections.abc import Mapping
from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from dragchain.documents import Document, Part
from dragchain.run.case import Fidelity
from dragchain.statistics.estimate import CONFIDENCE, Estimate
from dragchain.statistics.power_law_forms import TwoTerms

Verdict = Literal["agrees", "deviates", "no expectation"]


class Axis(NamedTuple):
    """How a field is called and in which unit it is shown: `factor` times its SI value."""

    label: str
    unit: str = ""
    factor: float = 1.0


_AXES: Mapping[str, Axis] = {
    "motion.immersion_depth_m": Axis("depth of the tip", "mm", 1e3),
    "workpiece.shape.radius_m": Axis("radius of the workpiece", "mm", 1e3),
    "motion.speed_m_s": Axis("speed of the workpiece", "mm/s", 1e3),
}
"""Fields that have a plain name."""


class Expectation(Part):
    """What is expected of a field.

    Attributes
    ----------
    exponent : float or None
    source : str or None
        Where the exponent comes from.
    within : (float, float) or None
        Levels for which it is meant; all if None.
    """

    exponent: float | None = None
    source: str | None = None
    within: tuple[float, float] | None = None


class CurvePoint(Part):
    """A point of a curve: level and drag in N."""

    x: float
    value: float


class BandPoint(CurvePoint):
    """A point of a curve with its 95 % interval, N."""

    ci95_low: float
    ci95_high: float


class FittedLaw(Part):
    """A power law from the level `lowest` to the level `highest`.

    Attributes
    ----------
    change_per_decade : Estimate
        Relative change of the drag for ten times the level.
    centre : float
        Geometric mean of the levels.
    degrees : int
        Degrees of freedom of the intervals.
    spread, bed_fraction : float
        Standard deviation between runs in logarithms, and the fraction of that
        variance which runs of one bed have in common.
    lack_of_fit : float or None
        Probability of so much disagreement with a power law by chance alone.
    """

    exponent: Estimate
    change_per_decade: Estimate
    centre: float
    drag_at_centre_n: Estimate
    lowest: float = Field(alias="from")
    highest: float = Field(alias="to")
    runs: int
    degrees: int
    spread: float
    bed_fraction: float
    lack_of_fit: float | None
    curve: tuple[BandPoint, ...]


class ShiftedLaw(Part):
    """The expected power of a shifted level; as `dragchain.statistics.power_law.Shifted`."""

    power: float
    root_slope: float
    root_constant: float
    offset: Estimate | None
    lack_of_fit: float | None
    curve: tuple[CurvePoint, ...]


class Level(Part):
    """All runs of one level.

    Attributes
    ----------
    x : float
        Value of the field.
    runs : int
    eta : float
        Geometric mean over the runs, see `ScaledRun`.
    inertial_number : float or None
    gap_particles : float or None
        Gap between workpiece and bowl wall in mean particle diameters; None off a circle.
    floor_particles : float
        Gap between tip and floor in mean particle diameters.
    drag_n : Estimate
        Of the level alone, N.
    fitted_n : float
        By the power law over all levels, N.
    deviation : Estimate or None
        Relative difference from the law of the other levels; None for too few runs.
    """

    x: float
    runs: int
    eta: float
    inertial_number: float | None
    gap_particles: float | None
    floor_particles: float
    drag_n: Estimate
    fitted_n: float
    deviation: Estimate | None


class ScaledRun(Part):
    """One run of a scaling.

    Attributes
    ----------
    run, bed : str
    seed : int or None
    level : float
        Value of the field.
    drag_n, standard_error_n : float
        Size of the mean drag and its standard error, autocorrelation counted, N.
    reliable : bool
        Whether the series was long enough to rely on that error.
    eta : float
        Drag over ``rho g d H^2``, with d the diameter of the workpiece, H the depth
        of its tip and rho the density of a particle (Albert et al. 1999, Phys. Rev.
        Lett. 82, 205).
    """

    run: str
    seed: int | None
    level: float
    drag_n: float
    standard_error_n: float
    reliable: bool
    eta: float
    bed: str


class ScalingFile(Document):
    """The content of ``scaling.json``; docs/evidence/scaling.md explains it."""

    made_by: ClassVar[str] = "snakemake scaling"

    study: str
    field: str
    confidence: float = CONFIDENCE
    expected: Expectation
    verdict: Verdict
    fit: FittedLaw
    fit_within: FittedLaw | None
    two_terms: TwoTerms | None
    shifted: ShiftedLaw | None
    eta: Estimate
    levels: tuple[Level, ...]
    local_exponents: tuple[Estimate, ...]
    runs: tuple[ScaledRun, ...]
    scene: Mapping[str, float]
    fidelity: Fidelity
    versions: Mapping[str, str]
    commands: tuple[str, ...]
    started: str | None
    engine: str | None
    cpu_time_s: float | None

    @property
    def judged(self) -> FittedLaw:
        """The law that is compared with the expectation."""
        return self.fit_within or self.fit

    @property
    def axis(self) -> Axis:
        """Label, unit and factor of the field: its own name if it has no plainer one."""
        block, _, entry = self.field.partition(".")
        if block == "pairs" and entry.endswith(".friction"):
            pair = entry.removesuffix(".friction")
            return Axis(f"friction coefficient, {pair.replace('-', ' on ')}")
        return _AXES.get(self.field, Axis(self.field))
