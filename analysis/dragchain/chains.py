"""Force chains of one network frame, by two definitions.

``peters``
    Quasi-linear chains of highly stressed balls (Peters, Muthuswamy, Wibowo and Tordesillas 2005,
    Phys. Rev. E 72, 041307), see `peters_chains`.
``rod_path``
    For each strong rod contact the path through strong contacts to the bowl whose weakest contact
    is strongest, see `rod_paths`.

No result depends on the numbering of the balls or on the order of the contacts.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.forces import wrap_angle
from dragchain.frames import FLOOR, KINDS, ROD, SIDE, Floats, Ints, NetworkFrame

ALPHA_RAD = np.pi / 4
"""Largest angle between a ball's principal direction and the line to the next ball of a chain."""

LEAST_BALLS = 3
"""Fewer balls are no chain (Peters et al. 2005)."""

STRESS_FACTOR = 1.0
"""Least major principal stress of a chain's balls, as a multiple of the frame's mean."""

THRESHOLD = 1.0
"""Least normal force of a rod path's contacts, as a multiple of the frame's mean."""

_BOWL = -1


@dataclass(frozen=True)
class RodPath:
    """A path from a rod contact to the bowl.

    Attributes
    ----------
    balls : sequence of int
        Rows of the frame's balls, from the rod on; only the ball on the rod if `end` is None.
    contacts : sequence of int
        Rows of the frame's contacts in the same order, the rod's first and the bowl's last.
    end : int or None
        `FLOOR` or `SIDE`, None if no path of strong contacts leads to the bowl.
    """

    balls: tuple[int, ...]
    contacts: tuple[int, ...]
    end: int | None


# --- stress and Peters' chains ---------------------------------------------------------------


def ball_stress(frame: NetworkFrame) -> Floats:
    """Return each ball's mean stress tensor in Pa, compression positive, (N, 3, 3).

    The sum over the ball's contacts of branch vector (centre to contact point) times force on the
    ball, over the ball's volume, made symmetric (Weber 1966; Peters et al. 2005, eq. 1). Contacts
    with rod and bowl count too.
    """
    inner = frame.between_balls()
    ball = np.concatenate([frame.a, frame.b[inner]])
    point = np.concatenate([frame.point, frame.point[inner]])
    force = np.concatenate([frame.force, -frame.force[inner]])
    moment = -np.einsum("ci,cj->cij", point - frame.centre[ball], force)
    total = np.zeros((frame.ball_id.size, 3, 3))
    np.add.at(total, ball, moment)
    volume = 4.0 / 3.0 * np.pi * frame.radius**3
    return (total + total.transpose(0, 2, 1)) / (2.0 * volume[:, None, None])


def major_stress(stress: Floats) -> tuple[Floats, Floats]:
    """Return the major compressive principal stress in Pa, (N,), and its axis, (N, 3)."""
    values, vectors = np.linalg.eigh(stress)
    return values[:, -1], vectors[:, :, -1]


def peters_chains(
    frame: NetworkFrame,
    alpha_rad: float = ALPHA_RAD,
    stress_factor: float = STRESS_FACTOR,
    major: tuple[Floats, Floats] | None = None,
) -> list[list[int]]:
    """Return the quasi-linear force chains as ordered rows of the frame's balls.

    A ball is highly stressed when its major compressive principal stress is above `stress_factor`
    times the mean of all balls (1 in the paper). Two highly stressed balls in contact are linked
    when the line of their centres is within `alpha_rad` of the principal axis of both; at least
    `LEAST_BALLS` linked balls are a chain (Peters et al. 2005). Ours is the rule for more than one
    candidate at the same end of a ball: candidates are taken by falling normal force, each end of
    an axis holds one link, and no link closes a ring, so that every chain is a path and no ball is
    in two chains. A chain starts at its higher end. `major` is what `major_stress` returns for the
    frame, if it is known already.
    """
    if not frame.normal_force.size:
        return []
    stress, axis = major_stress(ball_stress(frame)) if major is None else major
    high = stress > stress_factor * stress.mean()
    first, second, end = _candidates(frame, alpha_rad, high, axis)
    links: dict[int, dict[int, int]] = {}
    leader = np.arange(frame.ball_id.size)
    for i, j, end_i, end_j in zip(
        first.tolist(), second.tolist(), end[0].tolist(), end[1].tolist(), strict=True
    ):
        free = end_i not in links.get(i, {}) and end_j not in links.get(j, {})
        root_i, root_j = _root(leader, i), _root(leader, j)
        if free and root_i != root_j:
            leader[root_i] = root_j
            links.setdefault(i, {})[end_i] = j
            links.setdefault(j, {})[end_j] = i
    return [chain for chain in _walk(links, frame.centre) if len(chain) >= LEAST_BALLS]


