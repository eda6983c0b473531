"""Drops of one particle on a plate, as the engine made them: impacts sample by sample."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.polynomial.polynomial import polyfit, polyval

from dragchain.arrays import Floats
from dragchain.calibration.drops import IMPACTS, Drop, DropPurpose, DropTestOfStudy, drop_case
from dragchain.errors import TableError
from dragchain.tables.impacts import speed_at_plate
from dragchain.tables.run_folder import Run
from dragdeck.cases.case import Case
from dragdeck.engine.batch import Batch
from dragdeck.engine.reports import Report
from dragdeck.scenes.drop_test import drop_scene

_SAMPLES = ("step", "time_s", "z_m", "vz_m_s", "force_n")
"""Columns of a drop's output around its impacts."""


@dataclass(frozen=True)
class Waveform:
    """Force of one impact over time.

    Attributes
    ----------
    time_s, force_n : (N,) ndarray
        Every step; zero force at both ends.
    down_s, up_s : float
        When the particle's lowest point passes the plate's surface, s.
    centroid_s : float
        Mean time weighted with the force, s.
    peak_n : float
        Largest force, by a parabola through the three highest samples, N.
    """

    time_s: Floats
    force_n: Floats
    down_s: float
    up_s: float
    centroid_s: float
    peak_n: float


@dataclass(frozen=True)
class DropRun:
    """One simulated drop.

    Attributes
    ----------
    drop : Drop
        What it simulates.
    speeds_m_s : (K + 1,) ndarray
        Speed at the plate's surface before the first impact and after each.
    impacts : tuple of Waveform
        K of them.
    """

    drop: Drop
    speeds_m_s: Floats
    impacts: tuple[Waveform, ...]

    @property
    def rebound(self) -> Floats:
        """Speed after over speed before, of each of the impacts that are compared."""
        return np.asarray(self.speeds_m_s[1:] / self.speeds_m_s[:-1])[:IMPACTS]

    @property
    def effective(self) -> float:
        """Mean of `rebound`: the restitution that the drop shows."""
        return float(self.rebound.mean())


@dataclass(frozen=True)
class Drops:
    """Drops, and the drop test of the study."""

    known: DropTestOfStudy
    runs: tuple[DropRun, ...]

    def select(self, purpose: DropPurpose) -> list[DropRun]:
        """The runs of a purpose."""
        return [run for run in self.runs if run.drop.purpose == purpose]

    def _emulator(self, purpose: DropPurpose) -> "Emulator":
        known, runs = self.known, self.select(purpose)
        return emulate(runs, known.height_m, known.gravity_m_s2, single=purpose == "reference")

    @cached_property
    def production(self) -> "Emulator":
        """The model of the drops at the settings of the process runs."""
        return self._emulator("production")

    @cached_property
    def reference(self) -> "Emulator":
        """The model of the drops at the full modulus with a fine step."""
        return self._emulator("reference")


def run_drops(case: Case, drops: Sequence[Drop], batch: Batch, report: Report) -> Drops:
    """Run drops, each in a folder of its own, and read them.

    Parameters
    ----------
    case : Case
    drops : sequence of Drop
    batch : Batch
        Its folder gets a folder for each drop.
    report : callable
        Gets a line now and then.

    Raises
    ------
    EngineError, RejectedRunError
        A drop did not run to its end, or is no result.
    TableError
        A drop has too few impacts.
    DumpError
        As from the readers of a run.
    """
    for number, drop in enumerate(drops, start=1):
        batch.result(drop.name, drop_scene(drop_case(case, drop), drop.fidelity))
        if number % 20 == 0 or number == len(drops):
            report(f"{number} of {len(drops)} drops done")
    runs = tuple(_read_drop(batch.folder / drop.name, drop) for drop in drops)
    return Drops(DropTestOfStudy.of(case), runs)


def _read_drop(folder: Path, drop: Drop) -> DropRun:
    run = Run.open(folder)
    rows = pd.concat(
        [pd.DataFrame({name: block[name] for name in _SAMPLES}) for block in run.prints("impacts")]
    )
    windows = [window for _, window in rows.groupby((rows["step"].diff() != 1).cumsum())]
    if len(windows) < IMPACTS:
        raise TableError(f"{folder}: {len(windows)} impacts; a calibration requires {IMPACTS}")
    radius, gravity = run.case.media.radius_mean_m, run.case.gravity_m_s2
    pieces = [
        waveform({name: window[name].to_numpy(np.float64) for name in _SAMPLES}, radius, gravity)
        for window in windows
    ]
    speeds = np.array([pieces[0][1], *(piece[2] for piece in pieces)])
    return DropRun(drop, speeds, tuple(piece[0] for piece in pieces))


