"""Do chains explain the peaks of the drag? The paper's claim, test by test.

Uhlmann et al. (2015, section 5) say that the peaks of the drag are caused by contact chains
between workpiece and bowl. What can be tested without circular reasoning is limited: the force of
a chain on the workpiece is a part of the drag, so it is high at a peak by construction. Every test
therefore says how much of that is in its number (`built_in`), and the verdicts rest on those free
of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.ndimage import uniform_filter1d
from scipy.signal import find_peaks
from scipy.stats import CensoredData, ecdf

from dragchain.arrays import Floats, Ints
from dragchain.drag.force import read_counted
from dragchain.drag.peaks import find_drag_peaks, peak_separation_s
from dragchain.errors import TableError
from dragchain.run.case import Circle, load_case
from dragchain.run.kinematics import drag_start_s
from dragchain.statistics.association import near_any
from dragchain.statistics.estimate import finite
from dragchain.statistics.shift_test import (
    ShiftTest,
    Window,
    band,
    draw_shifts,
    holm,
    interval,
    joint,
    shift_test,
    shifted_means,
    standardised,
)
from dragchain.validation.peaks.dominant_chain import DEFINITIONS, SETTINGS, Setting, frame_table
from dragchain.validation.peaks.words import answer

SCHEMA = 2
REACH_S = 0.02
"""Frames within this time of a peak count as at the peak."""

ASIDE_S = (0.05, 0.15)
"""Stretch before, and after, a peak that are compared with each other."""

LAG_S = 0.5
"""Event-triggered averages reach this far before and after a peak."""

NEAR_S = 0.05
"""A strong chain within this time of a peak counts as together with it."""

STRONG_STDS = 1.0
"""A chain is strong if its weakest contact over the frame's mean is this many standard deviations
above the mean of the run; frames without a chain count as 0."""

TOP = 0.95
"""Quantile of a run's chains above which one is among the strongest."""

DISTINCT_STDS = 1.0
"""A peak is distinct if its resistance is this many standard deviations above the mean."""

LEVEL = 0.05
SMALL = 0.2
"""An effect below this many standard deviations is small (Cohen 1988)."""

AVERAGED_S = 0.05
"""Slow peaks are those of the drag averaged over this time: many times the period at which stiff
particles vibrate, and a tenth of a particle diameter of path in the study of the paper."""

PEAK_RULES = ("all", "distinct", "slow")

Found = dict[str, Any]


@dataclass(frozen=True)
class Descriptor:
    """A number of the dominant chain that is compared between peaks and other times.

    Attributes
    ----------
    name, label : str
        Its column and its name on the page.
    statement : str
        The statement of the paper that it tests; empty if none.
    claim : int
        +1 or -1 if the paper's claim has it larger or smaller at peaks, else 0.
    built_in : mapping of str to str
        For every definition, how much of the drag is in the number: `value` (a force on the
        workpiece is in it), `choice` (it decides only which chain counts), `against` (the drag
        divides it, which works against the claim) or `none`.
    """

    name: str
    label: str
    statement: str
    claim: int
    built_in: Mapping[str, str]


def _levels(widest_path: str, free_path: str, peters: str) -> dict[str, str]:
    return {
        "widest_path": widest_path,
        "free_path": free_path,
        "peters": peters,
        "peters_workpiece": peters,
    }


_FREE = _levels("choice", "none", "choice")
_HELD = _levels("value", "none", "choice")

DESCRIPTORS = (
    Descriptor("exists", "there is one", "presence", 1, _HELD),
    Descriptor("bottleneck_over_mean", "weakest contact / mean contact", "presence", 1, _HELD),
    Descriptor("outer_over_mean", "weakest beyond 1st link / mean", "presence", 1, _FREE),
    Descriptor("stands_out", "weakest behind workpiece / shell rms", "dominance", 1, _FREE),
    Descriptor(
        "bottleneck_over_drag", "weakest contact / drag", "dominance", 1,
        dict.fromkeys(DEFINITIONS, "against"),
    ),
    Descriptor(
        "workpiece_fraction", "share of the drag at its workpiece contact", "dominance", 1,
        dict.fromkeys(DEFINITIONS, "value"),
    ),
    Descriptor("left_s", "time until it ends in s", "breaking", -1, _FREE),
    Descriptor("life_s", "lifetime in s", "", 0, _FREE),
    Descriptor("particles", "number of particles", "", 0, _FREE),
    Descriptor("straightness", "straightness", "", 0, _FREE),
    Descriptor("angle_rad", "angle to the motion in rad", "", 0, _FREE),
    Descriptor("altitude_m", "altitude in m", "", 0, _FREE),
)  # fmt: skip

