"""A run with its tables, each read once and only if it is needed, and its findings from them."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from dragchain.arrays import Floats, Ints
from dragchain.drag import (
    ahead_behind,
    azimuth_profile,
    depth_profile,
    depth_slope,
    drag_peaks,
    peak_separation_s,
    read_counted,
)
from dragchain.errors import SeriesError
from dragchain.figures.network_picture import NetworkScene, load_scene
from dragchain.figures.rendering import check_rendering
from dragchain.loading.samples import SPHERES
from dragchain.quantities.document import MEASURED_FILE, RunQuantities
from dragchain.quantities.measure import estimates_along
from dragchain.report.findings import (
    FINDINGS_FILE,
    AheadBehind,
    AzimuthProfile,
    Chains,
    DepthProfile,
    DropFindings,
    DropRestitution,
    FillingFindings,
    Findings,
    OfClass,
    Peaks,
    ProcessFindings,
    Wake,
)
from dragchain.run.kinematics import drag_start_s, needed, path_passed, process_time
from dragchain.statistics.correlated import estimate_mean, estimates, frame_sums
from dragchain.statistics.estimate import CONFIDENCE, Estimate, EstimateColumns
from dragchain.tables.bed import segregation
from dragchain.tables.by_step import read_groups
from dragchain.tables.impacts import effective_restitution
from dragchain.tables.run_folder import Run
from dragdeck.records.case import CaseOfRun
from dragdeck.records.packing import Packing


class DragTrace(NamedTuple):
    """The force on the workpiece during the drag, (N,) each.

    Attributes
    ----------
    process_time_s : array
        From the start of the drag, at the speed of the process.
    drag_n, lateral_n : array
    counted : array of bool
        Whether a sample is in the statistics.
    """

    process_time_s: Floats
    drag_n: Floats
    lateral_n: Floats
    counted: NDArray[np.bool_]


class RunData(Run):
    """A run with its tables made."""

    @cached_property
    def network(self) -> pd.DataFrame:
        """Statistics of the network frames."""
        return self.table("network")

    @cached_property
    def chains(self) -> pd.DataFrame:
        """Force chains and workpiece paths of the network frames."""
        numbers = ["n_particles", "bottleneck_n", "azimuth_rad", "altitude_m"]
        return self.table(
            "chains", ["step", "definition", *numbers, "reaches_bowl", "end_kind", "dominant"]
        )

    @cached_property
    def drag(self) -> DragTrace:
        """The force on the workpiece during the drag."""
        columns = ["time_s", "phase", "drag_n", "lateral_n", "in_statistics"]
        table = self.table("workpiece_force", columns)
        table = table[table["phase"] == "drag"]
        time_s, drag, lateral = (
            table[name].to_numpy(np.float64) for name in ("time_s", "drag_n", "lateral_n")
        )
        counted = table["in_statistics"].to_numpy(bool)
        return DragTrace(process_time(time_s, self.case), drag, lateral, counted)

    @cached_property
    def quantities(self) -> Mapping[str, Estimate]:
        """The quantities of a process run by name, as they are in ``quantities.json``.

        They are computed if the file does not exist.
        """
        file = self.folder / MEASURED_FILE
        if file.is_file():
            return RunQuantities.read(file).values_of_run
        return estimates_along(self.folder, self.case)

    @cached_property
    def bottlenecks_n(self) -> Floats:
        """The dominant workpiece path's bottleneck in each network frame, see below."""
        return dominant_bottlenecks(self.network, self.chains)

    @cached_property
    def scene(self) -> NetworkScene:
        """What the pictures of the contact network show, if pictures can be rendered here."""
        check_rendering()
        return load_scene(self.folder, self.case)


def dominant_bottlenecks(network: pd.DataFrame, chains: pd.DataFrame) -> Floats:
    """The dominant workpiece path's bottleneck in each network frame in N, 0 without a path."""
    dominant = chains[chains["dominant"]].set_index("step")["bottleneck_n"]
    return dominant.reindex(network["step"]).fillna(0.0).to_numpy(np.float64)


