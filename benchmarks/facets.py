"""CPU time of a time step by the number of facets of the workpiece.

    python benchmarks/facets.py docs/data/benchmarks/facets.csv

The short run by which `dragdeck advise` measures the speed of a machine, of the study
`uhlmann2015` with finer and finer facets. One rank; the CPU time counts, so that other work on the
machine matters little.
"""

import argparse
import json
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from dragdeck.campaigns.machine_speed import measure_machine_speed
from dragdeck.cases.case import Case
from dragdeck.decks.templates import environment
from dragdeck.engine.reports import say
from dragdeck.project import Project, study_templates

SIZES_M = (1.5e-3, 0.75e-3, 0.5e-3)
"""Lengths of the facets of the lateral surface, round and along it."""


def with_facets(case: Case, size_m: float) -> Case:
    """The case on one rank with facets of a size."""
    study = case.study
    shape = study.workpiece.shape.model_copy(
        update={"facet_size_m": size_m, "facet_length_m": size_m}
    )
    workpiece = study.workpiece.model_copy(update={"shape": shape})
    fidelity = study.chosen_fidelity().model_copy(update={"ranks": 1})
    changed = study.model_copy(update={"workpiece": workpiece, "fidelity": fidelity})
    return replace(case, study=changed)


def measured(case: Case, folder: Path, project: Project) -> dict[str, float]:
    """Facets and CPU time of a step, ms."""
    templates = environment(project.templates, study_templates(case))
    measure_machine_speed(case, folder, templates, say)
    (run,) = (folder / "process").iterdir()
    record = json.loads((run / "run.json").read_text(encoding="utf-8"))
    facets = (run / "workpiece.stl").read_text(encoding="ascii").count("facet normal")
    return {
        "facets": facets,
        "particles": case.study.media.count,
        "steps": record["steps"],
        "cpu_ms_per_step": 1e3 * record["cpu_time_s"] / record["steps"],
    }


def main() -> None:
    """Write the table and print the line through it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", type=Path)
    asked = parser.parse_args()
    project = Project(Path(__file__).resolve().parents[1])
    case = project.cases("uhlmann2015")[0]
    rows = []
    for size in SIZES_M:
        with tempfile.TemporaryDirectory() as folder:
            row = measured(with_facets(case, size), Path(folder), project)
        rows.append({"facet_size_m": size, **row})
        print(rows[-1], flush=True)
    table = pd.DataFrame(rows)
    table.to_csv(asked.out, index=False, float_format="%.6g")
    slope, alone = np.polyfit(table["facets"], table["cpu_ms_per_step"], 1)
    print(f"{1e6 * slope:.3g} ns per facet and step beside {alone:.3g} ms")


if __name__ == "__main__":
    main()