def waveform(
    window: Mapping[str, Floats], radius_m: float, gravity_m_s2: float
) -> tuple[Waveform, float, float]:
    """One impact, and the speeds at the plate's surface before and after it.

    The speeds are those of the samples next to the contact, moved to the surface
    (`dragchain.tables.impacts.speed_at_plate`).

    Parameters
    ----------
    window : mapping of str to (N,) ndarray
        ``time_s z_m vz_m_s force_n`` of the steps around one impact.
    radius_m, gravity_m_s2 : float

    Raises
    ------
    TableError
        The particle does not come from above and go back there within the window.
    """
    time, force, speed = window["time_s"], window["force_n"], window["vz_m_s"]
    gap = window["z_m"] - radius_m
    inside = np.flatnonzero(gap < 0.0)
    if not len(inside) or inside[0] == 0 or inside[-1] == len(gap) - 1:
        raise TableError(
            "an impact of a drop test is not entirely within its window; widen the window"
        )
    before, after = inside[0] - 1, inside[-1] + 1
    near = [before, after]
    down, up = speed_at_plate(speed[near], gap[near], gravity_m_s2).tolist()
    top = int(np.argmax(force))
    return (
        Waveform(
            time_s=time[before : after + 1],
            force_n=force[before : after + 1],
            down_s=float(time[before] + (down + speed[before]) / gravity_m_s2),
            up_s=float(time[after] - (up - speed[after]) / gravity_m_s2),
            centroid_s=float(np.sum(force * time) / np.sum(force)),
            peak_n=_parabola_top(force[top - 1 : top + 2]),
        ),
        down,
        up,
    )


def _parabola_top(three: Floats) -> float:
    """Height of the parabola through three even samples, the middle one the highest."""
    left, middle, right = (float(value) for value in three)
    bend = left - 2.0 * middle + right
    return middle if bend == 0.0 else middle - (right - left) ** 2 / (8.0 * bend)


# --- sweep ---------------------------------------------------------------------------------------


_DEGREE = 4
"""Of the polynomials through the sweep."""


@dataclass(frozen=True)
class Emulator:
    """What a drop does as a function of the deck's restitution.

    Attributes
    ----------
    low, high : float
        Range of the sweep.
    by_value : (5, 5) ndarray
        Polynomials in the restitution: flight time after impact 1 and 2, s, at the study's height;
        contact time between the centroids of impacts 1 and 2 and of 2 and 3, s; rebound.
    by_log : (5, 2) ndarray
        Polynomials in its logarithm, nearly straight lines: logarithm of the peak of impact 2 and
        3 over that of impact 1.
    errors : (4,) ndarray
        Standard uncertainty of flights (s) and logarithms.
    """

    low: float
    high: float
    by_value: Floats
    by_log: Floats
    errors: Floats

    def flights_s(self, restitution: float) -> Floats:
        """Time of the flight after each impact but the last, s."""
        return np.asarray(polyval(restitution, self.by_value[:, : IMPACTS - 1]))

    def contact_s(self, restitution: float) -> Floats:
        """Time in contact between the centroids of impacts that follow one another, s."""
        return np.asarray(polyval(restitution, self.by_value[:, IMPACTS - 1 : -1]))

    def log_peaks(self, restitution: float) -> Floats:
        """Logarithm of the peak of each impact but the first over that of the first."""
        return np.asarray(polyval(math.log(restitution), self.by_log))

    def rebound(self, restitution: float) -> float:
        """Speed after over speed before, mean of the impacts."""
        return float(polyval(restitution, self.by_value[:, -1]))


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
        Errors are the scatter of a single drop, not the smaller standard
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
    speeds = np.array([run.speeds_m_s[1:IMPACTS] for run in runs])
    peaks = np.log([[impact.peak_n for impact in run.impacts[:IMPACTS]] for run in runs])
    flights = 2.0 * speeds / gravity_m_s2 * scale[:, None]
    contacts, rebounds = [_contact_parts(run) for run in runs], [run.effective for run in runs]
    by_value, errors = _polynomials(
        value, np.column_stack([flights, contacts, rebounds]), single=single
    )
    by_log, of_peaks = _polynomials(np.log(value), peaks[:, 1:] - peaks[:, :1], single=single)
    return Emulator(
        low=float(value.min()),
        high=float(value.max()),
        by_value=by_value,
        by_log=by_log,
        errors=np.append(errors[: IMPACTS - 1], of_peaks),
    )


def _contact_parts(run: DropRun) -> list[float]:
    """Time between two centroids that is no flight, s, for each pair of impacts."""
    return [
        (first.up_s - first.centroid_s) + (second.centroid_s - second.down_s)
        for first, second in pairwise(run.impacts[:IMPACTS])
    ]


def _polynomials(value: Floats, columns: Floats, *, single: bool) -> tuple[Floats, Floats]:
    """Least-squares polynomials through (N, C) columns; scatter of one point, or of the mean."""
    coefficients = np.asarray(polyfit(value, columns, _DEGREE), dtype=np.float64)
    rest = columns - polyval(value, coefficients).T
    scatter: Floats = np.sqrt(np.sum(rest**2, axis=0) / (len(value) - _DEGREE - 1))
    return coefficients, scatter if single else scatter * math.sqrt((_DEGREE + 1) / len(value))
