"""What a trade-off compares."""

from __future__ import annotations

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

    def of_blocks(self, blocks: Floats) -> float:
        """A run's value from the values of its blocks, (B,)."""
        mean = float(np.mean(blocks))
        return math.sqrt(mean) if self.squared else mean


QUANTITIES = (
    Quantity("drag_mean", "mean drag", "N", "mean drag"),
    Quantity("drag_std", "standard deviation of the drag", "N", "std. dev. of drag", squared=True),
    Quantity("drag_std_long", "drag variations over two particle diameters", "N", squared=True),
    Quantity("drag_std_middle", "drag variations in between", "N", squared=True),
    Quantity("drag_std_short", "drag variations under a quarter of a diameter", "N", squared=True),
    Quantity("lateral_mean", "mean lateral force", "N", signed=True),
    Quantity("vertical_mean", "mean vertical force", "N", signed=True),
    Quantity("workpiece_contacts", "contacts on the workpiece", short="contacts on workpiece"),
    Quantity(
        "contact_force_mean",
        "mean normal force of a contact on the workpiece",
        "N",
        "mean contact force",
    ),
    Quantity("contact_force_p50", "median force of a contact on the workpiece", "N"),
    Quantity(
        "contact_force_p90",
        "90th percentile of the contact forces on the workpiece",
        "N",
        "90th per\N{SOFT HYPHEN}centile of it",
    ),
    Quantity("contact_force_p99", "99th percentile of the contact forces on the workpiece", "N"),
    Quantity("workpiece_overlap", "mean overlap on the workpiece over the particle diameter"),
    Quantity(
        "coordination_number",
        "coordination number",
        short="coordi\N{SOFT HYPHEN}nation number",
    ),
    Quantity("mechanical_coordination_number", "coordination number of loaded particles"),
    Quantity("network_force_mean", "mean normal force in the network", "N"),
    Quantity("overlap_p99", "99th percentile of particle overlap over the diameter"),
    Quantity("chain_count", "Peters chains in a frame", short="Peters chains"),
    Quantity("chain_length", "particles in a Peters chain", short="particles in a chain"),
    Quantity("chain_alignment", "mean squared cosine of chains with the motion"),
    Quantity("path_bottleneck", "bottleneck of the dominant workpiece path", "N"),
    Quantity("bed_height", "fill height", "m"),
    Quantity("solid_fraction", "solid fraction of the bed"),
)
"""All but the last two have a value for every block of the path."""

MAIN = tuple(quantity.name for quantity in QUANTITIES if quantity.short)
"""The quantities that figures and the tables of settings show."""
