"""``packing.json``: the settled packing, from which a process starts."""

from dragdeck.documents import Document


class Packing(Document):
    """The settled packing: ``packing.json``.

    Attributes
    ----------
    bed_height_m : float
        Height of the settled surface, m.
    top_m : float
        Highest point of any particle, m.
    solid_fraction : float
        Volume of the particles / volume of the bowl up to the bed height.
    radius_std_m : float
        Standard deviation of the radii (divisor N), m.
    kinetic_energy_ratio : float
        Mean translational kinetic energy per particle / (m g d):
        ``mean(m v^2 / 2) / (mean(m) g d)``.
    n_particles : int
        Number of particles.
    radius_mean_m : float
        Mean radius, m.
    """

    remedy = "make it with: ./run dragchain tables FILLING_DIR"

    bed_height_m: float
    top_m: float
    solid_fraction: float
    n_particles: int
    radius_mean_m: float
    radius_std_m: float
    kinetic_energy_ratio: float
