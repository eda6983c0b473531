"""Synthetic force signals of a process."""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from dragdeck.study.process_signal import low_passed

BANDWIDTH_HZ = 20.0
MEAN_N, SPREAD = 2.6, 0.23
CORRELATION = ((0.8, 0.05), (0.2, 0.25))
"""Share of the variance and correlation time in s of the parts of the logarithm of the force."""


def synthetic(random: np.random.Generator, seconds: float) -> NDArray[np.float64]:
    """A skewed, correlated resistance at the common rate of a comparison, N."""
    count, rate = int(5 * BANDWIDTH_HZ * seconds), 5 * BANDWIDTH_HZ
    parts = np.zeros(count + 400)
    for share, time_s in CORRELATION:
        kept = np.exp(-1 / (rate * time_s))
        steps = random.normal(0.0, np.sqrt(share * (1 - kept**2)), len(parts))
        parts += lfilter([1.0], [1.0, -kept], steps)
    force = MEAN_N * np.exp(SPREAD * parts - SPREAD**2 / 2)
    smooth = low_passed(np.arange(len(force)) / rate, force, BANDWIDTH_HZ)[1]
    return smooth[200 : 200 + count]
