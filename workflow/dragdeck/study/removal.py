"""Removal from the workpiece: the laws of wear, and what their coefficient is from.

`LAWS` is the registry: a new law is an entry. A law gives each contact or impact an action in J;
times a coefficient in m2/N it is the removed volume. Laws add up: ``archard+oka``.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field, field_validator, model_validator

from dragdeck.arrays import Floats
from dragdeck.errors import choices
from dragdeck.study.base import Model, Positive

_TELLS = 0.5
"""With a larger relative uncertainty, the interval of a coefficient reaches zero."""


class WeighedTrial(Model):
    """A trial after which the workpiece was weighed."""

    mass_loss_kg: Positive
    """mass that one workpiece lost in the trial, kg"""
    time_s: Positive
    """duration of the trial, s"""
    sd_kg: Positive
    """standard uncertainty of `mass_loss_kg`, kg"""


class Removal(Model):
    """How load becomes removal, for the report; no run depends on it."""

    law: str = "archard"
    """law of removal: `archard`, `finnie`, `oka`, or a sum such as `archard+oka`"""
    coefficient_m2_n: Positive | None = None
    """removed volume per action, m2/N; none: from `calibrate`"""
    sd_m2_n: Positive | None = None
    """standard uncertainty of `coefficient_m2_n`, m2/N"""
    calibrate: Annotated[list[WeighedTrial], Field(min_length=1, max_length=100)] | None = None
    """weighed trial of this process, or a list of those"""
    impact_ratio: Positive | None = None
    """of a sum: coefficient of the impact law / that of sliding"""
    hardness_pa: Positive | None = None
    """Vickers hardness of the workpiece, Pa; for `oka` only"""
    target_depth_m: Positive | None = None
    """removal depth for which the time is reported, m"""

    @field_validator("calibrate", mode="before")
    @classmethod
    def _one_or_more(cls, value: Any) -> Any:
        """One trial is short for a list of it."""
        return [value] if isinstance(value, Mapping) else value

    @field_validator("law")
    @classmethod
    def _of_registry(cls, law: str) -> str:
        parts = law.split("+")
        for part in parts:
            if part not in LAWS:
                raise ValueError(f"no such law {part!r}: {choices(part, LAWS)}, or a sum of two")
        if [LAWS[part].impact for part in parts] not in ([False], [True], [False, True]):
            raise ValueError("a sum has one law of sliding and one of impact: archard+oka")
        return law

    @model_validator(mode="after")
    def _whole(self) -> "Removal":
        trials, coefficient = self.calibrate or [], self.coefficient_m2_n
        if (coefficient is None) == (not trials):
            raise ValueError("give either coefficient_m2_n, or calibrate with a weighed trial")
        if self.sd_m2_n is not None and coefficient is None:
            raise ValueError("sd_m2_n belongs to coefficient_m2_n: remove it")
        uncertain = [(coefficient or math.inf, self.sd_m2_n or 0.0, "sd_m2_n")]
        uncertain += [(trial.mass_loss_kg, trial.sd_kg, "sd_kg") for trial in trials]
        for value, sd, name in uncertain:
            if sd >= _TELLS * value:
                why = f"{name} {sd:g} is half of its value, {value:g}, or more"
                raise ValueError(f"{why}: the interval of the coefficient would include zero")
        wanted = {"impact_ratio"} if "+" in self.law else set()
        wanted |= {name for law in self.laws for name in law.parameters}
        for name in ("impact_ratio", *(name for law in LAWS.values() for name in law.parameters)):
            if (name in wanted) != (getattr(self, name) is not None):
                verb = "is missing: give it" if name in wanted else "has no meaning: remove it"
                raise ValueError(f"{name} {verb} for the law {self.law}")
        return self

    @property
    def laws(self) -> Sequence["Law"]:
        """The laws that are added up."""
        return [LAWS[part] for part in self.law.split("+")]


class TrialsFit(NamedTuple):
    """Mass loss per time from weighed trials, by weighted least squares through the origin.

    Attributes
    ----------
    rate_kg_s, error : float
        Slope, and its relative standard error.
    degrees : float
        Degrees of freedom of the error: one less than there are trials, infinite for one trial.
    residuals : sequence of float
        Measured minus fitted mass loss of each trial in its standard uncertainties.
    """

    rate_kg_s: float
    error: float
    degrees: float
    residuals: Sequence[float]

    @property
    def disagreement(self) -> float:
        """Probability of at least such a scatter if the uncertainties are the only cause."""
        from scipy.special import chdtrc

        square = math.fsum(residual**2 for residual in self.residuals)
        return float(chdtrc(self.degrees, square)) if math.isfinite(self.degrees) else 1.0

    @property
    def disagrees(self) -> bool:
        """Whether the trials scatter significantly beyond their uncertainties."""
        return self.disagreement < 0.05


_PROBABLE_ERROR = 0.6745
"""Half-width of a normal interval of 50 %, in standard errors."""


def fit_trials(removal: Removal) -> TrialsFit | None:
    """The fit to the trials of a study, None if its coefficient is given.

    The uncertainties give the weights, and the error of a single trial. That of several is
    estimated from their scatter, times Birge's ratio (1932), so that whatever varies from trial to
    trial is in it. Trials that agree by chance would have none: the interval of Student's t is at
    least the 50 % interval by the uncertainties alone.
    """
    from scipy.special import stdtrit

    if removal.calibrate is None:
        return None
    trials = [(trial.mass_loss_kg, trial.time_s, trial.sd_kg) for trial in removal.calibrate]
    mass, time, sd = np.array(trials).T
    information = float(((time / sd) ** 2).sum())
    rate = float((mass * time / sd**2).sum()) / information
    residuals = (mass - rate * time) / sd
    error, degrees = 1 / math.sqrt(information) / rate, len(trials) - 1
    if degrees:
        birge = math.sqrt(float((residuals**2).sum()) / degrees)
        error *= max(birge, _PROBABLE_ERROR / float(stdtrit(degrees, 0.975)))
    return TrialsFit(rate, error, degrees or math.inf, residuals.tolist())


def disagreements(removal: Removal) -> Iterator[str]:
    """What to say of trials that scatter beyond their uncertainties."""
    fit = fit_trials(removal)
    if fit is not None and fit.disagrees:
        worst = max(range(len(fit.residuals)), key=lambda at: abs(fit.residuals[at]))
        yield (
            f"removal.calibrate: the {len(fit.residuals)} trials scatter more than their sd_kg "
            f"(p = {fit.disagreement:.2g}); trial {worst + 1} is {fit.residuals[worst]:+.3g} sd_kg "
            "off the fit. The interval of the coefficient follows from the scatter; weigh again, "
            "leave a faulty trial out, or add trials"
        )


# --- laws ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Wearing:
    """What laws read of N contacts in a sample or of N impacts, (N,) each.

    Attributes
    ----------
    force_slide_n_m : array
        Normal force times sliding distance, N m.
    mass_kg, radius_m : array
        Of the particle.
    normal_m_s, tangential_m_s : array
        Relative velocity at the contact point at first touch, positive when closing; m/s.
    """

    force_slide_n_m: Floats
    mass_kg: Floats
    radius_m: Floats
    normal_m_s: Floats
    tangential_m_s: Floats

    @property
    def double_energy_j(self) -> Floats:
        """Mass times the square of the speed, (N,), zero where the surfaces do not close."""
        square = self.normal_m_s**2 + self.tangential_m_s**2
        return np.where(self.normal_m_s > 0.0, self.mass_kg * square, 0.0)

    @property
    def angle_rad(self) -> Floats:
        """Angle of impact, (N,)."""
        return impact_angle(self.normal_m_s, self.tangential_m_s)


def impact_angle(normal_m_s: Floats, tangential_m_s: Floats) -> Floats:
    """Angle from the surface at which N surfaces close at these velocities, (N,), 0 to pi/2."""
    return np.arctan2(np.maximum(normal_m_s, 0.0), tangential_m_s)


@dataclass(frozen=True)
class Law:
    """A law of removal.

    Attributes
    ----------
    title : str
        With its source.
    impact : bool
        Whether it reads impacts at first touch; otherwise contacts in samples.
    action : callable
        The action in J of N contacts or impacts, (N,).
    parameters : tuple of str
        Fields of `Removal` that it needs.
    """

    title: str
    impact: bool
    action: Callable[[Wearing, Removal], Floats]
    parameters: tuple[str, ...] = ()


def _finnie(wearing: Wearing, _: Removal) -> Floats:
    """Finnie (1960), with a ratio of normal to tangential force of 2."""
    angle = wearing.angle_rad
    flat = np.sin(2 * angle) - 3 * np.sin(angle) ** 2
    return wearing.double_energy_j * np.where(np.tan(angle) <= 1 / 3, flat, np.cos(angle) ** 2 / 3)


_OKA_SPEED_M_S, _OKA_DIAMETER_M = 104.0, 326e-6


def _oka(wearing: Wearing, of: Removal) -> Floats:
    """Oka et al. (2005), with their constants for sand; hardness in GPa.

    ``m v^2 (v/v')^(k2 - 2) (D/D')^k3 sin(a)^n1 (1 + Hv (1 - sin(a)))^n2``.
    """
    hard, sine = (of.hardness_pa or 0.0) / 1e9, np.sin(wearing.angle_rad)
    speed = np.hypot(wearing.normal_m_s, wearing.tangential_m_s)
    shape = sine ** (0.71 * hard**0.14) * (1 + hard * (1 - sine)) ** (2.4 * hard**-0.94)
    fast = (speed / _OKA_SPEED_M_S) ** (2.3 * hard**0.038 - 2)
    return np.asarray(
        wearing.double_energy_j * fast * (2 * wearing.radius_m / _OKA_DIAMETER_M) ** 0.19 * shape
    )


def _archard(wearing: Wearing, _: Removal) -> Floats:
    """Archard (1953), and Preston (1927) for polishing."""
    return wearing.force_slide_n_m


LAWS: Mapping[str, Law] = {
    "archard": Law("normal force times sliding distance (Archard, Preston)", False, _archard),
    "finnie": Law("erosion by cutting impacts (Finnie 1960)", True, _finnie),
    "oka": Law("erosion by impacts (Oka et al. 2005)", True, _oka, ("hardness_pa",)),
}
"""The registry of laws."""
