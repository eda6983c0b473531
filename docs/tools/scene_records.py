"""Tables from the measures of many scenes: python docs/tools/scene_records.py.

The archives ``docs/data/scenes/*.tar.xz`` contain the ``measures.json`` of each run. What pages
show of them, and neither ``promises.json`` nor ``stiffness.json`` contains, becomes a CSV beside
them.
"""

import json
import math
import tarfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from statistics import median

import numpy as np
import pandas as pd
from dragchain.tradeoff.stiffness_document import LawEntry, StiffnessRecord
from dragchain.tradeoff.stiffness_errors import errors_entry, scaled_runs
from dragchain.tradeoff.stiffness_law import left_out

from dragchain.arrays import Floats
from dragchain.tradeoff.measures import Measures, RunCost
from dragchain.tradeoff.quantities import QUANTITIES
from dragchain.tradeoff.runs import by_scene

ROOT = Path(__file__).resolve().parents[2]
SCENES = ROOT / "docs/data/scenes"

Row = dict[str, object]

REDUCED = (0.01, 0.001)

PLANNED = 175
"""Runs of `fresh` with the law of the stable step of that time; the others followed a new fit."""


def _laws() -> Mapping[str, LawEntry]:
    return StiffnessRecord.read(ROOT / "workflow/dragdeck/data/stiffness.json").laws


@cache
def runs_of(name: str) -> list[Measures]:
    """The complete and the rejected runs of an archive, in its order."""
    with tarfile.open(SCENES / f"{name}.tar.xz") as archive:
        files = sorted(archive.getnames())
        texts = [archive.extractfile(file).read() for file in files]  # type: ignore[union-attr]
    return [Measures.model_validate(json.loads(text)) for text in texts]


def merged() -> Iterator[Row]:
    """Changes by a reduced modulus in the scene of the trade-off, as they are and extrapolated."""
    laws = _laws()
    runs = runs_of("merged")
    for quantity in QUANTITIES:
        known, found = laws.get(quantity.name), scaled_runs(runs, quantity)
        if known is None or found is None:
            continue
        values = np.exp(found.logarithms)
        (full,) = values[found.scales == 1.0]
        for scale in REDUCED:
            own = values[found.scales == scale]
            at_full = [
                known.at_physical_modulus(one, runs[0].numbers, scale, found.path_to_particle)
                for one in own
            ]
            yield {
                "quantity": quantity.name,
                "youngs_modulus_scale": scale,
                "runs": len(own),
                "change": own.mean() / full - 1,
                "corrected": np.mean([math.exp(one.logarithm) for one in at_full]) / full - 1,
                "half_width": at_full[0].half_width(known.quantile),
            }


def costs(name: str, scenes: Sequence[Sequence[Measures]]) -> Iterator[Row]:
    """By how much steps and CPU time fall with a reduced modulus, scene by scene; one rank each."""
    for own in scenes:
        full = _costs(own, 1.0)
        settings = {
            (run.fidelity.youngs_modulus_scale, run.fidelity.timestep_fraction)
            for run in own
            if run.complete and run.fidelity.youngs_modulus_scale < 1.0
        }
        for scale, step in sorted(settings):
            reduced = _costs(own, scale, step)
            ranks = {one.ranks for one in (*full, *reduced)}
            yield {
                "archive": name,
                "inertial_number": own[0].numbers["inertial_number"],
                "youngs_modulus_scale": scale,
                "timestep_fraction": step,
                "steps_ratio": _ratio(full, reduced, "steps_per_m"),
                "cpu_time_ratio": _ratio(full, reduced, "cpu_per_m") if ranks == {1} else math.nan,
                "cpu_time_full_s": median(one.cpu_time_s for one in full),
                "cpu_time_reduced_s": median(one.cpu_time_s for one in reduced),
            }


def _costs(runs: Sequence[Measures], scale: float, step: float | None = None) -> list[RunCost]:
    return [
        run.cost
        for run in runs
        if run.complete
        and run.fidelity.youngs_modulus_scale == scale
        and step in (None, run.fidelity.timestep_fraction)
    ]


def _ratio(full: Sequence[RunCost], reduced: Sequence[RunCost], name: str) -> float:
    own, other = (median(getattr(one, name) for one in costs) for costs in (full, reduced))
    return own / other


