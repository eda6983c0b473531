"""Random valid scenes of drag finishing: studies as plain data, for property tests."""

import math
from typing import Any

from hypothesis import strategies as st

_TALLEST = 70
"""Height of the highest bed in particle diameters."""

QUANTITIES = (
    "drag_mean", "drag_std", "vertical_mean", "workpiece_contacts", "contact_force_mean",
    "contact_force_p90", "coordination_number", "chain_count", "chain_length", "restitution",
    ["drag_mean", "workpiece_contacts"],
)  # fmt: skip


def _linear(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers between two limits, evenly spread."""
    return st.integers(0, 1000).map(lambda n: float(f"{low + (high - low) * n / 1000:.4g}"))


def _between(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers between two limits, evenly spread on a logarithmic scale."""
    return _linear(math.log(low), math.log(high)).map(lambda x: float(f"{math.exp(x):.4g}"))


@st.composite
def random_scenes(draw: st.DrawFn) -> dict[str, Any]:
    """A study that asks for a tolerance. Lengths of the scene follow from the diameter d."""
    d = draw(_linear(1e-3, 6e-3))
    depth = draw(_between(1.5, _TALLEST - 10))
    height = (depth + draw(_linear(2.6, _TALLEST - depth))) / 0.94  # the bed may be 6 % lower
    gap, thick = draw(_linear(2.1, 6)), draw(_between(0.5, 4))
    reach = draw(_between(1.5, 10))
    outer = reach + gap + thick / 2
    count = math.ceil(0.59 * 6 * outer**2 * height) + 5
    speeds = [draw(_between(1e-3, 1.0)) for _ in range(3)]
    turns = draw(_linear(0.1, 2))
    circle = draw(st.booleans())
    length = (2 * math.pi * turns if circle else 2) * reach * d
    path: dict[str, Any] = {"kind": "circle", "radius_m": reach * d, "revolutions": turns}
    if not circle:
        path = {"kind": "line", "start_m": [-reach * d, 0.0], "length_m": length}
    media, steel = (
        {"youngs_modulus_pa": draw(_between(1e9, 4e11)), "poissons_ratio": draw(_linear(0.1, 0.4)),
         "density_kg_m3": draw(_linear(1000, 8000))}
        for _ in range(2)
    )  # fmt: skip
    pairs = {
        pair: {"restitution": draw(_linear(0.3, 0.95)), "friction": draw(_linear(0.05, 0.8))}
        for pair in ("media-media", "media-steel")
    }
    force_hz = max(1000.0, 60 * speeds[0] / length)
    return {
        "title": "A random scene",
        "materials": {"media": media, "steel": steel},
        "pairs": pairs,
        "media": {"material": "media", "count": count, "radius_mean_m": d / 2,
                  "radius_std_m": draw(_linear(0, 0.1)) * d / 2},
        "bowl": {"material": "steel", "radius_m": outer * d, "height_m": 1.5 * height * d},
        "workpiece": {
            "material": "steel",
            "shape": {"kind": "cylinder", "radius_m": thick * d / 2, "facet_size_m": thick * d / 4},
        },
        "motion": {"path": path, "speed_m_s": speeds[0], "immersion_depth_m": depth * d,
                   "plunge_speed_m_s": speeds[1], "approach_speed_m_s": speeds[2],
                   "transient_m": 0.1 * length},
        "outputs": {"workpiece_force_hz": force_hz, "workpiece_contacts_hz": force_hz / 5,
                    "network_hz": force_hz / 50},
        "fidelity": {
            "tolerance": draw(st.sampled_from([0.03, 0.1, 0.15, 0.2, 0.4, 0.8])),
            "quantity": draw(
                st.sampled_from([*5 * ["drag_mean"], ["drag_mean", "drag_std"], *QUANTITIES])
            ),
        },
        "seed": draw(st.integers(0, 2**32 - 1)),
    }  # fmt: skip
