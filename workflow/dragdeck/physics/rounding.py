"""Rounded numbers, so that input scripts stay readable."""

import math


def round_to(value: float, digits: int) -> float:
    """Round to significant digits."""
    return float(f"{value:.{digits}g}")


def timestep(rayleigh_s: float, fraction: float) -> float:
    """A share of the Rayleigh time, rounded down to four significant digits, s."""
    exact = rayleigh_s * fraction
    unit = 10.0 ** (math.floor(math.log10(exact)) - 3)
    return round_to(math.floor(exact / unit * (1 + 1e-12)) * unit, 4)