STATEMENTS = {
    "presence": "At a peak of the drag there is a stronger chain from workpiece to bowl "
    "than at other "
    "times.",
    "dominance": "That chain stands out: it is stronger than the general rise of the forces around "
    "the workpiece explains.",
    "order": "The chain builds up before the peak more than it lasts after it.",
    "breaking": "The chain of a peak ends sooner than the chain of any other time.",
    "coverage": "Most peaks come with a strong chain.",
    "reverse": "Most strong chains come with a peak.",
    "orientation": "The chains of peaks share one orientation in the xy plane more than the chains "
    "of other times.",
}

RULE = (
    "A statement is judged by its tests at the default thresholds that hold no force on the "
    "workpiece; "
    "for a definition without such a test, by those in which it only decides which chain counts. "
    f"Supported: at least one has a p-value below {LEVEL:g} after Holm's adjustment for all tests "
    "of claims, and the sign claimed at most thresholds; a statement about most peaks or most "
    "chains must also find a share above one half. Proved: all of them hold no "
    "force on the workpiece and have it at every threshold, and their 95 % intervals "
    "over the fills "
    "exclude a zero effect. Refuted: none has, and the "
    f"interval over the fills of each lies below {SMALL:g} standard deviations (of a share, below "
    "one half; of the orientation, below chance). Not supported: anything else. A ratio with the "
    "drag below the line can support a statement, for it errs against the claim, but not refute it."
)