# --- findings ------------------------------------------------------------------------------------


def write_findings(run: RunData) -> Findings:
    """Compute the findings of a run, write them to ``tables/findings.json`` and return them.

    Raises
    ------
    TableError
        If a table that the run's scene has is missing.
    SeriesError
        If the run is too short for its statistics.
    """
    collect = {"process": process_findings, "filling": _filling, "drop_test": _drop}[run.case.scene]
    findings = collect(run)
    findings.write(run.folder / FINDINGS_FILE)
    return findings


# --- process ---------------------------------------------------------------------------------


def process_findings(run: RunData) -> ProcessFindings:
    """Compute the findings of a process run; errors are those of `write_findings`."""
    samples = read_counted(run.folder, ("step", "time_s", "drag_n"))
    frame, frames, contacts = whole = _workpiece_contacts(run, samples)
    at, _, loads = _workpiece_contacts(run, samples, SPHERES) if run.case.bodies else whole
    names = [kind.name for kind in run.case.classes]
    depth, force = (contacts[name].to_numpy(np.float64) for name in ("depth_m", "normal_force_n"))
    load, azimuth = (loads[name].to_numpy(np.float64) for name in ("normal_force_n", "azimuth_rad"))
    edges, around = azimuth_profile(at, frames, azimuth, load)
    levels, contact, line = depth_profile(frame, frames, depth, force)
    if run.case.bodies:  # a force per contact is that of a body, a sum that of its spheres
        deep = loads["depth_m"].to_numpy(np.float64)
        _, _, line = depth_profile(at, frames, deep, load, edges_m=levels)
    return ProcessFindings(
        run=run.case.run,
        process_time_zero_s=drag_start_s(run.case),
        peaks=_peaks(samples, run),
        network_frames=len(run.network),
        rattler_fraction=float(run.network["rattler_fraction"].mean()),
        chains=_chains(run.chains, len(run.network)),
        confidence=CONFIDENCE,
        workpiece_frames=frames,
        ahead_behind=AheadBehind(**ahead_behind(at, frames, azimuth, load)),
        azimuth=AzimuthProfile(edges_rad=tuple(edges.tolist()), force_n=EstimateColumns.of(around)),
        depth=DepthProfile(
            edges_m=tuple(levels.tolist()),
            contact_n=EstimateColumns.of(contact),
            line_load_n_per_m=EstimateColumns.of(line),
            slope_n_per_m=depth_slope(frame, frames, depth, force),
        ),
        wake=_wake(samples, run.case),
        segregation=_segregation(run) if names else {},
        by_class={
            name: kind._replace(load_fraction=part.load_fraction)
            for (name, kind), part in zip(
                of_classes(names, frame, frames, contacts).items(),
                of_classes(names, at, frames, loads).values(),
                strict=True,
            )
        }
        if names
        else {},
    )


def of_classes(
    names: Sequence[str], frame: Ints, frames: int, contacts: pd.DataFrame
) -> dict[str, OfClass]:
    """What each class of the media does to the workpiece, with contacts that carry force.

    Parameters
    ----------
    names : sequence of str
        Of the classes.
    frame : (c,) array
        Frame of each contact, 0 to `frames` - 1.
    frames : int
    contacts : DataFrame
        ``class`` and ``normal_force_n`` of c contacts.
    """
    force = contacts["normal_force_n"].to_numpy(np.float64)[:, None]
    hits = (contacts["class"].to_numpy()[:, None] == np.array(names)) * (force != 0.0).astype(float)
    load = hits * force

    def statistic(sums: Floats) -> Floats:
        count, force = np.split(sums, 2, axis=-1)
        part = force / force.sum(axis=-1, keepdims=True)
        return np.concatenate([count, force / count, part], axis=-1)

    measures = estimates(frame_sums(frame, frames, np.hstack([hits, load])), statistic)
    parts = (measures[at :: len(names)] for at in range(len(names)))
    return {name: OfClass(*part_of_class) for name, part_of_class in zip(names, parts, strict=True)}


