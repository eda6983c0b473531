"""The inside of a bowl of triangles: distances, what is within, and horizontal sections.

Triangles are (F, 3, 3) corners, m. They leave the bowl open at the top only.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from dragdeck.arrays import Floats, Ints

Triangle = tuple[float, float, float, float, float, float, float, float, float]
"""x, y and z of three corners, m."""

_POINTS = 2000
"""Points that are held against all triangles at once."""

_ASIDE = np.array([3.7e-10, 6.1e-10])
"""By which vertical lines pass beside nodes of the mesh, m."""

_PER_M = 1e10
"""Precision of the ends of sections, 1/m: those of neighbouring triangles are the same."""


@lru_cache(maxsize=8)
def corners(triangles: tuple[Triangle, ...]) -> Floats:
    """Triangles as an (F, 3, 3) array, not to be changed."""
    return np.array(triangles).reshape(-1, 3, 3)


def nearest(place_m: Floats, corners_m: Floats) -> tuple[Floats, Floats]:
    """Distances of (N, 3) points from the nearest triangle, (N,), and directions away from it."""
    from scipy.spatial import KDTree
    from trimesh.triangles import closest_point

    middle = corners_m.mean(axis=1)
    size = np.linalg.norm(corners_m - middle[:, None], axis=2).max()
    tree = KDTree(middle)
    first = corners_m[tree.query(place_m)[1]]
    most = np.linalg.norm(closest_point(first, place_m) - place_m, axis=1)
    near = tree.query_ball_point(place_m, most + size * (1 + 1e-9))
    points = np.repeat(np.arange(len(place_m)), [len(triangles) for triangles in near])
    return nearest_of(place_m, corners_m, points, np.concatenate([*map(np.int64, near)]))


def nearest_of(
    place_m: Floats, corners_m: Floats, points: Ints, triangles: Ints
) -> tuple[Floats, Floats]:
    """Distances and directions of `nearest` among pairs of a point and a triangle.

    Parameters
    ----------
    place_m, corners_m : (N, 3) and (F, 3, 3) ndarray
    points, triangles : (P,) ndarray
        Numbers of the pairs. A point without one is infinitely far away, in no direction.
    """
    from trimesh.triangles import closest_point

    away = place_m[points] - closest_point(corners_m[triangles], place_m[points])
    lengths = np.linalg.norm(away, axis=1)
    order = np.lexsort((lengths, points))
    there, first = np.unique(points[order], return_index=True)
    best = order[first]
    distance, direction = np.full(len(place_m), np.inf), np.zeros_like(place_m)
    distance[there] = lengths[best]
    direction[there] = away[best] / np.maximum(lengths[best], 1e-300)[:, None]
    return distance, direction


def is_inside(place_m: Floats, corners_m: Floats) -> NDArray[np.bool_]:
    """Whether (N, 3) points below the rim are inside: an odd number of triangles is below each."""
    parts = np.array_split(place_m, 1 + len(place_m) // _POINTS)
    return np.concatenate([_below(part, corners_m) % 2 == 1 for part in parts])


def _below(place_m: Floats, corners_m: Floats) -> NDArray[np.int64]:
    """Number of triangles that a vertical line meets below each point."""
    a, b, c = corners_m.transpose(1, 0, 2)
    (ux, uy, uz), (vx, vy, vz) = (b - a).T, (c - a).T
    twice = ux * vy - uy * vx
    x, y = (place_m[:, None, :2] + _ASIDE - a[:, :2]).transpose(2, 0, 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        along, across = (x * vy - y * vx) / twice, (ux * y - uy * x) / twice
        height = a[:, 2] + along * uz + across * vz
        hit = (along >= 0) & (across >= 0) & (along + across <= 1) & (height < place_m[:, None, 2])
    return np.asarray((hit & (twice != 0.0)).sum(axis=1))


def cut(corners_m: Floats, height_m: float) -> Floats:
    """Where triangles that face inwards cross a height, (S, 2, 2): begins and ends, m.

    The inside is to the left of each, seen from above.
    """
    above = corners_m[:, :, 2] >= height_m
    at = above.any(axis=1) & ~above.all(axis=1)
    crossed, above = corners_m[at], above[at]
    if not len(crossed):
        return np.empty((0, 2, 2))
    alone = np.where(above.sum(axis=1) == 1, above.argmax(axis=1), (~above).argmax(axis=1))
    tip, second, third = (
        np.take_along_axis(crossed, ((alone + shift) % 3)[:, None, None], axis=1)[:, 0]
        for shift in range(3)
    )
    ends = []
    for other in (second, third):  # from below, so that neighbours have the same point
        first = tip[:, 2:] < other[:, 2:]
        low, high = np.where(first, tip, other), np.where(first, other, tip)
        share = (height_m - low[:, 2]) / (high[:, 2] - low[:, 2])
        ends.append(low + share[:, None] * (high - low))
    lines = np.stack(ends, axis=1)[:, :, :2]
    upwards = np.take_along_axis(above, alone[:, None], axis=1)
    return np.where(upwards[:, :, None], lines, lines[:, ::-1])


def area(lines_m: Floats) -> float:
    """Area within the closed lines that segments, (S, 2, 2), form, m2."""
    (ax, ay), (bx, by) = lines_m.transpose(1, 2, 0)
    return abs(float((ax * by - ay * bx).sum())) / 2


def outlines(lines_m: Floats, count: int) -> list[Floats]:
    """Closed lines of segments, (S, 2, 2), each as so many points, (count, 2); longest first.

    Each begins near the x axis and goes counter-clockwise, so that points of two lines correspond.
    """
    keys = [(_key(begin), _key(end)) for begin, end in lines_m]
    begins = {begin: number for number, (begin, end) in enumerate(keys) if begin != end}
    closed: list[tuple[float, Floats]] = []
    while begins:
        key, number = next(iter(begins.items()))
        points = [lines_m[number, 0]]
        while key in begins:
            number = begins.pop(key)
            points.append(lines_m[number, 1])
            key = keys[number][1]
        line = np.array(points)
        passed = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
        places = np.linspace(0.0, passed[-1], count)
        even = np.column_stack([np.interp(places, passed, column) for column in line.T])
        closed.append((passed[-1], _from_x_axis(even)))
    return [line for _, line in sorted(closed, key=lambda entry: -entry[0])]


def _from_x_axis(line: Floats) -> Floats:
    """The same closed line, counter-clockwise from its point nearest to the direction of x."""
    corners = line[:-1]
    (x, y), (next_x, next_y) = corners.T, np.roll(corners, -1, axis=0).T
    if (x * next_y - next_x * y).sum() < 0:
        x, y = x[::-1], y[::-1]
    first = int(np.abs(np.arctan2(y, x)).argmin())
    turned = np.roll(np.column_stack([x, y]), -first, axis=0)
    return np.vstack([turned, turned[:1]])


def _key(point: Floats) -> tuple[int, int]:
    x, y = np.rint(point * _PER_M).astype(np.int64).tolist()
    return x, y


def chord(lines_m: Floats, x_m: float, low_m: float, high_m: float) -> float:
    """Length along y from one value to another that is within closed lines at x, m."""
    (ax, ay), (bx, by) = lines_m.transpose(1, 2, 0)
    hit = (ax <= x_m) != (bx <= x_m)
    y = np.sort(ay[hit] + (x_m - ax[hit]) / (bx[hit] - ax[hit]) * (by[hit] - ay[hit]))
    ends = np.clip(y, low_m, high_m)
    return math.fsum((ends[1::2] - ends[::2]).tolist())
