"""Promises of windows in scenes drawn from a seed, against runs at the physical Young's modulus.

    python benchmarks/promises.py draw SEED PROJECT [--scenes 12] [--first 0] [--slowest 0.012]
    python benchmarks/promises.py targets PROJECT                     # files for snakemake to make
    python benchmarks/promises.py judge PROJECT... OUT.csv            # after the runs

PROJECT is a copy of the repository. Each scene is a study with one packing that asks for a
tolerance of 10 % on six quantities, and a study of the same scene with other packings in plain
runs at the physical modulus. The rule of stopping is applied to the windows again for each
quantity alone, in the order in which they were run: what it then says is a promise.
"""

import argparse
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from scipy.stats import norm

from dragchain.report.values import Extrapolated
from dragchain.statistics.estimate import NORMAL_QUANTILE
from dragchain.tradeoff.measure_run import quantities_along
from dragchain.windows.estimate import Round, WindowsRecord
from dragchain.windows.rounds import judged
from dragdeck.advice.advise import plain_option
from dragdeck.cases.case import Case
from dragdeck.project import Project, by_run
from dragdeck.records.case import load_case
from dragdeck.records.run import RunRecord
from dragdeck.scenes.process import SCENES
from dragdeck.scenes.workpiece import describe

TOLERANCE = 0.1
QUANTITIES = [
    "drag_mean",
    "workpiece_contacts",
    "coordination_number",
    "contact_force_mean",
    "contact_force_p90",
    "sliding_distance",
]
REFERENCE_PACKINGS = 1
SLOWEST, FASTEST = 0.012, 0.12
"""Bounds of the inertial number."""

MATERIALS = {
    "glass": (63e9, 0.22, 2500),
    "alumina": (370e9, 0.22, 3900),
    "zirconia": (205e9, 0.31, 6000),
    "porcelain": (77e9, 0.19, 2656),
    "steel": (210e9, 0.30, 7800),
    "polyester": (4e9, 0.38, 1400),
}
"""Young's modulus, Pa, Poisson's ratio, and density, kg/m3, of common media."""


def draw(rng: np.random.Generator, number: int, slowest: float) -> dict[str, Any]:
    """A scene as plain data; lengths follow from the particle diameter d.

    Workpiece, wall and floor are at least three diameters apart: in narrower gaps, particles jam at
    the physical modulus, and single forces decide the means.
    """
    name = [*MATERIALS][number % len(MATERIALS)]
    modulus, poisson, density = MATERIALS[name]
    d = round(rng.uniform(5e-3, 9e-3), 4)
    thick, gap = rng.uniform(1.0, 1.6), rng.uniform(3.0, 3.4)
    reach = rng.uniform(1.5, 2.2)
    outer = reach + thick / 2 + gap
    height = rng.uniform(7.0, 7.6)
    depth = height - rng.uniform(3.0, 3.4)
    inertial = math.exp(rng.uniform(math.log(slowest), math.log(FASTEST)))
    speed = inertial * math.sqrt(0.59 * 9.81 * depth * d)
    length = rng.uniform(11.0, 18.0)
    restitution, friction = rng.uniform(0.5, 0.9), rng.uniform(0.15, 0.5)
    return {
        "title": f"Drawn scene {number}: {name}",
        "materials": {
            "media": _material(modulus, poisson, density),
            "tool": _material(210e9, 0.3, 7800),
        },
        "pairs": {
            "media-media": {"restitution": _short(restitution), "friction": _short(friction)},
            "media-tool": {
                "restitution": _short(restitution - 0.05),
                "friction": _short(friction * rng.uniform(0.6, 1.0)),
            },
        },
        "media": {
            "material": "media",
            "count": math.ceil(0.59 * 6 * outer**2 * height),
            "radius_mean_m": d / 2,
            "radius_std_m": _short(rng.uniform(0.02, 0.08) * d / 2),
        },
        "bowl": {
            "material": "tool",
            "radius_m": _short(outer * d),
            "height_m": _short(1.6 * height * d),
        },
        "workpiece": {
            "material": "tool",
            "shape": {"kind": "cylinder", "radius_m": _short(thick * d / 2)},
        },
        "motion": {
            "path": {
                "kind": "circle",
                "radius_m": _short(reach * d),
                "revolutions": _short(length / (2 * math.pi * reach)),
            },
            "speed_m_s": _short(speed),
            "immersion_depth_m": _short(depth * d),
            "transient_m": _short(1.5 * d),
        },
        "outputs": {
            "workpiece_force_hz": _short(100 * speed / d),
            "workpiece_contacts_hz": _short(50 * speed / d),
            "network_hz": _short(12 * speed / d),
        },
        "seed": int(rng.integers(1, 10_000)),
    }


