"""The media of a study as numbers: radii, Rayleigh time, neighbour skin."""

from functools import lru_cache

from dragdeck.physics.contact_mechanics import rayleigh_time
from dragdeck.physics.packing import Array, radii
from dragdeck.physics.rounding import round_to
from dragdeck.study.material import Material
from dragdeck.study.model import Media, Study


def bed_radii(study: Study) -> Array:
    """Radii of a study's particles in ascending order, (count,), m."""
    return media_radii(study.media)


@lru_cache(maxsize=2)
def media_radii(media: Media) -> Array:
    """`bed_radii` of the media alone; not to be changed."""
    return radii(media.count, media.radius_mean_m, media.radius_std_m)


def smallest_radius(study: Study) -> float:
    """Radius of the smallest particle of the bed, m."""
    return float(bed_radii(study).min())


def bed_rayleigh_time(study: Study) -> float:
    """Rayleigh time of the bed's smallest particle at the fidelity's modulus, s."""
    scale = study.chosen_fidelity().youngs_modulus_scale
    return rayleigh_time(particle_material(study), smallest_radius(study), scale)


def particle_material(study: Study) -> Material:
    """Material of the particles."""
    return study.materials[study.media.material]


def skin(study: Study) -> float:
    """Neighbour skin, m: the fidelity's own, or a tenth of the mean radius."""
    chosen = study.chosen_fidelity().skin_m
    return chosen if chosen is not None else round_to(0.1 * study.media.radius_mean_m, 3)
