"""Errors of the default settings in the quantities that most users look at."""

import pandas as pd
from tables import Store, derived

_LABELS = {
    "drag_mean": "mean drag",
    "drag_std": "standard deviation of the drag",
    "drag_std_short": "fluctuations of the drag below a quarter of the particle diameter",
    "workpiece_contacts": "number of contacts on the workpiece",
    "contact_force_mean": "mean contact force on the workpiece",
    "contact_force_p50": "median contact force on the workpiece",
    "contact_force_p90": "90th percentile of the contact force on the workpiece",
    "coordination_number": "coordination number",
    "network_force_mean": "mean normal force in the network",
    "chain_count": "Peters chains per frame",
    "path_bottleneck": "bottleneck force of the dominant path",
}


@derived("settings/standard")
def _standard(store: Store) -> pd.DataFrame:
    """One row per quantity: error of the fidelity `standard`."""
    found = store.table("tradeoff/errors")
    same = (found["youngs_modulus_scale"] == 0.01) & (found["timestep_fraction"] == 0.5)
    chosen = found[same & (found["speed_factor"] == 1)].set_index("quantity")
    rows = chosen.loc[list(_LABELS)].reset_index()
    return rows.assign(words=list(_LABELS.values()))
