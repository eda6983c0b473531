"""Read a process run as the peaks of its drag and the dominant chains of its network frames."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.ndimage import uniform_filter1d

from dragchain.arrays import Floats
from dragchain.drag.force import read_counted
from dragchain.drag.peaks import find_drag_peaks, peak_separation_s
from dragchain.errors import TableError
from dragchain.run.case import load_case
from dragchain.run.kinematics import drag_start_s
from dragchain.run.paths.circle import Circle
from evidence.validation.peaks.dominant_chain import frame_table
from evidence.validation.peaks.run_series import AVERAGED_S, DISTINCT_STDS, RunSeries
from evidence.validation.peaks.settings import SETTINGS


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
