"""The dominant chain of every network frame, by each definition and threshold, in numbers.

Of every frame one chain counts for each setting: the one with the strongest weakest contact
(bottleneck), by mean force where two are equal. Four definitions are told apart:

- ``widest_path``: as in `dragchain.chains`, from a strong workpiece contact through strong
contacts to the
  bowl; the workpiece contact counts in the bottleneck.
- ``free_path``: the same path search in which the forces on the workpiece play no part, neither
for the
  choice of the path nor for its bottleneck nor in the mean: from any particle that the workpiece
  pushes.
- ``peters``: a chain by Peters et al. (2005) with a particle on the workpiece and a particle on
the bowl.
- ``peters_workpiece``: such a chain with a particle on the workpiece, wherever it ends.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from dragchain.network.chains import (
    ALPHA_RAD,
    STRESS_FACTOR,
    THRESHOLD,
    ChainRows,
    dominant_path,
    major_stress,
    particle_stress,
    peters_rows,
    widest_paths,
)
from dragchain.network.frame import FLOOR, SIDE, WORKPIECE, NetworkFrame, read_frames
from dragchain.run.kinematics import wrap_angle

FORCE_FACTORS = (0.5, 1.0, 1.5, 2.0, 10.0)
"""Times the mean normal force. Up to 2 a path is there almost always; at 10 only at times."""

ANGLES_DEG = (30.0, 45.0, 60.0)
STRESS_FACTORS = (0.5, 1.0, 1.5, 6.0)
"""Times the mean stress: 6 for the same reason."""

SAME_CHAIN = 0.5
"""Two chains of frames in a row are one if they share at least this part of their particles."""


@dataclass(frozen=True)
class Setting:
    """A definition of the dominant chain with its thresholds.

    Attributes
    ----------
    definition : str
        `widest_path`, `free_path`, `peters` or `peters_workpiece`.
    force_factor : float
        Least normal force of a path's contacts over the frame's mean; NaN for Peters' chains.
    alpha_rad, stress_factor : float
        Angle and stress of Peters' chains; NaN for paths.
    """

    definition: str
    force_factor: float = np.nan
    alpha_rad: float = np.nan
    stress_factor: float = np.nan

    @property
    def is_path(self) -> bool:
        """Whether it is a path from workpiece to bowl, not a chain by Peters et al."""
        return self.definition.endswith("_path")

    @property
    def label(self) -> str:
        """The thresholds in words."""
        if self.is_path:
            return f"force {self.force_factor:g} x mean"
        return f"{np.degrees(self.alpha_rad):.0f}°, stress {self.stress_factor:g} x mean"

    @property
    def default(self) -> bool:
        """Whether the thresholds are those of `dragchain.chains`."""
        if self.is_path:
            return self.force_factor == THRESHOLD
        return (self.alpha_rad, self.stress_factor) == (ALPHA_RAD, STRESS_FACTOR)


DEFINITIONS = {
    "widest_path": "path from workpiece to bowl",
    "free_path": "path, forces on the workpiece left out",
    "peters": "Peters' chain on workpiece and bowl",
    "peters_workpiece": "Peters' chain on the workpiece",
}


def _settings() -> tuple[Setting, ...]:
    """One threshold is varied at a time."""
    angles = [(np.radians(angle), STRESS_FACTOR) for angle in ANGLES_DEG]
    stresses = [(ALPHA_RAD, factor) for factor in STRESS_FACTORS if factor != STRESS_FACTOR]
    paths = [
        Setting(name, force_factor=factor)
        for name in ("widest_path", "free_path")
        for factor in FORCE_FACTORS
    ]
    peters = [
        Setting(name, alpha_rad=float(alpha), stress_factor=factor)
        for name in ("peters", "peters_workpiece")
        for alpha, factor in [*angles, *stresses]
    ]
    return (*paths, *peters)


SETTINGS = _settings()


@dataclass(frozen=True)
class Chain:
    """A chain, listed from the workpiece on.

    Attributes
    ----------
    particles : sequence of int
        Rows of the frame's particles.
    contacts : (n,) ndarray of int
        Rows of the contacts whose weakest is the bottleneck.
    behind : (n,) ndarray of int
        Those of them that are not the workpiece's.
    outer : (n,) ndarray of int
        Those of them beyond the first contact between two of its particles.
    points : (k, 3) ndarray
        Polyline in m: the centres, for a path also its workpiece contact and its bowl contact.
    """

    particles: tuple[int, ...]
    contacts: Ints
    behind: Ints
    outer: Ints
    points: Floats


# --- the dominant chain ----------------------------------------------------------------------


def path_chain(frame: NetworkFrame, *, with_workpiece: bool) -> Chain | None:
    """The frame's dominant path at the lowest of the force factors.

    At a higher factor the dominant path is the same, as long as its bottleneck is above it: all
    its contacts then are strong, and no path with a stronger bottleneck is lost.
    """
    paths = widest_paths(frame, min(FORCE_FACTORS), with_workpiece=with_workpiece)
    path = dominant_path(frame, paths, with_workpiece=with_workpiece)
    if path is None:
        return None
    contacts = np.array(path.contacts)
    ends = frame.point[contacts[[0, -1]]]
    points = np.vstack([ends[:1], frame.centre[list(path.particles)], ends[1:]])
    used = contacts if with_workpiece else contacts[1:]
    return Chain(path.particles, used, contacts[1:], contacts[2:], points)


def peters_chain(
    frame: NetworkFrame, chains: Sequence[Sequence[int]], contact_of: dict[tuple[int, int], int],
    *, on_bowl: bool,
) -> Chain | None:  # fmt: skip
    """The dominant one of Peters' chains that touch the workpiece and, if asked, the bowl."""
    pushed = set(frame.a[(frame.other == WORKPIECE) & (frame.normal_force > 0.0)].tolist())
    bowl = set(frame.a[(frame.other == FLOOR) | (frame.other == SIDE)].tolist())
    found = [
        _from_workpiece(frame, chain, pushed, contact_of)
        for chain in chains
        if not pushed.isdisjoint(chain) and (not on_bowl or not bowl.isdisjoint(chain))
    ]
    return max(found, key=lambda chain: _strength(frame, chain)) if found else None


