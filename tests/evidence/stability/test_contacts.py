"""Contacts of particles, bowl and workpiece, and their network."""

import math

import numpy as np
import pytest

from dragchain.contact_law.hertz import sphere_mass
from dragdeck.decks.case_file import CaseOfStudy, MediaOfRun
from dragdeck.physics.contact_network import ContactConstants
from evidence.stability.contacts import (
    BOWL,
    PARTICLE,
    WORKPIECE,
    Contacts,
    network_frequency,
    touching,
)


def test_particles_that_touch_are_found_with_their_overlaps() -> None:
    centre = np.array([[0.0, 0.0, 0.9], [1.9, 0.0, 1.0], [1.9, 0.0, 3.1]])
    found = touching(centre, np.ones(3), bowl_radius_m=2.7)
    rows = sorted(zip(found.a.tolist(), found.b.tolist(), found.overlap_m.tolist(), strict=True))
    assert [row[:2] for row in rows] == [(0, -1), (0, 1), (1, -1), (2, -1)]
    gap = math.hypot(1.9, 0.1)
    assert [row[2] for row in rows] == pytest.approx([0.1, 2 - gap, 0.2, 0.2])
    assert found.partner.tolist() == [BOWL if b < 0 else PARTICLE for b in found.b]


@pytest.mark.parametrize(("partner", "modulus"), [(BOWL, 1e9), (WORKPIECE, 4e9)])
def test_each_contact_has_the_moduli_of_its_partner(partner: int, modulus: float) -> None:
    """One particle on a plane without friction: the root of 2 E* sqrt(R d) / m."""
    moduli = {
        name: ContactConstants(modulus_pa=own, shear_pa=1.0, restitution=0.9, friction=0.3)
        for name, own in (("particle", 7e9), ("bowl", 1e9), ("workpiece", 4e9))
    }
    media = MediaOfRun(count=1, radius_mean_m=1e-3, radius_std_m=0.0, density_kg_m3=2500.0)
    case = CaseOfStudy.model_construct(contact_moduli=moduli, media=media)
    plane = Contacts(
        a=np.array([0]),
        b=np.array([-1]),
        partner=np.array([partner]),
        normal=np.array([[0.0, 0.0, -1.0]]),
        overlap_m=np.array([1e-6]),
    )
    stiffness = 2 * modulus * math.sqrt(1e-3 * 1e-6)
    found = network_frequency(case, False, np.array([1e-3]), plane)
    assert found == pytest.approx(math.sqrt(stiffness / sphere_mass(1e-3, 2500.0)))
