"""Ranks, orientation, altitude and lifetime of the dominant chains, at peaks and at all times."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import CensoredData, ecdf

from dragchain.arrays import Floats
from dragchain.documents import Part
from dragchain.statistics.estimate import Estimate, Real, mean_of
from evidence.validation.peaks.run_series import PeakRule, RunSeries
from evidence.validation.peaks.tests import mean_of_known

TOP = 0.95
"""Quantile of a run's chains above which one is among the strongest."""


class Ranks(Part):
    """How the chain of every peak's frame ranks among the chains of all frames of its run.

    Attributes
    ----------
    rank : sequence of float
        Of each peak, the fraction of the run's frames with a weaker chain (weakest contact over
        the mean).
    mean, above_half, top : float
        Their mean and the fractions of peaks above 1/2 and above `TOP`, by chance 1/2, 1/2 and
        1 - `TOP`.
    """

    rank: tuple[float, ...]
    mean: Real
    above_half: Real
    top: Real


class Directions(Part):
    """Orientation and altitude of the dominant chains.

    Every estimate is a mean over the runs with its interval over them. The angles are those of the
    line from the workpiece; azimuths count from the direction of motion to its left.
    """

    frames: int
    azimuth_mean_rad: Real
    resultant: Estimate
    inclination_mean_rad: Estimate
    inclination_std_rad: Estimate
    altitude_mean_m: Estimate
    altitude_std_m: Estimate


class Geometry(Part):
    """Orientation and altitude at the frames nearest to the peaks, and at all times."""

    at_peaks: Directions
    at_all_times: Directions


class Survival(Part):
    """Fraction of lives that last longer than a time (Kaplan and Meier 1958)."""

    time_s: tuple[float, ...]
    fraction: tuple[float, ...]
    median_s: Real


class Lifetimes(Part):
    """How long the dominant chain stays the same, each life once, and as seen at a moment.

    A life that touches the first or the last frame is ``truncated``: its end is unknown.
    What is seen at a moment is more often a long life than a short one; peaks are to be compared
    with moments, not with lives.
    """

    lives: int
    truncated: int
    median_s: Real
    longest_s: float
    survival: Survival
    seen_at_peaks_s: Estimate
    seen_at_all_times_s: Estimate


def ranks(runs: Sequence[RunSeries], at: int, rule: PeakRule = "all") -> Ranks:
    """Rank the chains of the peaks by one of `PEAK_RULES`."""
    rank = np.concatenate([run.ranks(at)[run.events(rule)] for run in runs])
    return Ranks(
        rank=tuple(rank.tolist()),
        mean=mean_of_known(rank),
        above_half=mean_of_known(rank > 0.5),
        top=mean_of_known(rank > TOP),
    )


def geometry(runs: Sequence[RunSeries], at: int) -> Geometry:
    """Orientation and altitude for a place in `SETTINGS`."""
    return Geometry(at_peaks=_directions(runs, at, True), at_all_times=_directions(runs, at, False))


def _directions(runs: Sequence[RunSeries], at: int, at_peaks: bool) -> Directions:
    azimuths, slopes, heights = (
        [_chosen(run, at, name, at_peaks) for run in runs]
        for name in ("azimuth_rad", "inclination_rad", "altitude_m")
    )
    turns = [np.exp(1j * azimuth) for azimuth in azimuths]
    all_turns = np.concatenate(turns)
    return Directions(
        frames=len(all_turns),
        azimuth_mean_rad=float(np.angle(all_turns.mean())) if len(all_turns) else np.nan,
        resultant=mean_of([abs(t.mean()) if len(t) else np.nan for t in turns]),
        inclination_mean_rad=_over_runs(mean_of_known, slopes),
        inclination_std_rad=_over_runs(_std, slopes),
        altitude_mean_m=_over_runs(mean_of_known, heights),
        altitude_std_m=_over_runs(_std, heights),
    )


def _chosen(run: RunSeries, at: int, name: str, at_peaks: bool) -> Floats:
    """A number of the chains of all frames that have one, or of those nearest to the peaks."""
    kept = run.chain(at, "exists") > 0.0
    if at_peaks:
        kept &= np.isin(np.arange(len(kept)), run.events("all"))
    return run.chain(at, name)[kept]


def _over_runs(statistic: Callable[[Floats], float], parts: Sequence[Floats]) -> Estimate:
    return mean_of([statistic(part) for part in parts])


def _std(values: Floats) -> float:
    return float(values.std(ddof=1)) if len(values) > 1 else float("nan")


def lifetimes(runs: Sequence[RunSeries], at: int) -> Lifetimes:
    """Lifetimes for a place in `SETTINGS`."""
    durations, truncated = _each_life(runs, at)
    survival = _kaplan_meier(durations, truncated)

    def seen(at_peaks: bool) -> Estimate:
        return _over_runs(mean_of_known, [_chosen(run, at, "life_s", at_peaks) for run in runs])

    return Lifetimes(
        lives=len(durations),
        truncated=int(truncated.sum()),
        median_s=survival.median_s,
        longest_s=float(durations.max(initial=0.0)),
        survival=survival,
        seen_at_peaks_s=seen(True),
        seen_at_all_times_s=seen(False),
    )


def _each_life(runs: Sequence[RunSeries], at: int) -> tuple[Floats, NDArray[np.bool_]]:
    """Duration of every life, and whether an end of its run cut it off."""
    durations, truncated = [], []
    for run in runs:
        chains = run.chains[at]
        first = chains[chains["life"] >= 0].drop_duplicates("life")
        durations.append(first["life_s"].to_numpy(np.float64))
        truncated.append(first["truncated"].to_numpy(bool))
    return np.concatenate(durations), np.concatenate(truncated)


def _kaplan_meier(durations: Floats, truncated: NDArray[np.bool_]) -> Survival:
    if not durations.size:
        return Survival(time_s=(), fraction=(), median_s=np.nan)
    data = CensoredData(uncensored=durations[~truncated], right=durations[truncated])
    survival = ecdf(data).sf
    times, fractions = survival.quantiles, survival.probabilities
    below = np.flatnonzero(fractions <= 0.5)
    return Survival(
        time_s=tuple(times.tolist()),
        fraction=tuple(fractions.tolist()),
        median_s=float(times[below[0]]) if below.size else np.nan,
    )
