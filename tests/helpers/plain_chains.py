"""The oracle of the chain tests: chains, paths and clusters particle by particle, in plain Python.

This is how the package itself found them before it held arrays. Nothing but tests may use it.
"""

import heapq
from collections import Counter
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from dragchain.network.chains import (
    ALPHA_RAD,
    LEAST_PARTICLES,
    WidestPath,
    dominant_path,
    major_stress,
)
from dragchain.network.frame import FLOOR, KINDS, SIDE, WORKPIECE, NetworkFrame
from dragdeck.study.drive import wrap_angle

BOWL = -1
Net = dict[int, list[tuple[float, int, int]]]


def plain_stress(frame: NetworkFrame) -> Floats:
    inner = frame.between_particles()
    particle = np.concatenate([frame.a, frame.b[inner]])
    point = np.concatenate([frame.point, frame.point[inner]])
    force = np.concatenate([frame.force, -frame.force[inner]])
    moment = -np.einsum("ci,cj->cij", point - frame.centre[particle], force)
    total = np.zeros((frame.particle_id.size, 3, 3))
    np.add.at(total, particle, moment)
    volume = 4.0 / 3.0 * np.pi * frame.radius**3
    return (total + total.transpose(0, 2, 1)) / (2.0 * volume[:, None, None])


def plain_peters(
    frame: NetworkFrame, alpha_rad: float = ALPHA_RAD, stress_factor: float = 1.0
) -> list[list[int]]:
    if not frame.normal_force.size:
        return []
    stress, axis = major_stress(plain_stress(frame))
    high = stress > stress_factor * stress.mean()
    inner = np.flatnonzero(frame.between_particles())
    inner = inner[high[frame.a[inner]] & high[frame.b[inner]]]
    inner = inner[np.argsort(-frame.normal_force[inner], kind="stable")]
    first, second = frame.a[inner], frame.b[inner]
    line = frame.centre[second] - frame.centre[first]
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    cosine = np.stack(
        [np.einsum("ci,ci->c", axis[first], line), -np.einsum("ci,ci->c", axis[second], line)]
    )
    aligned = (np.abs(cosine) >= np.cos(alpha_rad)).all(axis=0)
    links: dict[int, dict[int, int]] = {}
    leader = np.arange(frame.particle_id.size)
    for i, j, end_i, end_j in zip(
        *[values[aligned].tolist() for values in (first, second, *(cosine > 0))], strict=True
    ):
        free = end_i not in links.get(i, {}) and end_j not in links.get(j, {})
        root_i, root_j = _root(leader, i), _root(leader, j)
        if free and root_i != root_j:
            leader[root_i] = root_j
            links.setdefault(i, {})[end_i] = j
            links.setdefault(j, {})[end_j] = i
    return [chain for chain in _walk(links, frame.centre) if len(chain) >= LEAST_PARTICLES]


def _root(leader: Ints, particle: int) -> int:
    while leader[particle] != particle:
        leader[particle] = leader[leader[particle]]
        particle = int(leader[particle])
    return particle


def _walk(links: dict[int, dict[int, int]], centre: Floats) -> Iterator[list[int]]:
    seen: set[int] = set()
    ends = [particle for particle, of_particle in links.items() if len(of_particle) == 1]
    for start in sorted(ends, key=lambda particle: tuple(-centre[particle, ::-1])):
        if start in seen:
            continue
        chain, particle, before = [start], start, None
        while following := [other for other in links[particle].values() if other != before]:
            before, particle = particle, following[0]
            chain.append(particle)
        seen.add(particle)
        yield chain


def plain_paths(
    frame: NetworkFrame, threshold: float = 1.0, *, with_workpiece: bool = True
) -> list[WidestPath]:
    strong = np.flatnonzero(
        frame.normal_force > threshold * frame.mean_force_n(with_workpiece=with_workpiece)
    )
    net = _strong_net(frame, strong)
    width = _widths(net)
    pushed = strong if with_workpiece else np.flatnonzero(frame.normal_force > 0.0)
    workpieces = pushed[frame.other[pushed] == WORKPIECE]
    workpieces = workpieces[np.argsort(-frame.normal_force[workpieces], kind="stable")]
    return [
        _path_from(frame, net, width, int(workpiece), with_workpiece) for workpiece in workpieces
    ]


def _strong_net(frame: NetworkFrame, strong: Ints) -> Net:
    kept = strong[frame.other[strong] != WORKPIECE]
    ends = np.where(frame.between_particles()[kept], frame.b[kept], BOWL)
    net: Net = {BOWL: []}
    forces = frame.normal_force[kept].tolist()
    rows = zip(frame.a[kept].tolist(), ends.tolist(), kept.tolist(), forces, strict=True)
    for a, b, contact, force in rows:
        net.setdefault(a, []).append((force, contact, b))
        net.setdefault(b, []).append((force, contact, a))
    return net


def _widths(net: Net) -> dict[int, float]:
    width: dict[int, float] = {}
    heap = [(-np.inf, BOWL)]
    while heap:
        negative, node = heapq.heappop(heap)
        if node in width:
            continue
        width[node] = -negative
        for force, _, other in net[node]:
            if other not in width:
                heapq.heappush(heap, (max(negative, -force), other))
    return width


def _path_from(
    frame: NetworkFrame, net: Net, width: dict[int, float], workpiece: int, with_workpiece: bool
) -> WidestPath:
    start = int(frame.a[workpiece])
    if start not in width:
        return WidestPath((start,), (workpiece,), None)
    bottleneck = (
        min(float(frame.normal_force[workpiece]), width[start]) if with_workpiece else width[start]
    )
    particles, contacts = _shortest(net, start, bottleneck)
    return WidestPath(particles, (workpiece, *contacts), int(frame.other[contacts[-1]]))


