"""The source's statements, each with its number, its interval and a verdict by one rule."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

HOLDS, FAILS, OPEN = "holds", "does not hold", "not resolved"


@dataclass(frozen=True)
class Claim:
    """A statement and the number that tests it.

    Attributes
    ----------
    statement : str
        In our words.
    number : str
        What the number is.
    estimate : mapping or None
        ``value``, ``low`` and ``high`` over fills; None where it cannot be told.
    null : float
        The value of no effect; the statement says that the number is above it.
    unit : str
    """

    statement: str
    number: str
    estimate: Mapping[str, float | None] | None
    null: float
    unit: str = ""

    @property
    def verdict(self) -> str:
        """It holds if the whole interval lies above the null, does not if it lies below."""
        if self.estimate is None or None in self.estimate.values():
            return OPEN
        low, high = self.estimate["ci95_low"], self.estimate["ci95_high"]
        assert low is not None and high is not None
        if low > self.null:
            return HOLDS
        return FAILS if high < self.null else OPEN


def claims(found: Mapping[str, Any]) -> list[Claim]:
    """The statements of Uhlmann et al. (2015) that `dragchain.validation.statements` measures."""
    network = found["network"]
    depth = "contact forces grow with depth"
    rows = [
        Claim(
            "forces ahead of the workpiece are far above those behind it",
            "normal force on the workpiece, ahead over behind",
            found["ahead_behind"],
            1.0,
        ),
        Claim(
            "the same in the network of the particles",
            "mean contact force in the corridor ahead over that behind",
            network["ratio"],
            1.0,
        ),
        Claim(
            "the active zone reaches far ahead",
            "mean contact force at the bowl's wall ahead over that far from the workpiece",
            network["at_wall"],
            1.0,
        ),
        Claim(depth, "slope of a contact's normal force", found["depth_slope_n_per_m"], 0.0, "N/m"),
        Claim(
            depth,
            "mean contact force in the deepest third over the shallowest",
            found["deep_over_shallow"],
            1.0,
        ),
        Claim(
            "contacts are most intense at the front",
            "normal force on the front quarter over the two eighths beside it",
            found["front_over_flank"],
            1.0,
        ),
        Claim(
            "surfaces that point to the bowl's boundary are hit hardest",
            "normal force on the outer half of the workpiece over the inner half",
            found["outer_over_inner"],
            1.0,
        ),
    ]
    return [row for row in rows if row.estimate is not None]
