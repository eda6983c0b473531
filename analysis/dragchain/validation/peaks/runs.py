"""A process run as the peaks of its drag and the dominant chains of its network frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from scipy.ndimage import uniform_filter1d

from dragchain.arrays import Floats, Ints
from dragchain.drag.force import read_counted
from dragchain.drag.peaks import find_drag_peaks, peak_separation_s
from dragchain.errors import TableError
from dragchain.run.case import Circle, load_case
from dragchain.run.kinematics import drag_start_s
from dragchain.statistics.shift_test import Window, shifted_means
from dragchain.validation.peaks.dominant_chain import frame_table
from dragchain.validation.peaks.settings import SETTINGS

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


def read_run(run_dir: Path) -> RunSeries:
    """Read a process run with its tables and describe the chains of its frames.

    Raises
    ------
    TableError
        If a table is missing, or the drag has no peak.
    """
    case = load_case(run_dir)
    samples = read_counted(run_dir, ("time_s", "drag_n"))
    chains = tuple(
        part.drop(columns=["setting", "step"]).reset_index(drop=True)
        for _, part in frame_table(run_dir).groupby("setting", sort=True)
    )
    start_s = drag_start_s(case)
    time_s = chains[0]["time_s"].to_numpy(np.float64) - start_s
    sample_s = samples["time_s"].to_numpy(np.float64) - start_s
    drag = samples["drag_n"].to_numpy(np.float64)
    separation = peak_separation_s(case)
    peaks = peak_table(sample_s, drag, time_s, separation)
    if peaks.empty:
        raise TableError(
            f"{run_dir}: the drag has no peak, so there is nothing to explain; drag for longer"
        )
    return RunSeries(
        run=case.run,
        label=case.case or case.run,
        time_s=time_s,
        resistance_n=-np.interp(time_s, sample_s, drag),
        peaks=peaks,
        slow=peak_table(sample_s, averaged(sample_s, drag), time_s, separation),
        separation_s=separation,
        sense=case.motion.sign if isinstance(case.motion, Circle) else 0,
        chains=chains,
    )


def averaged(time_s: Floats, series: Floats) -> Floats:
    """A series at equal intervals, (N,), averaged over `AVERAGED_S` about every sample."""
    width = max(1, round(AVERAGED_S / float(np.median(np.diff(time_s)))))
    return np.asarray(uniform_filter1d(series, width, mode="nearest"), dtype=np.float64)


def peak_table(
    sample_s: Floats, drag_n: Floats, frame_s: Floats, separation_s: float
) -> pd.DataFrame:
    """Find the peaks by the rule of `find_drag_peaks`, and the network frame nearest to each."""
    peaks = find_drag_peaks(sample_s, drag_n, min_separation_s=separation_s)
    level = float((-drag_n).mean() + DISTINCT_STDS * drag_n.std(ddof=1))
    return pd.DataFrame(
        {
            "frame": np.abs(frame_s[None, :] - peaks.time_s[:, None]).argmin(axis=1),
            "process_time_s": peaks.time_s,
            "drag_n": peaks.drag_n,
            "prominence_n": peaks.prominence_n,
            "distinct": -peaks.drag_n > level,
        }
    )


def rules_of(runs: Sequence[RunSeries]) -> list[PeakRule]:
    """Those of `PEAK_RULES` by which every run has a peak."""
    return [rule for rule in PEAK_RULES if all(run.events(rule).size for run in runs)]


def peak_rows(runs: Sequence[RunSeries]) -> pd.DataFrame:
    """One row per peak and setting: the peak, and the chain of the nearest frame.

    ``rank`` is the fraction of the run's frames whose chain has a smaller bottleneck over the mean
    contact force; frames without a chain come first.
    """
    parts = []
    for run in runs:
        frames = run.events("all")
        for at, setting in enumerate(SETTINGS):
            peaks = run.peaks.assign(
                **vars(setting), thresholds=setting.label, default=setting.default
            )
            peaks["rank"] = run.ranks(at)[frames]
            peaks.insert(0, "run", run.run)
            peaks.insert(1, "peak", range(len(peaks)))
            chains = run.chains[at].iloc[frames].reset_index(drop=True)
            parts.append(pd.concat([peaks, chains], axis=1))
    return pd.concat(parts, ignore_index=True)
