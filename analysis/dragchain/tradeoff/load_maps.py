"""Where a workpiece is loaded, with reduced and with the physical Young's modulus."""

from collections.abc import Iterator, Sequence

import numpy as np

from dragchain.arrays import Floats
from dragchain.documents import Part
from dragchain.tradeoff.measures import Measures
from dragchain.tradeoff.six_digits import Number, SixDigits


class LoadMapEntry(Part):
    """How far load maps differ: sums over bins of the absolute difference of fractions of the load.

    Attributes
    ----------
    scale : float
        Factor on Young's modulus.
    scenes : int
    distance : float
        Between a run with it and one with the physical modulus, mean over scenes.
    by_chance : float or None
        Between two runs with it, mean over scenes; None if no scene has two.
    of_means : float
        Between the mean maps of all scenes: chance has less part in it.
    """

    scale: SixDigits
    scenes: int
    distance: SixDigits
    by_chance: Number
    of_means: SixDigits


def compare_load_maps(scenes: Sequence[Sequence[Measures]]) -> list[LoadMapEntry]:
    """Load maps at each reduced modulus against those with the physical one, scene by scene."""
    maps = [_maps(everyone) for everyone in scenes]
    scales = sorted({scale for own in maps for scale in own if scale != 1.0}, reverse=True)
    return [entry for scale in scales for entry in _entry(maps, scale)]


def _maps(runs: Sequence[Measures]) -> dict[float, list[Floats]]:
    """Shares of the load in each bin, (48,), of every run, by modulus scale."""
    found: dict[float, list[Floats]] = {}
    for run in runs:
        if run.complete and sum(run.load_map) > 0.0:
            shares = np.array(run.load_map) / sum(run.load_map)
            found.setdefault(run.fidelity.youngs_modulus_scale, []).append(shares)
    return found


def _entry(maps: Sequence[dict[float, list[Floats]]], scale: float) -> Iterator[LoadMapEntry]:
    known = [own for own in maps if scale in own and 1.0 in own]
    if not known:
        return
    twice = [_distance(own[scale][0], own[scale][1]) for own in known if len(own[scale]) > 1]
    means = [np.mean([np.mean(own[at], axis=0) for own in known], axis=0) for at in (scale, 1.0)]
    yield LoadMapEntry(
        scale=scale,
        scenes=len(known),
        distance=float(np.mean([_distance(own[scale][0], own[1.0][0]) for own in known])),
        by_chance=float(np.mean(twice)) if twice else None,
        of_means=_distance(*means),
    )


def _distance(one: Floats, other: Floats) -> float:
    return float(np.abs(one - other).sum())
