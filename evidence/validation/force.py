"""The force on the workpiece over several packings, against measured and published figures."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from scipy import signal, stats

from dragchain.arrays import Floats
from dragchain.drag.force import read_counted
from dragchain.drag.peaks import find_drag_peaks, peak_separation_s
from dragchain.run.kinematics import drag_start_s
from dragchain.run.reference import reference_drags
from dragchain.statistics.correlated import MeanEstimate, estimate_mean
from dragchain.statistics.estimate import Estimate, Real
from dragdeck.documents import Part
from dragdeck.records.case import CaseOfRun
from evidence.validation.runs_by_bed import Point, over_packings

_COMPONENTS = ("drag_n", "lateral_n", "vertical_n")

_PROMINENCES = (0.5, 1.0, 2.0)
"""Least prominence of a peak in standard deviations of the drag; the middle one is the rule."""

SEGMENT = 6.0
"""Length of the spectrum's segments in particle diameters of path (Welch 1967)."""


class PackingForce(Part):
    """The force of one packing: each component's mean with its interval, and what the run took."""

    run: str
    seed: int
    bed_height_m: Real
    arc_m: float
    steps: int
    cpu_time_s: float
    drag_n: MeanEstimate
    lateral_n: MeanEstimate
    vertical_n: MeanEstimate


class Together(Part):
    """A component's mean and standard deviation over the packings."""

    mean: Estimate
    std: Estimate


class Likeness(Part):
    """Cochran's Q test of whether the packings differ by more than their own standard errors."""

    statistic: Real
    p_value: Real
    std_between_n: float
    standard_error_within_n: Real


class Peaks(Part):
    """Peaks of the drag.

    Attributes
    ----------
    per_metre : mapping
        Least prominence in standard deviations to the number of peaks per metre of path.
    process_time_s : sequence of sequence of float
        When they are in each packing, by the rule.
    largest_n : sequence of float
        Drag of the largest of each packing.
    """

    per_metre: Mapping[str, Estimate]
    process_time_s: tuple[tuple[float, ...], ...]
    largest_n: tuple[Real, ...]


class Density(Part):
    """Power in N^2 diameters: mean, lowest and highest of the packings, (F,) each."""

    mean: tuple[float, ...]
    ci95_low: tuple[float, ...]
    ci95_high: tuple[float, ...]


class Spectrum(Part):
    """Power spectrum of the drag along the path.

    Attributes
    ----------
    waves_per_diameter : (F,) sequence of float
    density : Density
    half_wave : Estimate
        Half of the variance lies in waves longer than so many diameters.
    segment : float
        Length of the segments in diameters.
    """

    waves_per_diameter: tuple[float, ...]
    density: Density
    half_wave: Estimate
    segment: float = SEGMENT


class Force(Part):
    """The force of every packing, and of all of them together by component."""

    packings: tuple[PackingForce, ...]
    together: Mapping[str, Together]
    alike: Likeness
    peaks: Peaks
    spectrum: Spectrum


class Compared(Part):
    """The drag beside a reference figure of the study.

    Attributes
    ----------
    label, mean_n, std_n
        Of the reference.
    difference : Estimate
        Relative difference of our mean to it.
    std_ratio : Estimate or None
        Our standard deviation over it. Both intervals are those over packings alone: no source
        says how well it knows its own mean.
    """

    label: str
    mean_n: float
    std_n: float | None
    difference: Estimate
    std_ratio: Estimate | None


def of_packings(packings: Sequence[Point]) -> Force:
    """The force of every packing, and of all of them together."""
    rows = [_packing_force(point) for point in packings]
    return Force(
        packings=tuple(rows),
        together={name: _together([getattr(row, name) for row in rows]) for name in _COMPONENTS},
        alike=_alike([row.drag_n for row in rows]),
        peaks=_peaks(packings),
        spectrum=spectrum(packings),
    )


