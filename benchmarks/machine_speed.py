"""Drag and stability number at the speeds of machines (docs/evidence/scaling.md, stability.md).

    ./run all --config study=machine_speed
    python benchmarks/machine_speed.py docs/data/scaling

Writes a row per run, and the drag as a sum of a constant and a term with the square of the speed,
by least squares in which each run counts by its variance and the scatter about the law widens the
intervals.
"""

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.quantities.document import MEASURED_FILE, RunQuantities
from dragchain.statistics.estimate import flattened, student_quantile
from dragdeck.outlook.timestep import stability_forecast
from dragdeck.project import Project
from dragdeck.records.run import RunRecord
from dragdeck.scenes.process import PROCESS


def rows(project: Project) -> Iterator[dict[str, object]]:
    """Speed, packing, stability number as forecast and measured, drag and contacts of each run."""
    for case in project.cases("machine_speed"):
        folder = project.run_folder(case, PROCESS)
        checks = {check.code: check for check in RunRecord.read(folder / "run.json").checks}
        values = RunQuantities.read(folder / MEASURED_FILE).estimates({})
        yield flattened(
            {
                "speed_m_s": case.study.motion.nominal_speed_m_s,
                "seed": case.study.seed,
                "forecast": stability_forecast(case),
                "measured": checks["stable_timestep"].number,
                "drag_n": values["drag_mean"],
                "contacts": values["workpiece_contacts"],
                "contact_force_n": values["contact_force_mean"],
            }
        )


def law(runs: pd.DataFrame) -> pd.DataFrame:
    """Drag at rest, N, and its rise with the square of the speed, N s2/m2, with 95 % intervals."""
    drag, half = runs["drag_n"].abs(), runs["drag_n_ci95_high"] - runs["drag_n"]
    values, covariance = np.polyfit(runs["speed_m_s"] ** 2, drag, 1, w=1 / half, cov=True)
    halves = student_quantile(len(runs) - 2) * np.sqrt(np.diag(covariance))
    names = ("rise_n_s2_m2", "at_rest_n")
    columns = {"value": values, "ci95_low": values - halves, "ci95_high": values + halves}
    return pd.DataFrame({"name": names, **columns})


if __name__ == "__main__":
    out, table = Path(sys.argv[1]), pd.DataFrame(rows(Project(Path.cwd())))
    table.to_csv(out / "machine_speed.csv", index=False, float_format="%.5g")
    law(table).to_csv(out / "machine_speed_law.csv", index=False, float_format="%.4g")
