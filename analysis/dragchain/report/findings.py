"""The findings of one run: every number that its figures and the report show."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, NamedTuple

from dragchain.statistics.correlated import MeanEstimate
from dragchain.statistics.estimate import Estimate, EstimateColumns, Real
from dragchain.tables.impacts import Restitution
from dragdeck.documents import Document
from dragdeck.parts import Part, omitted

FINDINGS_FILE = Path("tables") / "findings.json"


class Peaks(Part):
    """Peaks of the drag force magnitude.

    Attributes
    ----------
    count : int
        Number of peaks.
    process_time_s : tuple of float
        Process times of the peaks, s.
    drag_n : tuple of float
        Drag at the peaks, N; negative: opposes the motion.
    largest_n : float
        Largest magnitude, N.
    separation_s : float
        Minimum time between two peaks, s.
    """

    count: int
    process_time_s: tuple[float, ...]
    drag_n: tuple[float, ...]
    largest_n: Real
    separation_s: float


class Chains(Part):
    """Force chains and paths from workpiece to bowl, means over the network frames.

    Attributes
    ----------
    widest_paths_per_frame : float
        Paths from workpiece to bowl per frame.
    widest_paths_to_side_fraction : float
        Fraction of the paths that end at the side wall.
    dominant_bottleneck_max_n : float
        Largest bottleneck force of the dominant paths, N.
    dominant_particles_mean : float
        Mean number of particles of the dominant paths.
    dominant_altitude_mean_m : float
        Height of the dominant paths above the floor, m.
    dominant_azimuth_mean_rad : float
        Circular mean of their direction from that of the motion, rad.
    """

    widest_paths_per_frame: float
    widest_paths_to_side_fraction: Real
    dominant_bottleneck_max_n: Real
    dominant_particles_mean: Real
    dominant_altitude_mean_m: Real
    dominant_azimuth_mean_rad: Real


class AheadBehind(Part):
    """Sums of the normal force ahead of and behind the workpiece, means over the samples.

    Attributes
    ----------
    ahead_n, behind_n : Estimate
        Within 90 degrees of the direction of motion, and beyond, N.
    """

    ahead_n: Estimate
    behind_n: Estimate


class AzimuthProfile(Part):
    """Normal force per sample in bins around the workpiece.

    Attributes
    ----------
    edges_rad : tuple of float
        Edges of the bins, from the direction of motion.
    force_n : EstimateColumns
        Sum of the normal forces of each bin, N.
    """

    edges_rad: tuple[float, ...]
    force_n: EstimateColumns


class DepthProfile(Part):
    """Normal force in bins of depth below the settled surface.

    Attributes
    ----------
    edges_m : tuple of float
        Edges of the bins, m.
    contact_n : EstimateColumns
        Mean normal force per contact, N.
    line_load_n_per_m : EstimateColumns
        Sum of the normal forces per metre of depth, N/m.
    slope_n_per_m : Estimate
        Slope of the normal force per contact with depth, N/m.
    """

    edges_m: tuple[float, ...]
    contact_n: EstimateColumns
    line_load_n_per_m: EstimateColumns
    slope_n_per_m: Estimate


class Wake(Part):
    """Mean drag before a workpiece enters a wake, in the wake, and their ratio.

    The last diameter of the workpiece before the wake is in neither.

    Attributes
    ----------
    fresh_n, wake_n : MeanEstimate
        Mean drag before and in the wake, N.
    ratio : Estimate
        Ratio wake / before.
    """

    fresh_n: MeanEstimate
    wake_n: MeanEstimate
    ratio: Estimate


class OfClass(NamedTuple):
    """What a class of the media does to the workpiece.

    Attributes
    ----------
    contacts : Estimate
        Contacts at a time.
    contact_force_n : Estimate
        Mean normal force of one of them, N.
    load_fraction : Estimate
        Part of the normal forces of all classes.
    """

    contacts: Estimate
    contact_force_n: Estimate
    load_fraction: Estimate


class Findings(Document):
    """What the findings of every scene have."""

    remedy = "make it with: ./run dragchain figures"

    run: str


class ProcessFindings(Findings):
    """The findings of a process run.

    Attributes
    ----------
    process_time_zero_s : float
        Simulated time at which the drag starts.
    network_frames : int
    rattler_fraction : float
        Mean over these frames.
    wake : Wake or None
        None if the workpiece enters no wake, or if there are too few samples before or in it.
    peaks : Peaks
        Of the drag force.
    chains : Chains
        Force chains.
    confidence : float
        Confidence level of all intervals.
    workpiece_frames : int
        Samples of the contacts on the workpiece.
    ahead_behind, azimuth, depth : AheadBehind, AzimuthProfile, DepthProfile
        Distribution of the normal force on the workpiece.
    segregation : mapping of str to (float, float)
        Of each class of the media, at the first and the last frame of the drag; see
        `segregation`. Absent if the media have no classes.
    by_class : mapping of str to OfClass
        Absent if the media have no classes.
    """

    scene: Literal["process"] = "process"
    process_time_zero_s: float
    network_frames: int
    rattler_fraction: float
    peaks: Peaks
    chains: Chains
    confidence: float
    workpiece_frames: int
    ahead_behind: AheadBehind
    azimuth: AzimuthProfile
    depth: DepthProfile
    wake: Wake | None = None
    segregation: Mapping[str, tuple[float, float]] = omitted({})
    by_class: Mapping[str, OfClass] = omitted({})


class FillingFindings(Findings):
    """The findings of a filling.

    Attributes
    ----------
    bed : mapping
        Content of ``packing.json``.
    rest_energy_ratio : float or None
        Settling criterion: kinetic energy / (m g d).
    """

    scene: Literal["filling"] = "filling"
    bed: Mapping[str, int | float]
    rest_energy_ratio: float | None


class DropRestitution(Restitution):
    """Restitution over all impacts of a drop test.

    Attributes
    ----------
    input : float or None
        Coefficient of restitution in the input script.
    """

    input: float | None


class DropFindings(Findings):
    """The findings of a drop test."""

    scene: Literal["drop_test"] = "drop_test"
    restitution: DropRestitution
