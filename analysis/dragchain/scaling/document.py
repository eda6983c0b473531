"""The document of a scaling, ``scaling.json``: what the runs say of one field."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Literal, NamedTuple

from dragchain.statistics.estimate import CONFIDENCE, Estimate, Verdict
from dragdeck.documents import Document
from dragdeck.parts import Part
from dragdeck.records.case import FidelityOfRun

Judged = Literal[Verdict, "no expectation"]


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
    """The expected power law of a field.

    Attributes
    ----------
    exponent : float or None
    source : str or None
        Source of the exponent.
    within : (float, float) or None
        Range of levels in which it is expected; None: all.
    """

    exponent: float | None = None
    source: str | None = None
    within: tuple[float, float] | None = None


class FittedLaw(Part):
    """A power law fitted to the levels at which its exponent is expected.

    Attributes
    ----------
    exponent : Estimate
        Fitted exponent.
    change_per_decade : Estimate
        Relative change of the drag for ten times the level.
    runs : int
        Number of runs.
    """

    exponent: Estimate
    change_per_decade: Estimate
    runs: int


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
    drag_n : float
        Geometric mean of this level alone, N.
    fitted_n : float
        Drag according to the power law, N.
    """

    x: float
    runs: int
    eta: float
    inertial_number: float | None
    gap_particles: float | None
    floor_particles: float
    drag_n: float
    fitted_n: float


class ScaledRun(Part):
    """One run of a scaling.

    Attributes
    ----------
    run, bed : str
    seed : int or None
    level : float
        Value of the field.
    drag_n, standard_error_n : float
        Magnitude of the mean drag, and its standard error including autocorrelation, N.
    reliable : bool
        Whether the series was long enough to rely on that error.
    eta : float
        Drag / ``(rho g d H^2)``, with d the diameter of the workpiece, H the depth
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
    """The content of ``scaling.json``; docs/evidence/scaling.md explains it.

    Attributes
    ----------
    field : str
        Dotted name of the field.
    confidence : float
        Confidence level of all intervals.
    expected : Expectation
        The expected exponent.
    verdict : str
        ``confirmed`` if the interval of the fitted exponent contains the expected one, otherwise
        ``contradicted``.
    fit : FittedLaw
        Fit to the levels at which the exponent is expected.
    eta : Estimate
        Dimensionless drag, see `ScaledRun`.
    levels : tuple of Level
        One entry per level.
    runs : tuple of ScaledRun
        One entry per run.
    scene : mapping
        Dimensionless numbers of the scene.
    engine : str or None
        Version of LIGGGHTS.
    cpu_time_s : float or None
        CPU time of all runs, s.
    started : str or None
        Date and time of the first start.
    """

    remedy = "make it with: ./run scaling"

    study: str
    field: str
    confidence: float = CONFIDENCE
    expected: Expectation
    verdict: Judged
    fit: FittedLaw
    eta: Estimate
    levels: tuple[Level, ...]
    runs: tuple[ScaledRun, ...]
    scene: Mapping[str, float]
    fidelity: FidelityOfRun
    versions: Mapping[str, str]
    commands: tuple[str, ...]
    started: str | None
    engine: str | None
    cpu_time_s: float | None

    @property
    def fitted(self) -> tuple[ScaledRun, ...]:
        """The runs that the law is fitted to."""
        low, high = self.expected.within or (0.0, math.inf)
        return tuple(run for run in self.runs if low <= run.level <= high)

    @property
    def axis(self) -> Axis:
        """Label, unit and factor of the field: its own name if it has no plainer one."""
        block, _, entry = self.field.partition(".")
        if block == "pairs" and entry.endswith(".friction"):
            pair = entry.removesuffix(".friction")
            return Axis(f"friction coefficient, {pair.replace('-', ' on ')}")
        return _AXES.get(self.field, Axis(self.field))


_STORED = Path(__file__).parent / "data"
"""The scalings that were measured for the documentation."""

_ORDER = ("drag-depth", "drag-diameter", "drag-speed", "drag-friction")
"""Their studies, in the order of the documentation."""


def read_scalings() -> list[ScalingFile]:
    """The scalings that come with the package."""
    return [ScalingFile.read(_STORED / f"{study}.json") for study in _ORDER]
