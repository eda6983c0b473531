"""The runs of a calibration, ``drops.json`` and ``runs.json``, and the fits in ``result.json``."""

from collections.abc import Mapping
from typing import Literal

from pydantic import PositiveFloat

from dragdeck.documents import Document, Part
from dragdeck.records.case import CaseOfRun
from dragdeck.study.calibration import Rig

IMPACTS = 3
"""Impacts compared at the most (Uhlmann et al. 2015, section 4)."""

Purpose = Literal["production", "reference", "confirm"]
"""Of a drop: as the process runs; full modulus, fine step; production at the fitted value."""


class DropTest(Document):
    """The drop test of the study, as in ``drops.json``.

    Attributes
    ----------
    pair : str
        Particle and plate, as the study names their pair.
    record : str
        The CSV of the measured drop test.
    height_m, height_std_m : float
        Drop height (gap below the particle) and its standard uncertainty, m.
    peaks : str
        Whether to compare peak forces.
    limit_force : bool
        Whether tensile normal forces are suppressed, as in the study.
    restitution_now : float
        Coefficient of restitution of the study.
    fall_time_s, contact_time_s : float
        Time of the fall before the first impact, and contact time of an elastic impact, s.
    """

    remedy = "make it with: ./run calibrate"

    study: str
    title: str
    pair: str
    fidelity: str
    record: str
    height_m: PositiveFloat
    height_std_m: PositiveFloat
    peaks: Literal["auto", "yes", "no"]
    gravity_m_s2: PositiveFloat
    limit_force: bool
    restitution_now: float
    fall_time_s: PositiveFloat
    contact_time_s: float


class Settings(Part):
    """Modulus and step of a drop; the fraction is that of this particle's Rayleigh time."""

    youngs_modulus_scale: PositiveFloat
    timestep_s: PositiveFloat
    timestep_fraction: PositiveFloat


class DropOfList(Settings):
    """A drop that was run and that ``drops.json`` lists.

    Attributes
    ----------
    folder : str
        Beside the list.
    purpose : str
        ``production``, ``reference`` or ``confirm``.
    restitution : float
        In the deck.
    """

    folder: str
    purpose: Purpose
    restitution: PositiveFloat
    limit_force: bool
    height_m: PositiveFloat


class DropsFile(DropTest):
    """The content of ``drops.json``."""

    drops: tuple[DropOfList, ...]


class Fit(Part):
    """The fitted coefficient of restitution for the input script.

    Attributes
    ----------
    restitution, ci95_low, ci95_high : float
        Best value and its 95 % interval.
    height_m : float
        Drop height that fits best, m.
    chi2 : float
        Weighted sum of squares at the best value.
    degrees : int
        Degrees of freedom; 0: the fit cannot be tested.
    p_value : float or None
        Probability of a larger `chi2` if the model is right.
    inflation : float
        Factor by which the interval is widened if the residuals exceed their uncertainties:
        sqrt(chi2 / degrees), at least 1.
    residuals : tuple of float
        (Measured - simulated) / standard uncertainty.
    """

    restitution: float
    ci95_low: float
    ci95_high: float
    height_m: float
    chi2: float
    degrees: int
    p_value: float | None
    inflation: float
    residuals: tuple[float, ...]


class FitFile(Document):
    """The fits in ``result.json``; `dragchain.calibration.results` adds what follows from them.

    Attributes
    ----------
    fit, fit_full : Fit
        At the production settings, and at the physical modulus.
    """

    remedy = "make it with: ./run calibrate"

    fit: Fit
    fit_full: Fit


class AnglesFile(Document):
    """The measured angles of a study, and the runs that they are compared with: ``runs.json``.

    Attributes
    ----------
    pair : str
        The particles' material with itself.
    friction, rolling_friction : (float, float)
        Ranges in which the coefficients are looked for.
    measured : mapping
        Measured angle and its standard uncertainty, degrees, by ``repose`` and ``drum``.
    runs : tuple of str
        Folders beside the list; a run that failed is absent.
    """

    remedy = "make it with: ./run calibrate"

    study: str
    title: str
    pair: str
    friction: tuple[float, float]
    rolling_friction: tuple[float, float]
    measured: Mapping[Rig, tuple[float, float]]
    runs: tuple[str, ...]


class AngleRun(Part):
    """What a heap or drum is simulated with.

    Attributes
    ----------
    rig : str
        ``repose`` or ``drum``.
    friction, rolling_friction : float
        Between particles.
    glued : int
        Particles of the glued layer, which have the first ids.
    drum_radius_m : float
        0 for a heap.
    counted_from : int
        First step at which a drum's angle is read.
    """

    rig: Rig
    friction: float
    rolling_friction: float
    seed: int
    glued: int = 0
    drum_radius_m: float = 0.0
    counted_from: int = 0


class AngleCase(CaseOfRun):
    """The ``case.json`` of a heap or drum."""

    scene: Literal["angles"] = "angles"
    angle: AngleRun