def _packing_force(point: Point) -> PackingForce:
    samples, own = read_counted(point.folder, _COMPONENTS), point.measures
    forces = {name: estimate_mean(samples[name].to_numpy()) for name in _COMPONENTS}
    numbers = {"seed": point.seed, "bed_height_m": own.single["bed_height"]}
    return PackingForce.model_validate({**dict(own), **dict(own.cost), **numbers, **forces})


def _together(means: Sequence[MeanEstimate]) -> Together:
    return Together(
        mean=over_packings([one.mean for one in means]),
        std=over_packings([one.std for one in means], ratio=True),
    )


def _alike(drags: Sequence[MeanEstimate]) -> Likeness:
    """Cochran's Q.

    Cochran (1954), Biometrics 10, 101-129: the weighted sum of squares about the
    weighted mean follows chi squared with N - 1 degrees of freedom if the packings differ by
    no more than their standard errors.
    """
    means = np.array([drag.mean for drag in drags])
    weights = np.array([drag.se for drag in drags]) ** -2.0
    centre = float(weights @ means / weights.sum())
    statistic = float(weights @ (means - centre) ** 2)
    return Likeness(
        statistic=statistic,
        p_value=float(stats.chi2.sf(statistic, len(drags) - 1)),
        std_between_n=float(means.std(ddof=1)),
        standard_error_within_n=float(np.sqrt(np.mean(1.0 / weights))),
    )


def _peaks(packings: Sequence[Point]) -> Peaks:
    """Peaks by the rule of docs/reference/results.md, at three least prominences."""
    counts: dict[float, list[float]] = {factor: [] for factor in _PROMINENCES}
    times, largest = [], []
    for point in packings:
        samples = read_counted(point.folder, ("time_s", "drag_n"))
        time_s, drag = (samples[name].to_numpy(np.float64) for name in ("time_s", "drag_n"))
        for factor in _PROMINENCES:
            peaks = find_drag_peaks(
                time_s,
                drag,
                min_separation_s=peak_separation_s(point.case),
                min_prominence_n=factor * float(np.std(drag, ddof=1)),
            )
            counts[factor].append(len(peaks.index) / point.measures.arc_m)
            if factor == 1.0:
                times.append(tuple((peaks.time_s - drag_start_s(point.case)).tolist()))
                largest.append(float(peaks.drag_n.min(initial=math.inf)))
    return Peaks(
        per_metre={f"{factor:g}": over_packings(found) for factor, found in counts.items()},
        process_time_s=tuple(times),
        largest_n=tuple(largest),
    )


def spectrum(packings: Sequence[Point]) -> Spectrum:
    """Power spectrum of the drag along the path, by Welch's method, mean over packings.

    Welch (1967), IEEE Trans. Audio Electroacoust. 15, 70-73: Hann windows of
    `SEGMENT` particle diameters, half overlapping.
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
    mean, low, high = (tuple(row.tolist()) for row in (
        together.mean(axis=0), together.min(axis=0), together.max(axis=0)
    ))  # fmt: skip
    return Spectrum(
        waves_per_diameter=tuple(grid.tolist()),
        density=Density(mean=mean, ci95_low=low, ci95_high=high),
        half_wave=over_packings(halves, ratio=True),
    )


def _half_wave(waves: Floats, density: Floats) -> float:
    total = np.cumsum(density)
    return float(1.0 / np.interp(0.5 * total[-1], total - 0.5 * density, waves))


def compare(drag: Together, case: CaseOfRun) -> tuple[Compared, ...]:
    """Mean and standard deviation of the drag beside every reference figure of the study."""
    return tuple(
        Compared(
            label=reference.label,
            mean_n=reference.mean_n,
            std_n=reference.std_n,
            difference=reference.difference(drag.mean),
            std_ratio=drag.std.over(reference.std_n) if reference.std_n else None,
        )
        for reference in reference_drags(case.reference)
    )
