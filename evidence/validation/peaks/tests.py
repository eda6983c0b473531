"""Tests of what distinguishes the dominant chains at peaks of the drag from those of other times.

The force of a chain on the workpiece is a part of the drag, so it is high at a peak by
construction. Every test therefore says how much of that is in its number (`built_in`).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray
from scipy.signal import find_peaks

from dragchain.arrays import Floats, Ints
from dragchain.documents import Part
from dragchain.statistics.estimate import Real
from evidence.validation.peaks import shift_test
from evidence.validation.peaks.run_series import PeakRule, RunSeries, rules_of
from evidence.validation.peaks.settings import SETTINGS, Definition

ASIDE_S = (0.05, 0.15)
"""Stretch before, and after, a peak that are compared with each other."""

NEAR_S = 0.05
"""A strong chain within this time of a peak counts as together with it."""

STRONG_STDS = 1.0
"""A chain is strong if its weakest contact over the frame's mean is this many standard deviations
above the mean of the run; frames without a chain count as 0."""

BuiltIn = Literal["none", "choice", "value", "against"]
"""How much of the drag is in a number: `value` (a force on the workpiece is in it), `choice` (it
decides only which chain counts), `against` (the drag divides it, which works against the claim) or
`none`."""

Statement = Literal[
    "presence", "dominance", "order", "breaking", "coverage", "reverse", "orientation"
]
"""Statements of the paper: at a peak the chain is stronger than at other times (presence) and than
the general rise of the forces explains (dominance); it builds up before the peak more than it lasts
(order) and ends sooner (breaking); most peaks come with a strong chain (coverage) and most strong
chains with a peak (reverse); chains of peaks share one orientation."""


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
        For every definition, how much of the drag is in the number.
    bounded : bool
        Whether it lies between 0 and 1, so that an interval beyond is cut there.
    """

    name: str
    label: str
    statement: Statement | Literal[""]
    claim: Literal[-1, 0, 1]
    built_in: Mapping[Definition, BuiltIn]
    bounded: bool = False


def _levels(widest: BuiltIn, free: BuiltIn, peters: BuiltIn) -> dict[Definition, BuiltIn]:
    return {
        "widest_path": widest, "free_path": free, "peters": peters, "peters_workpiece": peters
    }  # fmt: skip


_FREE = _levels("choice", "none", "choice")
_HELD = _levels("value", "none", "choice")
_DIVIDED = _levels("against", "against", "against")
_BORNE = _levels("value", "value", "value")

DESCRIPTORS = (
    Descriptor("exists", "chain present", "presence", 1, _HELD),
    Descriptor("bottleneck_over_mean", "weakest contact / mean contact", "presence", 1, _HELD),
    Descriptor("outer_over_mean", "weakest beyond 1st link / mean", "presence", 1, _FREE),
    Descriptor("stands_out", "weakest behind workpiece / shell rms", "dominance", 1, _FREE),
    Descriptor("bottleneck_over_drag", "weakest contact / drag", "dominance", 1, _DIVIDED),
    Descriptor(
        "workpiece_fraction", "fraction of drag at its workpiece contact", "dominance", 1, _BORNE
    ),
    Descriptor("left_s", "remaining lifetime (s)", "breaking", -1, _FREE),
    Descriptor("life_s", "lifetime (s)", "", 0, _FREE),
    Descriptor("particles", "number of particles", "", 0, _FREE),
    Descriptor("straightness", "straightness", "", 0, _FREE),
    Descriptor("angle_rad", "angle to the motion (rad)", "", 0, _FREE),
    Descriptor("altitude_m", "height (m)", "", 0, _FREE),
)

_ORDER = Descriptor("order", "before minus after", "order", 1, _HELD)
_COVERAGE = Descriptor("coverage", "peaks with a strong chain", "coverage", 1, _HELD, bounded=True)
_REVERSE = Descriptor("reverse", "strong chains with a peak", "reverse", 1, _HELD, bounded=True)
ORIENTATION = Descriptor(
    "resultant", "resultant of the azimuth", "orientation", 1, _FREE, bounded=True
)
FRACTIONS = (_COVERAGE.name, _REVERSE.name)


