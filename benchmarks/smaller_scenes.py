"""Machines against their cut-outs and against larger particles (docs/evidence/simplifications.md).

    ./run all --config study=drag_finisher      # and the others below
    python benchmarks/smaller_scenes.py docs/data/scenes results/drag_finisher{,_coarse} \
        results/stream_finisher{,_coarse} results/stream_machine{,_whole} \
        results/{coarser,roomy}_{slow,fast} results/roomy_thick

Makes three records of the runs of these studies: ``smaller_scenes.csv``, mean values over the
packings of each scene and size with the cost of filling and process; ``cut_out_change.csv``, the
change of the drag by the cut-outs; and ``true_size.csv``, what follows from the larger particles
for the true size.
"""

import math
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.quantities.document import MEASURED_FILE, RunQuantities
from dragchain.report.coarse_grained import coarse_grained, mean_of_runs
from dragchain.run.case import upstream_folders
from dragchain.statistics.estimate import NOT_KNOWN, Estimate, flattened
from dragchain.tables.by_step import read_table
from dragdeck.records.case import load_case
from dragdeck.records.run import RunRecord
from dragdeck.study.paths.path import AroundBowl

QUANTITIES = {"drag_n": "drag_mean", "contacts": "workpiece_contacts",
              "contact_force_n": "contact_force_mean", "load_n": "normal_load",
              "sliding_load_n_m_per_m": "force_slide", "vertical_n": "vertical_mean"}  # fmt: skip

_NEAR_M, _BINS = 0.02, 8
"""Surface beside the path to either side, m, and its bins."""


def main(out: Path, *results: Path) -> None:
    """Read the runs of studies and write the records."""
    rows, lines = [], []
    machines = defaultdict[str, dict[Path, RunQuantities]](dict)
    for study in results:
        machine = study.name.removesuffix("_coarse").removesuffix("_whole")
        for file in sorted(study.glob(f"process/*/{MEASURED_FILE}")):
            machines[machine][file.parents[1]] = RunQuantities.read(file)
    for machine, runs in machines.items():
        groups = defaultdict[tuple[str, float], list[Path]](list)
        for folder, run in runs.items():
            groups[_kind(run)].append(folder)
        rows += [_row(machine, *kind, of, runs) for kind, of in sorted(groups.items())]
        for scene in sorted({scene for scene, _ in groups}):
            of_scene = [run for run in runs.values() if _kind(run)[0] == scene]
            for line in coarse_grained(of_scene):
                if line.value is not None:
                    row = {**vars(line), "scene": scene, "study": machine}
                    row["at_true_size"] = line.at_true_size or NOT_KNOWN
                    lines.append(flattened(row))
    table = pd.DataFrame(rows)
    whole = table[table["scene"] == "whole"].sort_values("factor").drop_duplicates("study")
    cost = table["study"].map(whole.set_index("study")["cpu_time_s"])
    table["relative_cpu_time"] = table["cpu_time_s"] / cost
    records = {
        "cut_out_change": pd.DataFrame(_changes(table)),
        "smaller_scenes": table,
        "true_size": pd.DataFrame(lines),
    }
    for name, record in records.items():
        record.to_csv(out / f"{name}.csv", index=False, float_format="%.6g")


def _changes(table: pd.DataFrame) -> Iterator[dict[str, object]]:
    """Relative change of the drag by the cut-outs, for each particle size of a study."""
    for (study, factor), of_size in table.groupby(["study", "factor"]):
        drags = of_size.set_index("scene").filter(regex="^drag_n")
        if len(drags) == 2:
            value, low, high = drags.abs().to_numpy().T
            ratio = float(np.log(value[0] / value[1]))
            half = math.hypot(*np.abs(high - low) / 2 / value)
            change = Estimate.around(ratio, half).exp(minus=1.0)
            row = flattened({"study": study, "factor": factor, "drag": change})
            yield {"drag_value" if name == "drag" else name: row[name] for name in row}


def _kind(run: RunQuantities) -> tuple[str, float]:
    """Whether it is of the whole machine, and the factor on the diameters."""
    reduction = run.study.reduction
    cut = reduction is not None and reduction.cut_out
    return "cut out" if cut else "whole", (reduction and reduction.coarser) or 1.0


def _row(
    study: str, scene: str, factor: float, folders: Sequence[Path], runs: dict[Path, RunQuantities]
) -> dict[str, object]:
    of_scene = [runs[folder] for folder in folders]
    values = {name: mean_of_runs(of_scene, key) or NOT_KNOWN for name, key in QUANTITIES.items()}
    return flattened(
        {
            "study": study,
            "scene": scene,
            "factor": factor,
            "packings": len(folders),
            "particles": load_case(folders[0]).media.count,
            **values,
            "surface_tilt_deg": np.mean([_tilt_deg(folder, runs[folder]) for folder in folders]),
            "cpu_time_s": np.mean([_cpu_time(folder, runs[folder]) for folder in folders]),
        }
    )


def _cpu_time(folder: Path, run: RunQuantities) -> float:
    """Of the filling and of the process, s."""
    filling = upstream_folders(folder, load_case(folder))["filling"]
    return run.cost.cpu_time_s + float(RunRecord.read(filling / "run.json").cpu_time_s or math.nan)


def _tilt_deg(folder: Path, run: RunQuantities) -> float:
    """Inclination of the surface across the path, outwards, in the second half of the drag.

    Of particles beside the path, half a layer of the highest in each bin across it.
    """
    case, diameter = load_case(folder), 2 * load_case(folder).media.radius_mean_m
    drag = case.phases[-1]
    particles = read_table(folder / "tables/particles.parquet", ["step", "x_m", "y_m", "z_m"])
    particles = particles[particles["step"] > (drag.start_step + drag.end_step) / 2]
    if case.bowl.round:
        path = run.study.motion.path
        assert isinstance(path, AroundBowl)
        edges = path.radius_m + np.linspace(-_NEAR_M, _NEAR_M, _BINS + 1)
        across, areas, sign = np.hypot(particles["x_m"], particles["y_m"]), edges**2 * math.pi, 1.0
    else:
        edges = np.linspace(-_NEAR_M, _NEAR_M, _BINS + 1)
        across, areas = particles["y_m"], edges * 2 * case.bowl.half_widths_m[0]
        sign = 1.0 if case.bowl.motion is None else np.sign(case.bowl.motion.sideways_m_s2[1])
    top = np.diff(areas) / diameter**2 / 2
    slopes = []
    for _, frame in particles.assign(bin=np.digitize(across, edges) - 1).groupby("step"):
        heights = [
            frame.loc[frame["bin"] == number, "z_m"].nlargest(round(top[number])).mean()
            for number in range(_BINS)
        ]
        slopes.append(np.polyfit((edges[1:] + edges[:-1]) / 2, heights, 1)[0])
    return float(sign * np.degrees(np.arctan(np.mean(slopes))))


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
