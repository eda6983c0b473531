"""What a trade-off compares."""

import math
from dataclasses import dataclass

import numpy as np

from dragchain.arrays import Floats


@dataclass(frozen=True)
class Quantity:
    """Something a trade-off compares.

    Attributes
    ----------
    name, label, unit : str
    short : str
        Head of a column, of the main quantities.
    squared : bool
        Its blocks hold squares: a run's value is the root of their mean.
    signed : bool
        It may be zero or change its sign: errors are counted in mean drags.
    """

    name: str
    label: str
    unit: str = ""
    short: str = ""
    squared: bool = False
    signed: bool = False

    def rooted(self, blocks: Floats) -> Floats:
        """Values of blocks, (B,), as a run's value is one."""
        return np.sqrt(blocks) if self.squared else blocks

    def of_blocks(self, blocks: Floats) -> float:
        """A run's value from the values of its blocks, (B,)."""
        mean = float(np.mean(blocks))
        return math.sqrt(mean) if self.squared else mean


QUANTITIES = (
    Quantity("drag_mean", "mean drag", "N", "mean drag"),
    Quantity("drag_std", "standard deviation of the drag", "N", "std. dev. of drag", squared=True),
    Quantity(
        "drag_std_long",
        "drag fluctuations at wavelengths above 2 particle diameters",
        "N",
        squared=True,
    ),
    Quantity("drag_std_middle", "drag fluctuations at intermediate wavelengths", "N", squared=True),
    Quantity(
        "drag_std_short",
        "drag fluctuations at wavelengths below 1/4 particle diameter",
        "N",
        squared=True,
    ),
    Quantity("lateral_mean", "mean lateral force", "N", signed=True),
    Quantity("vertical_mean", "mean vertical force", "N", signed=True),
    Quantity("workpiece_contacts", "contacts on the workpiece", short="contacts on workpiece"),
    Quantity(
        "contact_force_mean",
        "mean normal force per contact on the workpiece",
        "N",
        "mean contact force",
    ),
    Quantity("contact_force_p50", "median of the contact forces on the workpiece", "N"),
    Quantity(
        "contact_force_p90",
        "90th percentile of the contact forces on the workpiece",
        "N",
        "90th per\N{SOFT HYPHEN}centile of contact force",
    ),
    Quantity("contact_force_p99", "99th percentile of the contact forces on the workpiece", "N"),
    Quantity("normal_load", "sum of the normal forces on the workpiece", "N"),
    Quantity(
        "sliding_distance",
        "sliding distance of all contacts over the path",
    ),
    Quantity(
        "friction_work",
        "friction work on the workpiece for a metre of path",
        "J/m",
    ),
    Quantity("workpiece_overlap", "mean relative overlap on the workpiece"),
    Quantity(
        "coordination_number",
        "coordination number",
        short="coordi\N{SOFT HYPHEN}nation number",
    ),
    Quantity("mechanical_coordination_number", "coordination number without rattlers"),
    Quantity("network_force_mean", "mean normal force in the network", "N"),
    Quantity(
        "overlap_p99",
        "99th percentile of the relative overlap between particles",
    ),
    Quantity("chain_count", "Peters chains per frame", short="Peters chains"),
    Quantity("chain_length", "particles per Peters chain", short="particles per chain"),
    Quantity("chain_alignment", "mean squared cosine of the angle between chains and motion"),
    Quantity("path_bottleneck", "bottleneck force of the dominant path", "N"),
    Quantity(
        "force_slide",
        "normal force \N{MULTIPLICATION SIGN} sliding distance per metre of path",
        "N m/m",
    ),
    Quantity("bed_height", "bed height", "m"),
    Quantity("solid_fraction", "solid fraction"),
)
"""All but the last two have a value for every block of the path."""

MAIN = tuple(quantity.name for quantity in QUANTITIES if quantity.short)
"""The quantities that figures and the tables of settings show."""
