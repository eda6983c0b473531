"""Force chains of one network frame, by two definitions.

``peters``
    Quasi-linear chains of highly stressed balls (Peters, Muthuswamy, Wibowo and Tordesillas 2005,
    Phys. Rev. E 72, 041307), see `peters_chains`.
``rod_path``
    For each strong rod contact the path through strong contacts to the bowl whose weakest contact
    is strongest, see `rod_paths`.

As long as no two contacts bear the same force, no result depends on the numbering of the balls or
on the order of the contacts. Where equal forces leave a choice, the contact counts that comes first
in the frame, which in ``contacts.parquet`` is the one with the lower ids.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain import network_kernels as kernels
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


@dataclass(frozen=True)
class ChainRows:
    """C chains, one after another, as rows of a frame.

    Attributes
    ----------
    balls, contacts : (K,) and (L,) ndarray of int64
        Rows of the balls and of the contacts, in the order of each chain.
    ball_starts, contact_starts : (C + 1,) ndarray of int64
        Where each chain begins in `balls` and in `contacts`, and where the last one ends.
    """

    balls: Ints
    contacts: Ints
    ball_starts: Ints
    contact_starts: Ints

    def __len__(self) -> int:
        return len(self.ball_starts) - 1

    def ball_lists(self) -> list[list[int]]:
        """Return the rows of each chain's balls."""
        return _split(self.balls, self.ball_starts)


def _split(values: Ints, starts: Ints) -> list[list[int]]:
    flat, at = values.tolist(), starts.tolist()
    return [flat[begin:end] for begin, end in pairwise(at)]


# --- stress and Peters' chains ---------------------------------------------------------------


