"""The findings of one run: every number that its figures and the report show."""

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar, Literal

from dragchain.documents import Document, Part
from dragchain.statistics.correlated import MeanEstimate
from dragchain.statistics.estimate import Estimate, EstimateColumns, Real

FILE = Path("tables") / "figures.json"

_PICTURES = ("network_xy", "network_xz")
FIGURES: Mapping[str, tuple[str, ...]] = {
    "process": ("forces", *_PICTURES, "force_around_workpiece", "force_depth", "chains_peaks"),
    "filling": ("filling",),
    "drop_test": ("drop_test",),
}
"""The figures of each scene in the order of the report; it has their captions."""


class Comparison(Part):
    """A mean drag of the study's source, and how ours differs from it.

    Attributes
    ----------
    label : str
        ``experiment`` or ``simulation``.
    mean_n, std_n : float
        Of the source, N; no standard deviation if it gives none.
    difference_percent, ci95_low, ci95_high : float
        Relative difference of our mean from the source's, with its interval from that of our mean
        alone.
    """

    label: str
    mean_n: float
    std_n: float | None
    difference_percent: float
    ci95_low: float
    ci95_high: float
    source: str


class Peaks(Part):
    """Peaks of the resistance: process times, drag there, and the least time between two."""

    count: int
    process_time_s: tuple[float, ...]
    drag_n: tuple[float, ...]
    largest_n: Real
    separation_s: float


class Chains(Part):
    """Force chains and workpiece paths, means over the network frames."""

    peters_per_frame: float
    peters_particles_mean: Real
    widest_paths_per_frame: float
    workpiece_contacts_without_path_per_frame: float
    widest_paths_to_side_fraction: Real
    dominant_frames: int
    dominant_bottleneck_mean_n: Real
    dominant_bottleneck_max_n: Real
    dominant_particles_mean: Real
    dominant_altitude_mean_m: Real
    dominant_altitude_std_m: Real
    dominant_azimuth_mean_rad: Real
    dominant_azimuth_resultant: Real


class AheadBehind(Part):
    """Normal force within 90 degrees of the direction of motion and beyond, mean of a frame."""

    ahead_n: Estimate
    behind_n: Estimate
    ratio: Estimate
    fraction_ahead: Estimate


class AzimuthProfile(Part):
    """Normal force of a frame in bins around the workpiece."""

    edges_rad: tuple[float, ...]
    force_n: EstimateColumns


class DepthProfile(Part):
    """Normal force of a contact, and of all contacts per metre of depth, in bins of depth."""

    edges_m: tuple[float, ...]
    contact_n: EstimateColumns
    line_load_n_per_m: EstimateColumns
    slope_n_per_m: Estimate


class Wake(Part):
    """Mean drag before a workpiece comes to a wake, in the wake, and their ratio.

    The last diameter of the workpiece before the wake is in neither.
    """

    fresh_n: MeanEstimate
    wake_n: MeanEstimate
    ratio: Estimate


class Findings(Document):
    """What the findings of every scene have."""

    made_by: ClassVar[str] = "dragchain figures"

    run: str


class ProcessFindings(Findings):
    """The findings of a process.

    Attributes
    ----------
    process_time_zero_s : float
        Simulated time at which the drag starts.
    forces : mapping of str to MeanEstimate
        ``drag_n``, ``lateral_n`` and ``vertical_n``.
    network : mapping of str to float
        Means of the columns of ``network.parquet``, and the number of ``frames``.
    wake : Wake or None
        None if the workpiece comes to no wake, or has too few samples before or in it.
    """

    scene: Literal["process"] = "process"
    process_time_zero_s: float
    forces: Mapping[str, MeanEstimate]
    comparison: tuple[Comparison, ...]
    peaks: Peaks
    network: Mapping[str, int | Real]
    chains: Chains
    confidence: float
    workpiece_frames: int
    ahead_behind: AheadBehind
    azimuth: AzimuthProfile
    depth: DepthProfile
    wake: Wake | None = None


class FillingFindings(Findings):
    """The findings of a filling: ``packing.json``, and below which energy ratio it is at rest."""

    scene: Literal["filling"] = "filling"
    bed: Mapping[str, int | float]
    rest_energy_ratio: float | None


class DropRestitution(Part):
    """Restitution over all impacts of a drop, beside the input of the deck."""

    mean: float
    lowest: float
    highest: float
    impacts: int
    input: float | None


class DropImpacts(Part):
    """The impacts of a drop in the order of time."""

    start_time_s: tuple[float, ...]
    duration_s: tuple[float, ...]
    peak_force_n: tuple[float, ...]
    restitution: tuple[float, ...]
    time_since_first_s: tuple[float, ...]


class DropFindings(Findings):
    """The findings of a drop test."""

    scene: Literal["drop_test"] = "drop_test"
    restitution: DropRestitution
    impacts: DropImpacts
