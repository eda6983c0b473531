"""The settled bed: how high it stands and how dense it is."""

import numpy as np
import pandas as pd

from dragchain.arrays import Floats
from dragchain.errors import TableError
from dragchain.run.kinematics import needed
from dragdeck.dumps.frame import Frame
from dragdeck.physics.walls import Container
from dragdeck.records.case import CaseOfRun
from dragdeck.records.packing import Packing


def describe_bed(particles: Frame, case: CaseOfRun, spheres: Frame | None = None) -> Packing:
    """Describe a settled bed.

    Parameters
    ----------
    particles : Frame
        The last frame of ``particles``, N particles.
    case : CaseOfRun
        The case of the fill.
    spheres : Frame, optional
        What stands for the particles, if they are clumps.

    Raises
    ------
    TableError
        If there are no particles or the bowl is narrower than a particle.
    """
    if particles.rows == 0:
        raise TableError(
            f"step {particles.step}: the last frame of particles is empty, so there is no packing"
        )
    radius = particles.radii
    bowl = needed(case.bowl, "bowl")
    surface = spheres or particles
    height = probed_height(surface.centres, surface.radii, bowl, float(radius.mean()))
    volume = 4.0 / 3.0 * np.pi * radius**3
    density: Floats | float = case.media.density_kg_m3
    if case.classes:
        density = case.density_of(particles.ids("particle_id"))
    mass = volume * density
    energy = 0.5 * mass * (particles.vectors("vx_m_s", "vy_m_s", "vz_m_s") ** 2).sum(axis=1)
    weight = (mass - volume * case.media.buoyancy_kg_m3).mean()
    scale = weight * case.gravity_m_s2 * 2.0 * radius.mean()
    return Packing(
        bed_height_m=height,
        top_m=float((surface.columns["z_m"] + surface.columns["radius_m"]).max()),
        solid_fraction=float(volume.sum() / bowl.volume_m3(height)),
        n_particles=particles.rows,
        radius_mean_m=float(radius.mean()),
        radius_std_m=float(radius.std()),
        kinetic_energy_ratio=float(energy.mean() / scale),
    )


def segregation(particles: pd.DataFrame) -> dict[str, float]:
    """How far each class of the media has risen above the others, from -1 to 1.

    Ratio of the mean height of a class to that of all particles, minus one, both weighted by
    volume: 0 in a mixed bed; in a bed of two classes with equal volumes, 0.5 and -0.5 if one lies
    on top of the other.

    Parameters
    ----------
    particles : DataFrame
        ``z_m``, ``radius_m`` and ``class`` of one frame.
    """
    volume = particles["radius_m"] ** 3
    lifted = particles["z_m"] * volume
    every = lifted.sum() / volume.sum()
    by_class = particles["class"]
    heights = (
        lifted.groupby(by_class, observed=True).sum()
        / volume.groupby(by_class, observed=True).sum()
    )
    return {str(name): float(height / every - 1) for name, height in heights.items()}


def probed_height(
    centre_m: Floats, radius_m: Floats, bowl: Container, mean_m: float | None = None
) -> float:
    """Mean height at which a thin vertical probe meets the bed.

    The probe comes down at the points of a square grid, one mean particle diameter
    d apart and centred on the bowl's axis, at least d/2 from its upright walls. It
    stops on the highest particle above or below which the point lies: at
    ``z + sqrt(r^2 - s^2)``, s being its horizontal distance from the particle's
    centre, or on the floor if there is none.

    Parameters
    ----------
    centre_m : (N, 3) ndarray
        Centres, m, from the bowl's axis and floor.
    radius_m : (N,) ndarray
        Radii, m.
    bowl : Container
    mean_m : float, optional
        Half of d; by default the mean of the radii.

    Returns
    -------
    float
        The height above the floor, m; 0 without particles.

    Raises
    ------
    TableError
        If the bowl is narrower than a particle.
    """
    if not radius_m.size:
        return 0.0
    pitch = 2.0 * (float(radius_m.mean()) if mean_m is None else mean_m)
    x, y = (
        np.arange(-half, half + 1)
        for half in (max(0, int((width - 0.5 * pitch) / pitch)) for width in bowl.half_widths_m)
    )
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    points = pitch * grid.astype(np.float64)
    inside = bowl.side_distance(points) >= 0.5 * pitch
    if not inside.any():
        raise TableError(f"a particle of {pitch:g} m does not fit between the walls of the bowl")
    heights = _probe_heights(centre_m, radius_m, pitch, (len(x) // 2, len(y) // 2))
    if bowl.rim:  # narrower at the surface of the bed
        on_bed = inside & (heights.ravel() > 0.0)
        surface = np.full((len(points), 1), np.median(heights.ravel()[on_bed]))
        inside = on_bed & (bowl.distance(np.hstack([points, surface])) >= 0.5 * pitch)
    return float(heights.ravel()[inside].mean())


def _probe_heights(
    centre_m: Floats, radius_m: Floats, pitch: float, half: tuple[int, int]
) -> Floats:
    """Heights at the points ``pitch * (i, j)``, i and j from -half to half of each."""
    heights = np.zeros((2 * half[0] + 1, 2 * half[1] + 1))
    nearest = np.rint(centre_m[:, :2] / pitch).astype(np.int64)
    span = int(np.ceil(radius_m.max() / pitch))
    shifts = range(-span, span + 1)
    for shift in ((i, j) for i in shifts for j in shifts):
        point = nearest + np.array(shift)
        rest = radius_m**2 - ((pitch * point - centre_m[:, :2]) ** 2).sum(axis=1)
        hit = (rest >= 0.0) & (np.abs(point) <= np.array(half)).all(axis=1)
        top = centre_m[hit, 2] + np.sqrt(rest[hit])
        np.maximum.at(heights, tuple((point[hit] + np.array(half)).T), top)
    return heights
