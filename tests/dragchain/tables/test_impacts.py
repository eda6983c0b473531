import numpy as np
import pytest

from dragchain.errors import TableError
from dragchain.tables import impacts
from dragchain.tables.impacts import speed_at_plate

DT = 0.5
RADIUS, GRAVITY = 0.25, 9.81


def rows(samples):
    """Samples of (step, speed upwards, force)."""
    table = np.array(samples, dtype=float)
    return {
        "step": table[:, 0].astype(np.int64),
        "time_s": DT * table[:, 0],
        "z_m": np.full(len(table), RADIUS),
        "vz_m_s": table[:, 1],
        "force_n": table[:, 2],
    }


def find_impacts(samples, timestep_s):
    """The particle's lowest point is at the plate's surface in every sample."""
    return impacts.find_impacts(samples, timestep_s, RADIUS, GRAVITY)


FIRST = [(10, -4, 0), (11, -3, 5), (12, 0, 9), (13, 2, 3), (14, 3, 0)]
SECOND = [(40, -3, 0), (41, 0, 7), (42, 1.5, 0), (43, 1, 0)]


def test_measures_two_impacts_by_hand() -> None:
    found = find_impacts(rows(FIRST + SECOND), DT)
    assert found["impact"].tolist() == [1, 2]
    assert found["start_time_s"].tolist() == [5.5, 20.5]
    assert found["duration_s"].tolist() == [1.5, 0.5]
    assert found["peak_force_n"].tolist() == [9, 7]
    assert found["speed_in_m_s"].tolist() == [4, 3]
    assert found["speed_out_m_s"].tolist() == [3, 1.5]
    assert found["restitution"].tolist() == [0.75, 0.5]
    assert found["time_since_first_s"].tolist() == [0, 15]


def test_two_impacts_in_one_stretch_are_two() -> None:
    close = [(15, -2, 0), (16, 0, 4), (17, 1, 0)]
    assert find_impacts(rows(FIRST + close), DT)["restitution"].tolist() == [0.75, 0.5]


def test_a_pull_at_the_end_belongs_to_the_impact() -> None:
    pulled = [(0, -2, 0), (1, 0, 8), (2, 1.9, -1), (3, 1.5, 0)]
    found = find_impacts(rows(pulled), DT)
    assert found["restitution"].tolist() == [0.75]
    assert found["duration_s"].tolist() == [1.0]


def test_gravity_between_the_surface_and_a_sample_is_taken_out() -> None:
    """Free flight on both sides of an impact that leaves half of the speed, 3 and 2 steps away."""
    fall, up, dt = 4.0, 2.0, 0.01
    time = np.array([-3 * dt, 0.0, 2 * dt])
    speed = np.array([-fall, 0.0, up]) - GRAVITY * time
    gap = np.array([-fall, 0.0, up]) * time - GRAVITY * time**2 / 2
    assert speed_at_plate(speed, gap, GRAVITY) == pytest.approx([fall, 0.0, up])
    seen = rows(np.column_stack([np.arange(3), speed, [0.0, 9.0, 0.0]]))
    seen |= {"time_s": time, "z_m": RADIUS + gap}
    assert find_impacts(seen, dt)["restitution"] == pytest.approx([up / fall], rel=1e-12)


@pytest.mark.parametrize(
    ("samples", "message"),
    [
        ([(0, -1, 0), (1, -2, 0)], "the particle never touched the plate"),
        ([*FIRST, (40, -3, 0), (41, -3, 0)], "steps 40 to 41: no force; the window"),
        (FIRST[1:], "steps 11 to 14: the window starts or ends during an impact"),
        (FIRST + SECOND[:2], "steps 40 to 41: the window starts or ends during an impact"),
        ([(0, 1, 0), (1, 0, 8), (2, 2, 0)], "does not have the sign of an impact"),
    ],
)
def test_refuses_samples_that_do_not_show_impacts(samples, message) -> None:
    with pytest.raises(TableError, match=message):
        find_impacts(rows(samples), DT)
