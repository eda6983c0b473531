"""A convex body as a clump of spheres, and how far the clump is from the body.

Lengths are in radii of the sphere of equal volume, masses in that of the body. The frame is the
body's own: its origin is the centre of mass, its axes are the principal axes of inertia.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from dragdeck.errors import InputError
from dragdeck.mesh.files import read
from dragdeck.mesh.surface import Floats

if TYPE_CHECKING:
    from trimesh import Trimesh

_SAMPLES, _CELLS = 1500, 16
"""Points on the surface to which spheres are fitted, and cells along the longest side of the body
from which they start."""

_FINE = 64
"""Cells along the longest side in which volume and inertia of the spheres are measured."""

_SMALLEST = 0.2
"""Radius of a sphere at least: smaller ones make the time step short and add little."""

_STARTS = 4
"""Starts of a fit."""

_DRAWN = (1.0, 0.9, 0.8, 0.7, 0.6)
"""Factors by which the spheres of a fit are drawn together, since fits may fall apart."""

_MARGIN = 0.93
"""Spheres count as overlapping if they do with radii smaller by this factor."""

_LARGEST = 1.5
"""Radius of a sphere at most, in that of the largest one inside the body."""

_DENTED = 0.02
"""Volume that the convex hull of a particle may have more than the particle."""

_FLAT = 1e-3
"""Extent of a body across over its extent along from which it is no body."""

_DIGITS = 5
"""Decimals of places and radii: far below the errors of a clump."""

WORST_SURFACE = 0.25
"""Root mean square distance between body and spheres from which a clump is refused."""


@dataclass(frozen=True)
class Clump:
    """Spheres that stand for a body.

    Attributes
    ----------
    offsets, radii : (K, 3) and (K,) array
        Spheres.
    inertia : (3,) array
        Principal moments of the body itself, divided by its mass.
    volume_error, inertia_error : float
        Of the spheres' union with the density of the body, relative to the body; that of the
        inertia is the norm of the difference of the tensors.
    surface_rms, left_out, stands_out : float
        Distance between the body's surface and the union: root mean square, farthest point that no
        sphere reaches, deepest point within a sphere.
    """

    offsets: Floats
    radii: Floats
    inertia: Floats
    volume_error: float = 0.0
    inertia_error: float = 0.0
    surface_rms: float = 0.0
    left_out: float = 0.0
    stands_out: float = 0.0

    @property
    def reach(self) -> float:
        """Distance of the farthest point from the centre of mass."""
        return float((np.linalg.norm(self.offsets, axis=1) + self.radii).max())

    @property
    def timestep_radius(self) -> float:
        """Radius of the free sphere whose Rayleigh time is the shortest that a contact has.

        A contact has the stiffness of its sphere, r, and moves the mass that the body presents
        there, ``1 / (1 + l)`` with the largest eigenvalue l of ``[c]^T I^-1 [c]`` at the arm c; of
        a free sphere of the same density it would be ``r^3``. The smaller mass counts.
        """
        x, y, z = self.offsets.T
        zero = np.zeros_like(x)
        cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
        turned = np.einsum("kij,i,kil->kjl", cross, 1 / self.inertia, cross)
        mass = 1 / (1 + np.linalg.eigvalsh(turned)[:, -1])
        return float((self.radii * np.sqrt(np.minimum(1.0, mass / self.radii**3))).min())


SPHERE = Clump(np.zeros((1, 3)), np.ones(1), np.full(3, 0.4))
"""The clump of a single sphere."""


def body(corners: Floats) -> Trimesh:
    """The convex hull of (N, 3) corners as a closed surface in the frame of a clump.

    Raises
    ------
    InputError
        The corners lie in a plane.
    """
    from trimesh.convex import convex_hull

    lengths = np.linalg.svd(corners - corners.mean(axis=0), compute_uv=False)
    if lengths[-1] < _FLAT * lengths[0]:
        raise InputError("the corners of a particle lie in a plane, or are too few")
    mesh: Trimesh = convex_hull(corners / min(1.0, lengths[0]))  # trimesh merges near corners
    mesh.apply_transform(mesh.principal_inertia_transform)
    mesh.apply_translation(-mesh.center_mass)
    mesh.apply_scale((4 / 3 * np.pi / float(mesh.volume)) ** (1 / 3))
    return mesh


def convex_corners(file: Path) -> Floats:
    """Corners of the convex body whose closed surface a file has, (N, 3); their unit is lost.

    Raises
    ------
    InputError
        The file cannot be read, or the surface is open or not convex.
    """
    mesh, field = read(file, "m"), "media.shape.points"
    if not mesh.is_watertight:
        raise InputError("the surface of a particle is not closed", file=file, field=field,
                         remedy="close the holes and export it again")  # fmt: skip
    hull, volume = mesh.convex_hull, abs(float(mesh.volume))
    if hull.volume > (1 + _DENTED) * volume:
        raise InputError(
            "a particle is not convex",
            file=file,
            field=field,
            value=f"its convex hull has {hull.volume / volume:.3g} times its volume",
            limit=f"at most {1 + _DENTED:g} times",
            remedy="use a convex body",
        )
    return np.asarray(hull.vertices, dtype=np.float64)


def fit_clump(corners: Floats, count: int) -> Clump:
    """Fit spheres to the convex hull of corners.

    Spheres inside the body are the start of a least-squares fit of the distances between the
    body's surface and the union of the spheres. The best of several starts counts whose spheres
    overlap, if need be drawn together. At last all radii change by the same length, so
    that the union has the volume of the body.

    Parameters
    ----------
    corners : (N, 3) array
    count : int
        Number of spheres.

    Raises
    ------
    InputError
        The corners lie in a plane, or the spheres do not overlap or miss the body.
    """
    from trimesh.sample import sample_surface

    mesh = body(corners)
    samples = np.asarray(sample_surface(mesh, _SAMPLES, seed=1)[0])
    starts, deepest = _inscribed(mesh, count)
    candidates = [_fitted(samples, *start, _LARGEST * deepest) for start in starts]
    fits = [(part * offsets, radii) for offsets, radii in candidates for part in _DRAWN]
    joined = [fit for fit in fits if _pieces(fit[0], _MARGIN * fit[1]) == 1]
    offsets, radii = min(
        joined or fits, key=lambda fit: float((_outside(samples, *fit) ** 2).sum())
    )
    offsets = np.round(offsets, _DIGITS) + 0.0
    points, cell = _grid(mesh, _FINE, 1.3)
    outside = _outside(points, offsets, radii)
    volume = float(mesh.volume)
    inside = np.argsort(outside, kind="stable")[: round(volume / cell)]
    radii = np.round(radii + outside[inside[-1]], _DIGITS)
    left = _outside(samples, offsets, radii)
    union = points[_outside(points, offsets, radii) < 0]
    square = cell * np.einsum("pi,pj->ij", union, union)
    tensor, inertia = np.trace(square) * np.eye(3) - square, np.asarray(mesh.moment_inertia)
    clump = Clump(
        offsets=offsets,
        radii=radii,
        inertia=np.diag(inertia) / volume,
        volume_error=len(union) * cell / volume - 1,
        inertia_error=float(np.linalg.norm(tensor - inertia, 2) / np.linalg.norm(inertia, 2)),
        surface_rms=float(np.sqrt((left**2).mean())),
        left_out=float(left.max()),
        stands_out=float(-left.min()),
    )
    _check(clump)
    return clump


def _pieces(offsets: Floats, radii: Floats) -> int:
    """Groups of spheres that overlap."""
    from scipy.sparse.csgraph import connected_components

    apart = np.linalg.norm(offsets[:, None] - offsets[None], axis=2)
    return int(connected_components(apart < radii[:, None] + radii)[0])


def _check(clump: Clump) -> None:
    pieces = _pieces(clump.offsets, clump.radii)
    if pieces > 1:
        raise InputError("the spheres do not overlap", value=f"{pieces} separate groups",
                         limit="one group", remedy="use more spheres")  # fmt: skip
    if clump.surface_rms > WORST_SURFACE:
        raise InputError(
            "the spheres miss the body",
            value=f"root mean square distance of the surfaces {clump.surface_rms:.2g} radii of the "
            "sphere of equal volume",
            limit=f"at most {WORST_SURFACE:g}",
            remedy="use more spheres, or a more compact shape",
        )


def _grid(mesh: Trimesh, cells: int, room: float = 1.0) -> tuple[Floats, float]:
    """Points in a box around a body, widened by a factor, and the volume of each."""
    low, high = mesh.bounds
    middle, half = (low + high) / 2, room * (high - low) / 2
    counts = np.maximum(8, np.ceil(cells * half / half.max())).astype(int)
    axes = [
        m + h * (2 * np.arange(n) + 1 - n) / n for m, h, n in zip(middle, half, counts, strict=True)
    ]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return points, float(np.prod(2 * half / counts))


def _inscribed(mesh: Trimesh, count: int) -> tuple[list[tuple[Floats, Floats]], float]:
    """Spheres inside a convex body from which fits may start, and the radius of the largest there.

    They lie about the centres of parts into which points of a grid fall.
    """
    from scipy.cluster.vq import kmeans2

    points, _ = _grid(mesh, _CELLS)
    normals = np.asarray(mesh.face_normals)
    depth = (np.einsum("fi,fi->f", normals, mesh.triangles[:, 0]) - points @ normals.T).min(axis=1)
    points, depth = points[depth > 0], depth[depth > 0]
    starts = []
    for seed in range(_STARTS):
        middles = kmeans2(points, count, seed=seed, minit="++")[0]
        chosen = np.linalg.norm(points[:, None] - middles, axis=2).argmin(axis=0)
        starts.append((points[chosen], depth[chosen]))
    return starts, float(depth.max())


def _outside(points: Floats, offsets: Floats, radii: Floats) -> Floats:
    """Distance of (N, 3) points from the union of spheres; negative within."""
    distance = np.full(len(points), np.inf)
    for centre, radius in zip(offsets, radii, strict=True):
        np.minimum(distance, np.linalg.norm(points - centre, axis=1) - radius, out=distance)
    return distance


def _fitted(
    samples: Floats, offsets: Floats, radii: Floats, largest: float
) -> tuple[Floats, Floats]:
    """Spheres whose union comes as near to points of a surface as it can from this start."""
    from scipy.optimize import least_squares

    def split(solution: Floats) -> tuple[Floats, Floats]:
        spheres = solution.reshape(-1, 4)
        return spheres[:, :3], spheres[:, 3]

    def distances(solution: Floats) -> tuple[Floats, Floats, Floats]:
        centres, sizes = split(solution)
        away = samples[:, None] - centres[None]
        length = np.linalg.norm(away, axis=2)
        return away, length, length - sizes

    def residuals(solution: Floats) -> Floats:
        return np.asarray(distances(solution)[2].min(axis=1))

    def slopes(solution: Floats) -> Floats:
        away, length, left = distances(solution)
        rows, nearest = np.arange(len(samples)), left.argmin(axis=1)
        slope = np.zeros((len(samples), len(radii), 4))
        slope[rows, nearest, :3] = -away[rows, nearest] / length[rows, nearest, None]
        slope[rows, nearest, 3] = -1.0
        return slope.reshape(len(samples), -1)

    # a flat face would pull the centre of a sphere far away
    start = np.column_stack([offsets, np.maximum(radii, 1.01 * _SMALLEST)]).ravel()
    low = np.append(samples.min(axis=0), _SMALLEST)
    high = np.append(samples.max(axis=0), largest)
    bounds = np.tile(low, len(radii)), np.tile(high, len(radii))
    return split(least_squares(residuals, start, slopes, bounds, max_nfev=100).x)
