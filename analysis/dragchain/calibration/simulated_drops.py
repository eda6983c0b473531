"""Drops of one particle on a plate, as the engine made them: impacts sample by sample."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from dragchain.arrays import Floats
from dragchain.dumps.run_parts import iter_prints
from dragchain.errors import TableError
from dragchain.run.case import load_case, load_outputs

Purpose = Literal["production", "reference", "confirm", "trial"]

IMPACTS = 3
"""Impacts that a calibration needs."""


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
    purpose : str
        ``production``, ``reference``, ``confirm`` or ``trial``.
    restitution : float
        In the deck.
    limit_force : bool
    height_m, youngs_modulus_scale, timestep_s, timestep_fraction : float
        The last is the step over the Rayleigh time of this particle at this modulus.
    speeds_m_s : (K + 1,) ndarray
        Speed at the plate's surface before the first impact and after each.
    impacts : tuple of Waveform
        K of them.
    """

    purpose: Purpose
    restitution: float
    limit_force: bool
    height_m: float
    youngs_modulus_scale: float
    timestep_s: float
    timestep_fraction: float
    speeds_m_s: Floats
    impacts: tuple[Waveform, ...]

    @property
    def rebound(self) -> Floats:
        """Speed after over speed before, of each impact."""
        return np.asarray(self.speeds_m_s[1:] / self.speeds_m_s[:-1])


@dataclass(frozen=True)
class Drops:
    """The drops of a folder and what ``drops.json`` says of the study."""

    known: Mapping[str, Any]
    runs: tuple[DropRun, ...]

    def select(self, purpose: Purpose, limit_force: bool | None = None) -> list[DropRun]:
        """The runs of a purpose, and of a contact option unless None."""
        return [
            run
            for run in self.runs
            if run.purpose == purpose and limit_force in (None, run.limit_force)
        ]


def read_drops(file: Path) -> Drops:
    """Read the drops that a ``drops.json`` lists.

    Raises
    ------
    TableError
        There is no such file, a drop is not complete, or has too few impacts.
    DocumentError, DumpError
        As from the readers of a run.
    """
    if not file.is_file():
        raise TableError(f"{file}: there is no such file; run `dragdeck drops` first")
    listed = json.loads(file.read_text(encoding="utf-8"))
    runs = tuple(_read_drop(file.parent / row["folder"], row) for row in listed.pop("drops"))
    return Drops(listed, runs)


def _read_drop(folder: Path, row: Mapping[str, Any]) -> DropRun:
    if not (folder / "run.json").is_file():
        raise TableError(f"{folder}: this drop is not complete; run `dragdeck drops` again")
    case = load_case(folder)
    blocks = list(iter_prints(folder, load_outputs(folder)["impacts"]))
    names = ("step", "time_s", "z_m", "vz_m_s", "force_n")
    columns = {
        name: np.concatenate([np.asarray(b[name], np.float64) for b in blocks]) for name in names
    }
    split = np.flatnonzero(np.diff(columns["step"]) != 1) + 1
    windows = [dict(zip(names, part, strict=True)) for part in _split(columns, names, split)]
    if len(windows) < IMPACTS:
        raise TableError(f"{folder}: {len(windows)} impacts, a calibration needs {IMPACTS}")
    radius, gravity = case.media.radius_mean_m, case.gravity_m_s2
    pieces = [waveform(window, radius, gravity) for window in windows]
    return DropRun(
        purpose=row["purpose"],
        restitution=row["restitution"],
        limit_force=row["limit_force"],
        height_m=row["height_m"],
        youngs_modulus_scale=row["youngs_modulus_scale"],
        timestep_s=row["timestep_s"],
        timestep_fraction=row["timestep_fraction"],
        speeds_m_s=np.array([pieces[0][1], *(piece[2] for piece in pieces)]),
        impacts=tuple(piece[0] for piece in pieces),
    )


def _split(
    columns: Mapping[str, Floats], names: Sequence[str], where: NDArray[np.intp]
) -> Iterable[tuple[Floats, ...]]:
    return zip(*(np.split(columns[name], where) for name in names), strict=True)


def waveform(
    window: Mapping[str, Floats], radius_m: float, gravity_m_s2: float
) -> tuple[Waveform, float, float]:
    """One impact, and the speeds at the plate's surface before and after it.

    The speeds are those of the samples next to the contact, moved to the
    surface by v^2 + 2 g (z - R), exact in free flight.

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
        raise TableError("an impact of a drop is not whole in its window; widen the window")
    before, after = inside[0] - 1, inside[-1] + 1
    fast = [math.sqrt(speed[k] ** 2 + 2 * gravity_m_s2 * gap[k]) for k in (before, after)]
    top = int(np.argmax(force))
    return (
        Waveform(
            time_s=time[before : after + 1],
            force_n=force[before : after + 1],
            down_s=float(time[before] + (fast[0] + speed[before]) / gravity_m_s2),
            up_s=float(time[after] - (fast[1] - speed[after]) / gravity_m_s2),
            centroid_s=float(np.sum(force * time) / np.sum(force)),
            peak_n=_parabola_top(force[top - 1 : top + 2]),
        ),
        fast[0],
        fast[1],
    )


def _parabola_top(three: Floats) -> float:
    """Height of the parabola through three even samples, the middle one the highest."""
    left, middle, right = (float(value) for value in three)
    bend = left - 2.0 * middle + right
    return middle if bend == 0.0 else middle - (right - left) ** 2 / (8.0 * bend)
