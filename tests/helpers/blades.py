"""Thin parts with obtuse facets at sharp edges, as CAD programs export them."""

import math

import numpy as np
from trimesh import Trimesh

from dragdeck.mesh.surface import surface


def twisted_blade(
    chord: float = 0.012, thickness: float = 0.0015, length: float = 0.045, twist_deg: float = 60.0,
    across: int = 8, rings: int = 20, cell_skew: float = 0.45,
) -> Trimesh:  # fmt: skip
    """A closed blade along z, its lowest point in the origin: two arcs meet in two sharp edges.

    Every second column of nodes is shifted along z by `cell_skew` of the distance of two rings,
    which makes obtuse facets; their first corner is the obtuse one as often as the others.
    """
    side = np.linspace(-1, 1, across + 1)
    x = chord / 2 * np.concatenate([side, side[-2:0:-1]])
    bulge = thickness / 2 * (1 - (2 * x / chord) ** 2)
    y = bulge * np.where(np.arange(2 * across) <= across, -1, 1)
    heights = np.linspace(0, length, rings + 1)
    nodes = []
    for ring, height in enumerate(heights):
        turn = math.radians(twist_deg) * height / length
        shift = cell_skew * heights[1] * (0 < ring < rings) * (np.arange(2 * across) % 2)
        nodes.append(np.column_stack([
            x * math.cos(turn) - y * math.sin(turn), x * math.sin(turn) + y * math.cos(turn),
            height + shift,
        ]))  # fmt: skip
    count = 2 * across
    place = np.arange(count)
    beside = (place + 1) % count
    facets = []
    for ring in range(rings):
        low, high = ring * count, (ring + 1) * count
        facets += [
            np.column_stack([low + place, low + beside, high + beside]),
            np.column_stack([low + place, high + beside, high + place]),
        ]
    front, back = np.arange(across), np.arange(1, across + 1)
    across_front, across_back = (count - front) % count, count - back
    strips = np.vstack([
        np.column_stack([front, back, across_back])[:-1],
        np.column_stack([front, across_back, across_front])[1:],
    ])  # fmt: skip
    points = np.vstack(nodes)
    corners = np.vstack([*facets, strips[:, ::-1], rings * count + strips])
    first = np.arange(len(corners)) % 3
    return surface(points, np.take_along_axis(corners, (first[:, None] + np.arange(3)) % 3, 1))


def knife(alpha_deg: float = 10.0) -> Trimesh:
    """Two faces, open, that meet in a sharp edge on the z axis and lie behind it along +x.

    A cell of 10 mm has a facet with an obtuse corner of 135 degrees, its first, on the edge, and
    one that fills the face.
    """
    y = 0.01 * math.tan(math.radians(alpha_deg) / 2)
    heights = 0.01 * np.arange(-2, 3)
    points = [(0, 0, z) for z in heights]
    points += [(0.01, side * y, z) for side in (1, -1) for z in heights]
    facets = []
    for cell in range(1, 4):
        for face in (5, 10):
            low, high, back, far = cell, cell + 1, face + cell - 1, face + cell
            pair = ((low, high, back), (back, high, far))
            facets += [one if face == 5 else (one[0], one[2], one[1]) for one in pair]
    return surface(points, facets)