class PeakTest(Part):
    """A test by shifts for one rule of peaks, setting and descriptor.

    Attributes
    ----------
    peaks, definition, thresholds, default, statement, descriptor, label, built_in, claim
        What is tested: the rule of peaks, the `Setting` and the `Descriptor`.
    effect, ci95_low, ci95_high : float
        The difference in standard deviations of the run, for fractions the fraction itself, with
        the interval over the packings.
    expected : float
        Its mean by chance.
    p_claimed, p_two_sided : float
        One-sided as the claim goes (two-sided without a claim), and two-sided.
    at_peaks, at_all_times : float
        Means over the runs, in the descriptor's unit.
    odds_ratio : float
        Of existence.
    p_holm : float
        After Holm's adjustment, of the claims at the default thresholds for all peaks; else NaN.
    """

    peaks: PeakRule
    definition: Definition
    thresholds: str
    default: bool
    statement: Statement | Literal[""]
    descriptor: str
    label: str
    built_in: BuiltIn
    claim: Literal[-1, 0, 1]
    effect: Real
    ci95_low: Real
    ci95_high: Real
    expected: Real = 0.0
    p_claimed: Real
    p_two_sided: Real
    at_peaks: Real = np.nan
    at_all_times: Real = np.nan
    odds_ratio: Real = np.nan
    p_holm: Real = np.nan

    @property
    def in_family(self) -> bool:
        """Whether it is one of the claims at the default thresholds for all peaks."""
        return self.default and self.peaks == "all" and self.claim != 0


def tests_of(runs: Sequence[RunSeries], shifts: Ints) -> list[PeakTest]:
    """Test every descriptor for every setting and rule of peaks, and every event test."""
    rules, places = rules_of(runs), range(len(SETTINGS))
    tests = [
        _descriptor_test(runs, shifts, at, descriptor, rule)
        for rule in rules
        for at in places
        for descriptor in DESCRIPTORS
    ]
    tests += [test for rule in rules for at in places for test in _events(runs, shifts, at, rule)]
    family = [test for test in tests if test.in_family]
    adjusted = iter(shift_test.holm([test.p_claimed for test in family]).tolist())
    return [
        test.model_copy(update={"p_holm": next(adjusted)}) if test.in_family else test
        for test in tests
    ]


def test_table(tests: Sequence[PeakTest]) -> pd.DataFrame:
    """The tests as a table, one row per test."""
    return pd.DataFrame([dict(test) for test in tests])


def _test(
    at: int, rule: PeakRule, descriptor: Descriptor, result: shift_test.ShiftTest, **more: float
) -> PeakTest:
    setting = SETTINGS[at]
    low, high = result.ci95_low, result.ci95_high
    if descriptor.bounded:
        low, high = np.clip([low, high], 0.0, 1.0).tolist()
    claimed = {1: result.p_greater, -1: result.p_less, 0: result.p_two_sided}[descriptor.claim]
    about = {
        "peaks": rule,
        "thresholds": setting.label,
        "default": setting.default,
        "descriptor": descriptor.name,
        "built_in": descriptor.built_in[setting.definition],
        "effect": result.value,
        "ci95_low": low,
        "ci95_high": high,
        "p_claimed": claimed,
    }
    known = {**vars(setting), **vars(descriptor), **vars(result)}
    return PeakTest.model_validate({**known, **about, **more})


def _descriptor_test(
    runs: Sequence[RunSeries], shifts: Ints, at: int, descriptor: Descriptor, rule: PeakRule
) -> PeakTest:
    series = [run.chain(at, descriptor.name) for run in runs]
    means = [run.around_peaks(one, rule) for run, one in zip(runs, series, strict=True)]
    result = shift_test.shift_test(
        [shift_test.standardised(one, mean) for one, mean in zip(series, means, strict=True)],
        shifts,
    )
    near, everywhere = mean_of_known([mean[0] for mean in means]), _mean_of_means(series)
    odds = _odds_ratio(near, everywhere) if descriptor.name == "exists" else np.nan
    return _test(
        at, rule, descriptor, result, at_peaks=near, at_all_times=everywhere, odds_ratio=odds
    )


