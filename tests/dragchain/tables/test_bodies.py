"""Spheres as bodies: their motion from that of the spheres, and one contact where two meet."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from dragchain.errors import TableError
from dragchain.tables.bodies import Bodies
from dragchain.tables.columns import CENTRE, ORIENTATION, SPIN, VELOCITY
from dragchain.tables.network_contacts import KINDS, ContactRows
from dragchain.tables.workpiece_contacts import WallContacts
from dragdeck.dumps.frame import Frame
from dragdeck.records.bed import BodiesOfRun
from dragdeck.records.case import CaseOfRun

L_SHAPE = ((0.2, 0.1, 0.0), (-0.3, 0.1, 0.0), (0.2, -0.4, 0.3))
ROW = ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0))


def _bodies() -> Bodies:
    """Three bodies of three spheres and two of two."""
    usual: dict[str, Any] = {"mass_kg": 1.0, "inertia_kg_m2": (1.0, 1.0, 1.0)}
    first = BodiesOfRun(first_id=1, count=3, first_sphere=1, radius_m=0.7, offsets_m=L_SHAPE,
                        radii_m=(0.3, 0.3, 0.3), **usual)  # fmt: skip
    second = BodiesOfRun(first_id=4, count=2, first_sphere=10, radius_m=1.1, offsets_m=ROW,
                         radii_m=(0.9, 0.9), **usual)  # fmt: skip
    case = SimpleNamespace(bodies=(first, second))
    case.body_of = lambda ids: CaseOfRun.body_of(cast(CaseOfRun, case), ids)
    return Bodies(cast(CaseOfRun, case))


def _moving(seed: int = 3) -> tuple[Frame, dict[str, np.ndarray[Any, Any]]]:
    """A frame of spheres in no order, and what their bodies do."""
    random = np.random.default_rng(seed)
    centre, velocity, spin = random.normal(size=(3, 5, 3))
    turned = Rotation.random(5, rng=random)
    rows = []
    for at in range(5):
        for offset in L_SHAPE if at < 3 else ROW:
            arm = turned[at].apply(offset)
            moved = velocity[at] + np.cross(spin[at], arm)
            rows.append([len(rows) + 1, at + 1, *(centre[at] + arm), *moved, *spin[at], 0.3])
    names = ("particle_id", "body_id", *CENTRE, *VELOCITY, *SPIN, "radius_m")
    table = np.array(rows)[random.permutation(len(rows))]
    frame = Frame(7, dict(zip(names, table.T, strict=True)))
    return frame, {"centre": centre, "velocity": velocity, "spin": spin,
                   "quaternion": turned.as_quat(canonical=True, scalar_first=True)}  # fmt: skip


def test_bodies_move_as_their_spheres_do() -> None:
    spheres, known = _moving()
    found = _bodies().frame(spheres)
    assert found.ids("particle_id").tolist() == [1, 2, 3, 4, 5]
    np.testing.assert_allclose(found.vectors(*CENTRE), known["centre"], atol=1e-12)
    np.testing.assert_allclose(found.vectors(*VELOCITY), known["velocity"], atol=1e-12)
    np.testing.assert_allclose(found.vectors(*SPIN), known["spin"])
    assert found.columns["radius_m"].tolist() == [0.7, 0.7, 0.7, 1.1, 1.1]
    quaternion = found.vectors(*ORIENTATION)
    np.testing.assert_allclose(quaternion[:3], known["quaternion"][:3], atol=1e-12)
    # two spheres leave the angle about their line open, and give its direction
    lines = [
        Rotation.from_quat(one[3:], scalar_first=True).apply([1, 0, 0])
        for one in (quaternion, known["quaternion"])
    ]
    np.testing.assert_allclose(*lines, atol=1e-12)


@pytest.mark.parametrize("spoil", ["body_id", "missing"])
def test_spheres_of_other_bodies_are_refused(spoil: str) -> None:
    spheres, _ = _moving()
    if spoil == "missing":
        spheres = spheres.take(np.arange(spheres.rows - 1))
    else:
        spheres.columns["body_id"][0] += 1
    with pytest.raises(TableError, match=r"step 7: the spheres .* case\.json"):
        _bodies().frame(spheres)


def _rows(kind: list[int], a: list[int], b: list[int], normal: Any, force: Any) -> ContactRows:
    force, normal = np.array(force, dtype=float), np.array(normal, dtype=float)
    along = np.einsum("ij,ij->i", force, normal)
    return ContactRows(
        np.array(kind, dtype=np.int8), np.array(a), np.array(b),
        point_m=np.arange(len(a), dtype=float)[:, None] * [1.0, 0, 0], force_n=force,
        normal_force_n=along,
        tangential_force_n=np.linalg.norm(force - along[:, None] * normal, axis=1),
        overlap_m=0.1 * np.arange(1.0, len(a) + 1), normal=normal,
    )  # fmt: skip


def test_contacts_between_the_same_bodies_are_one() -> None:
    """Spheres 1 and 2 of body 1 touch sphere 4 of body 2, written from either side."""
    pair, floor = KINDS.index("particle-particle"), KINDS.index("particle-floor")
    up = [0.0, 0, 1]
    rows = _rows(
        [pair, pair, pair, floor, floor],
        [4, 1, 2, 3, 11],
        [1, 10, 4, -1, -1],
        [up, up, [0, 0, -1], up, up],
        [[0, 0, 3], [1, 0, 2], [0.5, 0, -1], [0, 0, 5], [0, 0, 7]],
    )
    found = _bodies().network(rows)
    assert list(zip(found.a_id.tolist(), found.b_id.tolist(), strict=True)) == [
        (1, 2), (1, 4), (1, -1), (4, -1)
    ]  # fmt: skip
    # on body 1: minus the force on body 2 as written first, plus that on sphere 2
    np.testing.assert_allclose(found.force_n[0], [0.5, 0, -4])
    assert found.normal_force_n[0] == pytest.approx(4)
    assert found.tangential_force_n[0] == pytest.approx(0.5)
    np.testing.assert_allclose(found.point_m[0], [(3 * 0 + 1 * 2) / 4, 0, 0])
    assert found.overlap_m[0] == pytest.approx(0.3)


def test_contacts_of_a_body_on_the_workpiece_are_one() -> None:
    """The second one is the strongest; a silent one adds nothing and lends no velocity."""
    up = [0.0, 0, 1]
    contacts = WallContacts(
        particle_id=np.array([1, 2, 3, 10]), facet_id=np.array([5, 6, 7, 8]),
        point_m=np.eye(4)[:, :3],
        force_n=np.array([[0, 0, 1.0], [0.5, 0, 3], [0, 0, 0], [0, 0, 2]]),
        normal=np.array([up, up, [0, 0, 0], up]),
        surface_m_s=np.array([[1.0] * 3, [2.0] * 3, [np.nan] * 3, [4.0] * 3]),
        overlap_m=np.array([1.0, 2, 9, 4]), attraction_n=np.array([0.1, 0.2, 0, 0.4]),
        silent=np.array([False, False, True, False]),
    )  # fmt: skip
    found, at = _bodies().wall(contacts, np.array([0, 0, 0, 0]))
    assert found.particle_id.tolist() == [1, 4] and at.tolist() == [0, 0]
    np.testing.assert_allclose(found.force_n, [[0.5, 0, 4], [0, 0, 2]])
    assert found.facet_id.tolist() == [6, 8] and found.silent.tolist() == [False, False]
    np.testing.assert_allclose(found.surface_m_s, [[2.0] * 3, [4.0] * 3])
    np.testing.assert_allclose(found.normal_force_n(), [4, 2])
    np.testing.assert_allclose(found.attraction_n, [0.3, 0.4])
    same, steps = _bodies().wall(contacts, np.array([0, 1, 1, 2]))
    assert steps.tolist() == [0, 1, 2] and same.particle_id.tolist() == [1, 1, 4]


def test_no_contacts() -> None:
    none = _rows([], [], [], np.empty((0, 3)), np.empty((0, 3)))
    assert len(_bodies().network(none).kind) == 0
