"""Errors of the default settings in the quantities that most users look at."""

import pandas as pd
from tables import Store, derived

_SHOWN = [
    "drag_mean",
    "drag_std",
    "drag_std_short",
    "workpiece_contacts",
    "contact_force_mean",
    "contact_force_p50",
    "contact_force_p90",
    "coordination_number",
    "network_force_mean",
    "chain_count",
    "path_bottleneck",
]


@derived("settings/standard")
def _standard(store: Store) -> pd.DataFrame:
    """One row per quantity: error of the fidelity `standard`."""
    found = store.table("tradeoff/errors")
    same = (found["youngs_modulus_scale"] == 0.01) & (found["timestep_fraction"] == 0.5)
    chosen = found[same & (found["speed_factor"] == 1)].set_index("quantity")
    return chosen.loc[_SHOWN].reset_index()
