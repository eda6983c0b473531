"""The dominant chain of every network frame in numbers, by each definition and threshold.

In every frame one chain counts for each of `SETTINGS`: the one with the strongest weakest contact
(bottleneck), by mean force where two are equal.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints, wrap_angle
from dragchain.network import chains as network_chains
from dragchain.network.frame import FLOOR, SIDE, WORKPIECE, NetworkFrame, read_frames
from evidence.validation.peaks.lifetimes import lives
from evidence.validation.peaks.settings import FORCE_FACTORS, SETTINGS

Contacts = dict[tuple[int, int], int]
"""The contact of each linked pair of particles, the lower row first."""


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
    paths = network_chains.widest_paths(frame, min(FORCE_FACTORS), with_workpiece=with_workpiece)
    path = network_chains.dominant_path(frame, paths, with_workpiece=with_workpiece)
    if path is None:
        return None
    contacts = np.array(path.contacts)
    ends = frame.point[contacts[[0, -1]]]
    points = np.vstack([ends[:1], frame.centre[list(path.particles)], ends[1:]])
    used = contacts if with_workpiece else contacts[1:]
    return Chain(path.particles, used, contacts[1:], contacts[2:], points)


def peters_chain(
    frame: NetworkFrame, chains: Sequence[Sequence[int]], contacts: Contacts, *, on_bowl: bool
) -> Chain | None:
    """The dominant one of Peters' chains that touch the workpiece and, if asked, the bowl."""
    pushed = set(frame.a[(frame.other == WORKPIECE) & (frame.normal_force > 0.0)].tolist())
    bowl = set(frame.a[(frame.other == FLOOR) | (frame.other == SIDE)].tolist())
    touching = [
        _from_workpiece(frame, chain, pushed, contacts)
        for chain in chains
        if not pushed.isdisjoint(chain) and (not on_bowl or not bowl.isdisjoint(chain))
    ]
    return max(touching, key=lambda chain: _strength(frame, chain), default=None)


def _from_workpiece(
    frame: NetworkFrame, chain: Sequence[int], pushed: set[int], contacts: Contacts
) -> Chain:
    """List a chain from the end that is nearer to one of its particles on the workpiece."""
    at = [place for place, particle in enumerate(chain) if particle in pushed]
    particles = tuple(chain if at[0] <= len(chain) - 1 - at[-1] else reversed(chain))
    links = np.array([contacts[min(pair), max(pair)] for pair in pairwise(particles)])
    return Chain(particles, links, links, links[1:], frame.centre[list(particles)])


def _strength(frame: NetworkFrame, chain: Chain) -> tuple[float, float]:
    forces = frame.normal_force[chain.contacts]
    return float(forces.min()), float(forces.mean())


def _contacts_of(frame: NetworkFrame, links: Ints) -> Contacts:
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


@dataclass(frozen=True)
class ChainNumbers:
    """The numbers of a frame's dominant chain; NaN, and no particles, if there is none.

    Attributes
    ----------
    exists : float
        1 if there is a chain, else 0.
    particle_ids : list of int
    bottleneck_n : float
        Normal force of its weakest contact.
    bottleneck_over_mean, bottleneck_over_drag : float
        The same over the frame's mean normal force and over the resistance.
    outer_over_mean : float
        That of the weakest contact beyond the first link, over the mean.
    workpiece_fraction : float
        Fraction of the resistance that its particles bear at the workpiece.
    stands_out : float
        That of the weakest contact behind the workpiece, over `Around.shell_n`.
    particles, straightness : float
        Number of particles; distance of the ends over the length.
    angle_rad, azimuth_rad, inclination_rad : float
        Direction of the line from the workpiece to its end: from the motion, without sign and to
        its left, and above the horizontal.
    altitude_m : float
        Mean height of the particles' centres.
    """

    exists: float = 0.0
    particle_ids: Sequence[int] = ()
    bottleneck_n: float = np.nan
    bottleneck_over_mean: float = np.nan
    outer_over_mean: float = np.nan
    bottleneck_over_drag: float = np.nan
    workpiece_fraction: float = np.nan
    stands_out: float = np.nan
    particles: float = np.nan
    straightness: float = np.nan
    angle_rad: float = np.nan
    azimuth_rad: float = np.nan
    inclination_rad: float = np.nan
    altitude_m: float = np.nan


