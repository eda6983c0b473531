"""Rounds of windows: what the windows so far say, and how many more are needed."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dragchain.arrays import Floats
from dragchain.quantities.document import (
    MEASURED_FILE,
    LoadMap,
    Need,
    PathQuantities,
    Reached,
    RunQuantities,
)
from dragchain.quantities.registry import MEASURED, Quantity
from dragchain.statistics.estimate import NOT_KNOWN, Estimate
from dragchain.tables.by_step import read_table
from dragchain.windows.estimate import (
    Paired,
    Round,
    WindowOfRun,
    corrected_map,
    expected,
    paired,
    windows_needed,
)
from dragdeck.records.windows import UNKNOWN, WindowsRecord
from dragdeck.scenes.lead import FIRST_WINDOWS

_FEWEST = 2
"""Windows of which one alone says nothing of its scatter."""

_MOST_MORE = 2.0
"""A round has at most so many times the windows of the one before."""

_DOUBT = 0.8
"""Scatter along the path, over that found so far, with which a forecast must meet the tolerance for
more to be run: a first round knows it to some 20 %."""

_PLATEAU = 0.15
"""Largest relative difference of the coordination number in the first third of a sample from that
in the rest: a bed that was thrown up by the ramp differs by far more (docs/evidence/windows.md)."""


def judge_windows(
    run_dir: Path,
    windows: Sequence[Path],
    tolerance: float,
    quantities: Sequence[str],
    most: int,
    lengths: float,
    sample: float,
    packings: int,
    drag: Path | None,
    out: Path,
) -> None:
    """Write what the windows of a run say of its quantities at physical stiffness.

    Parameters
    ----------
    run_dir : Path
        The run with reduced moduli.
    windows : sequence of Path
        Folders of its windows so far; none in the first round.
    tolerance : float
        Relative half-width of the interval at which no further window is run.
    quantities : sequence of str
        To which the tolerance applies.
    most : int
        Number of windows that there can be.
    lengths : float
        How many windows cost as much as the whole drag.
    sample : float
        Blocks of the path that a window samples.
    packings : int
        Of the case, whose mean is to be inside the tolerance: each of them may be further off.
    drag : Path or None
        Folder of the whole drag at the physical modulus, if it was run.
    out : Path
        The file to write.

    Raises
    ------
    DocumentError
        A run has no ``quantities.json``.
    """
    soft = RunQuantities.read(run_dir / MEASURED_FILE)
    measured = [measured_window(folder) for folder in windows]
    asked = Asked(tolerance, tuple(quantities), most, lengths, sample, packings)
    judged_round = judged(soft, measured, asked, WindowsRecord.shipped())
    if drag is not None:
        judged_round = with_drag(judged_round, RunQuantities.read(drag / MEASURED_FILE), asked)
    judged_round.write(out)


@dataclass(frozen=True)
class Asked:
    """What the windows of a run are run for; see `judge_windows`."""

    tolerance: float
    quantities: tuple[str, ...]
    most: int = 0
    lengths: float = math.inf
    sample: float = 1.0
    packings: int = 1

    @property
    def of_each(self) -> float:
        """The tolerance of one packing."""
        return self.tolerance * math.sqrt(self.packings)


def judged(
    soft: PathQuantities, windows: Sequence[WindowOfRun], asked: Asked, record: WindowsRecord
) -> Round:
    """The round that these windows are; see `judge_windows`.

    Another round follows if it is expected to meet the tolerance: with as many windows as are
    needed for that, at most twice as many as so far; or with the whole drag, where that costs less
    or windows cannot do it. Where neither can, this round is the last. The first round has no
    windows: what is expected follows from the soft run and from other scenes, and where neither
    way is expected to do, the first windows show it at the least cost.
    """
    good = [window for window in windows if not window.refused]
    pairs = dict(_paired(soft, good, record) if windows else _expected_pairs(soft, asked, record))
    values = {quantity.name: pair.estimate(len(good)) for quantity, pair in pairs.items() if good}
    values = {name: value for name, value in values.items() if value.known}
    widest = _widest(values, asked.quantities)
    reached = len(good) >= _FEWEST and widest <= asked.of_each
    concerned = [pair for quantity, pair in pairs.items() if quantity.name in asked.quantities]
    needs = [windows_needed(pair, len(good), asked.of_each, asked.most) for pair in concerned]
    need = Need(*(max(numbers) for numbers in zip(Need(_FEWEST, 1), *needs, strict=True)))
    more = max(1, need.windows - len(good))
    if windows and len(good) < _FEWEST:  # of one, nothing is known; after none, others will fail
        by_windows, by_drag = bool(good), not good
    else:
        by_windows, by_drag = _may_do(concerned, need.windows, asked)
    by_windows &= len(windows) < asked.most
    by_drag &= not (by_windows and more <= asked.lengths)
    last = bool(windows) and (reached or not (by_windows or by_drag))
    most_next = math.ceil(_MOST_MORE * len(windows)) or FIRST_WINDOWS
    wanted = min(max(len(windows) + more, FIRST_WINDOWS), most_next, asked.most)
    return Round(
        values=values,
        tolerance=Reached(
            tolerance=asked.tolerance,
            packings=asked.packings,
            asked=asked.quantities,
            reached=reached,
            needed=Need(need.windows, need.packings * asked.packings),
            runs=tuple(window.run for window in good),
            refused={window.run: window.refused for window in windows if window.refused},
        ),
        load_map=_load_map(soft, good, values),
        windows=tuple(windows),
        wanted=len(windows) if last or by_drag else wanted,
        whole=by_drag and not last,
        last=last,
    )


def _may_do(pairs: Sequence[Paired], windows: int, asked: Asked) -> tuple[bool, bool]:
    """Whether so many windows, and whether the whole drag, are expected to meet the tolerance.

    Nothing gives a quantity that is not known of all.
    """
    if len(pairs) < len(asked.quantities):
        return False, False
    widths = [pair.relative_half_width(windows, scatter=_DOUBT) for pair in pairs]
    of_drag = [pair.whole_half_width(_DOUBT) for pair in pairs]
    return max(widths) <= asked.of_each, max(of_drag) <= asked.of_each


def with_drag(before: Round, drag: RunQuantities, asked: Asked) -> Round:
    """The last round, which the whole drag at the physical modulus ends.

    A drag that failed leaves what the windows say; the first of them follow if there are none.
    """
    if not drag.complete:
        refused = {**before.tolerance.refused, drag.run: drag.why_failed or "not complete"}
        tolerance = before.tolerance.model_copy(update={"refused": refused})
        update = {"tolerance": tolerance, "whole": False, "last": bool(before.windows)}
        wanted = before.wanted or min(FIRST_WINDOWS, asked.most)
        return before.model_copy(update={**update, "wanted": wanted})
    return Round(
        values={name: value for name, value in drag.values_of_run.items() if value.known},
        tolerance=reached_by(drag, asked).model_copy(
            update={"runs": (drag.run,), "whole": True, "refused": before.tolerance.refused}
        ),
        windows=before.windows,
        wanted=before.wanted,
        whole=False,
        last=True,
    )


def _widest(values: Mapping[str, Estimate], asked: Sequence[str]) -> float:
    """The largest relative half-width of some quantities; infinite where one has no value."""
    return max(values[name].relative_half_width if name in values else math.inf for name in asked)


def reached_by(run: RunQuantities, asked: Asked) -> Reached:
    """Whether a run at the physical modulus gives what was asked for."""
    worst = _widest(run.values_of_run, asked.quantities) / asked.of_each
    packings = math.ceil(worst**2) if math.isfinite(worst) else 1
    return Reached(
        tolerance=asked.tolerance,
        packings=asked.packings,
        asked=asked.quantities,
        reached=worst <= 1.0,
        needed=Need(0, packings * asked.packings),
    )


def _load_map(
    soft: PathQuantities, windows: Sequence[WindowOfRun], values: Mapping[str, Estimate]
) -> LoadMap | None:
    total = values.get("normal_load", NOT_KNOWN)
    runs = soft.arc_m / windows[0].arc_m if windows else math.nan
    return corrected_map(soft.load_map, [window.load_map for window in windows], total, runs)


def _paired(
    soft: PathQuantities, windows: Sequence[WindowOfRun], record: WindowsRecord
) -> Iterator[tuple[Quantity, Paired]]:
    """Each quantity at physical stiffness that the soft run and all windows have."""
    known_of_all = [soft.values(), *(window.values for window in windows)]
    for quantity in MEASURED if len(windows) >= _FEWEST else ():
        if quantity.name == "peaks":  # they stand out of the drag's long waves, which windows lack
            continue
        if all(quantity.name in values for values in known_of_all):
            pair = paired(
                of_windows(quantity, windows),
                beside(soft, quantity.name, windows),
                stretches(soft, quantity.name, windows[0].arc_m),
                record.quantities.get(quantity.name, UNKNOWN),
            )
            yield quantity, pair.root if quantity.squared else pair


def _expected_pairs(
    soft: PathQuantities, asked: Asked, record: WindowsRecord
) -> Iterator[tuple[Quantity, Paired]]:
    """What is expected of each requested quantity before there are windows."""
    known, arc_m = soft.values(), asked.sample * soft.block_m
    for quantity in MEASURED:
        if quantity.name in asked.quantities and quantity.name in known:
            of_others = record.quantities.get(quantity.name, UNKNOWN)
            pair = expected(stretches(soft, quantity.name, arc_m), of_others)
            yield quantity, pair.root if quantity.squared else pair


def of_windows(quantity: Quantity, windows: Sequence[WindowOfRun]) -> Floats:
    """A quantity in each window, its square where its blocks hold squares.

    In a window, the drag deviates from a mean of its own. What waves longer than its sample add to
    the variance is how far that mean is from that of all windows.
    """
    known = np.array([window.values[quantity.name] for window in windows]) ** (1 + quantity.squared)
    if quantity.name != "drag_std":
        return known
    means = np.array([window.values["drag_mean"] for window in windows])
    away = (means - means.mean()) ** 2 * len(means) / (len(means) - 1)
    return np.asarray(known + away)


def beside(soft: PathQuantities, name: str, windows: Sequence[WindowOfRun]) -> Floats:
    """Means of a quantity's blocks of the soft run where the windows sample, (K,).

    Where the soft run has none, its mean.
    """
    blocks = soft.of_blocks(name)
    begins = [(window.begin_m - soft.begin_m) / soft.block_m for window in windows]
    means = np.array(
        [
            blocks.between(begin, begin + window.arc_m / soft.block_m).mean
            for begin, window in zip(begins, windows, strict=True)
        ]
    )
    return np.where(np.isfinite(means), means, blocks.mean)


def stretches(soft: PathQuantities, name: str, arc_m: float) -> Floats:
    """Means of a quantity's blocks over stretches of the soft run as long as a window's sample."""
    blocks = soft.of_blocks(name)
    joined = max(1, round(arc_m / soft.block_m))
    means = blocks.means(max(1, len(blocks.values) // joined))
    return means[np.isfinite(means)]


def measured_window(folder: Path) -> WindowOfRun:
    """A window with its quantities; refused if it failed or its bed has not come to rest."""
    run = RunQuantities.read(folder / MEASURED_FILE)
    window = window_of(run)
    refused = unsettled(folder) if run.complete else run.why_failed or "not complete"
    return window.model_copy(update={"run": folder.name, "refused": refused})


def window_of(run: RunQuantities) -> WindowOfRun:
    """A window from its quantities."""
    return WindowOfRun(
        run=run.run,
        begin_m=run.begin_m,
        arc_m=run.arc_m,
        values=run.values(),
        load_map=run.load_map,
        cpu_time_s=run.cost.cpu_time_s,
    )


def unsettled(folder: Path) -> str:
    """Why a window's bed has not come to its plateau, empty if it has."""
    contacts = read_table(folder / "tables" / "network.parquet")["coordination_number"]
    first = max(1, len(contacts) // 3)
    early, late = contacts[:first].mean(), contacts[first:].mean()
    if abs(early / late - 1.0) <= _PLATEAU:
        return ""
    return (
        f"the bed has not settled: its coordination number is {early:.3g} in the first third of "
        f"the sample and {late:.3g} in the rest"
    )