def mean_of_known(values: ArrayLike) -> float:
    """The mean of the finite values, NaN if there is none."""
    known = np.asarray(values, dtype=np.float64)
    known = known[np.isfinite(known)]
    return float(known.mean()) if known.size else float("nan")


def _mean_of_means(series: Sequence[Floats]) -> float:
    return mean_of_known([mean_of_known(one) for one in series])


def _odds_ratio(first: float, second: float) -> float:
    if not 0.0 < second < 1.0 or first >= 1.0:
        return float("nan")
    return first / (1.0 - first) * (1.0 - second) / second


# --- order, coverage, reverse and orientation ------------------------------------------------


def _events(runs: Sequence[RunSeries], shifts: Ints, at: int, rule: PeakRule) -> Iterator[PeakTest]:
    peaks = [run.events(rule) for run in runs]
    yield _test(at, rule, _ORDER, shift_test.shift_test(_asymmetry(runs, at, rule), shifts))
    pairs = (
        (_COVERAGE, peaks, [_strong_frames(run, at) for run in runs]),
        (_REVERSE, [strongest(run, at) for run in runs], peaks),
    )
    for descriptor, events, others in pairs:
        shared = _together(runs, events, others)
        expected = _mean_of_means(shared)
        yield _test(at, rule, descriptor, shift_test.shift_test(shared, shifts), expected=expected)
    directions = _directions(runs, at, rule)
    by_chance = float(_resultant(shift_test.joint(directions, shifts)).mean())
    turned = shift_test.shift_test(directions, shifts, _resultant)
    yield _test(at, rule, ORIENTATION, turned, expected=by_chance)


def _strong_frames(run: RunSeries, at: int) -> Ints:
    """Frames with a strong chain (`STRONG_STDS`)."""
    strength = run.strength(at)
    level = strength.mean() + STRONG_STDS * strength.std(ddof=1)
    return np.flatnonzero(strength > level)


def strongest(run: RunSeries, at: int) -> Ints:
    """Frames at which a strong chain is strongest, no two closer than peaks may be."""
    apart = max(1.0, run.separation_s / run.interval_s)
    index, _ = find_peaks(run.strength(at), distance=apart)
    return np.asarray(index[np.isin(index, _strong_frames(run, at))], dtype=np.int64)


def _together(
    runs: Sequence[RunSeries], events: Sequence[Ints], others: Sequence[Ints]
) -> list[Floats]:
    """Fraction of the events with one of the others near, by shift."""
    return [
        shift_test.shifted_means(
            near_any(run.time_s, run.time_s[other], NEAR_S).astype(float),
            event,
            shift_test.Window(0, 0),
        )
        for run, event, other in zip(runs, events, others, strict=True)
    ]


def near_any(time_s: Floats, events_s: Floats, reach_s: float) -> NDArray[np.bool_]:
    """Which times lie within `reach_s` of an event."""
    if not len(events_s):
        return np.zeros(time_s.shape, dtype=bool)
    gaps = np.abs(time_s[:, None] - events_s[None, :]).min(axis=1)
    return np.asarray(gaps <= reach_s)


def _asymmetry(runs: Sequence[RunSeries], at: int, rule: PeakRule) -> list[Floats]:
    def aside(run: RunSeries, first_s: float, last_s: float) -> Floats:
        values = run.chain(at, "bottleneck_over_mean")
        return shift_test.standardised(values, run.around_peaks(values, rule, first_s, last_s))

    near, far = ASIDE_S
    return [aside(run, -far, -near) - aside(run, near, far) for run in runs]


def _directions(runs: Sequence[RunSeries], at: int, rule: PeakRule) -> list[Floats]:
    """Cosine and sine of the azimuth around the peaks, by shift, (N, 2) per run."""
    directions = []
    for run in runs:
        azimuth = run.chain(at, "azimuth_rad")
        parts = [run.around_peaks(turn(azimuth), rule) for turn in (np.cos, np.sin)]
        directions.append(np.stack(parts, axis=1))
    return directions


def _resultant(means: Floats) -> Floats:
    return np.asarray(np.hypot(means[..., 0], means[..., 1]))
