"""The source's statements, each with its number, its interval and a verdict by one rule."""

import pandas as pd

from dragchain.statistics.estimate import Estimate, Verdict
from dragdeck.documents import Part
from evidence.validation.around_workpiece import Statements


class Claim(Part):
    """A statement and the number that tests it.

    Attributes
    ----------
    statement, number : str
        Their names; the page has the words.
    null : float
        The value of no effect; the statement says that the number is above it.
    unit : str
    verdict : str
        See `Estimate.exceeds`.
    estimate : Estimate
        The number over the packings.
    """

    statement: str
    number: str
    null: float
    unit: str
    verdict: Verdict
    estimate: Estimate


def claims(found: Statements) -> tuple[Claim, ...]:
    """The statements of Uhlmann et al. (2015) that have a number here."""
    network = found.network
    rows = (
        ("ahead_above_behind", "ahead_behind", found.ahead_behind, 1.0, ""),
        ("network_ahead_above_behind", "network_ratio", network.ratio, 1.0, ""),
        ("active_zone_reaches_far", "network_at_wall", network.at_wall, 1.0, ""),
        ("forces_grow_with_depth", "depth_slope_n_per_m", found.depth_slope_n_per_m, 0.0, "N/m"),
        ("forces_grow_with_depth", "deep_over_shallow", found.deep_over_shallow, 1.0, ""),
        ("most_intense_at_front", "front_over_flank", found.front_over_flank, 1.0, ""),
        ("outer_surfaces_hit_hardest", "outer_over_inner", found.outer_over_inner, 1.0, ""),
    )
    return tuple(
        Claim(
            statement=statement,
            number=number,
            null=null,
            unit=unit,
            verdict=estimate.exceeds(null),
            estimate=estimate,
        )
        for statement, number, estimate, null, unit in rows
        if estimate is not None
    )


def claim_table(rows: tuple[Claim, ...]) -> pd.DataFrame:
    """The claims as a table, one row per number."""
    known = [dict(row) | vars(row.estimate) for row in rows]
    return pd.DataFrame(known).drop(columns=["estimate", "reliable"])
