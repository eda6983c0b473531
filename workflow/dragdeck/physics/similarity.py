"""What two scenes must have in common for a measured error to hold in both.

Settings are carried from the measured scene to another by two dimensionless
numbers, of the stiffness and of the inertia of the bed. The rest, lengths over
the particle's diameter, frictions and restitution, is only compared.
"""

from dragdeck.physics.engine_limits import ENGINE_SOFTEST_PA
from dragdeck.physics.rounding import rounded
from dragdeck.study.model import Study

SAME_NUMBER = 0.02
"""Scenes whose numbers differ by no more than this fraction count as the same: the
solid fraction behind the numbers is not known better."""

_FASTEST_FACTOR = 100.0
"""Largest speed factor that a study may have."""


def carried_scale(scale: float, ratio: float) -> float:
    """The modulus scale that does in another scene what `scale` does in the measured one.

    The error of soft particles goes with their overlap, that is with one over the
    stiffness number kappa. Neither 1 / kappa itself nor its rise over that of
    the full modulus may exceed the measured one::

        s'^(-2/3) <= min(ratio s^(-2/3), 1 + ratio (s^(-2/3) - 1))

    Parameters
    ----------
    scale : float
        Measured.
    ratio : float
        Stiffness number of the other scene over that of the measured scene,
        both at full modulus.

    Returns
    -------
    float
        Rounded up to two significant digits, at most 1; `scale` itself for a
        `ratio` of 1 within `SAME_NUMBER`.
    """
    if _same(ratio):
        return scale
    soft = scale ** (-2 / 3)
    allowed = min(ratio * soft, 1 + ratio * (soft - 1))
    return 1.0 if allowed <= 1 else min(1.0, rounded(allowed**-1.5, up=True))


def carried_speed(factor: float, ratio: float) -> float:
    """The speed factor that does in another scene what `factor` does in the measured one.

    Neither the inertial number nor its rise over that of the study's own speed
    may exceed the measured one::

        f' <= min(ratio f, 1 + ratio (f - 1))

    Parameters
    ----------
    factor : float
        Measured.
    ratio : float
        Inertial number of the measured scene over that of the other, both at
        the studies' own speeds.

    Returns
    -------
    float
        Rounded down to two significant digits, at least 1; `factor` itself for
        a `ratio` of 1 within `SAME_NUMBER`.
    """
    if _same(ratio):
        return factor
    allowed = min(ratio * factor, 1 + ratio * (factor - 1), _FASTEST_FACTOR)
    return max(1.0, rounded(allowed, up=False))


def softest_scale(study: Study) -> float:
    """The smallest modulus scale that the engine takes for a study's materials."""
    softest = min(study.materials[name].youngs_modulus_pa for name in study.type_names())
    return min(1.0, rounded(ENGINE_SOFTEST_PA / softest, up=True))


def _same(ratio: float) -> bool:
    return abs(ratio - 1) <= SAME_NUMBER
