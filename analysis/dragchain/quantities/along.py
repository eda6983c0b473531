"""What one process run says of every quantity along its path.

The counted path is cut into blocks of about one mean particle diameter; each
quantity has one value a block. A run's value is the mean over its blocks.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from dragchain.arrays import Floats, Ints
from dragchain.drag import parts, read_counted
from dragchain.loading.samples import Sampled, sample
from dragchain.quantities.registry import COMPARED
from dragchain.run.kinematics import drag_phase, needed
from dragchain.statistics.estimate import finite
from dragchain.tables.by_step import read_groups, read_table
from dragdeck.decks.outputs import load_outputs
from dragdeck.documents import Part
from dragdeck.records.case import CaseOfRun


class PathQuantities(Part):
    """The quantities of a complete run along its counted path.

    Attributes
    ----------
    arc_m : float
        Counted path, m.
    block_m : float
        Length of a block, m.
    blocks : mapping
        Quantity to a sequence of B values, None where a block has none.
    load_map : sequence of float
        Mean normal load by depth and azimuth, N, a depth after the other.
    """

    arc_m: float = 0.0
    block_m: float = 0.0
    blocks: Mapping[str, tuple[float | None, ...]] = {}
    load_map: tuple[float, ...] = ()

    def of_blocks(self, name: str) -> Floats:
        """The values of a quantity, (B,), NaN where a block has none; (0,) if none has one."""
        return np.array(self.blocks.get(name, ()), dtype=np.float64)

    def values(self, start: int = 0, stop: int | None = None) -> dict[str, float]:
        """The quantities over some blocks, all if not given, that have a value in each."""
        values = {}
        for quantity in COMPARED:
            blocks = self.of_blocks(quantity.name)[start:stop]
            if blocks.size and np.isfinite(blocks).all():
                values[quantity.name] = quantity.of_blocks(blocks)
        return values


MAP_DEPTHS, MAP_AZIMUTHS = 4, 12
"""Bins of a load map: equal parts of the immersion depth, and of the circumference."""


def loading_along(run_dir: Path, case: CaseOfRun, blocks: int) -> tuple[dict[str, Floats], Floats]:
    """Quantities of loading in each block of the path, and the load map.

    Parameters
    ----------
    run_dir : Path
        With the tables of a complete run.
    case : CaseOfRun
    blocks : int
        Number of equal blocks B of the counted path.

    Returns
    -------
    blocks : dict of str to (B,) ndarray
        Normal load, N: the sum of the normal forces of all contacts; sliding distance of all
        contacts for a metre of path, m/m; normal force times sliding distance for a metre of path,
        N m/m; friction work for a metre of path, J/m.
    load_map : (MAP_DEPTHS, MAP_AZIMUTHS) ndarray
        Mean normal load by depth and azimuth, N.

    Raises
    ------
    TableError
        If the slip of the contacts is not known, or no particle touches the workpiece.
    """
    counted = sample(run_dir, case)
    block = np.arange(counted.frames) * blocks // counted.frames
    frames = np.bincount(block, minlength=blocks)

    def per_frame(name: str) -> Floats:
        sums = counted.per_frame(counted.rows[name])
        return np.asarray(np.bincount(block, sums, blocks) / frames)

    path_m = counted.path_m / counted.frames
    along = {
        "normal_load": per_frame("normal_impulse_n_s") / counted.interval_s,
        "sliding_distance": per_frame("sliding_m") / path_m,
        "force_slide": per_frame("force_slide_n_m") / path_m,
        "friction_work": per_frame("friction_work_j") / path_m,
    }
    return along, _load_map(counted, needed(case.workpiece, "workpiece").immersion_depth_m)


def _load_map(counted: Sampled, depth_m: float) -> Floats:
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


Rows = tuple[Ints, Floats]
"""Steps, (N,), and values, (N, ...), of N rows of a table."""


@dataclass(frozen=True)
class CountedPath:
    """The counted path, cut into equal blocks; a step belongs to one of them."""

    first_step: int
    last_step: int
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
        return cls(before, last, length, diameter, max(1, round(length / diameter)))

    def block(self, steps: Ints) -> Ints:
        """Number of the block of each step, (N,); steps outside get the nearest."""
        fraction = (np.asarray(steps) - self.first_step) / (self.last_step - self.first_step)
        number = np.ceil(fraction * self.blocks).astype(np.int64) - 1
        return np.asarray(number.clip(0, self.blocks - 1))

    def mean(self, steps: Ints, values: Floats) -> Floats:
        """Mean of N values in every block, (B,); NaN in a block without any."""
        block = self.block(steps)
        total = np.bincount(block, weights=values, minlength=self.blocks)
        count = np.bincount(block, minlength=self.blocks)
        with np.errstate(invalid="ignore"):
            return np.asarray(total / count)

    def parts(self, rows: Iterable[Rows]) -> Iterator[tuple[int, Floats]]:
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
    """The quantities of a complete run with tables and chains."""
    force = read_counted(run_dir, ("step", "drag_n", "lateral_n", "vertical_n"))
    path = CountedPath.of(case, force["step"].to_numpy(np.int64))
    loading, load_map = loading_along(run_dir, case, path.blocks)
    on_workpiece, network = _of_workpiece_contacts(run_dir, path), _of_network(run_dir, path)
    blocks = {**_of_force(force, path), **on_workpiece, **loading, **network}
    return PathQuantities(
        arc_m=path.length_m,
        block_m=path.length_m / path.blocks,
        blocks={name: tuple(map(finite, values)) for name, values in blocks.items()},
        load_map=tuple(load_map.ravel().tolist()),
    )


def _of_force(force: pd.DataFrame, path: CountedPath) -> dict[str, Floats]:
    steps = force["step"].to_numpy(np.int64)
    drag = force["drag_n"].to_numpy(np.float64)
    deviation = drag - drag.mean()
    spacing = path.length_m / len(drag)
    bands = {
        "long": (LONG_WAVE, math.inf),
        "middle": (SHORT_WAVE, LONG_WAVE),
        "short": (0.0, SHORT_WAVE),
    }
    squares = {
        f"drag_std_{name}": path.mean(
            steps, band_pass(deviation, spacing, low * path.diameter_m, high * path.diameter_m) ** 2
        )
        for name, (low, high) in bands.items()
    }
    if path.length_m < 2.0 * LONG_WAVE * path.diameter_m:
        squares["drag_std_long"][:] = math.nan  # a window is no longer than its waves
    return {
        "drag_mean": path.mean(steps, drag),
        "drag_std": path.mean(steps, deviation**2),
        **squares,
        "lateral_mean": path.mean(steps, force["lateral_n"].to_numpy(np.float64)),
        "vertical_mean": path.mean(steps, force["vertical_n"].to_numpy(np.float64)),
    }


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


def _pushing_contacts(run_dir: Path) -> Iterator[Rows]:
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


def _of_workpiece_contacts(run_dir: Path, path: CountedPath) -> dict[str, Floats]:
    frames = np.bincount(path.block(_frames(run_dir, path)), minlength=path.blocks)
    contacts = np.zeros(path.blocks)
    names = ("mean", "p50", "p90", "p99")
    forces = {f"contact_force_{name}": np.full(path.blocks, math.nan) for name in names}
    overlap = np.full(path.blocks, math.nan)
    for number, (normal, depth) in (
        (number, values.T) for number, values in path.parts(_pushing_contacts(run_dir))
    ):
        contacts[number] = len(normal)
        overlap[number] = _mean(depth / path.diameter_m)
        forces["contact_force_mean"][number] = _mean(normal)
        for fraction in (50, 90, 99):
            forces[f"contact_force_p{fraction}"][number] = np.percentile(normal, fraction)
    return {"workpiece_contacts": contacts / frames, **forces, "workpiece_overlap": overlap}


def _mean(values: Floats) -> float:
    """Mean of values that are added one after the other."""
    return float(np.bincount(np.zeros(len(values), dtype=np.int64), values)[0] / len(values))


def _frames(run_dir: Path, path: CountedPath) -> Ints:
    """Steps of the counted frames of the contacts on the workpiece, those without contact too."""
    output = load_outputs(run_dir)["workpiece_contacts"]
    steps = np.arange(output.first_step, path.last_step + 1, output.period_steps, dtype=np.int64)
    return steps[steps > path.first_step]


def _of_network(run_dir: Path, path: CountedPath) -> dict[str, Floats]:
    tables = run_dir / "tables"
    network = read_table(tables / "network.parquet")
    steps = network["step"].to_numpy(np.int64)
    overlap = np.full(path.blocks, math.nan)
    for number, values in path.parts(_overlaps(tables / "contacts.parquet", path)):
        overlap[number] = np.percentile(values, 99)
    columns = {
        "coordination_number": "coordination_number",
        "mechanical_coordination_number": "mechanical_coordination_number",
        "network_force_mean": "normal_force_mean_n",
    }
    return {
        **{name: path.mean(steps, network[col].to_numpy()) for name, col in columns.items()},
        "overlap_p99": overlap,
        **_of_chains(read_table(tables / "chains.parquet", _CHAIN_COLUMNS), steps, path),
    }


def _overlaps(file: Path, path: CountedPath) -> Iterator[Rows]:
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


def _of_chains(chains: pd.DataFrame, frames: Ints, path: CountedPath) -> dict[str, Floats]:
    peters = chains[chains["definition"] == "peters"]
    steps = peters["step"].to_numpy(np.int64)
    along = np.cos(peters["inclination_rad"]) * np.cos(peters["azimuth_rad"])
    paths = chains[chains["dominant"]]
    count = np.bincount(path.block(steps), minlength=path.blocks)
    return {
        "chain_count": count / np.bincount(path.block(frames), minlength=path.blocks),
        "chain_length": path.mean(steps, peters["n_particles"].to_numpy(np.float64)),
        "chain_alignment": path.mean(steps, along.to_numpy(np.float64) ** 2),
        "path_bottleneck": path.mean(
            paths["step"].to_numpy(np.int64), paths["bottleneck_n"].to_numpy(np.float64)
        ),
    }
