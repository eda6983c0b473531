"""What a record's rate and noise do to an impact, and what is left to compare."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from dragchain.arrays import Floats
from dragchain.calibration.measured_impacts import Measured, pulse
from dragchain.calibration.simulated_drops import Waveform
from dragchain.errors import RecordError

_SAMPLINGS = 200
"""Random samplings of a simulated impact, to know what sampling does to it."""

_SAMPLING_SEED = 20150


@dataclass(frozen=True)
class Sampling:
    """What a record's rate and noise do to one impact.

    Attributes
    ----------
    peak_ratio, peak_std : float
        Largest sample over the true peak: mean and standard deviation.
    time_bias_s, time_std_s : float
        Centroid of the samples less the true one.
    width_s : float
        Mean width at half height as the samples show it.
    """

    peak_ratio: float
    peak_std: float
    time_bias_s: float
    time_std_s: float
    width_s: float


def sample_impact(shape: Waveform, measured: Measured, peak_n: float) -> Sampling:
    """Sample a simulated impact many times at the record's rate, with its noise.

    Parameters
    ----------
    shape : Waveform
        At the full modulus: as long as the real impact.
    measured : Measured
        Rate, noise and threshold.
    peak_n : float
        The measured peak, to which the force is scaled.

    Raises
    ------
    RecordError
        ``coarse``: less than half of the samplings would see the impact.
    """
    random = np.random.default_rng(_SAMPLING_SEED)
    step, (start, end) = measured.interval_s, (shape.time_s[0], shape.time_s[-1])
    count = int((end - start) / step) + 6
    found: list[tuple[float, float, float]] = []
    for phase in random.random(_SAMPLINGS):
        time = start + (np.arange(count) - 3 + phase) * step
        force = np.interp(time, shape.time_s, shape.force_n, 0.0, 0.0) * peak_n / shape.peak_n
        force = force + random.normal(0.0, measured.noise_n, count)
        above = np.flatnonzero(force > measured.threshold_n)
        if len(above) < 2:
            continue
        seen = pulse(time, force, (int(above[0]), int(above[-1])), step)
        found.append((seen.peak_n / peak_n, seen.centroid_s - shape.centroid_s, seen.width_s))
    if len(found) < _SAMPLINGS / 2:
        raise RecordError(
            "coarse",
            "the sampling rate is too low to resolve an impact of this particle",
            value=f"interval {step:.3g} s, contact {shape.up_s - shape.down_s:.3g} s",
            limit="2 samples above the noise in most impacts",
            remedy="record at a higher rate",
        )
    table = np.array(found)
    mean, std = table.mean(axis=0), table.std(axis=0, ddof=1)
    return Sampling(*map(float, (mean[0], std[0], mean[1], std[1], mean[2])))


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


def observe(measured: Measured, samplings: Sequence[Sampling], *, with_peaks: bool) -> Observed:
    """Times and peaks of a record with their uncertainties.

    Parameters
    ----------
    measured : Measured
    samplings : sequence of Sampling
        One an impact.
    with_peaks : bool
        Whether to compare the peaks too.
    """
    pairs = list(zip(measured.impacts, samplings, strict=True))
    time = np.array([impact.centroid_s - seen.time_bias_s for impact, seen in pairs])
    peak = np.array([impact.peak_n / seen.peak_ratio for impact, seen in pairs])
    peak_std = np.array([seen.peak_std / seen.peak_ratio for seen in samplings])
    blocks = [_since_first(np.array([seen.time_std_s for seen in samplings]))]
    logs = np.empty(0)
    if with_peaks:
        logs = np.log(peak[1:] / peak[0])
        blocks.append(_since_first(peak_std))
    return Observed(time[1:] - time[0], logs, block_diag(*blocks), peak, peak_std)


def _since_first(std: Floats) -> Floats:
    """Covariance of x_k - x_1 for independent x."""
    return np.asarray(np.diag(std[1:] ** 2) + std[0] ** 2)
