"""Keep what pages and figures need of a run of uhlmann2015: python docs/tools/run_records.py.

Needs the results of ``./run all --config study=uhlmann2015``.
"""

import numpy as np
import pandas as pd
from records import DATA, ROOT

import dragchain

BLOCK_S = 0.02


def main() -> None:
    """Write summary, force over time and facets of the workpiece into docs/data/validation."""
    study = dragchain.load(str(ROOT / "results/uhlmann2015"))
    (run,) = study.runs
    out = DATA / "validation"
    study.summary.to_csv(out / "run.csv", index=False, float_format="%.6g")
    force = run.force[run.force["phase"] == "drag"]
    block = np.floor(force["time_s"] / BLOCK_S).astype(int)
    means = force.groupby(block)[["time_s", "drag_n", "lateral_n"]].mean()
    means["time_s"] -= force["time_s"].iloc[0]
    means.to_csv(out / "run_force.csv", index=False, float_format="%.5g")
    names = [
        "centre_x_m",
        "centre_y_m",
        "centre_z_m",
        "area_m2",
        "force_slide_n_m",
        "force_slide_pa",
    ]
    facets = pd.read_parquet(run.folder / "tables/facets.parquet", columns=names)
    facets.to_csv(out / "run_facets.csv", index=False, float_format="%.5g")


if __name__ == "__main__":
    main()
