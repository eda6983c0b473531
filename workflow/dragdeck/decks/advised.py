"""What ``case.json`` keeps of the advice that a run's settings came from."""

from collections.abc import Sequence

from dragdeck.documents import Part


class AdvisedSettings(Part):
    """The tolerance for which the settings of a run were chosen, and their expected error.

    Attributes
    ----------
    held_to : float
        Tolerance that the settings meet: the requested one, or a smaller one outside the measured
        range.
    extrapolated : bool
        Whether the tolerance applies to the value extrapolated to the physical Young's modulus.
    error, ci95_low, ci95_high, bound : float or None
        Expected relative error, its 95 % CI, and the bound of its absolute value; None for the
        reference.
    half_width : float or None
        Relative half-width of the 95 % CI of the value of one run.
    tolerance : float
        Requested relative error.
    quantity, label : str
        Quantity to which the tolerance applies: name and wording.
    relative_cost : float
        CPU time / CPU time of the reference settings.
    outside : sequence of str
        Dimensionless numbers outside the measured range.
    fallback : str or None
        Why the reference settings are used.
    source : str
        Measurement on which the advice is based.
    """

    tolerance: float
    quantity: str
    label: str
    held_to: float
    extrapolated: bool
    error: float | None
    ci95_low: float | None
    ci95_high: float | None
    bound: float | None
    relative_cost: float
    half_width: float | None
    outside: Sequence[str]
    fallback: str | None
    source: str