# --- reading ---------------------------------------------------------------------------------


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
    columns : sequence of mapping
        For each of `SETTINGS`, the numbers of `frame_table` by name, (N,) each.
    """

    run: str
    label: str
    time_s: Floats
    resistance_n: Floats
    peaks: pd.DataFrame
    slow: pd.DataFrame
    separation_s: float
    sense: int
    columns: tuple[Mapping[str, Floats], ...]

    @property
    def interval_s(self) -> float:
        """Time between frames."""
        return float(np.median(np.diff(self.time_s)))

    def events(self, rule: str) -> Ints:
        """Frames of the peaks by one of `PEAK_RULES`."""
        kept = {
            "all": self.peaks,
            "distinct": self.peaks[self.peaks["distinct"]],
            "slow": self.slow,
        }[rule]
        return kept["frame"].to_numpy(np.int64)

    def window(self, first_s: float, last_s: float) -> Window:
        """Frames between two times after a peak."""
        return Window(round(first_s / self.interval_s), round(last_s / self.interval_s))


def read_run(run_dir: Path) -> RunSeries:
    """Read a process run with its tables and describe the chains of its frames.

    Raises
    ------
    TableError
        If a table is missing, or the drag has no peak.
    """
    case = load_case(run_dir)
    samples = read_counted(run_dir, ("time_s", "drag_n"))
    table = frame_table(run_dir)
    parts = [part for _, part in table.groupby("setting", sort=True)]
    start_s = drag_start_s(case)
    time_s = parts[0]["time_s"].to_numpy(np.float64) - start_s
    sample_s = samples["time_s"].to_numpy(np.float64) - start_s
    drag = samples["drag_n"].to_numpy(np.float64)
    separation = peak_separation_s(case)
    peaks = peak_table(sample_s, drag, time_s, separation)
    slow = peak_table(sample_s, averaged(sample_s, drag), time_s, separation)
    if peaks.empty:
        raise TableError(
            f"{run_dir}: the drag has no peak, so there is nothing to explain; drag for longer"
        )
    columns = tuple(
        {str(name): part[name].to_numpy() for name in part if name not in ("setting", "step")}
        for part in parts
    )
    label = case.case or case.run
    resistance = -np.interp(time_s, sample_s, drag)
    sense = case.motion.sign if isinstance(case.motion, Circle) else 0
    return RunSeries(case.run, label, time_s, resistance, peaks, slow, separation, sense, columns)


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


def rules_of(runs: Sequence[RunSeries]) -> list[str]:
    """Those of `PEAK_RULES` by which every run has a peak."""
    return [rule for rule in PEAK_RULES if all(run.events(rule).size for run in runs)]


# --- tests -----------------------------------------------------------------------------------


def tests_of(runs: Sequence[RunSeries], shifts: Ints) -> pd.DataFrame:
    """Test every descriptor for every setting and rule of peaks, and every event test.

    Returns
    -------
    DataFrame
        ``peaks`` (rule), ``definition``, ``thresholds``, ``default``, ``statement``,
        ``descriptor``, ``label``, ``built_in``, ``claim``; ``at_peaks`` and ``at_all_times``
        (means over the runs, in the descriptor's unit), ``odds_ratio`` (of existence);
        ``effect`` with ``low`` and ``high``: the difference in standard deviations of the run, for
        shares the share itself; ``expected``, its mean by chance; ``p_claimed`` (one-sided,
        two-sided without a claim), ``p_two_sided`` and ``p_holm`` (of the claims at the default
        thresholds for all peaks, else NaN).
    """
    rows = [
        _descriptor_row(runs, shifts, at, descriptor, rule)
        for rule in rules_of(runs)
        for at in range(len(SETTINGS))
        for descriptor in DESCRIPTORS
    ]
    for rule in rules_of(runs):
        for at, setting in enumerate(SETTINGS):
            rows += _event_rows(runs, shifts, at, setting, rule)
    table = pd.DataFrame(rows)
    family = table["default"] & (table["peaks"] == "all") & (table["claim"] != 0)
    table["p_holm"] = np.nan
    table.loc[family, "p_holm"] = holm(table.loc[family, "p_claimed"].to_numpy(np.float64))
    return table


def _head(setting: Setting, rule: str) -> Found:
    return {
        "peaks": rule,
        "definition": setting.definition,
        "thresholds": setting.label,
        "default": setting.default,
    }


def _row(
    setting: Setting, rule: str, descriptor: Descriptor, test: ShiftTest, **more: float
) -> Found:
    low, high = test.ci95_low, test.ci95_high
    if descriptor.name in BOUNDED:
        low, high = np.clip([low, high], 0.0, 1.0).tolist()
    claimed = {1: test.p_greater, -1: test.p_less, 0: test.p_two_sided}[descriptor.claim]
    return (
        _head(setting, rule)
        | {
            "statement": descriptor.statement,
            "descriptor": descriptor.name,
            "label": descriptor.label,
            "built_in": descriptor.built_in[setting.definition],
            "claim": descriptor.claim,
            "effect": test.value,
            "ci95_low": low,
            "ci95_high": high,
            "expected": 0.0,
            "p_claimed": claimed,
            "p_two_sided": test.p_two_sided,
            "at_peaks": np.nan,
            "at_all_times": np.nan,
            "odds_ratio": np.nan,
        }
        | more
    )


def _descriptor_row(
    runs: Sequence[RunSeries], shifts: Ints, at: int, descriptor: Descriptor, rule: str
) -> Found:
    series = [run.columns[at][descriptor.name].astype(np.float64) for run in runs]
    means = [
        shifted_means(values, run.events(rule), run.window(-REACH_S, REACH_S))
        for run, values in zip(runs, series, strict=True)
    ]
    test = shift_test(_standardised(series, means), shifts)
    near, everywhere = _mean([mean[0] for mean in means]), _mean([_mean(one) for one in series])
    more = {"at_peaks": near, "at_all_times": everywhere}
    if descriptor.name == "exists":
        more["odds_ratio"] = _odds_ratio(near, everywhere)
    return _row(SETTINGS[at], rule, descriptor, test, **more)


def _standardised(series: Sequence[Floats], means: Sequence[Floats]) -> list[Floats]:
    return [standardised(values, mean) for values, mean in zip(series, means, strict=True)]


def _mean(values: Floats | Sequence[float]) -> float:
    known = np.asarray(values, dtype=np.float64)
    known = known[np.isfinite(known)]
    return float(known.mean()) if known.size else float("nan")


def _odds_ratio(first: float, second: float) -> float:
    if not 0.0 < second < 1.0 or first >= 1.0:
        return float("nan")
    return first / (1.0 - first) * (1.0 - second) / second


def _event_rows(
    runs: Sequence[RunSeries], shifts: Ints, at: int, setting: Setting, rule: str
) -> list[Found]:
    """Test order, coverage, reverse and orientation."""
    peaks = [run.events(rule) for run in runs]
    strong = [strong_frames(run, at) for run in runs]
    with_chain = _together(runs, peaks, strong)
    with_peak = _together(runs, [strongest(run, at) for run in runs], peaks)
    coverage, reverse = shift_test(with_chain, shifts), shift_test(with_peak, shifts)
    order = shift_test(_asymmetry(runs, at, rule), shifts)
    turned = shift_test(_directions(runs, at, rule), shifts, _resultant)
    expected = float(_resultant(joint(_directions(runs, at, rule), shifts)).mean())
    return [
        _row(setting, rule, _ORDER, order),
        _row(
            setting, rule, _COVERAGE, coverage, expected=_mean([_mean(one) for one in with_chain])
        ),
        _row(setting, rule, _REVERSE, reverse, expected=_mean([_mean(one) for one in with_peak])),
        _row(setting, rule, _ORIENTATION, turned, expected=expected),
    ]


_ORDER = Descriptor("order", "before less after", "order", 1, _HELD)
_COVERAGE = Descriptor("coverage", "peaks with a strong chain", "coverage", 1, _HELD)
_REVERSE = Descriptor("reverse", "strong chains with a peak", "reverse", 1, _HELD)
_ORIENTATION = Descriptor("resultant", "resultant of the azimuth", "orientation", 1, _FREE)
FRACTIONS = ("coverage", "reverse")
BOUNDED = (*FRACTIONS, "resultant")
"""Numbers between 0 and 1, so that an interval beyond is cut there."""


def _strength(run: RunSeries, at: int) -> Floats:
    """Weakest contact of the chain over the frame's mean, 0 in a frame without a chain."""
    return np.nan_to_num(run.columns[at]["bottleneck_over_mean"].astype(np.float64))


def strong_frames(run: RunSeries, at: int) -> Ints:
    """Frames with a strong chain (`STRONG_STDS`)."""
    strength = _strength(run, at)
    level = strength.mean() + STRONG_STDS * strength.std(ddof=1)
    return np.flatnonzero(strength > level)


def strongest(run: RunSeries, at: int) -> Ints:
    """Frames at which a strong chain is strongest, no two closer than peaks may be."""
    strength = _strength(run, at)
    apart = max(1.0, run.separation_s / run.interval_s)
    index, _ = find_peaks(strength, distance=apart)
    return np.asarray(index[np.isin(index, strong_frames(run, at))], dtype=np.int64)


def _together(
    runs: Sequence[RunSeries], events: Sequence[Ints], others: Sequence[Ints]
) -> list[Floats]:
    """Share of the events with one of the others near, by shift."""
    return [
        shifted_means(
            near_any(run.time_s, run.time_s[other], NEAR_S).astype(np.float64),
            event,
            Window(0, 0),
        )
        for run, event, other in zip(runs, events, others, strict=True)
    ]


def _asymmetry(runs: Sequence[RunSeries], at: int, rule: str) -> list[Floats]:
    found = []
    for run in runs:
        values = run.columns[at]["bottleneck_over_mean"].astype(np.float64)
        before, after = (
            standardised(values, shifted_means(values, run.events(rule), run.window(*edges)))
            for edges in ((-ASIDE_S[1], -ASIDE_S[0]), ASIDE_S)
        )
        found.append(before - after)
    return found


def _directions(runs: Sequence[RunSeries], at: int, rule: str) -> list[Floats]:
    found = []
    for run in runs:
        azimuth = run.columns[at]["azimuth_rad"].astype(np.float64)
        window = run.window(-REACH_S, REACH_S)
        events = run.events(rule)
        parts = [shifted_means(turn(azimuth), events, window) for turn in (np.cos, np.sin)]
        found.append(np.stack(parts, axis=1))
    return found


def _resultant(means: Floats) -> Floats:
    return np.asarray(np.hypot(means[..., 0], means[..., 1]))


def ranks(runs: Sequence[RunSeries], at: int, rule: str = "all") -> Found:
    """How the chain of every peak's frame ranks among the chains of all frames of its run.

    Returns
    -------
    dict
        ``rank``: of each peak, the share of the run's frames with a weaker chain (weakest contact
        over the mean); ``mean``, ``above_half`` and ``top``: their mean and the shares of peaks
        above 1/2 and above `TOP`, by chance 1/2, 1/2 and 1 - `TOP`.
    """
    each = [rank for run in runs for rank in chain_ranks(run, at)[run.events(rule)].tolist()]
    return {
        "rank": each,
        "mean": finite(_mean(each)),
        "above_half": finite(_mean([float(rank > 0.5) for rank in each])),
        "top": finite(_mean([float(rank > TOP) for rank in each])),
    }


def chain_ranks(run: RunSeries, at: int) -> Floats:
    """Share of a run's frames with a weaker chain than each frame's, none being the weakest."""
    strength = _strength(run, at)
    return np.asarray(np.searchsorted(np.sort(strength), strength) / len(strength))


# --- lags, orientation, lives ----------------------------------------------------------------


def lag_curves(runs: Sequence[RunSeries], shifts: Ints, rule: str = "all") -> Found:
    """Event-triggered averages around the peaks, in standard deviations of each run.

    Returns
    -------
    dict
        ``lag_s``; ``drag``; and for every definition at its default thresholds and for
        ``bottleneck_over_mean``, ``stands_out`` and ``exists``: ``mean``, ``by_run``, ``band``
        (95 % of shifted data sets stay within it at all lags), ``peak_lag_s`` (where the mean is
        largest), ``above_s`` (from when to when around the peak it is above the band, None if it
        is not at the peak).
    """
    interval_s = min(run.interval_s for run in runs)
    lags = np.arange(-round(LAG_S / interval_s), round(LAG_S / interval_s) + 1)
    lag_s = interval_s * lags.astype(np.float64)
    some = shifts[:2000]
    alone = Window(0, 0)
    drag = [
        standardised(run.resistance_n, shifted_means(run.resistance_n, run.events(rule), alone))
        for run in runs
    ]
    found: Found = {"lag_s": lag_s.tolist(), "drag": _curve(drag, lags)["mean"]}
    for at, setting in enumerate(SETTINGS):
        if not setting.default:
            continue
        found[setting.definition] = {}
        for name in ("bottleneck_over_mean", "stands_out", "exists"):
            series = [run.columns[at][name].astype(np.float64) for run in runs]
            means = [
                shifted_means(values, run.events(rule), alone)
                for run, values in zip(runs, series, strict=True)
            ]
            by_shift = _standardised(series, means)
            curve = _curve(by_shift, lags)
            width = band(by_shift, some, lags)
            found[setting.definition][name] = curve | {
                "band": finite(width),
                **_reach_of(np.array(curve["mean"], dtype=np.float64), lag_s, width),
            }
    return found


def _curve(by_shift: Sequence[Floats], lags: Ints) -> Found:
    runs = len(by_shift)
    mean = joint(by_shift, np.repeat(lags[:, None], runs, axis=1))
    return {
        "mean": [finite(value) for value in mean],
        "by_run": [[finite(value) for value in run[lags % len(run)]] for run in by_shift],
    }


def _reach_of(mean: Floats, lag_s: Floats, width: float) -> Found:
    middle = len(mean) // 2
    if not np.isfinite(mean).any():
        return {"peak_lag_s": None, "above_s": None}
    above = np.nan_to_num(mean) > width
    first = last = middle
    while above[middle] and first > 0 and above[first - 1]:
        first -= 1
    while above[middle] and last < len(mean) - 1 and above[last + 1]:
        last += 1
    return {
        "peak_lag_s": float(lag_s[int(np.nanargmax(mean))]),
        "above_s": [float(lag_s[first]), float(lag_s[last])] if above[middle] else None,
    }


def geometry(runs: Sequence[RunSeries], at: int) -> Found:
    """Orientation and altitude of the dominant chains, at peaks and at all times.

    Every number is a mean over the runs with its Student's t interval over them. The angles are
    those of the line from the workpiece; azimuths count from the direction of motion to its left.
    """
    return {
        place: _geometry(runs, at, at_peaks=place == "at_peaks")
        for place in ("at_peaks", "at_all_times")
    }


def _geometry(runs: Sequence[RunSeries], at: int, *, at_peaks: bool) -> Found:
    parts = [_numbers(run, at, at_peaks=at_peaks) for run in runs]
    turns = [np.exp(1j * part["azimuth_rad"]) for part in parts]
    heights = [part["altitude_m"] for part in parts]
    slopes = [part["inclination_rad"] for part in parts]
    all_turns = np.concatenate(turns)
    return {
        "frames": len(all_turns),
        "azimuth_mean_rad": finite(np.angle(all_turns.mean())) if len(all_turns) else None,
        "resultant": _over_runs([abs(turn.mean()) if len(turn) else np.nan for turn in turns]),
        "within_45_deg": _over_runs([_mean(np.abs(np.angle(turn)) < np.pi / 4) for turn in turns]),
        "inclination_mean_rad": _over_runs([_mean(slope) for slope in slopes]),
        "inclination_std_rad": _over_runs([_spread(slope) for slope in slopes]),
        "altitude_mean_m": _over_runs([_mean(height) for height in heights]),
        "altitude_std_m": _over_runs([_spread(height) for height in heights]),
        "altitude_range_m": [
            [finite(height.min()), finite(height.max())] for height in heights if len(height)
        ],
    }


def _numbers(run: RunSeries, at: int, *, at_peaks: bool) -> dict[str, Floats]:
    """Numbers of the chains of all frames, or of those nearest to the peaks."""
    columns = run.columns[at]
    kept = columns["exists"].astype(np.float64) > 0.0
    if at_peaks:
        kept &= np.isin(np.arange(len(kept)), run.events("all"))
    names = ("azimuth_rad", "inclination_rad", "altitude_m", "life_s", "left_s", "age_s")
    return {name: columns[name].astype(np.float64)[kept] for name in names}


def _spread(values: Floats) -> float:
    return float(values.std(ddof=1)) if len(values) > 1 else float("nan")


def _over_runs(values: Sequence[float]) -> Found:
    low, high = interval(values)
    return {
        "value": finite(_mean(list(values))),
        "ci95_low": finite(low),
        "ci95_high": finite(high),
    }


def lifetimes(runs: Sequence[RunSeries], at: int) -> Found:
    """How long the dominant chain stays the same, each life once, and as seen at a moment.

    A life that touches the first or the last frame is longer than seen: its end counts as unknown
    (Kaplan and Meier 1958). What is seen at a moment is more often a long life than a short one;
    peaks are to be compared with moments, not with lives.
    """
    durations, cut = _each_life(runs, at)
    survival = _kaplan_meier(durations, cut)
    at_peaks = [_numbers(run, at, at_peaks=True) for run in runs]
    moments = [_numbers(run, at, at_peaks=False) for run in runs]
    return {
        "lives": len(durations),
        "cut": int(cut.sum()),
        "median_s": survival["median_s"],
        "mean_s": finite(_mean(durations)),
        "longest_s": finite(durations.max(initial=0.0)),
        "survival": survival,
        "seen_at_peaks_s": _over_runs([_mean(part["life_s"]) for part in at_peaks]),
        "seen_at_all_times_s": _over_runs([_mean(part["life_s"]) for part in moments]),
        "left_at_peaks_s": _over_runs([_mean(part["left_s"]) for part in at_peaks]),
        "left_at_all_times_s": _over_runs([_mean(part["left_s"]) for part in moments]),
        "age_at_peaks_s": _over_runs([_mean(part["age_s"]) for part in at_peaks]),
    }


def _each_life(runs: Sequence[RunSeries], at: int) -> tuple[Floats, np.typing.NDArray[np.bool_]]:
    durations, cut = [np.array([])], [np.array([], dtype=bool)]
    for run in runs:
        life = run.columns[at]["life"].astype(np.int64)
        _, first = np.unique(life, return_index=True)
        first = first[life[first] >= 0]
        durations.append(run.columns[at]["life_s"].astype(np.float64)[first])
        cut.append(run.columns[at]["cut"].astype(bool)[first])
    return np.concatenate(durations), np.concatenate(cut)


def _kaplan_meier(durations: Floats, cut: np.typing.NDArray[np.bool_]) -> Found:
    if not durations.size:
        return {"time_s": [], "fraction": [], "median_s": None}
    data = CensoredData(uncensored=durations[~cut], right=durations[cut])
    survival = ecdf(data).sf
    below = np.flatnonzero(survival.probabilities <= 0.5)
    return {
        "time_s": survival.quantiles.tolist(),
        "fraction": survival.probabilities.tolist(),
        "median_s": float(survival.quantiles[below[0]]) if below.size else None,
    }


# --- verdicts --------------------------------------------------------------------------------


def judge(tests: pd.DataFrame) -> list[Found]:
    """Judge every statement for every definition by `RULE`.

    Returns
    -------
    list of dict
        ``statement``, ``text``, ``verdict`` (of the path that leaves out the forces on the
        workpiece) and ``by_definition``: ``verdict``, ``built_in`` (of the tests it rests on),
        ``why``.
    """
    found = []
    for statement, text in STATEMENTS.items():
        cells = {
            name: _cell(tests[(tests["definition"] == name) & (tests["statement"] == statement)])
            for name in DEFINITIONS
        }
        found.append(
            {
                "statement": statement,
                "text": text,
                "verdict": cells["free_path"]["verdict"],
                "by_definition": cells,
            }
        )
    return found


def _cell(tests: pd.DataFrame) -> Found:
    all_peaks = tests[(tests["peaks"] == "all") & (tests["claim"] != 0)]
    level = next(
        (name for name in ("none", "choice", "value") if (all_peaks["built_in"] == name).any()),
        "none",
    )
    judged = all_peaks[all_peaks["built_in"].isin([level, "against"])]
    main = judged[judged["default"] & judged["p_claimed"].notna()]
    if main.empty:
        return {"verdict": "cannot be told", "built_in": level, "why": "no chain, or one always"}
    outcomes = [_outcome(row, judged) for _, row in main.iterrows()]
    full = [one for one, name in zip(outcomes, main["built_in"], strict=True) if name != "against"]
    if any(one["supports"] for one in outcomes):
        proved = level == "none" and bool(full) and all(one["proves"] for one in full)
        verdict = "proved" if proved else "supported"
    else:
        refuted = bool(full) and all(one["refutes"] for one in full)
        verdict = "refuted" if refuted else "not supported"
    return {"verdict": verdict, "built_in": level, "why": "; ".join(one["why"] for one in outcomes)}


def _outcome(row: pd.Series[Any], judged: pd.DataFrame) -> Found:
    """Judge one test at the default thresholds with its like at the others."""
    like = judged[(judged["descriptor"] == row["descriptor"]) & judged["effect"].notna()]
    as_claimed = (like["effect"] - like["expected"]) * row["claim"] > 0
    fraction = row["descriptor"] in FRACTIONS
    found = row["p_holm"] < LEVEL and as_claimed.mean() > 0.5
    supports = bool(found and (not fraction or row["effect"] > 0.5))
    edges = np.array([row["ci95_low"], row["ci95_high"]]) - (0.5 if fraction else row["expected"])
    edges = np.sort(edges * row["claim"])
    small = 0.0 if fraction or row["descriptor"] == _ORIENTATION.name else SMALL
    return {
        "supports": supports,
        "proves": supports and bool(as_claimed.all()) and bool(edges[0] > 0.0),
        "refutes": not supports and bool(edges[1] < small),
        "why": f"{row['label']}: {row['effect']:+.2f}, p {row['p_holm']:.3g}, sign as claimed at "
        f"{int(as_claimed.sum())} of {len(like)} thresholds",
    }


# --- all together ----------------------------------------------------------------------------


def peak_rows(runs: Sequence[RunSeries]) -> pd.DataFrame:
    """A row for every peak and setting: the peak, and the chain of the nearest frame.

    ``rank`` is the share of the run's frames whose chain has a smaller bottleneck over the mean
    contact force; frames without a chain come first.
    """
    rows = []
    for run in runs:
        for at, setting in enumerate(SETTINGS):
            columns = run.columns[at]
            rank = chain_ranks(run, at)
            for number, peak in enumerate(run.peaks.to_dict("records")):
                frame = int(peak["frame"])
                rows.append(
                    {"run": run.run, "peak": number}
                    | {str(key): value for key, value in peak.items()}
                    | asdict(setting)
                    | {"thresholds": setting.label, "default": setting.default}
                    | {"rank": float(rank[frame])}
                    | {name: values[frame] for name, values in columns.items()}
                )
    return pd.DataFrame(rows)


@dataclass(frozen=True)
class Study:
    """What tables, figures and page are made of."""

    runs: tuple[RunSeries, ...]
    tests: pd.DataFrame
    found: Found


def study(run_dirs: Sequence[Path]) -> Study:
    """Read the runs, make all tests and judge them.

    Raises
    ------
    TableError
        No run is given, a table is missing, or a run has no peak.
    """
    if not run_dirs:
        raise TableError("no folder of a run is given, so there are no peaks to explain")
    return study_of([read_run(Path(folder)) for folder in run_dirs])


def study_of(runs: Sequence[RunSeries]) -> Study:
    """Make all tests of runs that are read, and judge them."""
    shifts = draw_shifts([len(run.time_s) for run in runs])
    tests = tests_of(runs, shifts)
    defaults = {setting.definition: at for at, setting in enumerate(SETTINGS) if setting.default}
    found: Found = {
        "schema": SCHEMA,
        "runs": [_run_row(run) for run in runs],
        "limits": {
            "reach_s": REACH_S,
            "aside_s": list(ASIDE_S),
            "near_s": NEAR_S,
            "strong_stds": STRONG_STDS,
            "top": TOP,
            "distinct_stds": DISTINCT_STDS,
            "averaged_s": AVERAGED_S,
            "shifts": len(shifts),
            "family": int(tests["p_holm"].notna().sum()),
        },
        "rule": RULE,
        "definitions": DEFINITIONS,
        "statements": judge(tests),
        "tests": _json_rows(tests),
        "lags": lag_curves(runs, shifts),
        "ranks": {
            rule: {name: ranks(runs, at, rule) for name, at in defaults.items()}
            for rule in rules_of(runs)
        },
        "geometry": {name: geometry(runs, at) for name, at in defaults.items()},
        "lifetimes": {name: lifetimes(runs, at) for name, at in defaults.items()},
    }  # fmt: skip
    found["answer"] = answer(found)
    return Study(tuple(runs), tests, found)


def _run_row(run: RunSeries) -> Found:
    return {
        "run": run.run,
        "label": run.label,
        "frames": len(run.time_s),
        "interval_s": run.interval_s,
        "from_s": float(run.time_s[0]),
        "to_s": float(run.time_s[-1]),
        "peaks": len(run.peaks),
        "distinct_peaks": int(run.peaks["distinct"].sum()),
        "slow_peaks": len(run.slow),
        "separation_s": run.separation_s,
        "sense": run.sense,
    }


def _json_rows(table: pd.DataFrame) -> list[Found]:
    return [
        {
            str(name): finite(value) if isinstance(value, float) else value
            for name, value in row.items()
        }
        for row in table.to_dict("records")
    ]