def _from_workpiece(
    frame: NetworkFrame,
    chain: Sequence[int],
    pushed: set[int],
    contact_of: dict[tuple[int, int], int],
) -> Chain:
    """List a chain from the end that is nearer to one of its particles on the workpiece."""
    at = [place for place, particle in enumerate(chain) if particle in pushed]
    particles = tuple(chain if at[0] <= len(chain) - 1 - at[-1] else reversed(chain))
    links = np.array([contact_of[min(pair), max(pair)] for pair in pairwise(particles)])
    return Chain(particles, links, links, links[1:], frame.centre[list(particles)])


def _strength(frame: NetworkFrame, chain: Chain) -> tuple[float, float]:
    forces = frame.normal_force[chain.contacts]
    return float(forces.min()), float(forces.mean())


def _contact_of(frame: NetworkFrame, links: Ints) -> dict[tuple[int, int], int]:
    """The contact of each linked pair of particles, the lower row first."""
    low = np.minimum(frame.a[links], frame.b[links]).tolist()
    high = np.maximum(frame.a[links], frame.b[links]).tolist()
    return dict(zip(zip(low, high, strict=True), links.tolist(), strict=True))


# --- its numbers -----------------------------------------------------------------------------


@dataclass(frozen=True)
class Around:
    """What a frame's chain is compared with.

    Attributes
    ----------
    mean_n, free_mean_n : float
        Mean normal force of all contacts, and of those that are not the workpiece's.
    resistance_n : float
        Force of the workpiece on the particles along its motion.
    shell_n : float
        Root mean square normal force between the particles that the workpiece pushes and others.
    """

    mean_n: float
    free_mean_n: float
    resistance_n: float
    shell_n: float


