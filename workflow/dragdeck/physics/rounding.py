"""Rounded numbers, so that input scripts stay readable, and primes, as their seeds must be."""

import math
from functools import cache


def round_to(value: float, digits: int) -> float:
    """Round to significant digits."""
    return float(f"{value:.{digits}g}")


def rounded(value: float, *, up: bool, digits: int = 2) -> float:
    """Round a number up or down to significant digits; one without a logarithm to the nearest."""
    if not 0 < value < math.inf:
        return round_to(value, digits)
    unit = 10.0 ** (math.floor(math.log10(value)) - digits + 1)
    units = value / unit
    whole = math.ceil(units * (1 - 1e-9)) if up else math.floor(units * (1 + 1e-9))
    return round_to(whole * unit, digits)


def limit_of(value: float, *, up: bool = False) -> str:
    """A limit with four significant digits, which is itself accepted: a lower one is rounded up."""
    return f"{rounded(value, up=up, digits=4):g}"


def timestep(rayleigh_s: float, fraction: float) -> float:
    """A fraction of the Rayleigh time, rounded down to four significant digits, s."""
    exact = rayleigh_s * fraction
    unit = 10.0 ** (math.floor(math.log10(exact)) - 3)
    return round_to(math.floor(exact / unit * (1 + 1e-12)) * unit, 4)


@cache
def is_prime(number: int) -> bool:
    """Whether a number above 1 has no divisor."""
    return all(number % divisor for divisor in range(2, math.isqrt(number) + 1))
