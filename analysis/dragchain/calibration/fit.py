"""The restitution to put into a deck, fitted to a measured drop test.

Compared are, as in Uhlmann et al. (2015, section 4), the change of the peak
forces and the times since the first impact. What the engine makes of a deck's
restitution is measured in a sweep of drops at the production modulus, step and
contact option, so that whatever these do to the rebound is corrected.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial
from scipy.optimize import brentq, minimize_scalar
from scipy.stats import chi2

from dragchain.arrays import Floats
from dragchain.calibration.force_record import Impact, Measured, pulse
from dragchain.calibration.simulated_drops import IMPACTS, DropRun, Drops, Purpose, Waveform
from dragchain.errors import RecordError, TableError

DEGREE = 4
"""Of the polynomials through the sweep."""

CONFIDENCE = 0.95
SAMPLINGS = 200
"""Random samplings of a simulated impact, to know what sampling does to it."""

SAMPLING_SEED = 20150
WIDTH_LIMIT = 1.25
"""A measured impact wider than this times the simulated one, seen at the same
rate, shows the sensor and not the contact: its peaks are not compared."""


# --- the sweep as a smooth model -------------------------------------------------------------


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
    single : bool
        `errors` are the scatter of a single drop, not the smaller standard
        error of the polynomial: for drops at so fine a step that what is left
        of the step's error is of that size.

    Raises
    ------
    TableError
        The sweep has too few values.
    """
    value = np.array([run.restitution for run in runs])
    if len(np.unique(value)) <= DEGREE + 1:
        raise TableError(f"a sweep needs more than {DEGREE + 1} values of the restitution")
    scale = np.sqrt(height_m / np.array([run.height_m for run in runs]))
    speeds = np.array([run.speeds_m_s[: IMPACTS + 1] for run in runs])
    peaks = np.log([[impact.peak_n for impact in run.impacts[:IMPACTS]] for run in runs])
    flights = 2.0 * speeds[:, 1:IMPACTS] / gravity_m_s2 * scale[:, None]
    contact = np.array([_contact_parts(run) for run in runs])
    ratios = peaks[:, 1:] - peaks[:, :1]
    rebound, scatter, mean_error = _polynomial(
        value, np.array([run.rebound[:IMPACTS].mean() for run in runs])
    )
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
    fitted = Polynomial.fit(value, column, DEGREE)
    rest = column - fitted(value)
    scatter = math.sqrt(float(rest @ rest) / (len(value) - DEGREE - 1))
    return fitted, scatter, scatter * math.sqrt((DEGREE + 1) / len(value))


# --- what sampling does to an impact -----------------------------------------------------------


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
    random = np.random.default_rng(SAMPLING_SEED)
    step, (start, end) = measured.interval_s, (shape.time_s[0], shape.time_s[-1])
    count = int((end - start) / step) + 6
    found: list[tuple[float, float, float]] = []
    for phase in random.random(SAMPLINGS):
        time = start + (np.arange(count) - 3 + phase) * step
        force = np.interp(time, shape.time_s, shape.force_n, 0.0, 0.0) * peak_n / shape.peak_n
        force = force + random.normal(0.0, measured.noise_n, count)
        above = np.flatnonzero(force > measured.threshold_n)
        if len(above) < 2:
            continue
        seen = pulse(time, force, int(above[0]), int(above[-1]), step)
        found.append((seen.peak_n / peak_n, seen.centroid_s - shape.centroid_s, seen.width_s))
    if len(found) < SAMPLINGS / 2:
        raise RecordError(
            "coarse",
            "sampled too coarsely to see an impact of this particle",
            value=f"interval {step:.3g} s, contact {shape.up_s - shape.down_s:.3g} s",
            limit="2 samples above the noise in most impacts",
            remedy="record at a higher rate",
        )
    table = np.array(found)
    mean, std = table.mean(axis=0), table.std(axis=0, ddof=1)
    return Sampling(*(float(v) for v in (mean[0], std[0], mean[1], std[1], mean[2])))