def _segregation(run: RunData) -> dict[str, tuple[float, float]]:
    steps = run.table("particles", ["step"])["step"].iloc[[0, -1]].to_numpy()
    columns = ["step", "z_m", "radius_m", "class"]
    rows = pd.concat(read_groups(run.file("particles.parquet"), columns, steps))
    first, last = (segregation(rows[rows["step"] == step]) for step in steps)
    return {name: (first[name], last[name]) for name in first}


def _wake(samples: pd.DataFrame, case: CaseOfRun) -> Wake | None:
    workpiece = needed(case.workpiece, "workpiece")
    if workpiece.wake_from_m is None:
        return None
    path = path_passed(samples["time_s"].to_numpy(), case)
    fresh = path <= workpiece.wake_from_m - 2 * workpiece.radius_m
    try:
        before, after = (
            estimate_mean(samples["drag_n"][which].to_numpy())
            for which in (fresh, path > workpiece.wake_from_m)
        )
    except SeriesError:
        return None
    return Wake(fresh_n=before, wake_n=after, ratio=after.over(before))


def _peaks(samples: pd.DataFrame, run: RunData) -> Peaks:
    peaks = drag_peaks(samples, run.case)
    process_s = process_time(peaks.time_s, run.case)
    return Peaks(
        count=len(peaks.index),
        process_time_s=tuple(process_s.tolist()),
        drag_n=tuple(peaks.drag_n.tolist()),
        largest_n=peaks.drag_n.min(initial=np.inf),
        separation_s=run.case.fidelity.speed_factor * peak_separation_s(run.case),
    )


def _chains(chains: pd.DataFrame, frames: int) -> Chains:
    paths = chains[chains["definition"] == "widest_path"]
    dominant = paths[paths["dominant"]]
    whole = paths[paths["reaches_bowl"]]
    azimuth = np.exp(1j * dominant["azimuth_rad"].to_numpy(np.float64))
    mean_azimuth = azimuth.mean() if len(azimuth) else np.nan
    return Chains(
        widest_paths_per_frame=len(whole) / frames,
        widest_paths_to_side_fraction=(whole["end_kind"] == "side").mean(),
        dominant_bottleneck_max_n=dominant["bottleneck_n"].max(),
        dominant_particles_mean=dominant["n_particles"].mean(),
        dominant_altitude_mean_m=dominant["altitude_m"].mean(),
        dominant_azimuth_mean_rad=np.angle(mean_azimuth),
    )


def _workpiece_contacts(
    run: RunData, samples: pd.DataFrame, table: str = "workpiece_contacts"
) -> tuple[Ints, int, pd.DataFrame]:
    """Frame of each counted contact, number of frames (those without contact too), contacts."""
    columns = ["step", "azimuth_rad", "depth_m", "normal_force_n", "in_statistics"]
    columns += ["class"] if run.case.classes else []
    contacts = run.table(table, columns)
    contacts = contacts[contacts["in_statistics"]]
    output = run.outputs["workpiece_contacts"]
    counted = samples["step"].to_numpy(np.int64)
    written = np.arange(output.first_step, counted[-1] + 1, output.period_steps)
    written = written[written >= counted[0]]
    frame = np.searchsorted(written, contacts["step"].to_numpy(np.int64))
    return frame, len(written), contacts


# --- filling and drop ------------------------------------------------------------------------


def _filling(run: RunData) -> FillingFindings:
    bed = Packing.read(run.file("packing.json"))
    settled = run.case.settled
    return FillingFindings(
        run=run.case.run,
        bed=bed.model_dump(exclude={"version"}),
        rest_energy_ratio=settled.energy_ratio if settled else None,
    )


def _drop(run: RunData) -> DropFindings:
    ratio = dict(effective_restitution(run.folder))
    return DropFindings(
        run=run.case.run, restitution=DropRestitution(**ratio, input=run.case.restitution)
    )
