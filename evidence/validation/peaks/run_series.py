"""Frames and peaks of a process run, with the dominant chain of every frame."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from evidence.validation.peaks.shift_test import Window, shifted_means

REACH_S = 0.02
"""Frames within this time of a peak count as at the peak."""

DISTINCT_STDS = 1.0
"""A peak is distinct if its resistance is this many standard deviations above the mean."""

AVERAGED_S = 0.05
"""Slow peaks are those of the drag averaged over this time: many times the period at which stiff
particles vibrate, and a tenth of a particle diameter of path in the study of the paper."""

PeakRule = Literal["all", "distinct", "slow"]
PEAK_RULES: tuple[PeakRule, ...] = ("all", "distinct", "slow")


@dataclass(frozen=True)
class RunSeries:
    """Frames and peaks of a run.

    Attributes
    ----------
    run, label : str
        The run id and the case's readable name.
    time_s : (N,) ndarray
        Process times of the network frames.
    resistance_n : (N,) ndarray
        Minus the drag there.
    peaks : DataFrame
        ``frame`` (the nearest), ``process_time_s``, ``drag_n``, ``prominence_n``, ``distinct``.
    slow : DataFrame
        The same of the peaks of the drag averaged over `AVERAGED_S`.
    separation_s : float
        Least time between peaks.
    sense : int
        +1 if the workpiece runs counter-clockwise, so that the bowl's side is on its right, -1 the
        other way round, 0 on a line.
    chains : sequence of DataFrame
        For each of `SETTINGS`, the numbers of `frame_table`, one row per frame.
    """

    run: str
    label: str
    time_s: Floats
    resistance_n: Floats
    peaks: pd.DataFrame
    slow: pd.DataFrame
    separation_s: float
    sense: int
    chains: tuple[pd.DataFrame, ...]

    @property
    def interval_s(self) -> float:
        """Time between frames."""
        return float(np.median(np.diff(self.time_s)))

    def chain(self, at: int, name: str) -> Floats:
        """A number of the dominant chain for a place in `SETTINGS`, (N,)."""
        return self.chains[at][name].to_numpy(np.float64)

    def strength(self, at: int) -> Floats:
        """Weakest contact of the chain over the frame's mean, 0 in a frame without a chain."""
        return np.nan_to_num(self.chain(at, "bottleneck_over_mean"))

    def ranks(self, at: int) -> Floats:
        """Fraction of the run's frames with a weaker chain than each frame's, (N,)."""
        strength = self.strength(at)
        return np.asarray(np.searchsorted(np.sort(strength), strength) / len(strength))

    def events(self, rule: PeakRule) -> Ints:
        """Frames of the peaks by one of `PEAK_RULES`."""
        peaks = self.slow if rule == "slow" else self.peaks
        kept = peaks[peaks["distinct"]] if rule == "distinct" else peaks
        return kept["frame"].to_numpy(np.int64)

    def window(self, first_s: float, last_s: float) -> Window:
        """Frames between two times after a peak."""
        return Window(round(first_s / self.interval_s), round(last_s / self.interval_s))

    def around_peaks(
        self, series: Floats, rule: PeakRule, first_s: float = -REACH_S, last_s: float = REACH_S
    ) -> Floats:
        """Mean of a series around the peaks, for every circular shift of them, (N,)."""
        return shifted_means(series, self.events(rule), self.window(first_s, last_s))


def rules_of(runs: Sequence[RunSeries]) -> list[PeakRule]:
    """Those of `PEAK_RULES` by which every run has a peak."""
    return [rule for rule in PEAK_RULES if all(run.events(rule).size for run in runs)]
