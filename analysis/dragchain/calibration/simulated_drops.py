"""Drops of one particle on a plate, as the engine made them: impacts sample by sample."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
import pandas as pd
from pydantic import PositiveFloat

from dragchain.arrays import Floats
from dragchain.calibration.measured_impacts import IMPACTS
from dragchain.documents import Document, Part
from dragchain.errors import TableError
from dragchain.run.case import load_case, load_outputs
from dragchain.run.run_parts import iter_prints
from dragchain.tables.impacts import speed_at_plate

Purpose = Literal["production", "reference", "confirm"]

_SAMPLES = ("step", "time_s", "z_m", "vz_m_s", "force_n")
"""Columns of a drop's output around its impacts."""


class DropTest(Document):
    """The drop test of the study, as in ``drops.json``.

    Attributes
    ----------
    pair : str
        Particle and plate, as the study names their pair.
    record : str
        The CSV of the measured drop test.
    height_m, height_std_m : float
        Drop height (gap below the particle) and its standard uncertainty, m.
    peaks : str
        Whether to compare peak forces.
    limit_force : bool
        Whether tensile normal forces are suppressed, as in the study.
    restitution_now : float
        Coefficient of restitution of the study.
    fall_time_s, contact_time_s : float
        Time of the fall before the first impact, and contact time of an elastic impact, s.
    """

    made_by: ClassVar[str] = "snakemake calibrate"

    study: str
    title: str
    pair: str
    fidelity: str
    record: str
    height_m: PositiveFloat
    height_std_m: PositiveFloat
    peaks: Literal["auto", "yes", "no"]
    gravity_m_s2: PositiveFloat
    limit_force: bool
    restitution_now: float
    fall_time_s: PositiveFloat
    contact_time_s: float


class Settings(Part):
    """Modulus and step of a drop; the fraction is that of this particle's Rayleigh time."""

    youngs_modulus_scale: PositiveFloat
    timestep_s: PositiveFloat
    timestep_fraction: PositiveFloat


class Drop(Settings):
    """A drop that ``drops.json`` lists.

    Attributes
    ----------
    folder : str
        Beside the list.
    purpose : str
        ``production``, ``reference`` or ``confirm``.
    restitution : float
        In the deck.
    """

    folder: str
    purpose: Purpose
    restitution: PositiveFloat
    limit_force: bool
    height_m: PositiveFloat


class DropsFile(DropTest):
    """The content of ``drops.json``."""

    drops: tuple[Drop, ...]


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
        As it is listed.
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
    """The drops of a folder and what ``drops.json`` says of the study."""

    known: DropTest
    runs: tuple[DropRun, ...]

    def select(self, purpose: Purpose, limit_force: bool | None = None) -> list[DropRun]:
        """The runs of a purpose, and of a contact option unless None."""
        return [
            run
            for run in self.runs
            if run.drop.purpose == purpose and limit_force in (None, run.drop.limit_force)
        ]


def read_drops(file: Path) -> Drops:
    """Read the drops that a ``drops.json`` lists.

    Raises
    ------
    TableError
        A drop is not complete, or has too few impacts.
    DocumentError, DumpError
        The list cannot be used, or as from the readers of a run.
    """
    listed = DropsFile.read(file)
    return Drops(
        listed, tuple(_read_drop(file.parent / drop.folder, drop) for drop in listed.drops)
    )


def _read_drop(folder: Path, drop: Drop) -> DropRun:
    if not (folder / "run.json").is_file():
        raise TableError(f"{folder}: this drop is not complete; run `snakemake calibrate` again")
    case = load_case(folder)
    blocks = iter_prints(folder, load_outputs(folder)["impacts"])
    rows = pd.concat([pd.DataFrame({name: block[name] for name in _SAMPLES}) for block in blocks])
    windows = [window for _, window in rows.groupby((rows["step"].diff() != 1).cumsum())]
    if len(windows) < IMPACTS:
        raise TableError(f"{folder}: {len(windows)} impacts; a calibration requires {IMPACTS}")
    radius, gravity = case.media.radius_mean_m, case.gravity_m_s2
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