def load_maps(scenes: Sequence[Sequence[Measures]]) -> Iterator[Row]:
    """How far load maps differ in new scenes: sums over the bins of the absolute difference."""
    maps = []
    for own in scenes:
        found: dict[float, list[Floats]] = {}
        for run in own:
            if run.complete and sum(run.load_map) > 0.0:
                shares = np.array(run.load_map) / sum(run.load_map)
                found.setdefault(run.fidelity.youngs_modulus_scale, []).append(shares)
        if {*REDUCED, 1.0} <= found.keys():
            maps.append(found)
    yield {
        "what": "two pairs of runs with one modulus",
        "youngs_modulus_scale": 1.0,
        "scenes": len(maps),
        "runs": 2,
        "distance": np.mean([_between_pairs(one[1.0]) for one in maps]),
    }
    for scale in REDUCED:
        yield {
            "what": "four runs with each modulus",
            "youngs_modulus_scale": scale,
            "scenes": len(maps),
            "runs": 4,
            "distance": np.mean([_distance(one[scale][:4], one[1.0][:4]) for one in maps]),
        }
        own, full = ([np.mean(one[at], axis=0) for one in maps] for at in (scale, 1.0))
        yield {
            "what": "mean of all runs and scenes",
            "youngs_modulus_scale": scale,
            "scenes": len(maps),
            "runs": sum(len(one[scale]) for one in maps),
            "distance": _distance(own, full),
        }


def _distance(one: Sequence[Floats], other: Sequence[Floats]) -> float:
    return float(np.abs(np.mean(one, axis=0) - np.mean(other, axis=0)).sum())


def _between_pairs(maps: Sequence[Floats]) -> float:
    """Between the means of two pairs of four maps, over the three ways to pair them."""
    first, second, third, fourth = maps[:4]
    pairs = (
        ([first, second], [third, fourth]),
        ([first, third], [second, fourth]),
        ([first, fourth], [second, third]),
    )
    return float(np.mean([_distance(*pair) for pair in pairs]))


def outcomes() -> Iterator[Row]:
    """How many runs of each archive the acceptance checks rejected, by the reason."""
    for name in ("measures", "fresh", "merged"):
        runs = runs_of(name)
        for part, own in (("", runs[:PLANNED]), ("refitted law", runs[PLANNED:])):
            failures = [run.telling_failure for run in own if not run.complete]
            checks = Counter(one.name for one in failures if one is not None)
            if own:
                yield {
                    "archive": name,
                    "part": part,
                    "check": "any",
                    "runs": len(own),
                    "rejected": len(failures),
                }
            for check, count in checks.items():
                yield {
                    "archive": name,
                    "part": part,
                    "check": check,
                    "runs": len(own),
                    "rejected": count,
                }


def friction_of_sliding() -> Iterator[Row]:
    """Errors of the sliding distance in scenes left out, by the friction in its law."""
    scenes = [own for _, own in by_scene(runs_of("measures"))]
    sliding = next(one for one in QUANTITIES if one.name == "sliding_distance")
    for friction in ("workpiece_friction", "particle_friction"):
        found = [
            one for own in scenes if (one := scaled_runs(own, replace(sliding, friction=friction)))
        ]
        plans = ({0.001: 1}, {0.01: 1})
        for plan, errors in zip(plans, left_out(found, plans), strict=True):
            entry = errors_entry(sliding, plan, errors, 2.0)
            yield {
                "friction": friction,
                "youngs_modulus_scale": min(plan),
                "root_mean_square": entry.root_mean_square,
            }


def main() -> None:
    """Write every table."""
    designed = [own for _, own in by_scene(runs_of("measures"))]
    fresh = [own for _, own in by_scene(runs_of("fresh")[:PLANNED])]
    tables = {
        "merged": merged(),
        "costs": [
            *costs("measures", designed),
            *costs("fresh", fresh),
            *costs("merged", [runs_of("merged")]),
        ],
        "load_maps": load_maps(fresh),
        "outcomes": outcomes(),
        "friction_of_sliding": friction_of_sliding(),
    }
    for name, rows in tables.items():
        pd.DataFrame(rows).to_csv(SCENES / f"{name}.csv", index=False, float_format="%.6g")


if __name__ == "__main__":
    main()
