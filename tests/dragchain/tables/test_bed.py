from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from changed import changed
from hypothesis import given, settings
from hypothesis import strategies as st
from made_frames import frame

from dragchain import TableError, load_case
from dragchain.tables.bed import describe_bed, probed_height, segregation
from dragdeck.physics.walls import round_container

NAMES = ("x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s", "radius_m")


def test_a_bed_of_nothing_has_no_height() -> None:
    assert probed_height(np.empty((0, 3)), np.empty(0), round_container(0.04)) == 0.0


def test_where_no_particle_lies_the_probe_meets_the_floor() -> None:
    """Bowl of radius 1.5, pitch 1: probes on the axis and at distance 1, 5 in all."""
    height = probed_height(np.array([[0, 0, 0.5]]), np.array([0.5]), round_container(1.5))
    assert height == pytest.approx(1.0 / 5)


@given(st.lists(st.tuples(*[st.floats(-1, 1)] * 2, st.floats(0.1, 3), st.floats(0.1, 0.4))))
@settings(max_examples=60)
def test_it_is_what_a_plain_search_finds(particles) -> None:
    particles = [*particles, (0.0, 0.0, 0.3, 0.3)]
    table = np.array(particles)
    pitch = 2 * table[:, 3].mean()
    spots = [pitch * np.array([i, j]) for i in range(-8, 9) for j in range(-8, 9)]
    tops = []
    for spot in spots:
        if np.hypot(*spot) > 1.2 - pitch / 2:
            continue
        rest = table[:, 3] ** 2 - ((table[:, :2] - spot) ** 2).sum(axis=1)
        hits = [z + np.sqrt(r) for z, r in zip(table[:, 2], rest, strict=True) if r >= 0]
        tops.append(max(hits, default=0.0))
    assert probed_height(table[:, :3], table[:, 3], round_container(1.2)) == pytest.approx(
        np.mean(tops), rel=1e-6
    )


def test_a_bowl_narrower_than_a_particle_is_an_error() -> None:
    with pytest.raises(TableError, match="does not fit"):
        probed_height(np.array([[0, 0, 0.5]]), np.array([0.5]), round_container(0.4))


def test_describes_a_bed_of_one_particle_by_hand(tiny_run: Path) -> None:
    """Radius 0.03 in a bowl of 0.04: height 0.06, 4/3 r^3 / (R^2 h); v^2 / 2 over g d."""
    case = changed(load_case(tiny_run), gravity_m_s2=10.0)
    bed = describe_bed(frame(NAMES, [[0, 0, 0.03, 0.1, 0, 0.2, 0.03]]), case)
    assert bed.bed_height_m == pytest.approx(0.06)
    assert bed.solid_fraction == pytest.approx(4 / 3 * 0.03**3 / (0.04**2 * 0.06))
    assert bed.kinetic_energy_ratio == pytest.approx(0.5 * 0.05 / (10 * 0.06))
    assert (bed.n_particles, bed.radius_mean_m, bed.radius_std_m) == (1, 0.03, 0.0)
    floating = case.media.density_kg_m3 / 4
    media = case.media.model_copy(update={"buoyancy_kg_m3": floating})
    wet = describe_bed(frame(NAMES, [[0, 0, 0.03, 0.1, 0, 0.2, 0.03]]), changed(case, media=media))
    assert wet.kinetic_energy_ratio == pytest.approx(bed.kinetic_energy_ratio / 0.75)


def test_the_spread_of_radii_is_that_of_the_bed(tiny_run: Path) -> None:
    rows = [[0, 0, 0.01, 0, 0, 0, r] for r in (0.009, 0.010, 0.011)]
    bed = describe_bed(frame(NAMES, rows), load_case(tiny_run))
    assert bed.radius_std_m == pytest.approx(0.001 * (2 / 3) ** 0.5)
    assert bed.kinetic_energy_ratio == 0.0


def test_an_empty_bowl_is_an_error(tiny_run: Path) -> None:
    with pytest.raises(TableError, match="there is no packing"):
        describe_bed(frame(NAMES, []), load_case(tiny_run))


@pytest.mark.parametrize(
    ("heights", "index"), [([1.0, 3.0, 1.0, 3.0], 0.0), ([3.0, 3.0, 1.0, 1.0], 0.5)]
)
def test_segregation_is_half_where_one_of_two_equal_classes_lies_on_top(
    heights: list[float], index: float
) -> None:
    rows = pd.DataFrame({"z_m": heights, "radius_m": 1.0, "class": list("aabb")})
    assert segregation(rows) == {"a": pytest.approx(index), "b": pytest.approx(-index)}


def test_segregation_counts_particles_by_their_volume() -> None:
    """Eight particles of half the radius weigh as much as one: it lies above them."""
    rows = pd.DataFrame(
        {"z_m": [3.0] + 8 * [1.0], "radius_m": [2.0] + 8 * [1.0], "class": ["a"] + 8 * ["b"]}
    )
    assert segregation(rows) == {"a": pytest.approx(0.5), "b": pytest.approx(-0.5)}
