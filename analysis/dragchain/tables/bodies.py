"""Spheres of clumps as the bodies that they are: their motion, and one contact where two meet.

LIGGGHTS numbers and writes spheres. They are counted body by body in the order of the bodies' ids,
so that ids of bodies follow from those of spheres; the dumps of particles have both.
"""

from dataclasses import dataclass, replace

import numpy as np

from dragchain.arrays import Floats, Ints
from dragchain.errors import TableError
from dragchain.tables.columns import CENTRE, ORIENTATION, SPIN, VELOCITY
from dragchain.tables.network_contacts import ContactRows
from dragchain.tables.workpiece_contacts import WallContacts, sums
from dragdeck.dumps.frame import Columns, Frame
from dragdeck.physics.rigid import pose
from dragdeck.records.bed import BodiesOfRun
from dragdeck.records.case import CaseOfRun


@dataclass(frozen=True)
class Bodies:
    """The clumps of a run; false if its particles are spheres."""

    case: CaseOfRun

    def __bool__(self) -> bool:
        """Whether particles are clumps."""
        return bool(self.case.bodies)

    def frame(self, spheres: Frame) -> Frame:
        """A frame with a row per body in the order of their ids, from one of all spheres.

        Centre of mass and orientation are those that place the spheres where they are; see `pose`.

        Raises
        ------
        TableError
            Spheres are missing, or belong to other bodies than their ids say.
        """
        spheres = spheres.by_particle()
        ids = spheres.ids("particle_id")
        count = self.case.bodies[-1].rows.stop
        wrong = self.case.body_of(ids) != spheres.ids("body_id")
        if not np.array_equal(ids, np.arange(1, count + 1)) or wrong.any():
            raise TableError(
                f"step {spheres.step}: the spheres of particles are not those of case.json"
            )
        parts = [_moving(spheres, body) for body in self.case.bodies]
        return Frame(
            spheres.step,
            {name: np.concatenate([part[name] for part in parts]) for name in parts[0]},
        )

    def network(self, rows: ContactRows) -> ContactRows:
        """Contacts of spheres as those of bodies, in the order of kind, body a and body b.

        Several contacts between the same two bodies become one: the sum of their forces, at the
        mean of their points, weighted by normal force, with the largest overlap. Its normal force
        is the part of the sum along the resultant of the normal forces.
        """
        a, b = self.case.body_of(rows.a_id), self.case.body_of(rows.b_id)
        sign = np.ones(len(rows.kind))
        turned = (b > 0) & (a > b)
        a, b, sign[turned] = np.where(turned, b, a), np.where(turned, a, b), -1.0
        keys = np.column_stack([rows.kind, a, b])
        first, at = _groups(keys)
        force, normal, joined = _joined(
            at, len(first), sign[:, None] * rows.force_n, sign[:, None] * rows.normal,
            rows.normal_force_n, rows.point_m,
        )  # fmt: skip
        along = np.einsum("ij,ij->i", force, normal)
        return ContactRows(
            kind=rows.kind[first],
            a_id=a[first],
            b_id=b[first],
            point_m=joined,
            force_n=force,
            normal=normal,
            normal_force_n=along,
            tangential_force_n=np.linalg.norm(force - along[:, None] * normal, axis=1),
            overlap_m=_largest(at, len(first), rows.overlap_m),
        )

    def of_spheres(self, contacts: WallContacts) -> WallContacts:
        """Contacts of spheres with a wall under the ids of their bodies."""
        return replace(contacts, particle_id=self.case.body_of(contacts.particle_id))

    def wall(self, contacts: WallContacts, at: Ints) -> tuple[WallContacts, Ints]:
        """Contacts of spheres with a wall at their steps as those of bodies; see `network`.

        They tell how many there are; what is summed over contacts is of `of_spheres`. Point, facet
        and surface velocity are those of the contact with the largest normal force.
        """
        body = self.case.body_of(contacts.particle_id)
        first, group = _groups(np.column_stack([at, body]))
        order = np.lexsort((contacts.normal_force_n(), ~contacts.silent, group))
        strongest = order[np.cumsum(np.bincount(group, minlength=len(first))) - 1]
        forces = contacts.force_n, contacts.normal, contacts.normal_force_n(), contacts.point_m
        force, normal, _ = _joined(group, len(first), *forces)
        kept = contacts.select(strongest)
        whole = replace(
            kept,
            particle_id=body[strongest],
            force_n=force,
            normal=normal,
            overlap_m=_largest(group, len(first), contacts.overlap_m),
            attraction_n=_sum(group, contacts.attraction_n, len(first)),
        )
        return whole, at[strongest]


def _moving(spheres: Frame, size: BodiesOfRun) -> Columns:
    """Motion of the bodies of one size, from all spheres in the order of their ids."""
    places, velocity, spin = (
        size.by_particle(spheres.vectors(*names)) for names in (CENTRE, VELOCITY, SPIN)
    )
    centre, turned = pose(np.array(size.offsets_m), places)
    arm, spin = places.mean(axis=1) - centre, spin[:, 0]
    motion = {
        CENTRE: centre,
        VELOCITY: velocity.mean(axis=1) - np.cross(spin, arm),
        SPIN: spin,
        ORIENTATION: turned.as_quat(canonical=True, scalar_first=True),
    }
    columns: Columns = {
        "particle_id": size.first_id + np.arange(size.count),
        "radius_m": np.full(size.count, size.radius_m),
    }
    for names, values in motion.items():
        columns |= dict(zip(names, values.T, strict=True))
    return columns


def _groups(keys: Ints) -> tuple[Ints, Ints]:
    """First row of each different key of (N, M), in their order, and the group of each row."""
    _, first, at = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return first, at.ravel()


def _joined(
    at: Ints, count: int, force: Floats, normal: Floats, normal_n: Floats, point: Floats
) -> tuple[Floats, Floats, Floats]:
    """Sum of forces, direction of the normal forces' resultant and mean point of each group."""
    weight = np.maximum(normal_n, 0.0)
    total = _sum(at, weight, count)
    weight = np.where(total[at] > 0, weight, 1.0)
    resultant = sums(at, weight[:, None] * normal, count)
    length = np.linalg.norm(resultant, axis=1, keepdims=True)
    mean = sums(at, weight[:, None] * point, count) / _sum(at, weight, count)[:, None]
    return sums(at, force, count), resultant / np.where(length > 0, length, 1.0), mean


def _sum(at: Ints, values: Floats, count: int) -> Floats:
    return np.asarray(np.bincount(at, values, count), dtype=np.float64)


def _largest(at: Ints, count: int, values: Floats) -> Floats:
    largest = np.full(count, -np.inf)
    np.maximum.at(largest, at, values)
    return largest