def ball_stress(frame: NetworkFrame) -> Floats:
    """Return each ball's mean stress tensor in Pa, compression positive, (N, 3, 3).

    The sum over the ball's contacts of branch vector (centre to contact point) times force on the
    ball, over the ball's volume, made symmetric (Weber 1966; Peters et al. 2005, eq. 1). Contacts
    with rod and bowl count too.
    """
    other = np.where(frame.between_balls(), frame.b, -1)
    total: Floats = kernels.ball_moments(frame.a, other, frame.centre, frame.point, frame.force)
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
    candidate at the same end of a ball: candidates are taken by falling normal force (of equal
    ones the first of the frame), each end of an axis holds one link, and no link closes a ring, so
    that every chain is a path and no ball is in two chains. A chain starts at its higher end, and
    the chains come by the height of their starts. `major` is what `major_stress` returns for the
    frame, if it is known already.
    """
    return peters_rows(frame, alpha_rad, stress_factor, major).ball_lists()


def peters_rows(
    frame: NetworkFrame,
    alpha_rad: float = ALPHA_RAD,
    stress_factor: float = STRESS_FACTOR,
    major: tuple[Floats, Floats] | None = None,
) -> ChainRows:
    """Return the chains of `peters_chains` with the contacts between their balls."""
    stress, axis = major_stress(ball_stress(frame)) if major is None else major
    high = stress > stress_factor * stress.mean() if stress.size else stress > 0.0
    candidates, end = _candidates(frame, alpha_rad, high, axis)
    near, by = kernels.link_balls(
        frame.ball_id.size, frame.a[candidates], frame.b[candidates], end[0], end[1]
    )
    ends = np.flatnonzero((near >= 0).sum(axis=1) == 1)
    ends = ends[np.lexsort(-frame.centre[ends].T)]
    balls, pairs, starts = kernels.walk_links(near, by, ends, LEAST_BALLS)
    return ChainRows(balls, candidates[pairs], starts, starts - np.arange(len(starts)))


def _candidates(
    frame: NetworkFrame, alpha_rad: float, high: NDArray[np.bool_], axis: Floats
) -> tuple[Ints, NDArray[np.bool_]]:
    """Return the linkable contacts by falling force, and at which end of either axis they link."""
    inner = np.flatnonzero(frame.between_balls())
    inner = inner[high[frame.a[inner]] & high[frame.b[inner]]]
    first, second = frame.a[inner], frame.b[inner]
    line = frame.centre[second] - frame.centre[first]
    line /= np.linalg.norm(line, axis=1, keepdims=True)
    cosine = np.stack(
        [np.einsum("ci,ci->c", axis[first], line), -np.einsum("ci,ci->c", axis[second], line)]
    )
    aligned = np.flatnonzero((np.abs(cosine) >= np.cos(alpha_rad)).all(axis=0))
    aligned = aligned[np.argsort(-frame.normal_force[inner[aligned]], kind="stable")]
    return inner[aligned], cosine[:, aligned] > 0


# --- paths from the rod to the bowl ----------------------------------------------------------


def rod_paths(
    frame: NetworkFrame, threshold: float = THRESHOLD, *, with_rod: bool = True
) -> list[RodPath]:
    """Return one path for each strong rod contact, by falling force of that contact.

    Contacts whose normal force is above `threshold` times the mean of all the frame's contacts are
    strong. A path leads from the rod contact through strong contacts between balls to a strong
    contact with floor or side. Of all such paths the widest counts: the one whose weakest contact
    (its bottleneck, rod and bowl contacts included) is strongest; among several the one with the
    fewest contacts, then the one with the largest sum of forces, then the one that is found first
    from the rod on, level by level, where contacts are taken in the order of the frame. The widest
    path of a graph runs along its maximum spanning tree (Hu 1961, Oper. Res. 9, 898-900); the tie
    rule is ours.

    With `with_rod` false the forces of rod contacts play no part, not even in the mean: a path
    leads from every ball that the rod pushes, and its bottleneck is that of the contacts behind
    that ball.
    """
    rows = path_rows(frame, threshold, with_rod=with_rod)
    pairs = zip(rows.ball_lists(), _split(rows.contacts, rows.contact_starts), strict=True)
    return [RodPath(tuple(balls), tuple(links), _end(frame, links)) for balls, links in pairs]


def _end(frame: NetworkFrame, contacts: list[int]) -> int | None:
    return int(frame.other[contacts[-1]]) if len(contacts) > 1 else None


def path_rows(
    frame: NetworkFrame, threshold: float = THRESHOLD, *, with_rod: bool = True
) -> ChainRows:
    """Return the paths of `rod_paths`; one that leads nowhere has the rod contact alone."""
    force = frame.normal_force
    strong = np.flatnonzero(force > threshold * frame.mean_force_n(with_rod=with_rod))
    pushed = strong if with_rod else np.flatnonzero(force > 0.0)
    rods = pushed[frame.other[pushed] == ROD]
    rods = rods[np.argsort(-force[rods], kind="stable")]
    links = strong[frame.other[strong] != ROD]
    bowl = frame.ball_id.size
    ends = frame.a[links], np.where(frame.between_balls()[links], frame.b[links], bowl)
    strength, start = force[links], frame.a[rods]
    width = kernels.widths(*ends, strength, np.argsort(-strength), bowl + 1, bowl)[start]
    least = np.minimum(width, force[rods]) if with_rod else width
    net, space = kernels.adjacency(*ends, bowl + 1), kernels.search_space(bowl + 1)
    balls, contacts = [], []
    for number in range(len(rods)):
        ball, link = start[number : number + 1], links[:0]
        if width[number] > -np.inf:
            ball, link = kernels.shortest_path(
                net, strength, start[number], bowl, least[number], number, space
            )
        balls.append(ball)
        contacts.append(np.append(rods[number], links[link]))
    return ChainRows(_joined(balls), _joined(contacts), _starts(balls), _starts(contacts))


def _joined(parts: list[Ints]) -> Ints:
    return np.concatenate([np.empty(0, dtype=np.int64), *parts])


def _starts(parts: list[Ints]) -> Ints:
    return np.cumsum([0, *map(len, parts)])


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
    tables = [_peters_table(frame, alpha_rad, stress_factor), _path_table(frame, threshold)]
    count = sum(len(table["ball_ids"]) for table in tables)
    moment = {"step": np.full(count, frame.step), "time_s": np.full(count, frame.time_s)}
    return pd.DataFrame(
        {
            name: _column(kind, [moment[name]] if name in moment else [t[name] for t in tables])
            for name, kind in _COLUMNS.items()
        }
    )


def _column(kind: str, parts: Sequence[Any]) -> Any:
    """Return a column of a table made of its parts."""
    if kind in ("str", "object"):
        values = [value for part in parts for value in part]
        return pd.array(values, dtype="str") if kind == "str" else values
    return np.concatenate(parts).astype(kind)


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


def _peters_table(frame: NetworkFrame, alpha_rad: float, stress_factor: float) -> dict[str, Any]:
    major = major_stress(ball_stress(frame))
    rows = peters_rows(frame, alpha_rad, stress_factor, major)
    on_bowl = np.zeros(frame.ball_id.size, dtype=bool)
    on_bowl[frame.a[(frame.other == FLOOR) | (frame.other == SIDE)]] = True
    return {
        **_measures(frame, rows),
        **_shape(frame, frame.centre[rows.balls], rows.ball_starts),
        "ball_ids": _ids(frame, rows),
        "definition": ["peters"] * len(rows),
        "major_stress_mean_pa": _of_each(rows.ball_starts, major[0][rows.balls], _mean),
        "reaches_bowl": _of_each(rows.ball_starts, on_bowl[rows.balls], _any),
        "end_kind": ["none"] * len(rows),
        "dominant": np.zeros(len(rows), dtype=bool),
    }


def _path_table(frame: NetworkFrame, threshold: float) -> dict[str, Any]:
    rows = path_rows(frame, threshold)
    whole = np.diff(rows.contact_starts) > 1
    first = rows.contacts[rows.contact_starts[:-1]]
    last = rows.contacts[rows.contact_starts[1:] - 1]
    starts = rows.ball_starts + 2 * np.arange(len(rows) + 1)
    points = np.empty((starts[-1], 3))
    inner = np.ones(len(points), dtype=bool)
    inner[starts[:-1]] = inner[starts[1:] - 1] = False
    points[inner] = frame.centre[rows.balls]
    points[starts[:-1]], points[starts[1:] - 1] = frame.point[first], frame.point[last]
    found = _measures(frame, rows) | _shape(frame, points, starts)
    for name in ("bottleneck_n", "mean_force_n", "length_m", "azimuth_rad", "inclination_rad"):
        found[name] = np.where(whole, found[name], np.nan)
    order = np.lexsort((-found["mean_force_n"], -found["bottleneck_n"]))
    dominant = np.zeros(len(rows), dtype=bool)
    dominant[order[:1]] = whole[order[:1]]
    kinds = frame.other[last].tolist()
    return {
        **found,
        "ball_ids": _ids(frame, rows),
        "definition": ["rod_path"] * len(rows),
        "major_stress_mean_pa": np.full(len(rows), np.nan),
        "reaches_bowl": whole,
        "end_kind": [
            KINDS[kind] if there else "none" for kind, there in zip(kinds, whole, strict=True)
        ],
        "dominant": dominant,
    }


def _ids(frame: NetworkFrame, rows: ChainRows) -> list[list[int]]:
    return _split(frame.ball_id[rows.balls], rows.ball_starts)


def _measures(frame: NetworkFrame, rows: ChainRows) -> dict[str, NDArray[Any]]:
    forces = frame.normal_force[rows.contacts]
    return {
        "n_balls": np.diff(rows.ball_starts),
        "bottleneck_n": _of_each(rows.contact_starts, forces, lambda x: x.min(axis=1)),
        "mean_force_n": _of_each(rows.contact_starts, forces, _mean),
        "altitude_m": _of_each(rows.ball_starts, frame.centre[rows.balls, 2], _mean),
    }


def _shape(frame: NetworkFrame, points: Floats, starts: Ints) -> dict[str, Floats]:
    """Return length and direction of polylines, one after another."""
    line = points[starts[1:] - 1] - points[starts[:-1]]
    x, y, z = np.ascontiguousarray(line.T)
    return {
        "length_m": _of_each(starts, points, _length),
        "azimuth_rad": wrap_angle(np.arctan2(y, x) - frame.heading_rad),
        "inclination_rad": np.arctan2(z, np.hypot(x, y)),
    }


def _of_each(starts: Ints, values: NDArray[Any], measure: Callable[[Any], NDArray[Any]]) -> Floats:
    """Measure each chain's values: all chains of one length at once, (n, length, ...)."""
    found = np.empty(len(starts) - 1)
    lengths = np.diff(starts)
    for length in np.unique(lengths):
        which = np.flatnonzero(lengths == length)
        found[which] = measure(values[starts[which][:, None] + np.arange(length)])
    return found


def _mean(values: NDArray[Any]) -> Floats:
    return np.asarray(values.mean(axis=1))


def _any(values: NDArray[Any]) -> NDArray[np.bool_]:
    return np.asarray(values.any(axis=1))


def _length(points: Floats) -> Floats:
    return np.asarray(np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1))