def _candidates(
    frame: NetworkFrame, alpha_rad: float, high: NDArray[np.bool_], axis: Floats
) -> tuple[Ints, Ints, NDArray[np.bool_]]:
    """Return the linkable pairs by falling force, and at which end of either axis they link."""
    inner = np.flatnonzero(frame.between_balls())
    inner = inner[high[frame.a[inner]] & high[frame.b[inner]]]
    inner = inner[np.argsort(-frame.normal_force[inner], kind="stable")]
    first, second = frame.a[inner], frame.b[inner]
    line = frame.centre[second] - frame.centre[first]
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    cosine = np.stack(
        [np.einsum("ci,ci->c", axis[first], line), -np.einsum("ci,ci->c", axis[second], line)]
    )
    aligned = (np.abs(cosine) >= np.cos(alpha_rad)).all(axis=0)
    return first[aligned], second[aligned], cosine[:, aligned] > 0


def _root(leader: Ints, ball: int) -> int:
    while leader[ball] != ball:
        leader[ball] = leader[leader[ball]]
        ball = int(leader[ball])
    return ball


def _walk(links: dict[int, dict[int, int]], centre: Floats) -> Iterator[list[int]]:
    """Yield every path of the links once, from its higher end."""
    seen: set[int] = set()
    ends = [ball for ball, of_ball in links.items() if len(of_ball) == 1]
    for start in sorted(ends, key=lambda ball: tuple(-centre[ball, ::-1])):
        if start in seen:
            continue
        chain, ball, before = [start], start, None
        while following := [other for other in links[ball].values() if other != before]:
            before, ball = ball, following[0]
            chain.append(ball)
        seen.add(ball)
        yield chain


# --- paths from the rod to the bowl ----------------------------------------------------------


def rod_paths(
    frame: NetworkFrame, threshold: float = THRESHOLD, *, with_rod: bool = True
) -> list[RodPath]:
    """Return one path for each strong rod contact, by falling force of that contact.

    Contacts whose normal force is above `threshold` times the mean of all the frame's contacts are
    strong. A path leads from the rod contact through strong contacts between balls to a strong
    contact with floor or side. Of all such paths the widest counts: the one whose weakest contact
    (its bottleneck, rod and bowl contacts included) is strongest; among several the one with the
    fewest contacts, then the one with the largest sum of forces. The widest path of a graph runs
    along its maximum spanning tree (Hu 1961, Oper. Res. 9, 898-900); the tie rule is ours.

    With `with_rod` false the forces of rod contacts play no part, not even in the mean: a path
    leads from every ball that the rod pushes, and its bottleneck is that of the contacts behind
    that ball.
    """
    strong = np.flatnonzero(frame.normal_force > threshold * frame.mean_force_n(with_rod=with_rod))
    net = _strong_net(frame, strong)
    width = _widths(net)
    pushed = strong if with_rod else np.flatnonzero(frame.normal_force > 0.0)
    rods = pushed[frame.other[pushed] == ROD]
    rods = rods[np.argsort(-frame.normal_force[rods], kind="stable")]
    return [_path_from(frame, net, width, int(rod), with_rod) for rod in rods]


_Net = dict[int, list[tuple[float, int, int]]]


