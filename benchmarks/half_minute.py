"""Where the time goes from a changed study file to the report, for one or more checkouts.

    python benchmarks/half_minute.py [--tolerance 0.1] [--rounds 2] [CHECKOUT ...]

The study is ``uhlmann2015`` with a tolerance, under the name `NAME`, from an empty results folder.
The checkouts take turns, and the round with the least CPU time of each is shown: other programs on
the machine add to it and never take from it. The first round of a new checkout compiles numba's
loops, so one round says little of it. CPU time is that of all processes, as the kernel counts
it; that of single jobs is Snakemake's, sampled and therefore lower. Two ranks that wait for each
other use CPU time, so a run of LIGGGHTS on a busy machine has more of it.
"""

import argparse
import csv
import json
import os
import resource
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

from machine import machine

NAME = "half_minute"
HERE = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Call:
    """One call of Snakemake: wall and CPU time of all and of each job, s, and the load after it."""

    wall_s: float
    cpu_s: float
    start_s: float
    load: float
    jobs: dict[str, tuple[float, float]]


def call(checkout: Path, tolerance: float) -> Call:
    """Run the study of a checkout from nothing and read what its jobs took."""
    file = checkout / "studies" / NAME / "study.yaml"
    results = checkout / "results" / NAME
    file.parent.mkdir(exist_ok=True)
    file.write_text(
        f"title: Half a minute\nextends: uhlmann2015\nfidelity: {{tolerance: {tolerance:g}}}\n"
    )
    shutil.rmtree(results, ignore_errors=True)
    paths = os.pathsep.join([str(checkout / "workflow"), str(checkout / "analysis"), str(checkout)])
    words = [sys.executable, "-m", "snakemake", "all", "--config", f"study={NAME}"]
    before, start, first = _children_s(), time.perf_counter(), 0.0
    environment = {
        **os.environ,
        "PYTHONPATH": paths,
        "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}",
    }
    with subprocess.Popen(
        words,
        cwd=checkout,
        env=environment,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as running:
        assert running.stderr is not None
        for line in running.stderr:
            if not first and line.startswith(("rule ", "localrule ")):
                first = time.perf_counter() - start
    assert running.returncode == 0, f"snakemake failed in {checkout}"
    wall = time.perf_counter() - start
    return Call(wall, _children_s() - before, first, os.getloadavg()[0], _jobs(results))


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _jobs(results: Path) -> dict[str, tuple[float, float]]:
    found = {}
    for file in sorted(results.rglob("benchmarks/*.tsv")):
        place = file.relative_to(results).parts[0]
        (row,) = csv.DictReader(file.open(), delimiter="\t")
        name = file.stem if place in (file.stem, "benchmarks") else f"{place}: {file.stem}"
        found[name] = float(row["s"]), float(row["cpu_time"] if row["cpu_time"] != "NA" else "nan")
    return found


def table(names: list[str], calls: list[Call]) -> str:
    """The jobs of all checkouts side by side; columns of wall and CPU time, s."""
    heads = [f"{name}: {what} (s)" for name in names for what in ("wall", "CPU")]
    lines = [f"| job | {' | '.join(heads)} |", "| --- |" + " ---: |" * len(heads)]
    nothing = (float("nan"),) * 2
    rows = {"start of Snakemake": [(one.start_s, float("nan")) for one in calls]}
    rows |= {job: [one.jobs.get(job, nothing) for one in calls] for job in calls[0].jobs}
    rows["whole call"] = [(one.wall_s, one.cpu_s) for one in calls]
    for job, times in rows.items():
        cells = [f"{value:.1f}" if value == value else "" for pair in times for value in pair]
        lines.append(f"| {job} | {' | '.join(cells)} |")
    return "\n".join(lines)


def certainty(checkout: Path) -> str:
    """What is known of the mean drag: the error of the settings and the chance of the run."""
    results = checkout / "results" / NAME
    advice = json.loads((results / "advice.json").read_text())["cases"][0]["asked"]
    (row,) = csv.DictReader((results / "report/summary.csv").open())
    low, mean, high = (float(row[f"drag_{name}_n"]) for name in ("ci95_low", "mean", "ci95_high"))
    half, bound = (high - low) / 2 / abs(mean), advice["bound"]
    both = (half**2 + bound**2) ** 0.5
    return (
        f"mean drag {mean:.3f} N; half-width of the run {100 * half:.1f} %, bound of the settings' "
        f"error {100 * bound:.1f} %, root of the sum of squares {100 * both:.1f} %"
    )


def plain(checkout: Path) -> str:
    """The time of the plain input script, computed from its steps and the speed measured here."""
    results = checkout / "results" / NAME
    (case,) = json.loads((results / "advice.json").read_text())["cases"]
    (reference,) = (one for one in case["options"] if one["role"] == "reference")
    (record,) = results.glob("process/*/run.json")
    rate = json.loads(record.read_text())["steps_per_s"]
    tradeoff = json.loads((HERE / "workflow/dragdeck/data/tradeoff.json").read_text())
    cost = {one["name"]: one["per_step"] for one in tradeoff["costs"]}
    scale = json.loads(record.with_name("case.json").read_text())["fidelity"][
        "youngs_modulus_scale"
    ]
    dearer = cost["bowl_facets"] * cost["modulus_1"] / cost[f"modulus_{scale:g}"]
    steps, rate = reference["steps"]["process"], rate / dearer
    return (
        "plain input script (E x 1, 20 % of the Rayleigh time, bowl with facets), computed, not"
        f" run: {steps:,} steps of the process at {rate:.0f} steps/s: {steps / rate / 3600:.1f} h"
    )


def main() -> None:
    """Run the checkouts in turn and print the breakdown."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("checkouts", nargs="*", type=Path, default=[HERE])
    parser.add_argument("--tolerance", type=float, default=0.1)
    parser.add_argument("--rounds", type=int, default=2)
    options = parser.parse_args()
    checkouts = [folder.resolve() for folder in options.checkouts]
    rounds = [[call(one, options.tolerance) for one in checkouts] for _ in range(options.rounds)]
    best = [min(calls, key=lambda one: one.cpu_s) for calls in zip(*rounds, strict=True)]
    print(table([folder.name for folder in checkouts], best))
    print()
    for folder, one in zip(checkouts, best, strict=True):
        print(f"- {folder.name}: load {one.load:.1f} at the end; {certainty(folder)}")
    print(f"- {plain(checkouts[-1])}\n- {machine('snakemake', 'numpy', 'matplotlib')}")


if __name__ == "__main__":
    main()