def _shortest(net: Net, start: int, least: float) -> tuple[tuple[int, ...], tuple[int, ...]]:
    best: dict[int, tuple[float, int, int]] = {start: (0.0, -1, start)}
    level = {start: 0.0}
    while BOWL not in best:
        found: dict[int, tuple[float, int, int]] = {}
        for node, total in level.items():
            for force, contact, other in net[node]:
                if force < least or other in best:
                    continue
                if other not in found or total + force > found[other][0]:
                    found[other] = (total + force, contact, node)
        best |= found
        level = {node: entry[0] for node, entry in found.items()}
    particles: list[int] = []
    contacts: list[int] = []
    node = BOWL
    while node != start:
        _, contact, node = best[node]
        contacts.append(contact)
        particles.append(node)
    return tuple(reversed(particles)), tuple(reversed(contacts))


def plain_table(frame: NetworkFrame) -> pd.DataFrame:
    """The chain table row by row; the columns' types are those that the rows happen to give."""
    rows = [*_peters_rows(frame), *_path_rows(frame)]
    return pd.DataFrame([{"step": frame.step, "time_s": frame.time_s} | row for row in rows])


def _peters_rows(frame: NetworkFrame) -> Iterator[dict[str, object]]:
    stress, _ = major_stress(plain_stress(frame))
    inner = frame.between_particles()
    pairs = zip(frame.a[inner].tolist(), frame.b[inner].tolist(), strict=True)
    force_of = dict(zip(pairs, frame.normal_force[inner].tolist(), strict=True))
    force_of |= {(j, i): force for (i, j), force in force_of.items()}
    on_bowl = set(frame.a[(frame.other == FLOOR) | (frame.other == SIDE)].tolist())
    for chain in plain_peters(frame):
        yield {
            "definition": "peters",
            **_measures(frame, chain, [force_of[p] for p in pairwise(chain)], frame.centre[chain]),
            "major_stress_mean_pa": float(stress[chain].mean()),
            "reaches_bowl": not on_bowl.isdisjoint(chain),
            "end_kind": "none",
            "dominant": False,
        }


def _path_rows(frame: NetworkFrame) -> Iterator[dict[str, object]]:
    paths = plain_paths(frame)
    dominant = dominant_path(frame, paths)
    for path in paths:
        forces: list[float] = []
        points = np.empty((0, 3))
        if path.end is not None:
            forces = frame.normal_force[list(path.contacts)].tolist()
            workpiece, bowl = frame.point[[path.contacts[0], path.contacts[-1]]]
            points = np.vstack([workpiece, frame.centre[list(path.particles)], bowl])
        yield {
            "definition": "widest_path",
            **_measures(frame, list(path.particles), forces, points),
            "major_stress_mean_pa": np.nan,
            "reaches_bowl": path.end is not None,
            "end_kind": "none" if path.end is None else KINDS[path.end],
            "dominant": path is dominant,
        }


def _measures(
    frame: NetworkFrame, particles: list[int], forces: list[float], points: Floats
) -> dict[str, object]:
    line = points[-1] - points[0] if len(points) else np.full(3, np.nan)
    turn = np.arctan2(line[1], line[0]) - frame.direction_rad
    segments = np.linalg.norm(np.diff(points, axis=0), axis=1)
    return {
        "n_particles": len(particles),
        "particle_ids": frame.particle_id[particles].tolist(),
        "bottleneck_n": min(forces, default=np.nan),
        "mean_force_n": float(np.mean(forces)) if forces else np.nan,
        "length_m": float(segments.sum()) if len(points) else np.nan,
        "azimuth_rad": float(wrap_angle(turn)),
        "inclination_rad": float(np.arctan2(line[2], np.hypot(line[0], line[1]))),
        "altitude_m": float(frame.centre[particles, 2].mean()),
    }


def plain_clusters(frame: NetworkFrame, least: float) -> tuple[Counter[int], set[str]]:
    """Flood the contacts above `least`: how many clusters have how many particles, and what
    spans."""
    near: dict[int, set[int]] = {particle: set() for particle in range(frame.particle_id.size)}
    touch: dict[int, set[object]] = {particle: set() for particle in near}
    for k in np.flatnonzero(frame.normal_force > max(least, 0.0)).tolist():
        a, b, kind = int(frame.a[k]), int(frame.b[k]), int(frame.other[k])
        if kind in (WORKPIECE, FLOOR):
            touch[a].add(KINDS[kind])
        elif kind == SIDE:
            x, y = frame.point[k, :2]
            touch[a].add(("+x" if x > 0 else "-x") if abs(x) > abs(y) else "+y" if y > 0 else "-y")
        else:
            near[a].add(b)
            near[b].add(a)
    sizes: Counter[int] = Counter()
    spans: set[str] = set()
    left = set(near)
    while left:
        cluster, edge = set(), {left.pop()}
        while edge:
            cluster |= edge
            edge = set().union(*(near[particle] for particle in edge)) - cluster
        left -= cluster
        sizes[len(cluster)] += len(cluster) > 1
        places = set().union(*(touch[particle] for particle in cluster))
        if "workpiece" in places and places - {"workpiece"}:
            spans.add("workpiece_to_bowl")
        if {"+x", "-x"} <= places or {"+y", "-y"} <= places:
            spans.add("side_to_side")
    return +sizes, spans