def _strong_net(frame: NetworkFrame, strong: Ints) -> _Net:
    """Return (normal force, contact, other node) of each node; the bowl is one node."""
    kept = strong[frame.other[strong] != ROD]
    ends = np.where(frame.between_balls()[kept], frame.b[kept], _BOWL)
    net: _Net = {_BOWL: []}
    for a, b, contact, force in zip(
        frame.a[kept].tolist(),
        ends.tolist(),
        kept.tolist(),
        frame.normal_force[kept].tolist(),
        strict=True,
    ):
        net.setdefault(a, []).append((force, contact, b))
        net.setdefault(b, []).append((force, contact, a))
    return net


def _widths(net: _Net) -> dict[int, float]:
    """Return the bottleneck of the widest path from the bowl to every node that has a path."""
    width: dict[int, float] = {}
    heap = [(-np.inf, _BOWL)]
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
    frame: NetworkFrame, net: _Net, width: dict[int, float], rod: int, with_rod: bool
) -> RodPath:
    start = int(frame.a[rod])
    if start not in width:
        return RodPath((start,), (rod,), None)
    bottleneck = min(float(frame.normal_force[rod]), width[start]) if with_rod else width[start]
    balls, contacts = _shortest(net, start, bottleneck)
    return RodPath(balls, (rod, *contacts), int(frame.other[contacts[-1]]))


