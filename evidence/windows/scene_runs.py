"""Whole runs of designed scenes, and the blocks of a quantity along their paths."""

import math
import tarfile
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from dragchain.arrays import Floats
from dragchain.quantities.document import RunQuantities
from dragchain.quantities.registry import Quantity

_SOFT = 1e-3


class SceneRun(RunQuantities):
    """The quantities of a run, with the number of the acceptance check of the time step."""

    stability_number: float | None = None


Scenes = Sequence[Sequence[SceneRun]]
"""The runs of each scene."""


def read_archive(archive: Path) -> Iterator[tuple[Path, SceneRun]]:
    """The runs of an archive, each with the path of its file in it."""
    with tarfile.open(archive) as files:
        for member in files:
            if stream := files.extractfile(member):
                yield Path(member.name), SceneRun.model_validate_json(stream.read())


def read_scenes(archives: Sequence[Path]) -> Scenes:
    """All runs, by what tells one scene from another: archive and dimensionless numbers."""
    scenes = defaultdict[object, list[SceneRun]](list)
    for archive in archives:
        for _, run in read_archive(archive):
            numbers = {name: value for name, value in run.numbers.items() if name != "particles"}
            scenes[archive, frozenset(numbers.items())].append(run)
    return list(scenes.values())


def last_day(scenes: Sequence[Sequence[RunQuantities]]) -> str:
    """Date on which the last run was started."""
    return max(run.started for runs in scenes for run in runs)[:10]


@dataclass(frozen=True)
class QuantityOfRun:
    """The blocks of a quantity along the path of a run, (B,)."""

    run: SceneRun
    blocks: Floats

    @cached_property
    def value(self) -> float:
        """Magnitude of the mean."""
        return abs(float(self.blocks.mean()))

    @cached_property
    def variance(self) -> float:
        """Of a block, relative to the square of the mean."""
        return float(self.blocks.var(ddof=1)) / self.value**2

    @property
    def variance_of_mean(self) -> float:
        """Relative variance of the mean, for blocks that are independent."""
        return self.variance / len(self.blocks)


def is_soft(run: SceneRun) -> bool:
    """Whether it has the modulus of soft runs."""
    return math.isclose(run.fidelity.youngs_modulus_scale, _SOFT, rel_tol=0.1)


def runs_with(quantity: Quantity, runs: Sequence[SceneRun]) -> list[QuantityOfRun]:
    """The accepted runs at the speed of their scene in which every block has the quantity."""
    plain = [run for run in runs if run.fidelity.speed_factor == 1 and run.complete]
    blocks = [run.of_blocks(quantity.name).values for run in plain]
    rows = [
        QuantityOfRun(run, np.sqrt(of) if quantity.squared else of)
        for run, of in zip(plain, blocks, strict=True)
    ]
    return [row for row in rows if len(row.blocks) > 1 and np.isfinite(row.blocks).all()]


def mean_attribute(runs: Sequence[QuantityOfRun], name: str) -> float:
    """Mean of an attribute over runs."""
    return float(np.mean([getattr(run, name) for run in runs]))


def variance_of_mean(runs: Sequence[QuantityOfRun]) -> float:
    """Relative variance of the mean over runs."""
    return mean_attribute(runs, "variance_of_mean") / len(runs)
