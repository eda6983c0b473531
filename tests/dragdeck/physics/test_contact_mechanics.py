"""Formulae against independent numbers."""

import math

import pytest
from scipy.integrate import solve_ivp

from dragdeck.physics.contact_mechanics import (
    effective_modulus,
    effective_shear,
    fall_speed,
    hertz_contact_time,
    hertz_overlap,
    impact_overlap,
    particle_mass,
    rayleigh_time,
    shear_modulus,
)
from dragdeck.study.workpiece import Material

CERAMIC = Material(youngs_modulus_pa=77e9, poissons_ratio=0.19, density_kg_m3=2656)
STEEL = Material(youngs_modulus_pa=210e9, poissons_ratio=0.30, density_kg_m3=7610)
RADIUS = 3.27e-3


def test_rayleigh_time_of_the_papers_particle() -> None:
    assert rayleigh_time(CERAMIC, RADIUS) == pytest.approx(3.24e-6, rel=2e-3)


def test_softer_particles_have_a_longer_rayleigh_time() -> None:
    ratio = rayleigh_time(CERAMIC, RADIUS, scale=0.01) / rayleigh_time(CERAMIC, RADIUS)
    assert ratio == pytest.approx(10)


def test_shear_modulus_of_an_incompressible_body_is_a_third() -> None:
    rubber = Material(youngs_modulus_pa=3e6, poissons_ratio=0.499999, density_kg_m3=1e3)
    assert shear_modulus(rubber) == pytest.approx(1e6, rel=1e-5)


def test_effective_modulus_of_two_alike() -> None:
    alike = effective_modulus(CERAMIC, CERAMIC)
    assert alike == pytest.approx(77e9 / (2 * (1 - 0.19**2)))
    shear = 77e9 / (4 * (2 - 0.19) * (1 + 0.19))
    assert effective_shear(CERAMIC, CERAMIC) == pytest.approx(shear)
    rigid = Material(youngs_modulus_pa=1e20, poissons_ratio=0.3, density_kg_m3=1)
    assert effective_modulus(CERAMIC, rigid) == pytest.approx(2 * alike)


def test_contact_time_against_the_integrated_impact() -> None:
    mass, speed = particle_mass(CERAMIC, RADIUS), fall_speed(0.01, 9.81)
    modulus = effective_modulus(CERAMIC, STEEL)
    stiffness = 4 / 3 * modulus * math.sqrt(RADIUS)

    def motion(_: float, state: list[float]) -> list[float]:
        return [state[1], -stiffness / mass * max(state[0], 0.0) ** 1.5]

    def apart(_: float, state: list[float]) -> float:
        return state[0]

    apart.terminal, apart.direction = True, -1  # type: ignore[attr-defined]
    impact = solve_ivp(
        motion, (0, 1), [0.0, speed], events=apart, rtol=1e-9, atol=1e-15, max_step=1e-6
    )
    expected = impact.t_events[0][0]
    assert hertz_contact_time(mass, RADIUS, modulus, speed) == pytest.approx(expected, rel=5e-3)


def test_overlap_gives_back_the_force() -> None:
    modulus = effective_modulus(CERAMIC, STEEL)
    overlap = hertz_overlap(2.5, RADIUS, modulus)
    assert 4 / 3 * modulus * math.sqrt(RADIUS) * overlap**1.5 == pytest.approx(2.5)


@pytest.mark.parametrize(("speed", "overlap"), [(1.0, 0.032), (2.0, 0.056), (3.0, 0.077)])
def test_the_overlap_of_an_impact(speed: float, overlap: float) -> None:
    """Half of the overlap over the radius, in sphere on sphere impacts of soft ceramic."""
    modulus = 77e6 / (2 * (1 - 0.19**2))
    assert impact_overlap(2656.0, modulus, speed) == pytest.approx(overlap / 2, rel=0.02)
