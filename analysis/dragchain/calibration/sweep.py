"""A sweep of drops as a smooth model: what the engine makes of a deck's restitution."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq

from dragchain.arrays import Floats
from dragchain.calibration.measured_impacts import IMPACTS
from dragchain.calibration.simulated_drops import DropRun, Drops, DropTest, Purpose
from dragchain.errors import TableError

_DEGREE = 4
"""Of the polynomials through the sweep."""


@dataclass(frozen=True)
class Emulator:
    """What a drop does as a function of the deck's restitution.

    Attributes
    ----------
    low, high : float
        Range of the sweep.
    flights_s : tuple of Polynomial
        Time of the flight after impact 1 and 2, s, at the study's height.
    log_peaks : tuple of Polynomial
        Natural logarithm of the peak of impact 2 and 3 over that of impact 1,
        as a function of the restitution's logarithm: nearly a straight line.
    rebound : Polynomial
        Speed after over before, mean of the impacts.
    scatter, rebound_error : float
        Standard deviation of one drop's rebound about `rebound`, and standard
        uncertainty of `rebound`.
    errors : (4,) ndarray
        Standard uncertainty of flights (s) and logarithms.
    contact_s : tuple of Polynomial
        Time in contact between the centroids of impacts k and k + 1, s.
    """

    low: float
    high: float
    flights_s: tuple[Polynomial, ...]
    log_peaks: tuple[Polynomial, ...]
    rebound: Polynomial
    scatter: float
    rebound_error: float
    errors: Floats
    contact_s: tuple[Polynomial, ...]

    def inverse(self, rebound: float) -> float | None:
        """The deck value that rebounds so, or None outside the sweep."""
        ends = self.rebound(self.low) - rebound, self.rebound(self.high) - rebound
        if ends[0] * ends[1] > 0.0:
            return None
        return float(brentq(lambda e: self.rebound(e) - rebound, self.low, self.high))


def emulate(
    runs: Sequence[DropRun], height_m: float, gravity_m_s2: float, *, single: bool = False
) -> Emulator:
    """Fit polynomials in the deck's restitution through a sweep of drops.

    Flight times are 2 v / g (free flight), scaled to the study's height by the
    root of the ratio of heights: the rebound of a Hertz contact with damping
    after Tsuji et al. (1992) does not depend on the speed.

    Parameters
    ----------
    runs : sequence of DropRun
    height_m, gravity_m_s2 : float
        Of the study's drop test.
    single : bool
        `errors` are the scatter of a single drop, not the smaller standard
        error of the polynomial: for drops at so fine a step that what is left
        of the step's error is of that size.

    Raises
    ------
    TableError
        The sweep has too few values.
    """
    value = np.array([run.drop.restitution for run in runs])
    if len(np.unique(value)) <= _DEGREE + 1:
        raise TableError(f"a sweep requires more than {_DEGREE + 1} values of the restitution")
    scale = np.sqrt(height_m / np.array([run.drop.height_m for run in runs]))
    speeds = np.array([run.speeds_m_s[: IMPACTS + 1] for run in runs])
    peaks = np.log([[impact.peak_n for impact in run.impacts[:IMPACTS]] for run in runs])
    flights = 2.0 * speeds[:, 1:IMPACTS] / gravity_m_s2 * scale[:, None]
    contact = np.array([_contact_parts(run) for run in runs])
    ratios = peaks[:, 1:] - peaks[:, :1]
    rebound, scatter, mean_error = _polynomial(value, np.array([run.effective for run in runs]))
    fitted = [_polynomial(value, column) for column in flights.T]
    fitted += [_polynomial(np.log(value), column) for column in ratios.T]
    return Emulator(
        low=float(value.min()),
        high=float(value.max()),
        flights_s=tuple(f[0] for f in fitted[: IMPACTS - 1]),
        log_peaks=tuple(f[0] for f in fitted[IMPACTS - 1 :]),
        rebound=rebound,
        scatter=scatter,
        rebound_error=scatter if single else mean_error,
        errors=np.array([f[1 if single else 2] for f in fitted]),
        contact_s=tuple(_polynomial(value, column)[0] for column in contact.T),
    )


def _contact_parts(run: DropRun) -> list[float]:
    """Time between two centroids that is no flight, s, for each pair of impacts."""
    return [
        (first.up_s - first.centroid_s) + (second.centroid_s - second.down_s)
        for first, second in zip(run.impacts[: IMPACTS - 1], run.impacts[1:IMPACTS], strict=True)
    ]


def _polynomial(value: Floats, column: Floats) -> tuple[Polynomial, float, float]:
    """Least-squares polynomial, scatter of one point about it, standard error of its mean."""
    fitted = Polynomial.fit(value, column, _DEGREE)
    rest = column - fitted(value)
    scatter = math.sqrt(float(rest @ rest) / (len(value) - _DEGREE - 1))
    return fitted, scatter, scatter * math.sqrt((_DEGREE + 1) / len(value))


@dataclass(frozen=True)
class Sweep:
    """A sweep of drops, ready to be compared with records.

    Attributes
    ----------
    known : DropTest
        What ``drops.json`` says of the study.
    reference_runs : list of DropRun
        Full modulus, fine step, the study's contact option.
    production, reference : Emulator
        With the study's contact option.
    """

    known: DropTest
    reference_runs: Sequence[DropRun]
    production: Emulator
    reference: Emulator


def prepare(drops: Drops) -> Sweep:
    """Make the models of a sweep."""
    option = drops.known.limit_force
    return Sweep(
        drops.known,
        drops.select("reference", option),
        emulator_of(drops, "production", option),
        emulator_of(drops, "reference", option),
    )


def emulator_of(drops: Drops, purpose: Purpose, limit_force: bool) -> Emulator:
    """The model of the drops of a purpose and a contact option."""
    known, runs = drops.known, drops.select(purpose, limit_force)
    return emulate(runs, known.height_m, known.gravity_m_s2, single=purpose == "reference")