def _material(modulus: float, poisson: float, density: float) -> dict[str, float]:
    return {
        "youngs_modulus_pa": modulus,
        "poissons_ratio": poisson,
        "density_kg_m3": float(density),
    }


def _short(number: float) -> float:
    return float(f"{number:.4g}")


def write_studies(seed: int, project: Project, numbers: range, slowest: float) -> None:
    """Write two studies per scene."""
    rng = np.random.default_rng(seed)
    for number in numbers:
        data = draw(rng, number, slowest)
        asked = {"tolerance": TOLERANCE, "quantity": QUANTITIES}
        _write(project, f"drawn-{number:02d}", {**data, "fidelity": asked})
        (case,) = project.cases(f"drawn-{number:02d}")
        stiff = {**plain_option(case).fidelity.plain(), "ranks": 1}
        seeds = [data["seed"] + 1 + one for one in range(REFERENCE_PACKINGS)]
        reference = {**data, "fidelity": stiff, "sweep": {"seed": seeds}}
        _write(project, f"drawn-{number:02d}-stiff", reference)


def _write(project: Project, name: str, data: dict[str, Any]) -> None:
    folder = project.studies / name
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "study.yaml").write_text(yaml.safe_dump(data, sort_keys=False))


def studies(project: Project) -> list[str]:
    """Names of the drawn scenes."""
    found = (file.parent.name for file in project.studies.glob("drawn-*/study.yaml"))
    return sorted(name for name in found if not name.endswith("-stiff"))


def folders(project: Project, name: str) -> dict[Path, Case]:
    """The folders of a study's process runs."""
    process = SCENES["process"]
    runs = by_run(project.cases(name), process).values()
    return {project.run_folder(case, process): case for case in runs}


def targets(project: Project) -> Iterator[tuple[str, str]]:
    """Each study with the files that its runs and windows end in."""
    for name in studies(project):
        for each in (name, f"{name}-stiff"):
            files = (folder / "tables/extrapolated.json" for folder in folders(project, each))
            yield each, " ".join(str(file.relative_to(project.root)) for file in files)


@dataclass(frozen=True)
class Reference:
    """A quantity over packings at the physical modulus: its mean and standard error."""

    mean: float
    se: float


def references(project: Project, name: str) -> tuple[dict[str, Reference], float]:
    """Quantities of the plain runs, and their mean CPU time."""
    values: dict[str, list[tuple[float, float]]] = {one: [] for one in QUANTITIES}
    cpu = []
    for folder, case in folders(project, f"{name}-stiff").items():
        if not (folder / "tables/extrapolated.json").is_file():
            continue
        along = quantities_along(folder, load_case(folder))
        for one in QUANTITIES:
            blocks = along.of_blocks(one)
            values[one].append((float(blocks.mean()), float(blocks.var(ddof=1)) / len(blocks)))
        own = RunRecord.read(folder / "run.json").processor_time_s
        cpu.append(own + _before(project, case, folder))
    found = {}
    for one, pairs in values.items():
        means, variances = (np.array(column) for column in zip(*pairs, strict=True))
        between = float(means.var(ddof=1)) if len(means) > 1 else 0.0
        variance = max(between, float(variances.mean())) / len(means)
        found[one] = Reference(float(means.mean()), math.sqrt(variance))
    return found, float(np.mean(cpu))


def _before(project: Project, case: Case, folder: Path) -> float:
    """CPU time of the filling, and of a softer run, that a run goes on from, s."""
    lead = load_case(folder).lead
    found = [SCENES["filling"].run_id(case)]
    runs = [project.results(case.study_name) / "filling" / one for one in found]
    runs += [folder.parent / lead] if lead else []
    return sum(RunRecord.read(run / "run.json").processor_time_s for run in runs)


def judge(projects: Sequence[Project], out: Path) -> None:
    """Write one row per scene and quantity, and beside it one row per quantity."""
    rows = [row for project in projects for row in _of_project(project)]
    table = pd.DataFrame(rows)
    table.to_csv(out, index=False)
    spread = np.hypot(table["half_width"] / NORMAL_QUANTILE, table["reference_se"])
    off = table["error"].abs() > TOLERANCE
    table = table.assign(
        kept=table["reached"] & ~off,
        off=np.where(table["reached"], table["error"].abs(), 0.0),
        by_chance=np.where(table["reached"], 2.0 * norm.sf(TOLERANCE / spread), 0.0),
        saving=table["plain_cpu_time_s"] / table["cpu_time_s"],
    )
    groups = table.groupby("quantity", sort=False)
    summary = groups.agg(
        scenes=("scene", "size"),
        reached=("reached", "sum"),
        kept=("kept", "sum"),
        by_chance=("by_chance", "sum"),
        largest=("off", "max"),
        error=("error", "mean"),
        error_se=("error", "sem"),
        covered=("covered", "sum"),
        saving_low=("saving", "min"),
        saving_median=("saving", "median"),
        saving_high=("saving", "max"),
    )
    summary.round(4).to_csv(out.with_name(f"{out.stem}_summary.csv"))
    print(summary.round(3).to_string())


