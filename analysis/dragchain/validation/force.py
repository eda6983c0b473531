"""The force on the workpiece over several fills, against measured and published figures."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy import signal, stats

from dragchain.arrays import Floats
from dragchain.drag.force import read_counted
from dragchain.drag.peaks import find_drag_peaks, peak_separation_s
from dragchain.report.findings import mean_numbers
from dragchain.run.case import Case
from dragchain.run.kinematics import drag_start_s
from dragchain.run.reference import ReferenceDrag, reference_drags
from dragchain.statistics.bed_effects import Fit, fit_effects
from dragchain.statistics.correlated import estimate_mean
from dragchain.statistics.estimate import CONFIDENCE, Estimate, finite
from dragchain.validation.runs_by_bed import Point, Points, over_packings

Found = dict[str, Any]

COMPONENTS = {"drag_n": "drag", "lateral_n": "lateral force", "vertical_n": "vertical force"}

PROMINENCES = (0.5, 1.0, 2.0)
"""Least prominence of a peak in standard deviations of the drag; the middle one is the rule."""

SEGMENT = 6.0
"""Length of the spectrum's segments in particle diameters of path (Welch 1967)."""


def of_packings(points: Points) -> Found:
    """The force of every fill, and of all of them together.

    Returns
    -------
    dict
        ``fills`` (a row a fill), ``together`` (component to ``mean`` and ``sd`` with
        the interval over fills), ``alike`` (whether the fills differ by more than
        each knows its own mean), ``peaks`` and ``spectrum``.
    """
    rows = [_packing_row(point) for point in points.packings]
    together = {
        name: {
            "mean": over_packings([row[name]["mean"] for row in rows]).as_json(),
            "std": over_packings([row[name]["std"] for row in rows], ratio=True).as_json(),
        }
        for name in COMPONENTS
    }
    return {
        "packings": rows,
        "together": together,
        "alike": _alike(rows),
        "peaks": _peaks(points.packings),
        "spectrum": spectrum(points.packings),
    }


def _packing_row(point: Point) -> Found:
    samples = read_counted(point.folder, tuple(COMPONENTS))
    cost = point.measures.cost
    return {
        "run": point.case.run,
        "seed": point.seed,
        "bed_height_m": point.measures.single["bed_height"],
        "arc_m": point.measures.arc_m,
        "steps": cost.steps,
        "cpu_time_s": cost.cpu_time_s,
        **{name: mean_numbers(estimate_mean(samples[name].to_numpy())) for name in COMPONENTS},
    }


def _alike(rows: Sequence[Found]) -> Found:
    """Test by Cochran's Q whether the fills differ by more than their own standard errors.

    Cochran (1954), Biometrics 10, 101-129: the weighted sum of squares about the
    weighted mean follows chi squared with N - 1 degrees of freedom if they do not.
    """
    means = np.array([row["drag_n"]["mean"] for row in rows])
    weights = np.array([row["drag_n"]["se"] for row in rows]) ** -2.0
    centre = float(weights @ means / weights.sum())
    statistic = float(weights @ (means - centre) ** 2)
    return {
        "statistic": statistic,
        "p_value": float(stats.chi2.sf(statistic, len(rows) - 1)),
        "std_between_n": float(means.std(ddof=1)),
        "standard_error_within_n": float(np.sqrt(np.mean(1.0 / weights))),
    }


def _peaks(packings: Sequence[Point]) -> Found:
    """Peaks by the rule of docs/outputs.md, at three least prominences."""
    counts: dict[float, list[float]] = {factor: [] for factor in PROMINENCES}
    times, largest = [], []
    for point in packings:
        samples = read_counted(point.folder, ("time_s", "drag_n"))
        time_s, drag = (samples[name].to_numpy(np.float64) for name in ("time_s", "drag_n"))
        for factor in PROMINENCES:
            peaks = find_drag_peaks(
                time_s,
                drag,
                min_separation_s=peak_separation_s(point.case),
                min_prominence_n=factor * float(np.std(drag, ddof=1)),
            )
            counts[factor].append(len(peaks.index) / point.measures.arc_m)
            if factor == 1.0:
                times.append((peaks.time_s - drag_start_s(point.case)).tolist())
                largest.append(float(peaks.drag_n.min(initial=math.inf)))
    return {
        "per_metre": {
            f"{factor:g}": over_packings(found).as_json() for factor, found in counts.items()
        },
        "process_time_s": times,
        "largest_n": [finite(force) for force in largest],
    }


def spectrum(packings: Sequence[Point]) -> Found:
    """Power spectrum of the drag along the path, by Welch's method, mean over fills.

    Welch (1967), IEEE Trans. Audio Electroacoust. 15, 70-73: Hann windows of
    `SEGMENT` particle diameters, half overlapping.

    Returns
    -------
    dict
        ``waves_per_diameter`` (F values), ``density`` (N^2 diameters: mean, lowest and
        highest of the fills) and ``half_wave``: half of the variance lies in waves
        longer than so many diameters, with its interval over fills.
    """
    curves, halves = [], []
    grid = np.empty(0)
    for point in packings:
        drag = read_counted(point.folder, ("drag_n",))["drag_n"].to_numpy(np.float64)
        spacing = point.measures.arc_m / len(drag) / (2.0 * point.case.media.radius_mean_m)
        length = min(len(drag), round(SEGMENT / spacing))
        waves, density = (half[1:] for half in signal.welch(drag, 1.0 / spacing, nperseg=length))
        grid = grid if grid.size else waves
        curves.append(np.interp(grid, waves, density))
        halves.append(_half_wave(waves, density))
    together = np.array(curves)
    return {
        "waves_per_diameter": grid.tolist(),
        "density": {
            "mean": together.mean(axis=0).tolist(),
            "ci95_low": together.min(axis=0).tolist(),
            "ci95_high": together.max(axis=0).tolist(),
        },
        "half_wave": over_packings(halves, ratio=True).as_json(),
        "segment": SEGMENT,
    }


