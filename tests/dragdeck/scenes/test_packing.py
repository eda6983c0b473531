"""The particles before they fall."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from dragdeck.errors import InputError
from dragdeck.physics.packing import pour
from dragdeck.physics.walls import round_container
from dragdeck.study.media import quantiles


@settings(max_examples=25)
@given(
    count=st.integers(1, 600),
    width=st.floats(3, 20),
    spread=st.floats(0, 0.3),
    seed=st.integers(0, 2**32 - 1),
)
def test_no_particle_touches_another_or_the_bowl(
    count: int, width: float, spread: float, seed: int
) -> None:
    mean = 3e-3
    bowl = width * mean
    sizes = quantiles("normal", mean, spread * mean, count)
    if bowl < (1 + 0.2 * 2**0.5) * sizes.max():
        with pytest.raises(InputError, match="does not fit"):
            pour([sizes], round_container(bowl), seed)
        return
    particles = pour([sizes], round_container(bowl), seed)
    assert sorted(particles.radii_m) == sorted(sizes)
    x, y, z = particles.positions_m.T
    assert (np.hypot(x, y) + particles.radii_m).max() < bowl
    assert (z - particles.radii_m).min() > 0
    assert particles.velocities_m_s[:, 2].max() <= 0
    pairs = cKDTree(particles.positions_m).query_pairs(2 * sizes.max(), output_type="ndarray")
    gaps = np.linalg.norm(np.diff(particles.positions_m[pairs], axis=1)[:, 0], axis=1)
    assert (gaps > particles.radii_m[pairs].sum(axis=1)).all()


def test_the_seed_decides() -> None:
    sizes = quantiles("normal", 3e-3, 2e-4, 50)
    first, again, other = (pour([sizes], round_container(0.03), seed) for seed in (1, 1, 2))
    assert np.array_equal(first.positions_m, again.positions_m)
    assert not np.array_equal(first.positions_m, other.positions_m)