# --- the fit ---------------------------------------------------------------------------------


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
    time = np.array(
        [i.centroid_s - s.time_bias_s for i, s in zip(measured.impacts, samplings, strict=True)]
    )
    peak = np.array(
        [i.peak_n / s.peak_ratio for i, s in zip(measured.impacts, samplings, strict=True)]
    )
    peak_std = np.array([s.peak_std / s.peak_ratio for s in samplings])
    blocks = [_since_first(np.array([s.time_std_s for s in samplings]))]
    logs = np.log(peak[1:] / peak[0]) if with_peaks else np.empty(0)
    if with_peaks:
        blocks.append(_since_first(peak_std))
    size = sum(len(block) for block in blocks)
    covariance, at = np.zeros((size, size)), 0
    for block in blocks:
        covariance[at : at + len(block), at : at + len(block)] = block
        at += len(block)
    return Observed(time[1:] - time[0], logs, covariance, peak, peak_std)


def _since_first(std: Floats) -> Floats:
    """Covariance of x_k - x_1 for independent x."""
    return np.asarray(np.diag(std[1:] ** 2) + std[0] ** 2)


@dataclass(frozen=True)
class Fit:
    """The restitution to put into the deck.

    Attributes
    ----------
    restitution, low, high : float
        Best value and its 95 % interval.
    height_m : float
        Drop height that fits best, m.
    chi2 : float
        Weighted sum of squares at the best value.
    degrees : int
        Degrees of freedom; 0: nothing tests the fit.
    p_value : float or None
        Probability of a larger `chi2` if the model is right.
    inflation : float
        Factor on the interval because the residuals are larger than their
        uncertainties, the root of chi2 over degrees; 1 if they are not.
    residuals : (M,) ndarray
        Measured less simulated, over its standard uncertainty.
    """

    restitution: float
    low: float
    high: float
    height_m: float
    chi2: float
    degrees: int
    p_value: float | None
    inflation: float
    residuals: Floats


class Misfit:
    """Weighted sum of squares between a record and a sweep, by deck value.

    The drop height is a second unknown, known to `height_std_m`: flight times go
    with its root. For a given restitution the best height has a closed form,
    so what is left is a function of one number (profile likelihood).

    Parameters
    ----------
    observed : Observed
    emulator : Emulator
        The sweep at production.
    contact : sequence of Polynomial
        Contact part of the times, at the full modulus: the real particle is hard.
    height_m, height_std_m : float
    """

    def __init__(
        self,
        observed: Observed,
        emulator: Emulator,
        contact: Sequence[Polynomial],
        height_m: float,
        height_std_m: float,
    ) -> None:
        self.observed, self.emulator, self.contact = observed, emulator, contact
        self.height_m, self.spread = height_m, 0.5 * height_std_m / height_m
        flights, logs = len(observed.times_s), len(observed.log_peaks)
        errors = [emulator.errors[k] for k in range(flights)]
        errors += [emulator.errors[IMPACTS - 1 + k] for k in range(logs)]
        model = np.diag(np.square(errors))
        self._root = np.linalg.cholesky(observed.covariance + model)

    def parts(self, restitution: float) -> tuple[Floats, Floats]:
        """Whitened: measured less what does not depend on the height, and what does."""
        e, flights = self.emulator, len(self.observed.times_s)
        flight = np.cumsum([f(restitution) for f in e.flights_s[:flights]])
        touch = np.cumsum([c(restitution) for c in self.contact[:flights]])
        logs = [p(math.log(restitution)) for p in e.log_peaks[: len(self.observed.log_peaks)]]
        rest = np.concatenate([self.observed.times_s - touch, self.observed.log_peaks - logs])
        with_height = np.concatenate([flight, np.zeros(len(logs))])
        return np.linalg.solve(self._root, rest), np.linalg.solve(self._root, with_height)

    def speed_scale(self, restitution: float) -> float:
        """Best root of the height over the nominal one."""
        rest, slope = self.parts(restitution)
        weight = self.spread**-2
        return float((slope @ rest + weight) / (slope @ slope + weight))

    def residuals(self, restitution: float) -> Floats:
        """Measured less simulated, whitened, at the best height."""
        rest, slope = self.parts(restitution)
        return np.asarray(rest - self.speed_scale(restitution) * slope)

    def __call__(self, restitution: float) -> float:
        """Chi square at the best height."""
        left = self.residuals(restitution)
        return float(left @ left + ((self.speed_scale(restitution) - 1.0) / self.spread) ** 2)