_NO_CHAIN = ChainNumbers()


def describe(
    frame: NetworkFrame, around: Around, chain: Chain | None, *, with_workpiece: bool = True
) -> ChainNumbers:
    """Measure a frame's dominant chain.

    With `with_workpiece` false the mean force leaves out the contacts of the workpiece.
    """
    if chain is None:
        return _NO_CHAIN
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
    return ChainNumbers(
        exists=1.0,
        particle_ids=frame.particle_id[particles].tolist(),
        bottleneck_n=weakest,
        bottleneck_over_mean=weakest / mean,
        outer_over_mean=outer / mean,
        bottleneck_over_drag=weakest / resistance,
        workpiece_fraction=float(push.sum()) / resistance,
        stands_out=float(forces[chain.behind].min()) / around.shell_n,
        particles=float(len(particles)),
        straightness=float(np.linalg.norm(line) / length),
        angle_rad=abs(azimuth),
        azimuth_rad=azimuth,
        inclination_rad=float(np.arctan2(line[2], flat)),
        altitude_m=float(frame.centre[particles, 2].mean()),
    )


# --- all settings and frames -----------------------------------------------------------------


def chains_of(frame: NetworkFrame, around: Around) -> list[ChainNumbers]:
    """The numbers of a frame's dominant chain for every one of `SETTINGS`, in their order."""
    return [*_paths(frame, around), *_peters_chains(frame, around)]


def _paths(frame: NetworkFrame, around: Around) -> Iterator[ChainNumbers]:
    """Search once for each definition: the threshold only decides whether the path counts."""
    for definition, mean in (("widest_path", around.mean_n), ("free_path", around.free_mean_n)):
        with_workpiece = definition == "widest_path"
        chain = path_chain(frame, with_workpiece=with_workpiece)
        numbers = describe(frame, around, chain, with_workpiece=with_workpiece)
        for setting in SETTINGS:
            if setting.definition == definition:
                strong = numbers.bottleneck_n > setting.force_factor * mean
                yield numbers if strong else _NO_CHAIN


def _peters_chains(frame: NetworkFrame, around: Around) -> Iterator[ChainNumbers]:
    major = network_chains.major_stress(network_chains.particle_stress(frame))
    by_limits: dict[tuple[float, float], network_chains.ChainRows] = {}
    for setting in SETTINGS:
        if setting.is_path:
            continue
        limits = (setting.alpha_rad, setting.stress_factor)
        if limits not in by_limits:
            by_limits[limits] = network_chains.peters_rows(frame, *limits, major)
        rows, on_bowl = by_limits[limits], setting.definition == "peters"
        contacts = _contacts_of(frame, rows.contacts)
        yield describe(
            frame, around, peters_chain(frame, rows.particle_lists(), contacts, on_bowl=on_bowl)
        )


def _rows(frame: NetworkFrame) -> Iterator[dict[str, object]]:
    around = around_workpiece(frame)
    moment = {"step": frame.step, "time_s": frame.time_s, "resistance_n": around.resistance_n}
    for at, numbers in enumerate(chains_of(frame, around)):
        yield {"setting": at, **moment, **vars(numbers)}


def frame_table(run_dir: Path) -> pd.DataFrame:
    """The dominant chains of a process run: one row per counted network frame and setting.

    Returns
    -------
    DataFrame
        ``setting`` (place in `SETTINGS`), ``step``, ``time_s``, ``resistance_n``, the numbers of
        the chain (`ChainNumbers`) and its life (`Lives`), by setting and time.

    Raises
    ------
    TableError
        If a table is missing.
    """
    table = pd.DataFrame([row for frame in read_frames(run_dir) for row in _rows(frame)])
    table = table.sort_values(["setting", "step"], kind="stable", ignore_index=True)
    parts = [
        pd.DataFrame(vars(lives(part["particle_ids"].tolist(), part["time_s"].to_numpy(float))))
        for _, part in table.groupby("setting", sort=True)
    ]
    return pd.concat([table, pd.concat(parts, ignore_index=True)], axis=1)
