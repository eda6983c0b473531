"""Tables from the measures of many scenes: python docs/tools/scene_records.py.

The archives ``docs/data/scenes/*.tar.xz`` contain the ``measures.json`` of each run. What pages show
of them, and what neither ``promises.json`` nor ``stiffness.json`` contains, becomes a CSV beside them.
"""

import json
import tarfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import mean, median

import numpy as np
import pandas as pd

from dragchain.tradeoff.measures import Measures
from dragchain.tradeoff.runs import by_scene
from dragchain.tradeoff.stiffness_document import StiffnessRecord
from dragchain.tradeoff.stiffness_errors import scaled_runs
from dragchain.tradeoff.quantities import QUANTITIES

ROOT = Path(__file__).resolve().parents[2]
SCENES = ROOT / "docs/data/scenes"


def runs_of(name: str) -> list[Measures]:
    """The complete and the rejected runs of an archive, in its order."""
    with tarfile.open(SCENES / f"{name}.tar.xz") as archive:
        files = sorted(archive.getnames())
        texts = [archive.extractfile(file).read() for file in files]  # type: ignore[union-attr]
    return [Measures.model_validate(json.loads(text)) for text in texts]


def merged() -> Iterator[dict[str, object]]:
    """Changes by a reduced modulus in the scene of the trade-off, as they are and extrapolated."""
    laws = StiffnessRecord.read(ROOT / "workflow/dragdeck/data/stiffness.json").laws
    runs = runs_of("merged")
    for quantity in QUANTITIES:
        known, found = laws.get(quantity.name), scaled_runs(runs, quantity)
        if known is None or found is None:
            continue
        values = np.exp(found.logarithms)
        (full,) = values[found.scales == 1.0]
        for scale in (0.01, 0.001):
            own = values[found.scales == scale]
            at_full = [
                known.at_physical_modulus(one, runs[0].numbers, scale, found.path_to_particle)
                for one in own
            ]
            corrected = [float(np.exp(one.logarithm)) for one in at_full]
            half = np.expm1(known.quantile * at_full[0].se)
            yield {
                "quantity": quantity.name,
                "youngs_modulus_scale": scale,
                "runs": len(own),
                "change": mean(own) / full - 1,
                "corrected": mean(corrected) / full - 1,
                "predicted_half_width": half,
            }


for row in merged():
    print(row["quantity"], row["youngs_modulus_scale"], *(f"{100*row[k]:+.1f}" for k in ("change","corrected","predicted_half_width")))
for r in runs_of("merged"):
    print(r.fidelity.youngs_modulus_scale, r.cost.cpu_time_s, r.cost.ranks, r.cost.steps, r.seed, r.arc_m, r.versions, r.started, r.numbers)