def around_workpiece(frame: NetworkFrame) -> Around:
    """Measure a frame."""
    on_workpiece = frame.other == WORKPIECE
    push = frame.force[on_workpiece] @ _heading(frame)
    pushed = np.zeros(frame.particle_id.size, dtype=bool)
    pushed[frame.a[on_workpiece & (frame.normal_force > 0.0)]] = True
    inner = frame.between_particles()
    shell = frame.normal_force[inner & (pushed[frame.a] | pushed[frame.b])]
    return Around(
        frame.mean_force_n(),
        frame.mean_force_n(with_workpiece=False),
        float(push.sum()),
        float(np.sqrt(np.mean(shell**2))) if shell.size else np.nan,
    )


def _heading(frame: NetworkFrame) -> Floats:
    return np.array([np.cos(frame.direction_rad), np.sin(frame.direction_rad), 0.0])


def describe(
    frame: NetworkFrame, around: Around, chain: Chain | None, *, with_workpiece: bool = True
) -> dict[str, object]:
    """The numbers of a frame's dominant chain; NaN, and no particles, if there is none.

    With `with_workpiece` false the mean force leaves out the contacts of the workpiece.
    """
    if chain is None:
        return dict.fromkeys(_NUMBERS, np.nan) | {"exists": 0.0, "particle_ids": []}
    particles = list(chain.particles)
    forces = frame.normal_force
    mean = around.mean_n if with_workpiece else around.free_mean_n
    weakest = float(forces[chain.contacts].min())
    outer = float(forces[chain.outer].min()) if chain.outer.size else np.nan
    push = frame.force[(frame.other == WORKPIECE) & np.isin(frame.a, particles)] @ _heading(frame)
    resistance = around.resistance_n if around.resistance_n > 0.0 else np.nan
    line = chain.points[-1] - chain.points[0]
    flat = float(np.hypot(line[0], line[1]))
    azimuth = float(wrap_angle(np.arctan2(line[1], line[0]) - frame.direction_rad))
    length = np.linalg.norm(np.diff(chain.points, axis=0), axis=1).sum()
    return {
        "exists": 1.0,
        "particle_ids": frame.particle_id[particles].tolist(),
        "bottleneck_n": weakest,
        "bottleneck_over_mean": weakest / mean,
        "outer_over_mean": outer / mean,
        "bottleneck_over_drag": weakest / resistance,
        "workpiece_fraction": float(push.sum()) / resistance,
        "stands_out": float(forces[chain.behind].min()) / around.shell_n,
        "particles": float(len(particles)),
        "straightness": float(np.linalg.norm(line) / length),
        "angle_rad": abs(azimuth),
        "azimuth_rad": azimuth,
        "inclination_rad": float(np.arctan2(line[2], flat)),
        "altitude_m": float(frame.centre[particles, 2].mean()),
    }


_NUMBERS = (
    "bottleneck_n", "bottleneck_over_mean", "outer_over_mean", "bottleneck_over_drag",
    "workpiece_fraction",
    "stands_out", "particles", "straightness", "angle_rad", "azimuth_rad", "inclination_rad",
    "altitude_m",
)  # fmt: skip


def frame_rows(frame: NetworkFrame) -> Iterator[dict[str, object]]:
    """Yield the numbers of a frame's dominant chain for every one of `SETTINGS`, in their order."""
    around = around_workpiece(frame)
    rows = [*_path_rows(frame, around), *_peters_rows(frame, around)]
    for at, row in enumerate(rows):
        moment = {"setting": at, "step": frame.step, "time_s": frame.time_s}
        yield moment | {"resistance_n": around.resistance_n} | row


def _path_rows(frame: NetworkFrame, around: Around) -> Iterator[dict[str, object]]:
    """Search once for each definition: the threshold only decides whether the path counts."""
    for definition, mean in (("widest_path", around.mean_n), ("free_path", around.free_mean_n)):
        with_workpiece = definition == "widest_path"
        chain = path_chain(frame, with_workpiece=with_workpiece)
        row = describe(frame, around, chain, with_workpiece=with_workpiece)
        weakest = 0.0 if chain is None else float(frame.normal_force[chain.contacts].min())
        for setting in SETTINGS:
            if setting.definition == definition:
                kept = weakest > setting.force_factor * mean
                yield row if kept else describe(frame, around, None)