def fit(misfit: Misfit) -> Fit:
    """The deck value with the least misfit, and its interval by profile likelihood.

    The interval ends where chi square is 3.84 (95 % of one degree of freedom)
    above its least value, times chi square over degrees of freedom where that
    is above 1 (Birge 1932, Physical Review 40, 207).

    Raises
    ------
    RecordError
        ``range``: the best value or its interval leaves the sweep.
    """
    e = misfit.emulator
    grid = np.linspace(e.low, e.high, 241)
    near = int(np.argmin([misfit(value) for value in grid]))
    bounds = (float(grid[max(near - 1, 0)]), float(grid[min(near + 1, len(grid) - 1)]))
    found = minimize_scalar(misfit, bounds=bounds, method="bounded", options={"xatol": 1e-9})
    best, least = float(found.x), float(found.fun)
    degrees = len(misfit.observed.times_s) + len(misfit.observed.log_peaks) - 1
    inflation = math.sqrt(max(1.0, least / degrees)) if degrees else 1.0
    rise = float(chi2.ppf(CONFIDENCE, 1)) * inflation**2

    def above(value: float) -> float:
        return misfit(value) - least - rise

    low, high = _edge(above, best, e.low), _edge(above, best, e.high)
    return Fit(
        restitution=best,
        low=low,
        high=high,
        height_m=misfit.height_m * misfit.speed_scale(best) ** 2,
        chi2=least,
        degrees=degrees,
        p_value=float(chi2.sf(least, degrees)) if degrees else None,
        inflation=inflation,
        residuals=misfit.residuals(best),
    )


def _edge(above: Callable[[float], float], best: float, end: float) -> float:
    """Where the misfit has risen enough, between the best value and the sweep's end."""
    if above(end) <= 0.0:
        raise RecordError(
            "range",
            "the restitution that fits is not inside the sweep",
            value=f"{best:.3f}, with an interval past {end:g}",
            limit="inside the sweep's range with its whole interval",
            remedy="check drop.height_m and the record: is it this particle on this plate?",
        )
    return float(brentq(above, best, end, xtol=1e-10))


# --- all together ----------------------------------------------------------------------------


@dataclass(frozen=True)
class Calibration:
    """A record, the sweep, and what follows.

    Attributes
    ----------
    measured : Measured
    samplings : tuple of Sampling
    observed : Observed
    with_peaks : bool
    why : str
        Why the peaks are or are not compared.
    production, reference : Emulator
        With the study's contact option.
    fit, fit_reference : Fit
        Deck value at production, and at the full modulus with the fine step.
    misfit : Misfit
        At production.
    """

    measured: Measured
    samplings: tuple[Sampling, ...]
    observed: Observed
    with_peaks: bool
    why: str
    production: Emulator
    reference: Emulator
    fit: Fit
    fit_reference: Fit
    misfit: Misfit


@dataclass(frozen=True)
class Sweep:
    """A sweep of drops, ready to be compared with records.

    Attributes
    ----------
    known : mapping
        What ``drops.json`` says of the study.
    reference_runs : list of DropRun
        Full modulus, fine step, the study's contact option.
    production, reference : Emulator
    """

    known: Mapping[str, Any]
    reference_runs: Sequence[DropRun]
    production: Emulator
    reference: Emulator