def _half_wave(waves: Floats, density: Floats) -> float:
    total = np.cumsum(density)
    return float(1.0 / np.interp(0.5 * total[-1], total - 0.5 * density, waves))


def compare(mean: Mapping[str, float], std: Mapping[str, float], case: Case) -> list[Found]:
    """Mean and standard deviation of the drag beside every reference figure of the study.

    Returns
    -------
    list of dict
        ``label``, ``mean_n``, ``std_n``; ``difference`` of our mean over it less one with
        ``low`` and ``high``, and ``std_ratio`` the same way, both from the interval over
        fills alone: no source says how well it knows its own mean.
    """
    ours = Estimate(mean["value"], mean["ci95_low"], mean["ci95_high"])
    return [_against(ours, std, reference) for reference in reference_drags(case.reference)]


def _against(mean: Estimate, std: Mapping[str, float], reference: ReferenceDrag) -> Found:
    row: Found = {
        "label": reference.label,
        "mean_n": reference.mean_n,
        "std_n": reference.std_n,
        "difference": vars(reference.difference(mean)),
    }
    if reference.std_n is not None and reference.std_n > 0.0:
        row["std_ratio"] = {
            name: std[name] / reference.std_n for name in ("value", "ci95_low", "ci95_high")
        }
    return row


# --- other settings --------------------------------------------------------------------------


def effects(points: Points) -> pd.DataFrame:
    """What every other setting does to the mean drag and to its standard deviation.

    All runs are fitted together (`dragchain.effects`): one mean a setting, one
    variance for all, in inverse proportion to the path. What runs from one bed have in common
    is not made use of: it was measured to be little (docs/trade.md), and these are too few runs
    to tell. A setting that
    changes an input is compared with the same fidelity without that change; one
    that changes the fidelity alone with the fills.

    Returns
    -------
    DataFrame
        A row a setting: ``parameters``, ``field``, ``value``, ``reference_value`` (of the input
        that it changes), ``runs``, ``quantity``, ``change low high`` (relative),
        ``exponent exponent_low exponent_high`` (of the change over that of the input).

    Raises
    ------
    SeriesError
        If there are too few runs.
    """
    rows = []
    drags = [
        read_counted(point.folder, ("drag_n",))["drag_n"].to_numpy(np.float64)
        for point in points.all
    ]
    sizes = {
        "mean": [abs(float(drag.mean())) for drag in drags],
        "std": [float(drag.std(ddof=1)) for drag in drags],
    }
    for quantity, values in sizes.items():
        fitted = _Fitted(points, values)
        for setting in fitted.settings[1:]:
            rows.append({"quantity": f"drag_{quantity}", **fitted.row(setting)})
    return pd.DataFrame(rows)


class _Fitted:
    """One quantity fitted over all runs."""

    def __init__(self, points: Points, sizes: Sequence[float]) -> None:
        self.points = points.all
        self.settings = list(dict.fromkeys(point.setting for point in self.points))
        values = np.log(sizes)
        design = np.array([self._indicator(point.setting) for point in self.points])
        weights = np.sqrt([float(point.measures.arc_m) for point in self.points])
        weights /= weights.max()
        runs = range(len(self.points))
        self.fit: Fit = fit_effects(weights[:, None] * design, weights * values, runs)

    def _indicator(self, setting: tuple[object, ...]) -> Floats:
        return np.array([float(setting == other) for other in self.settings])

    def row(self, setting: tuple[object, ...]) -> Found:
        """A setting against what it is to be compared with."""
        own = [point for point in self.points if point.setting == setting]
        base = self._base(own[0])
        weights = self._indicator(setting) - self._indicator(base.setting)
        value, error = self.fit.contrast(weights)
        reach = float(stats.t.ppf(0.5 + 0.5 * CONFIDENCE, self.fit.degrees)) * error
        change = Estimate(*(math.expm1(edge) for edge in (value, value - reach, value + reach)))
        return {
            "youngs_modulus_scale": own[0].parameters[0],
            "timestep_fraction": own[0].parameters[1],
            "speed_factor": own[0].parameters[2],
            "runs": len(own),
            "field": next(iter(own[0].changed), ""),
            "value": next(iter(own[0].changed.values()), None),
            "reference_value": _input(base, own[0]),
            "change": change.value,
            "ci95_low": change.ci95_low,
            "ci95_high": change.ci95_high,
            **_exponent(value, reach, base, own[0]),
        }

    def _base(self, point: Point) -> Point:
        alike = (
            one for one in self.points if one.parameters == point.parameters and not one.changed
        )
        return (next(alike, self.points[0])) if point.changed else self.points[0]


def _input(base: Point, point: Point) -> object:
    field = next(iter(point.changed), None)
    return None if field is None else base.measures.inputs.get(field)


def _exponent(value: float, reach: float, base: Point, point: Point) -> Found:
    names = ("exponent", "exponent_low", "exponent_high")
    new, old = next(iter(point.changed.values()), None), _input(base, point)
    if len(point.changed) != 1 or not all(isinstance(x, int | float) for x in (new, old)):
        return dict.fromkeys(names)
    assert isinstance(new, int | float) and isinstance(old, int | float)
    if new <= 0 or old <= 0:
        return dict.fromkeys(names)
    scale = math.log(new / old)
    edges = sorted((value + sign * reach) / scale for sign in (-1.0, 1.0))
    return dict(zip(names, (value / scale, *edges), strict=True))