def _peters_rows(frame: NetworkFrame, around: Around) -> Iterator[dict[str, object]]:
    major = major_stress(particle_stress(frame))
    found: dict[tuple[float, float], ChainRows] = {}
    for setting in SETTINGS:
        if setting.is_path:
            continue
        limits = (setting.alpha_rad, setting.stress_factor)
        if limits not in found:
            found[limits] = peters_rows(frame, *limits, major)
        rows, on_bowl = found[limits], setting.definition == "peters"
        contact_of = _contact_of(frame, rows.contacts)
        chain = peters_chain(frame, rows.particle_lists(), contact_of, on_bowl=on_bowl)
        yield describe(frame, around, chain)


def frame_table(run_dir: Path) -> pd.DataFrame:
    """The dominant chains of a process run: a row a counted network frame and setting.

    Returns
    -------
    DataFrame
        ``setting`` (place in `SETTINGS`), ``step``, ``time_s``, ``resistance_n``, ``exists``,
        ``particle_ids``, the numbers of the chain (`describe`), and ``life_s``, ``age_s`` and
        ``left_s`` (`lives`), by setting and time.

    Raises
    ------
    TableError
        If a table is missing.
    """
    rows = [row for frame in read_frames(run_dir) for row in frame_rows(frame)]
    table = pd.DataFrame(rows).sort_values(["setting", "step"], kind="stable")
    parts = [
        pd.DataFrame(
            vars(lives(part["particle_ids"].tolist(), part["time_s"].to_numpy(np.float64)))
        )
        for _, part in table.groupby("setting", sort=True)
    ]
    return pd.concat(
        [table.reset_index(drop=True), pd.concat(parts, ignore_index=True)], axis=1
    )  # fmt: skip


# --- lifetimes -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Lives:
    """The life of the dominant chain that a frame has, for N frames.

    Attributes
    ----------
    life : (N,) ndarray of int
        Number of the life, from 0; -1 in a frame without a chain.
    life_s : (N,) ndarray
        How long the frame's chain is the dominant one in all: number of frames times their
        interval; NaN without a chain.
    age_s, left_s : (N,) ndarray
        Time since its first frame and until its last one.
    cut : (N,) ndarray of bool
        Whether the life touches the first or the last frame, so that it is longer than seen.
    """

    life: Ints
    life_s: Floats
    age_s: Floats
    left_s: Floats
    cut: np.typing.NDArray[np.bool_]


def overlap(first: Sequence[int], second: Sequence[int]) -> float:
    """The Jaccard index of two sets of particles: shared over all; 0 if either is empty."""
    both = set(first) & set(second)
    return len(both) / len(set(first) | set(second)) if both else 0.0


def lives(particle_ids: Sequence[Sequence[int]], time_s: Floats) -> Lives:
    """Follow the dominant chain from frame to frame.

    A life goes on as long as the chains of frames in a row overlap by `SAME_CHAIN` at least.

    Parameters
    ----------
    particle_ids : sequence of sequence of int
        Particles of each frame's chain, none where there is no chain.
    time_s : (N,) ndarray
        Times of the frames, at equal intervals.
    """
    count = len(particle_ids)
    there = np.array([len(particles) > 0 for particles in particle_ids], dtype=bool)
    kept = np.array([overlap(a, b) >= SAME_CHAIN for a, b in pairwise(particle_ids)], dtype=bool)
    begins = there & ~np.concatenate([[False], kept])
    life = np.where(there, np.cumsum(begins) - 1, -1)
    interval = float(np.median(np.diff(time_s))) if count > 1 else 0.0
    numbers = life[there]
    frames = np.bincount(numbers, minlength=1)
    place = np.arange(count)
    first = np.full(len(frames), count)
    np.minimum.at(first, numbers, place[there])
    last = first + frames - 1
    ends = (first == 0) | (last == count - 1)

    def spread(values: Floats) -> Floats:
        return np.where(there, values, np.nan)

    return Lives(
        life=life,
        life_s=spread(interval * frames[life].astype(np.float64)),
        age_s=spread(interval * (place - first[life]).astype(np.float64)),
        left_s=spread(interval * (last[life] - place).astype(np.float64)),
        cut=there & ends[life],
    )
