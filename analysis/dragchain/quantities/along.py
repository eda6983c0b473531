"""What one process run says of every quantity along its path.

The counted path is cut into blocks of about one mean particle diameter; each
quantity has one value a block, and `dragchain.quantities.blocks` makes the run's value of them.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from dragchain.drag import FORCES, drag_peaks, parts, read_counted, within_angle
from dragchain.loading.samples import Sampled, sample
from dragchain.quantities.blocks import FEWEST, Blocks
from dragchain.quantities.document import PathQuantities
from dragchain.run.kinematics import drag_phase, motion_of, needed, spins, workpiece_rotation
from dragchain.statistics.estimate import finite
from dragchain.tables.by_step import read_groups, read_table
from dragchain.tables.columns import vector
from dragdeck.records.case import CaseOfRun

MAP_DEPTHS, MAP_AZIMUTHS = 4, 12
"""Bins of a load map: equal parts of the immersion depth, and of the circumference."""


def _of_loading(sampled: Sampled, path: "CountedPath") -> dict[str, Blocks]:
    """What the contacts on the workpiece do to it, in equal parts of their samples."""
    block = np.arange(sampled.frames) * path.blocks // sampled.frames  # of each sample
    frames = np.bincount(block, minlength=path.blocks)
    ahead = within_angle(sampled.rows["azimuth_rad"].to_numpy(np.float64), np.pi / 2)

    def sums(of_rows: Floats | pd.Series) -> Floats:
        return np.asarray(np.bincount(block, sampled.per_frame(of_rows), path.blocks), np.float64)

    load = sums(sampled.rows["normal_impulse_n_s"])
    metres = sampled.path_m / sampled.frames * frames
    return {
        "workpiece_contacts": Blocks.ratio(sums(sampled.rows["contacts"]), frames),
        "normal_load": Blocks.ratio(load / sampled.interval_s, frames),
        **{
            name: Blocks.ratio(sums(sampled.rows[column]), metres)
            for name, column in _PER_METRE.items()
        },
        "ahead_behind": Blocks.ratio(sums(sampled.rows["normal_impulse_n_s"] * ahead), load),
        "events": path.per_metre(block[_begins(sampled)]),
    }


_PER_METRE = {
    "sliding_distance": "sliding_m",
    "force_slide": "force_slide_n_m",
    "friction_work": "friction_work_j",
    "workpiece_work": "workpiece_work_j",
    "normal_impulse": "normal_impulse_n_s",
}
"""Amounts of the contacts that are told for a metre of path."""


def _load_map(counted: Sampled, depth_m: float) -> Floats:
    """Mean normal load by depth and azimuth, (MAP_DEPTHS, MAP_AZIMUTHS) in N."""
    rows = counted.rows
    level = np.floor(rows["depth_m"].to_numpy() / depth_m * MAP_DEPTHS).astype(np.int64)
    level = level.clip(0, MAP_DEPTHS - 1)
    load = rows["normal_impulse_n_s"].to_numpy() / (counted.frames * counted.interval_s)
    load_map = np.zeros((MAP_DEPTHS, MAP_AZIMUTHS))
    for half in parts(rows["azimuth_rad"].to_numpy(np.float64), MAP_AZIMUTHS):
        np.add.at(load_map, (level, half), load / 2.0)
    return load_map


LONG_WAVE, SHORT_WAVE = 2.0, 0.25
"""Wave lengths in mean particle diameters that part the spectrum of the drag in three bands."""


# --- blocks of the path --------------------------------------------------------------------------


PathRows = tuple[Ints, Floats]
"""Steps, (N,), and values, (N, ...), of N rows of a table."""


@dataclass(frozen=True)
class CountedPath:
    """The counted path, cut into equal blocks; a step belongs to one of them."""

    first_step: int
    last_step: int
    begin_m: float
    length_m: float
    diameter_m: float
    blocks: int

    @classmethod
    def of(cls, case: CaseOfRun, counted_steps: Ints) -> "CountedPath":
        """The path of a process, from the steps at which its force is counted, (N,)."""
        motion = case.motion
        assert motion is not None
        diameter = 2.0 * case.media.radius_mean_m
        first, last = int(counted_steps[0]), int(counted_steps[-1])
        start, per_step = drag_phase(case).start_step, case.timestep_s * motion.axis_speed_m_s
        before = max(first - int(np.median(np.diff(counted_steps))), start)
        length = (last - before) * per_step
        begin = (before - start) * per_step
        return cls(before, last, begin, length, diameter, max(FEWEST, round(length / diameter)))

    def block(self, steps: Ints) -> Ints:
        """Number of the block of each step, (N,); steps outside get the nearest."""
        fraction = (np.asarray(steps) - self.first_step) / (self.last_step - self.first_step)
        number = np.ceil(fraction * self.blocks).astype(np.int64) - 1
        return np.asarray(number.clip(0, self.blocks - 1))

    def mean(self, steps: Ints, values: Floats) -> Blocks:
        """Means of N values in every block, with their numbers."""
        block = self.block(steps)
        total = np.bincount(block, weights=values, minlength=self.blocks)
        return Blocks.ratio(total, np.bincount(block, minlength=self.blocks))

    def per_metre(self, block: Ints) -> Blocks:
        """How many there are in a metre of every block, from the block of each, (N,)."""
        count = np.bincount(block, minlength=self.blocks)
        return Blocks(count / (self.length_m / self.blocks), np.ones(self.blocks))

    def parts(self, rows: Iterable[PathRows]) -> Iterator[tuple[int, Floats]]:
        """Values of rising steps block by block: number of the block, and what is in it.

        Parameters
        ----------
        rows : iterable of ((N,) ndarray of int, (N, ...) ndarray)
            Steps and values, a piece of the table each. One piece and one block are held.
        """
        held: list[Floats] = []
        last = 0
        for steps, values in rows:
            block = self.block(steps)
            cuts = np.flatnonzero(np.diff(block)) + 1
            for first, end in zip([0, *cuts], [*cuts, len(block)], strict=True):
                if held and block[first] != last:
                    yield last, np.concatenate(held)
                    held = []
                held.append(values[first:end])
                last = int(block[first])
        if held:
            yield last, np.concatenate(held)


def quantities_along(run_dir: Path, case: CaseOfRun) -> PathQuantities:
    """The quantities of a complete run with tables and chains.

    Raises
    ------
    TableError
        If a table is missing, the slip of the contacts is not known, or no particle touches the
        workpiece.
    """
    turning = (_HEADING, *_TORQUES) if spins(case) else ()
    force = read_counted(run_dir, ("step", "time_s", *FORCES, *turning))
    path = CountedPath.of(case, force["step"].to_numpy(np.int64))
    sampled = sample(run_dir, case)
    quantities = {
        **_of_force(force, path, case),
        **_of_workpiece_contacts(run_dir, path),
        **_of_loading(sampled, path),
        **_of_network(run_dir, path),
    }
    load_map = _load_map(sampled, needed(case.workpiece, "workpiece").immersion_depth_m)
    return PathQuantities(
        begin_m=path.begin_m,
        arc_m=path.length_m,
        block_m=path.length_m / path.blocks,
        blocks={
            name: tuple(map(finite, blocks.values.tolist())) for name, blocks in quantities.items()
        },
        weights={
            name: tuple(blocks.weights.tolist())
            for name, blocks in quantities.items()
            if np.ptp(blocks.weights) > 0.0 or not blocks.weights.any()
        },
        load_map=tuple(load_map.ravel().tolist()),
    )


_HEADING, _TORQUES = "direction_rad", vector("torque", "n_m")


def _of_force(force: pd.DataFrame, path: CountedPath, case: CaseOfRun) -> dict[str, Blocks]:
    steps = force["step"].to_numpy(np.int64)
    series = {name.removesuffix("_n"): force[name].to_numpy(np.float64) for name in FORCES}
    unbiased = math.sqrt(len(steps) / (len(steps) - 1))
    away = {name: (forces - forces.mean()) * unbiased for name, forces in series.items()}
    spacing = path.length_m / len(steps)
    bands = {
        "long": (LONG_WAVE, math.inf),
        "middle": (SHORT_WAVE, LONG_WAVE),
        "short": (0.0, SHORT_WAVE),
    }
    squares = {
        f"drag_std_{name}": path.mean(
            steps,
            band_pass(away["drag"], spacing, low * path.diameter_m, high * path.diameter_m) ** 2,
        )
        for name, (low, high) in bands.items()
    }
    if spins(case):
        series["torque"] = _own_torque(force, case)
    blocks = {
        **{f"{name}_mean": path.mean(steps, of_samples) for name, of_samples in series.items()},
        **{f"{name}_std": path.mean(steps, of_samples**2) for name, of_samples in away.items()},
        **squares,
        "peaks": path.per_metre(path.block(steps[drag_peaks(force, case).index])),
    }
    if path.length_m < 2.0 * LONG_WAVE * path.diameter_m:  # a window is no longer than its waves
        del blocks["drag_std_long"]
    return blocks


def _own_torque(samples: pd.DataFrame, case: CaseOfRun) -> Floats:
    """Torque of the particles on the workpiece about its own axis, (N,) in N m.

    Unless the workpiece turns in the frame of its path, its work is negligible beside the drag's.
    """
    step, heading = samples["step"].to_numpy(np.int64), samples[_HEADING].to_numpy(np.float64)
    torque = samples[[*_TORQUES]].to_numpy(np.float64)
    axis = motion_of(case).drive.own_axis
    return np.asarray(workpiece_rotation(step, heading, case).into(torque) @ axis)


def band_pass(series: Floats, spacing_m: float, shortest_m: float, longest_m: float) -> Floats:
    """The part of a series whose wave lengths lie in [shortest, longest).

    Parameters
    ----------
    series : (N,) ndarray
        Deviations from the mean at equal distances.
    spacing_m : float
        That distance, m.
    shortest_m, longest_m : float
        Limits of the band, m; bands that follow one another add up to the series.

    Returns
    -------
    (N,) ndarray
    """
    amplitude = np.fft.rfft(series)
    frequency = np.fft.rfftfreq(len(series), spacing_m)
    with np.errstate(divide="ignore"):
        wave = 1.0 / frequency
    amplitude[~((wave >= shortest_m) & (wave < longest_m))] = 0.0
    if math.isinf(longest_m):
        amplitude[0] = np.sum(series)
    return np.fft.irfft(amplitude, n=len(series))


def _pushing_contacts(run_dir: Path) -> Iterator[PathRows]:
    """Normal force and overlap of contacts that push the workpiece, (N, 2).

    A silent contact overlaps without a force and does not count.
    """
    file = run_dir / "tables" / "workpiece_contacts.parquet"
    for rows in read_groups(file, ["step", "normal_force_n", "overlap_m", "in_statistics"]):
        pushing = rows[rows["in_statistics"] & (rows["normal_force_n"] > 0.0)]
        if len(pushing):
            yield (
                pushing["step"].to_numpy(np.int64),
                pushing[["normal_force_n", "overlap_m"]].to_numpy(np.float64),
            )


def _of_workpiece_contacts(run_dir: Path, path: CountedPath) -> dict[str, Blocks]:
    names = (*(f"contact_force_{name}" for name in ("mean", "p50", "p90", "p99")), _OVERLAP)
    values = {name: np.full(path.blocks, math.nan) for name in names}
    contacts = np.zeros(path.blocks)
    for number, (normal, depth) in (
        (number, values.T) for number, values in path.parts(_pushing_contacts(run_dir))
    ):
        contacts[number] = len(normal)
        of_block = [_mean(normal), *np.percentile(normal, (50, 90, 99)), _mean(depth)]
        for name, value in zip(names, of_block, strict=True):
            values[name][number] = value
    values[_OVERLAP] /= path.diameter_m
    return {name: Blocks(of_blocks, contacts) for name, of_blocks in values.items()}


_OVERLAP = "workpiece_overlap"


def _mean(values: Floats) -> float:
    """Mean of values that are added one after the other."""
    return float(np.bincount(np.zeros(len(values), dtype=np.int64), values)[0] / len(values))


def _begins(sampled: Sampled) -> Ints:
    """Samples in which contact events begin: a particle had no contact in the one before."""
    stays = sampled.rows[["particle_id", "frame"]].drop_duplicates()
    stays = stays.sort_values(["particle_id", "frame"])
    other = stays["particle_id"].diff() != 0
    return stays.loc[other | (stays["frame"].diff() > 1), "frame"].to_numpy(np.int64)


def _of_network(run_dir: Path, path: CountedPath) -> dict[str, Blocks]:
    tables = run_dir / "tables"
    columns = {
        "coordination_number": "coordination_number",
        "mechanical_coordination_number": "mechanical_coordination_number",
        "network_force_mean": "normal_force_mean_n",
    }
    network = read_table(tables / "network.parquet", ["step", *columns.values()])
    steps = network["step"].to_numpy(np.int64)
    overlap = np.full(path.blocks, math.nan)
    for number, values in path.parts(_overlaps(tables / "contacts.parquet", path)):
        overlap[number] = np.percentile(values, 99)
    frames = np.bincount(path.block(steps), minlength=path.blocks)
    return {
        **{name: path.mean(steps, network[col].to_numpy()) for name, col in columns.items()},
        "overlap_p99": Blocks(overlap, np.where(np.isnan(overlap), 0.0, frames)),
        **_of_chains(read_table(tables / "chains.parquet", _CHAIN_COLUMNS), frames, path),
    }


def _overlaps(file: Path, path: CountedPath) -> Iterator[PathRows]:
    """Overlaps of particles over the mean diameter, from the path's beginning on."""
    for rows in read_groups(file, ["step", "kind", "overlap_m"]):
        inner = rows[(rows["kind"] == "particle-particle") & (rows["step"] > path.first_step)]
        if len(inner):
            yield (
                inner["step"].to_numpy(np.int64),
                inner["overlap_m"].to_numpy(np.float64) / path.diameter_m,
            )


_CHAIN_COLUMNS = [
    *("step", "definition", "n_particles", "inclination_rad", "azimuth_rad"),
    *("dominant", "bottleneck_n"),
]


def _of_chains(chains: pd.DataFrame, frames: Ints, path: CountedPath) -> dict[str, Blocks]:
    peters = chains[chains["definition"] == "peters"]
    steps = peters["step"].to_numpy(np.int64)
    along = np.cos(peters["inclination_rad"]) * np.cos(peters["azimuth_rad"])
    paths = chains[chains["dominant"]]
    count = np.bincount(path.block(steps), minlength=path.blocks)
    return {
        "chain_count": Blocks.ratio(count, frames),
        "chain_length": path.mean(steps, peters["n_particles"].to_numpy(np.float64)),
        "chain_alignment": path.mean(steps, along.to_numpy(np.float64) ** 2),
        "path_bottleneck": path.mean(
            paths["step"].to_numpy(np.int64), paths["bottleneck_n"].to_numpy(np.float64)
        ),
    }