def prepare(drops: Drops) -> Sweep:
    """Make the models of a sweep."""
    known = drops.known
    option, height, gravity = known["limit_force"], known["height_m"], known["gravity_m_s2"]
    reference = drops.select("reference", option)
    return Sweep(
        known,
        reference,
        emulate(drops.select("production", option), height, gravity),
        emulate(reference, height, gravity, single=True),
    )


def calibrate(measured: Measured, sweep: Sweep) -> Calibration:
    """Fit the restitution to a record.

    Raises
    ------
    RecordError
        ``coarse`` or ``range``.
    """
    shapes = _nearest_shapes(measured.impacts, sweep.reference_runs)
    samplings = tuple(
        sample_impact(shape, measured, impact.peak_n)
        for shape, impact in zip(shapes, measured.impacts, strict=False)
    )
    ratio = measured.impacts[0].width_s / samplings[0].width_s
    with_peaks, why = _compare_peaks(ratio, sweep.known["peaks"])
    if ratio > WIDTH_LIMIT:
        samplings = _as_the_sensor_shows(measured, samplings)
    observed = observe(measured, samplings, with_peaks=with_peaks)
    height, spread = sweep.known["height_m"], sweep.known["height_std_m"]
    contact = sweep.reference.contact_s
    misfits = [
        Misfit(observed, e, contact, height, spread) for e in (sweep.production, sweep.reference)
    ]
    return Calibration(
        measured=measured,
        samplings=samplings,
        observed=observed,
        with_peaks=with_peaks,
        why=why,
        production=sweep.production,
        reference=sweep.reference,
        fit=fit(misfits[0]),
        fit_reference=fit(misfits[1]),
        misfit=misfits[0],
    )


def _nearest_shapes(impacts: Sequence[Impact], runs: Sequence[DropRun]) -> tuple[Waveform, ...]:
    """Impacts of the reference drop whose first flight is nearest the measured one."""
    flight = impacts[1].centroid_s - impacts[0].centroid_s
    times = [run.impacts[1].centroid_s - run.impacts[0].centroid_s for run in runs]
    return runs[int(np.argmin(np.abs(np.array(times) - flight)))].impacts


def _as_the_sensor_shows(measured: Measured, samplings: Sequence[Sampling]) -> tuple[Sampling, ...]:
    """What rate and noise do to impacts that a slow sensor widens.

    Each is taken to look like the first, whose samples are drawn again. Only
    the difference of two impacts counts, so their common delay does not.
    """
    time, force = measured.shape.T
    weight = np.maximum(force, 0.0)
    centroid = float(np.sum(weight * time) / np.sum(weight))
    shape = Waveform(time, force, time[0], time[-1], centroid, float(force.max()))
    return tuple(
        replace(sample_impact(shape, measured, impact.peak_n), width_s=sampling.width_s)
        for impact, sampling in zip(measured.impacts, samplings, strict=True)
    )


def _compare_peaks(ratio: float, wish: str) -> tuple[bool, str]:
    seen = f"the first impact is {ratio:.2f} times as wide as simulated at the full modulus"
    if wish != "auto":
        return wish == "yes", f"as the study asks; {seen}"
    if ratio > WIDTH_LIMIT:
        return False, f"{seen} and sampled alike: the sensor is too slow for peak forces"
    return True, f"{seen} and sampled alike: the sensor is fast enough"


def bias_rows(drops: Drops) -> list[dict[str, Any]]:
    """Effective against deck restitution for each purpose and contact option."""
    rows = []
    purposes: tuple[Purpose, ...] = ("production", "reference")
    for purpose in purposes:
        for option in (True, False):
            runs = drops.select(purpose, option)
            for value in sorted({run.restitution for run in runs}):
                found = np.array([r.rebound[:IMPACTS] for r in runs if r.restitution == value])
                rows.append(
                    {
                        "purpose": purpose,
                        "limit_force": option,
                        "restitution_deck": value,
                        "restitution_effective": float(found.mean()),
                        "lowest": float(found.min()),
                        "highest": float(found.max()),
                        "impacts": int(found.size),
                    }
                )
    return rows
