"""Rotations of the workpiece, and angles about the vertical."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from dragdeck.arrays import Floats


def wrap_angle(angle_rad: ArrayLike) -> Floats:
    """Wrap angles into (-pi, pi]."""
    turned = np.pi - np.asarray(angle_rad, dtype=np.float64)
    return np.asarray(np.pi - np.mod(turned, 2.0 * np.pi))


def rotated(vectors: Floats, angle_rad: Floats | float) -> Floats:
    """Rotate (..., 3) vectors about the vertical."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    x, y, z = np.moveaxis(vectors, -1, 0)
    return np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=-1)


def about_vertical(rate_rad_s: Floats | float, arm_m: Floats) -> Floats:
    """Velocity of a rotation about +z, ``w x r``, (N, 3) in m/s, at arms from its axis, (N, 3)."""
    x, y, _ = arm_m.T
    return np.column_stack([-rate_rad_s * y, rate_rad_s * x, np.zeros(len(arm_m))])


def by_vector(vector_rad: Floats) -> Floats:
    """Matrices, (..., 3, 3), of rotation vectors, (..., 3): axis times angle."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(vector_rad).as_matrix())


def rotation_vector(matrix: Floats) -> Floats:
    """Rotation vector, (3,), of a matrix, (3, 3), by less than half a turn."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(matrix).as_rotvec())


@dataclass(frozen=True)
class Orientations:
    """N orientations of a workpiece: from its own frame, +x its front and z up, to the bowl's.

    Attributes
    ----------
    turn_rad : (N,) ndarray
        About the vertical.
    in_frame : (N, 3, 3) ndarray or None
        Rotations in its own frame, before that; None if it stands as it starts.
    """

    turn_rad: Floats
    in_frame: Floats | None = None

    @property
    def matrices(self) -> Floats:
        """The rotations as matrices, (N, 3, 3)."""
        matrix = np.eye(3) if self.in_frame is None else self.in_frame
        columns = np.moveaxis(np.broadcast_to(matrix, (len(self.turn_rad), 3, 3)), -1, 0)
        return np.stack([rotated(column, self.turn_rad) for column in columns], axis=-1)

    @property
    def front_rad(self) -> Floats:
        """Direction of the front from +x, (N,)."""
        if self.in_frame is None:
            return self.turn_rad
        return np.asarray(
            self.turn_rad + np.arctan2(self.in_frame[:, 1, 0], self.in_frame[:, 0, 0])
        )

    def out_of(self, vectors: Floats) -> Floats:
        """Vectors of the workpiece's own frame, (N, 3), in the bowl's."""
        if self.in_frame is not None:
            vectors = np.einsum("nij,nj->ni", self.in_frame, vectors)
        return rotated(vectors, self.turn_rad)

    def into(self, vectors: Floats) -> Floats:
        """Vectors of the bowl's frame, (N, 3), in the workpiece's own."""
        turned = rotated(vectors, -self.turn_rad)
        return turned if self.in_frame is None else np.einsum("nji,nj->ni", self.in_frame, turned)
