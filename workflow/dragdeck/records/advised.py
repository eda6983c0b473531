"""What ``case.json`` keeps of the advice that a run's settings came from."""

from dragdeck.parts import Part


class AdvisedSettings(Part):
    """The tolerance for which the settings of a run were chosen.

    Attributes
    ----------
    tolerance : float
        Requested relative half-width of the 95 % CI, or error of a drop test.
    quantities : tuple of str
        Quantities to which the tolerance applies.
    error : float or None
        Largest measured error of a drop test; None for a process, whose windows measure it.
    relative_cost, largest_cost : float
        CPU time / CPU time of a plain run at the physical modulus: with the first windows, and with
        all that there can be.
    fallback : str or None
        Why the settings do not meet the tolerance.
    """

    tolerance: float
    quantities: tuple[str, ...]
    error: float | None
    relative_cost: float
    largest_cost: float
    fallback: str | None
