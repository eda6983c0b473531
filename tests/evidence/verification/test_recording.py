"""Reading runs of the verification suite, on motions made by hand."""

import pytest
from recordings import ON_PARTICLE, ON_PLANE, recording

from dragchain.errors import TableError
from evidence.verification.law import RelativeMotion


def test_overlap_is_measured_to_a_plane_and_to_a_particle() -> None:
    plane, particle = recording([[0.9, 2.7]], contacts=[ON_PLANE, ON_PARTICLE]).contacts
    assert plane.overlap_m == pytest.approx([0.1])
    assert particle.overlap_m == pytest.approx([0.2])


def test_each_contact_has_the_constants_of_its_pair() -> None:
    run = recording([[0.9, 2.7]], contacts=[ON_PLANE, ON_PARTICLE])
    plane, particle = (contact.constants for contact in run.contacts)
    assert (plane.restitution, particle.restitution) == (0.5, 0.9)
    assert particle.modulus_pa == pytest.approx(2e11 / 0.91 / 2)
    assert particle.shear_pa == pytest.approx(2e11 / (4 * 1.7 * 1.3))
    assert plane.partner is None


def test_a_duration_is_read_between_frames() -> None:
    contact = recording([[1.1], [0.9], [0.9], [1.3]]).contact
    assert contact.duration_s == pytest.approx(1.75)  # from 0.5 s to 2.25 s


@pytest.mark.parametrize("heights", [[1.1, 0.9], [0.9, 1.1], [1.1, 1.2]])
def test_an_impact_that_is_not_whole_is_refused(heights: list[float]) -> None:
    contact = recording([[height] for height in heights]).contact
    with pytest.raises(TableError, match="not whole"):
        _ = contact.before


def test_the_underside_of_a_particle_that_turns_about_y_moves_backwards() -> None:
    run = recording([[1.1], [0.9], [1.1]])
    run.spin_rad_s[0, 0, 1] = 2.0
    before = run.contact.before
    assert before == RelativeMotion(pytest.approx(0.2), 0.0, -2.0)
    assert before.patch_m_s(run.contact.constants) == pytest.approx(-2.0)