def _of_project(project: Project) -> Iterator[dict[str, Any]]:
    record = WindowsRecord.read(project.root / "workflow/dragdeck/data/windows.json")
    for name in studies(project):
        if _finished(project, name):
            yield from _rows(project, name, record)


def _finished(project: Project, name: str) -> bool:
    """Whether the windows of a scene and at least one of its references are there."""
    own, other = (
        [folder / "tables/extrapolated.json" for folder in folders(project, each)]
        for each in (name, f"{name}-stiff")
    )
    return own[0].is_file() and any(file.is_file() for file in other)


def _rows(project: Project, name: str, record: WindowsRecord) -> Iterator[dict[str, Any]]:
    ((folder, case),) = folders(project, name).items()
    reference, plain = references(project, name)
    numbers = describe(case)
    shared = _before(project, case, folder)
    shared += RunRecord.read(folder / "run.json").processor_time_s
    rounds = sorted((folder / "windows").glob("round-*.json"))
    soft = quantities_along(folder, load_case(folder))
    for one in QUANTITIES:
        if rounds:
            every = max((Round.read(file) for file in rounds), key=lambda each: len(each.windows))
            last = _replayed(soft, every, one, record)
            found = next(row for row in last.quantities if row.name == one).value
            reached, count = last.tolerance.reached, len(last.windows)
            cpu = shared + sum(window.cpu_time_s for window in last.windows)
        else:
            known = Extrapolated.read(folder / "tables/extrapolated.json").of(one)
            assert known is not None and known.value is not None
            found, count, cpu = known.value, 0, shared
            reached = (found.ci95_high - found.ci95_low) / 2 <= TOLERANCE * abs(found.value)
        beside = reference[one]
        error = found.value / beside.mean - 1
        half = (found.ci95_high - found.ci95_low) / 2
        yield {
            "scene": name,
            "material": case.study.title.rsplit(" ", 1)[-1],
            "stiffness_number": round(numbers["stiffness_number"]),
            "inertial_number": round(numbers["inertial_number"], 4),
            "quantity": one,
            "windows": count,
            "reached": reached,
            "value": f"{found.value:.6g}",
            "half_width": round(half / abs(found.value), 4),
            "soft": f"{soft.values()[one]:.6g}",
            "reference": f"{beside.mean:.6g}",
            "reference_se": round(beside.se / abs(beside.mean), 4),
            "error": round(error, 4),
            "covered": abs(found.value - beside.mean) <= math.hypot(half, 1.96 * beside.se),
            "cpu_time_s": round(cpu, 1),
            "plain_cpu_time_s": round(plain, 1),
        }


def _replayed(soft: Any, every: Round, quantity: str, record: WindowsRecord) -> Round:
    """The last round if this quantity alone had been asked about."""
    count, most = 3, len(every.windows)
    while True:
        windows = every.windows[:count]
        found = judged(soft, windows, TOLERANCE, [quantity], most, record)
        if found.last:
            return found
        count = found.wanted


def main() -> None:
    """Draw scenes, list what is to be made of them, or judge them."""
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    drawing, listing, judging = map(commands.add_parser, ("draw", "targets", "judge"))
    drawing.add_argument("seed", type=int)
    for each in (drawing, listing):
        each.add_argument("project", type=Path)
    drawing.add_argument("--scenes", type=int, default=12)
    drawing.add_argument("--first", type=int, default=0, help="number of the first scene")
    drawing.add_argument("--slowest", type=float, default=SLOWEST, help="least inertial number")
    judging.add_argument("project", type=Path, nargs="+")
    judging.add_argument("out", type=Path)
    given = parser.parse_args()
    if given.command == "judge":
        judge([Project(each.resolve()) for each in given.project], given.out)
        return
    project = Project(given.project.resolve())
    if given.command == "draw":
        numbers = range(given.first, given.first + given.scenes)
        write_studies(given.seed, project, numbers, given.slowest)
    else:
        for name, files in targets(project):
            print(name, files)


if __name__ == "__main__":
    main()
