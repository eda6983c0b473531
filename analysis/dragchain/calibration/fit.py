"""The restitution to put into a deck, fitted to a measured drop test.

Compared are, as in Uhlmann et al. (2015, section 4), the change of the peak
forces and the times since the first impact. What the engine makes of a deck's
restitution is measured in a sweep of drops at the production modulus, step and
contact option, so that whatever these do to the rebound is corrected.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import least_squares
from scipy.stats import chi2

from dragchain.arrays import Floats
from dragchain.calibration.drops import IMPACTS, DropTestOfStudy
from dragchain.calibration.measured_impacts import Impact, MeasuredImpacts, pulse
from dragchain.calibration.simulated_drops import DropRun, Drops, Emulator, Waveform
from dragchain.statistics.estimate import NORMAL_QUANTILE, Estimate, birge_factor
from dragdeck.errors import RecordError
from dragdeck.parts import Part

# --- sampling ------------------------------------------------------------------------------------


_SAMPLINGS = 200
"""Random samplings of a simulated impact, to know what sampling does to it."""

_SAMPLING_SEED = 20150


@dataclass(frozen=True)
class Sampling:
    """What a record's rate and noise do to K impacts.

    Attributes
    ----------
    peak_ratio, peak_std : (K,) ndarray
        Largest sample over the true peak: mean and standard deviation.
    time_bias_s, time_std_s : (K,) ndarray
        Centroid of the samples less the true one.
    width_s : (K,) ndarray
        Mean width at half height as the samples show it.
    """

    peak_ratio: Floats
    peak_std: Floats
    time_bias_s: Floats
    time_std_s: Floats
    width_s: Floats


def sample_impacts(shapes: Sequence[Waveform], measured: MeasuredImpacts) -> Sampling:
    """Sample a simulated impact for each measured one many times at its rate, with its noise.

    Parameters
    ----------
    shapes : sequence of Waveform
        At the full modulus: as long as the real impacts.
    measured : MeasuredImpacts
        Rate, noise and threshold, and the peaks to which the forces are scaled.

    Raises
    ------
    RecordError
        ``coarse``: less than half of the samplings would see an impact.
    """
    pairs = zip(shapes, measured.impacts, strict=False)
    return Sampling(
        *np.array([_sampled(diameter, measured, impact.peak_n) for diameter, impact in pairs]).T
    )


def _sampled(shape: Waveform, measured: MeasuredImpacts, peak_n: float) -> list[float]:
    """The numbers of a `Sampling` of one impact."""
    random = np.random.default_rng(_SAMPLING_SEED)
    step, (start, end) = measured.interval_s, (shape.time_s[0], shape.time_s[-1])
    count = int((end - start) / step) + 6
    samples: list[tuple[float, float, float]] = []
    for phase in random.random(_SAMPLINGS):
        time = start + (np.arange(count) - 3 + phase) * step
        force = np.interp(time, shape.time_s, shape.force_n, 0.0, 0.0) * peak_n / shape.peak_n
        force = force + random.normal(0.0, measured.noise_n, count)
        above = np.flatnonzero(force > measured.threshold_n)
        if len(above) < 2:
            continue
        seen = pulse(time, force, (int(above[0]), int(above[-1])), step)
        samples.append((seen.peak_n / peak_n, seen.centroid_s - shape.centroid_s, seen.width_s))
    if len(samples) < _SAMPLINGS / 2:
        raise RecordError(
            "coarse",
            "the sampling rate is too low to resolve an impact of this particle",
            value=f"interval {step:.3g} s, contact {shape.up_s - shape.down_s:.3g} s",
            limit="2 samples above the noise in most impacts",
            remedy="record at a higher rate",
        )
    table = np.array(samples)
    (ratio, bias, width), (ratio_std, bias_std, _) = table.mean(axis=0), table.std(axis=0, ddof=1)
    return [ratio, ratio_std, bias, bias_std, width]


@dataclass(frozen=True)
class Observed:
    """What is compared with the sweep, corrected for sampling.

    Attributes
    ----------
    times_s : (K - 1,) ndarray
        Centroids of impacts 2 ... K since that of impact 1, s.
    log_peaks : (K - 1,) ndarray
        Logarithms of their peaks over that of impact 1; empty if not compared.
    covariance : (M, M) ndarray
        Of both together; the first impact is in all of them.
    peaks_n : (K,) ndarray
        Peaks, N.
    peaks_std : (K,) ndarray
        Their relative standard uncertainty.
    """

    times_s: Floats
    log_peaks: Floats
    covariance: Floats
    peaks_n: Floats
    peaks_std: Floats


def observe(measured: MeasuredImpacts, sampling: Sampling, *, with_peaks: bool) -> Observed:
    """Times and peaks of a record with their uncertainties, and whether to compare the peaks."""
    time = np.array([impact.centroid_s for impact in measured.impacts]) - sampling.time_bias_s
    peak = np.array([impact.peak_n for impact in measured.impacts]) / sampling.peak_ratio
    peak_std = sampling.peak_std / sampling.peak_ratio
    blocks, logs = [_since_first(sampling.time_std_s)], np.empty(0)
    if with_peaks:
        logs = np.log(peak[1:] / peak[0])
        blocks.append(_since_first(peak_std))
    return Observed(time[1:] - time[0], logs, block_diag(*blocks), peak, peak_std)


def _since_first(std: Floats) -> Floats:
    """Covariance of x_k - x_1 for independent x."""
    return np.asarray(np.diag(std[1:] ** 2) + std[0] ** 2)


# --- fit -----------------------------------------------------------------------------------------


WIDTH_LIMIT = 1.25
"""A measured impact wider than this times the simulated one, seen at the same
rate, shows the sensor and not the contact: its peaks are not compared."""


class Fit(Part):
    """The fitted coefficient of restitution for the input script.

    Attributes
    ----------
    restitution, ci95_low, ci95_high : float
        Best value and its 95 % interval.
    height_m : float
        Drop height that fits best, m.
    chi2 : float
        Weighted sum of squares at the best value.
    degrees : int
        Degrees of freedom; 0: the fit cannot be tested.
    p_value : float or None
        Probability of a larger `chi2` if the model is right.
    inflation : float
        Factor by which the interval is widened if the residuals exceed their uncertainties, see
        `birge_factor`.
    residuals : tuple of float
        (Measured - simulated) / standard uncertainty.
    """

    restitution: float
    ci95_low: float
    ci95_high: float
    height_m: float
    chi2: float
    degrees: int
    p_value: float | None
    inflation: float
    residuals: tuple[float, ...]


def fit(observed: Observed, emulator: Emulator, contact: Emulator, known: DropTestOfStudy) -> Fit:
    """The deck value with the least misfit, and its interval, by weighted least squares.

    The drop height is a second unknown, known to `height_std_m`: flight times go with its root.

    Parameters
    ----------
    observed : Observed
    emulator : Emulator
        The sweep.
    contact : Emulator
        That at the full modulus, for the contact part of the times: the real particle is hard.
    known : DropTestOfStudy

    Raises
    ------
    RecordError
        ``range``: the best value or its interval leaves the sweep.
    """
    flights, peaks = len(observed.times_s), len(observed.log_peaks)
    spread = 0.5 * known.height_std_m / known.height_m
    errors = [*emulator.errors[:flights], *emulator.errors[IMPACTS - 1 : IMPACTS - 1 + peaks]]
    root = np.linalg.cholesky(observed.covariance + np.diag(np.square(errors)))
    seen = np.append(observed.times_s, observed.log_peaks)

    def misfit(at: Floats) -> Floats:
        restitution, scale = at
        parts = scale * emulator.flights_s(restitution) + contact.contact_s(restitution)
        logs = emulator.log_peaks(restitution)[:peaks]
        away = np.linalg.solve(root, seen - np.append(np.cumsum(parts)[:flights], logs))
        return np.append(away, (scale - 1.0) / spread)

    low, high = emulator.low, emulator.high
    best = least_squares(
        misfit, ((low + high) / 2, 1.0), bounds=((low, 0.5), (high, 2.0)), x_scale=(0.1, spread),
        xtol=1e-12, ftol=1e-12, gtol=1e-12,
    )  # fmt: skip
    least, degrees = 2.0 * float(best.cost), flights + peaks - 1
    inflation = birge_factor(least, degrees)
    slopes = np.asarray(best.jac)
    std = math.sqrt(np.linalg.inv(slopes.T @ slopes)[0, 0])
    value = Estimate.around(float(best.x[0]), NORMAL_QUANTILE * inflation * std)
    if not low < value.ci95_low < value.ci95_high < high:
        raise RecordError(
            "range",
            "the fitted restitution lies outside the sweep",
            value=f"{value.value:.3f}, CI {value.ci95_low:.3f} to {value.ci95_high:.3f}",
            limit=f"value and confidence interval within {low:g} to {high:g}",
            remedy="check drop_test.height_m, and that particle and plate of the record "
            "are those of the study",
        )
    return Fit(
        restitution=value.value,
        ci95_low=value.ci95_low,
        ci95_high=value.ci95_high,
        height_m=known.height_m * float(best.x[1]) ** 2,
        chi2=least,
        degrees=degrees,
        p_value=float(chi2.sf(least, degrees)) if degrees else None,
        inflation=inflation,
        residuals=tuple(best.fun[:-1].tolist()),
    )


@dataclass(frozen=True)
class RecordFit:
    """A record, the drops that it is compared with, and what follows.

    Attributes
    ----------
    measured : MeasuredImpacts
    sampling : Sampling
    observed : Observed
    width_ratio : float
        Width of the first impact over that of the simulated one, sampled alike.
    drops : Drops
    fit, fit_reference : Fit
        At production and at the full modulus.
    """

    measured: MeasuredImpacts
    sampling: Sampling
    observed: Observed
    width_ratio: float
    drops: Drops
    fit: Fit
    fit_reference: Fit

    @property
    def with_peaks(self) -> bool:
        """Whether the peaks are compared."""
        return len(self.observed.log_peaks) > 0


def calibrate(measured: MeasuredImpacts, drops: Drops) -> RecordFit:
    """Fit the restitution to a record.

    Raises
    ------
    RecordError
        ``coarse`` or ``range``.
    """
    known = drops.known
    shapes = _nearest_shapes(measured.impacts, drops.select("reference"))
    sampling = sample_impacts(shapes, measured)
    ratio = measured.impacts[0].width_s / float(sampling.width_s[0])
    with_peaks = ratio <= WIDTH_LIMIT if known.peaks == "auto" else known.peaks == "yes"
    if ratio > WIDTH_LIMIT:
        sampling = _as_the_sensor_shows(measured, sampling)
    observed = observe(measured, sampling, with_peaks=with_peaks)
    production, reference = (
        fit(observed, emulator, drops.reference, known)
        for emulator in (drops.production, drops.reference)
    )
    return RecordFit(measured, sampling, observed, ratio, drops, production, reference)


def _nearest_shapes(impacts: Sequence[Impact], runs: Sequence[DropRun]) -> tuple[Waveform, ...]:
    """Impacts of the reference drop whose first flight is nearest the measured one."""
    flight = impacts[1].centroid_s - impacts[0].centroid_s
    times = [run.impacts[1].centroid_s - run.impacts[0].centroid_s for run in runs]
    return runs[int(np.argmin(np.abs(np.array(times) - flight)))].impacts


def _as_the_sensor_shows(measured: MeasuredImpacts, sampling: Sampling) -> Sampling:
    """What rate and noise do to impacts that a slow sensor widens.

    Each is taken to look like the first, whose samples are drawn again. Only
    the difference of two impacts counts, so their common delay does not.
    """
    time, force = measured.first_pulse.T
    weight = np.maximum(force, 0.0)
    centroid = float(np.sum(weight * time) / np.sum(weight))
    shape = Waveform(time, force, time[0], time[-1], centroid, float(force.max()))
    again = sample_impacts([shape] * len(measured.impacts), measured)
    return replace(again, width_s=sampling.width_s)