def _shortest(net: _Net, start: int, least: float) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return balls and contacts of the path to the bowl with the fewest contacts of `least` force.

    Level by level; within a level the largest sum of forces wins.
    """
    best: dict[int, tuple[float, int, int]] = {start: (0.0, -1, start)}
    level = {start: 0.0}
    while _BOWL not in best:
        found: dict[int, tuple[float, int, int]] = {}
        for node, total in level.items():
            for force, contact, other in net[node]:
                if force < least or other in best:
                    continue
                if other not in found or total + force > found[other][0]:
                    found[other] = (total + force, contact, node)
        best |= found
        level = {node: entry[0] for node, entry in found.items()}
    return _trace(best, start)


def _trace(
    best: dict[int, tuple[float, int, int]], start: int
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    balls: list[int] = []
    contacts: list[int] = []
    node = _BOWL
    while node != start:
        _, contact, node = best[node]
        contacts.append(contact)
        balls.append(node)
    return tuple(reversed(balls)), tuple(reversed(contacts))


# --- measures --------------------------------------------------------------------------------

_COLUMNS: dict[str, str] = {
    "step": "int64",
    "time_s": "float64",
    "definition": "str",
    "n_balls": "int64",
    "ball_ids": "object",
    "bottleneck_n": "float64",
    "mean_force_n": "float64",
    "length_m": "float64",
    "azimuth_rad": "float64",
    "inclination_rad": "float64",
    "altitude_m": "float64",
    "major_stress_mean_pa": "float64",
    "reaches_bowl": "bool",
    "end_kind": "str",
    "dominant": "bool",
}


def chain_table(
    frame: NetworkFrame,
    *,
    alpha_rad: float = ALPHA_RAD,
    stress_factor: float = STRESS_FACTOR,
    threshold: float = THRESHOLD,
) -> pd.DataFrame:
    """Return the chains of a frame by both definitions, a row each.

    Returns
    -------
    DataFrame
        ``definition`` (`peters` or `rod_path`), ``n_balls``, ``ball_ids`` (list, in order),
        ``bottleneck_n`` and ``mean_force_n`` (smallest and mean normal force of the chain's
        contacts), ``length_m`` (polyline through the centres; a rod path's begins at the rod
        contact and ends at the bowl contact), ``azimuth_rad`` (direction from first to last point
        in the xy plane, counter-clockwise from the tool's heading, in (-pi, pi]),
        ``inclination_rad`` (the same line's angle above the horizontal), ``altitude_m`` (mean
        height of the centres above the floor), ``major_stress_mean_pa`` (peters only),
        ``reaches_bowl``, ``end_kind`` (`floor`, `side` or `none`) and ``dominant``: the rod path of
        the frame with the largest bottleneck, by mean force where two are equal. A rod contact
        without a path to the bowl has a row with ``reaches_bowl`` false, the ball on the rod only,
        and NaN for bottleneck, mean force, length and angles. A chain by Peters et al. has no
        direction: it is listed from its higher end, and reaches the bowl if one of its balls
        touches it; ``end_kind`` is then `none` all the same.
    """
    rows = [*_peters_rows(frame, alpha_rad, stress_factor), *_path_rows(frame, threshold)]
    moment = {"step": frame.step, "time_s": frame.time_s}
    table = pd.DataFrame([moment | row for row in rows], columns=list(_COLUMNS))
    return table.astype(_COLUMNS)


def _peters_rows(
    frame: NetworkFrame, alpha_rad: float, stress_factor: float
) -> Iterator[dict[str, object]]:
    major = major_stress(ball_stress(frame))
    chains = peters_chains(frame, alpha_rad, stress_factor, major)
    if not chains:
        return
    stress, _ = major
    force_of = _force_between(frame)
    on_bowl = set(frame.a[(frame.other == FLOOR) | (frame.other == SIDE)].tolist())
    for chain in chains:
        forces = [force_of[i, j] for i, j in pairwise(chain)]
        yield {
            **_measures(frame, chain, forces, frame.centre[chain]),
            "definition": "peters",
            "major_stress_mean_pa": float(stress[chain].mean()),
            "reaches_bowl": not on_bowl.isdisjoint(chain),
            "end_kind": "none",
            "dominant": False,
        }


def _force_between(frame: NetworkFrame) -> dict[tuple[int, int], float]:
    inner = frame.between_balls()
    pairs = zip(frame.a[inner].tolist(), frame.b[inner].tolist(), strict=True)
    forces = dict(zip(pairs, frame.normal_force[inner].tolist(), strict=True))
    return forces | {(j, i): force for (i, j), force in forces.items()}


def _path_rows(frame: NetworkFrame, threshold: float) -> Iterator[dict[str, object]]:
    paths = rod_paths(frame, threshold)
    dominant = dominant_path(frame, paths)
    for path in paths:
        forces: Sequence[float] = []
        points = np.empty((0, 3))
        if path.end is not None:
            forces = frame.normal_force[list(path.contacts)].tolist()
            rod, bowl = frame.point[[path.contacts[0], path.contacts[-1]]]
            points = np.vstack([rod, frame.centre[list(path.balls)], bowl])
        yield {
            **_measures(frame, path.balls, forces, points),
            "definition": "rod_path",
            "major_stress_mean_pa": np.nan,
            "reaches_bowl": path.end is not None,
            "end_kind": "none" if path.end is None else KINDS[path.end],
            "dominant": path is dominant,
        }


def dominant_path(
    frame: NetworkFrame, paths: Iterable[RodPath], *, with_rod: bool = True
) -> RodPath | None:
    """Return the path to the bowl with the largest bottleneck, or None if no path leads there.

    With `with_rod` false the rod contacts' forces do not count.
    """

    def strength(path: RodPath) -> tuple[float, float]:
        forces = frame.normal_force[list(path.contacts[0 if with_rod else 1 :])]
        return float(forces.min()), float(forces.mean())

    whole = [path for path in paths if path.end is not None]
    return max(whole, key=strength) if whole else None


def _measures(
    frame: NetworkFrame, balls: Sequence[int], forces: Sequence[float], points: Floats
) -> dict[str, object]:
    rows = list(balls)
    line = points[-1] - points[0] if len(points) else np.full(3, np.nan)
    turn = np.arctan2(line[1], line[0]) - frame.heading_rad
    return {
        "n_balls": len(rows),
        "ball_ids": frame.ball_id[rows].tolist(),
        "bottleneck_n": min(forces, default=np.nan),
        "mean_force_n": float(np.mean(forces)) if len(forces) else np.nan,
        "length_m": _length(points) if len(points) else np.nan,
        "azimuth_rad": float(wrap_angle(turn)),
        "inclination_rad": float(np.arctan2(line[2], np.hypot(line[0], line[1]))),
        "altitude_m": float(frame.centre[rows, 2].mean()),
    }


def _length(points: Floats) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
