"""The angle of a surface from the positions of particles: of a heap, and of the bed in a drum."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from dragchain.arrays import Floats
from dragchain.errors import TableError
from dragchain.statistics.correlated import estimate_mean
from dragchain.tables.run_folder import Run
from dragdeck.dumps.frame import Frame
from dragdeck.records.run import read_accepted
from dragdeck.scenes.angles import AngleCase, AngleRun

_SECTORS = 8
"""Sectors of a heap; the scatter of its angle is that without one of them."""

_TIP, _TOE = 0.15, 0.7
"""Part of a heap's radius whose surface counts: the tip is rounded, the toe a single layer."""

_CENTRAL = 0.5
"""Half of the counted length of a drum's surface, over its radius: it bends near the wall."""

_ROUNDS = 5

_LEAST = 12
"""Particles of a surface."""


def exposed(flat: Floats, height: Floats, radius: Floats) -> NDArray[np.bool_]:
    """Whether nothing lies above the centre of each of N particles.

    Parameters
    ----------
    flat : (N, 2) array
        Horizontal coordinates of the centres, m.
    height, radius : (N,) array
        Of centres, and of particles, m.

    Returns
    -------
    (N,) array of bool
    """
    from scipy.spatial import cKDTree

    pairs = cKDTree(flat).query_pairs(float(radius.max()), output_type="ndarray")
    low, high = np.where(height[pairs[:, :1]] < height[pairs[:, 1:]], pairs, pairs[:, ::-1]).T
    covers = np.linalg.norm(flat[low] - flat[high], axis=1) < radius[high]
    uncovered = np.ones(len(flat), dtype=bool)
    uncovered[low[covers]] = False
    return uncovered


def heap_angle(centre: Floats, radius: Floats) -> tuple[float, float]:
    """Angle of the flank of a heap about the z axis, and its standard error, degrees.

    A straight line through the tops of exposed particles against their distance from the axis.
    The base radius is twice the median distance of all particles, as in a cone. The error is that
    of a jackknife over sectors (Efron and Stein 1981, Ann. Statist. 9, 586).

    Parameters
    ----------
    centre : (N, 3) array
        Of the particles, m.
    radius : (N,) array

    Raises
    ------
    TableError
        There is no surface.
    """
    away = np.linalg.norm(centre[:, :2], axis=1)
    base = 2 * float(np.median(away))
    flank = exposed(centre[:, :2], centre[:, 2], radius)
    flank &= (away > _TIP * base) & (away < _TOE * base)
    sector = (np.arctan2(centre[:, 1], centre[:, 0]) / (2 * np.pi) * _SECTORS) % _SECTORS // 1
    top = centre[:, 2] + radius
    whole = -_slope(away[flank], top[flank])
    without = [
        -_slope(away[rest], top[rest])
        for number in range(_SECTORS)
        for rest in [flank & (sector != number)]
    ]
    return whole, float(np.sqrt((_SECTORS - 1) * np.var(without)))


def drum_angle(centre: Floats, radius: Floats, drum_m: float) -> float:
    """Angle of the middle of the surface in a drum about z, gravity along -y, degrees.

    A straight line through the tops of exposed particles, as seen along the normal of the surface
    that the line of the round before gives.
    """
    angle = 0.0
    for _ in range(_ROUNDS):
        turn = np.radians(angle)
        along = centre[:, 0] * np.cos(turn) + centre[:, 1] * np.sin(turn)
        above = centre[:, 1] * np.cos(turn) - centre[:, 0] * np.sin(turn)
        seen = exposed(np.column_stack([along, centre[:, 2]]), above, radius)
        seen &= np.abs(along) < _CENTRAL * drum_m
        angle += _slope(along[seen], (above + radius)[seen])
    return angle


def _slope(x: Floats, y: Floats) -> float:
    """Angle of the straight line through points, degrees."""
    if len(x) < _LEAST:
        raise TableError(f"{len(x)} particles on the surface, not {_LEAST}: use more particles")
    return float(np.degrees(np.arctan(np.polyfit(x, y, 1)[0])))


def read_angle(folder: Path) -> Mapping[str, str | float]:
    """A simulated heap or drum: how it was simulated, its angle and standard error in degrees.

    The angle of a drum is the mean over frames, which are correlated.

    Raises
    ------
    TableError, RejectedRunError, DumpError
        The run is not complete, or has no surface.
    """
    read_accepted(folder)
    case = AngleCase.read(folder / "case.json")
    run, frame = case.angle, None
    angles: list[float] = []
    for frame in Run(folder, case).frames("particles"):
        if run.drum_radius_m and frame.step >= run.counted_from:
            angles.append(drum_angle(*_free(frame, run), run.drum_radius_m))
    assert frame is not None  # an accepted run has all its frames
    if run.drum_radius_m:
        mean = estimate_mean(angles)
        angle, error = mean.mean, mean.se
    else:
        angle, error = heap_angle(*_free(frame, run))
    return {**run.model_dump(), "angle_deg": angle, "se_deg": error}


def _free(frame: Frame, run: AngleRun) -> tuple[Floats, Floats]:
    """Centres and radii of the particles that are not glued."""
    free = frame.take(np.flatnonzero(frame.ids("particle_id") > run.glued))
    return free.centres, free.radii
