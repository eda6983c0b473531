"""What windows of other scenes say beforehand: workflow/dragdeck/data/windows.json.

    python benchmarks/windows_record.py

It reads the runs of designed scenes in docs/data/scenes (each scene at the physical Young's modulus
and at x 0.001, over one or more packings) and writes for each quantity the ratio of both values
between scenes, the ratio of the variances along the path, and the scatter between packings. A ratio
that differs from scene to scene by more than `LARGEST_STD` says too little to save windows.
"""

import json
import math
import tarfile
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from scipy.optimize import brentq
from scipy.special import polygamma

from dragchain.tradeoff.measures import QUANTITIES, Measurand
from dragchain.windows.estimate import Known, WindowsRecord

ROOT = Path(__file__).resolve().parent.parent
ARCHIVES = [ROOT / f"docs/data/scenes/{name}.tar.xz" for name in ("measures", "fresh")]
OUT = ROOT / "workflow/dragdeck/data/windows.json"

SOFT = 1e-3
LARGEST_STD = 0.08
MOST_DEGREES = 10.0
"""Windows' worth of evidence on a variance: never more, whatever the scenes agree on."""


@dataclass(frozen=True)
class RecordedRun:
    """A quantity of a run: its value, its relative variance along the path, and its blocks."""

    scene: str
    scale: float
    step: float
    value: float
    variance: float
    blocks: int


def runs(quantity: Measurand) -> Iterator[RecordedRun]:
    """The quantity in every complete run at the speed of its scene."""
    for archive in ARCHIVES:
        with tarfile.open(archive) as files:
            for member in files:
                stream = files.extractfile(member)
                if stream is None or not member.name.endswith(".json"):
                    continue
                run = json.load(stream)
                blocks = run.get("blocks", {}).get(quantity.name, [])
                if run["fidelity"]["speed_factor"] != 1 or len(blocks) < 2 or None in blocks:
                    continue
                values = quantity.rooted(np.array(blocks, dtype=np.float64))
                mean = abs(float(values.mean()))
                numbers = {key: one for key, one in run["numbers"].items() if key != "particles"}
                yield RecordedRun(
                    scene=f"{archive.name} {sorted(numbers.items())}",
                    scale=run["fidelity"]["youngs_modulus_scale"],
                    step=run["fidelity"]["timestep_fraction"],
                    value=mean,
                    variance=float(values.var(ddof=1)) / mean**2,
                    blocks=len(values),
                )


def known(quantity: Measurand) -> Known | None:
    """What the runs say of a quantity; None if too few scenes have it."""
    scenes = defaultdict[str, list[RecordedRun]](list)
    for run in runs(quantity):
        scenes[run.scene].append(run)
    pairs = [
        (stiff, soft)
        for every in scenes.values()
        if (stiff := [run for run in every if run.scale == 1.0])
        and (soft := [run for run in every if math.isclose(run.scale, SOFT, rel_tol=0.1)])
    ]
    if len(pairs) < 5:
        return None
    ratios = [math.log(_mean(stiff) / _mean(soft)) for stiff, soft in pairs]
    noise = np.mean([_variance_of_mean(stiff) + _variance_of_mean(soft) for stiff, soft in pairs])
    between = max(float(np.var(ratios, ddof=1) - noise), 0.0) + float(noise) / len(pairs)
    std = math.sqrt(between * (1 + 1 / len(pairs)))
    logs = [math.log(_pooled(stiff) / _pooled(soft)) for stiff, soft in pairs]
    chance = np.mean([_log_variance(stiff) + _log_variance(soft) for stiff, soft in pairs])
    return Known(
        ratio_log=round(float(np.mean(ratios)), 4),
        ratio_log_std=round(std, 4) if std <= LARGEST_STD and not quantity.signed else math.inf,
        variance_ratio=round(math.exp(float(np.mean(logs))), 3),
        degrees=round(_degrees(float(np.var(logs, ddof=1) - chance)), 1),
        packing_std=round(_between_packings(scenes.values()), 4),
    )


def _mean(every: Sequence[RecordedRun]) -> float:
    return float(np.mean([run.value for run in every]))


def _variance_of_mean(every: Sequence[RecordedRun]) -> float:
    return float(np.mean([run.variance / run.blocks for run in every])) / len(every)


def _pooled(every: Sequence[RecordedRun]) -> float:
    return float(np.mean([run.variance for run in every]))


def _log_variance(every: Sequence[RecordedRun]) -> float:
    """Variance of the logarithm of a variance with so many degrees of freedom."""
    return float(polygamma(1, sum(run.blocks - 1 for run in every) / 2))


def _degrees(excess: float) -> float:
    """Degrees of freedom of a variance whose logarithm has this variance."""
    least, most = 1.0, MOST_DEGREES
    if polygamma(1, most / 2) >= excess:
        return most
    return float(brentq(lambda degrees: polygamma(1, degrees / 2) - excess, least / 2, most))


def _between_packings(scenes: Iterable[list[RecordedRun]]) -> float:
    """Relative standard deviation of a mean between packings beyond that along the path."""
    squares, degrees = 0.0, 0
    for every in scenes:
        groups = defaultdict[tuple[float, float], list[RecordedRun]](list)
        for run in every:
            groups[run.scale, run.step].append(run)
        for group in groups.values():
            if len(group) > 1:
                values = np.array([run.value for run in group]) / _mean(group)
                within = np.mean([run.variance / run.blocks for run in group])
                squares += float(values.var(ddof=1) - within) * (len(group) - 1)
                degrees += len(group) - 1
    return math.sqrt(max(squares / degrees, 0.0))


def main() -> None:
    """Write the record."""
    found = {one.name: row for one in QUANTITIES if (row := known(one)) is not None}
    WindowsRecord(
        measured=datetime.now(UTC).date().isoformat(),
        source=f"designed scenes at E x 1 and E x {SOFT:g}, docs/data/scenes",
        quantities=found,
    ).write(OUT)
    for name, row in found.items():
        print(name, row)


if __name__ == "__main__":
    main()
