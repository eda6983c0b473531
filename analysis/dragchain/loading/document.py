"""The document ``loading.json`` of a run; docs/explanation/loading.md explains its numbers."""

from collections.abc import Mapping
from pathlib import Path

from dragchain.loading.contact_events import Thresholds
from dragchain.statistics.estimate import Estimate, EstimateColumns, Real
from dragdeck.documents import Document
from dragdeck.parts import Part

LOADING_FILE = Path("tables") / "loading.json"


class Totals(Part):
    """Sums over all contacts and counted samples, and ratios of them.

    Attributes
    ----------
    totals : mapping
        By amount, `AMOUNTS` and ``normal_work_j``, ``workpiece_work_j`` and ``events``.
    front_fraction : mapping
        Fraction of each amount on the front half of the workpiece.
    friction_fraction_of_work : Estimate
        Of the work that the workpiece does on the particles.
    load_while_sliding_fraction : Estimate
        Of the normal impulse.
    """

    totals: Mapping[str, int | float]
    front_fraction: Mapping[str, Estimate]
    friction_fraction_of_work: Estimate
    load_while_sliding_fraction: Estimate


class Quantiles(Part):
    """Quartiles and 95th percentile over the events of a type; null if there are none.

    Attributes
    ----------
    p25, p50, p75, p95 : float or None
        Percentiles.
    """

    p25: Real
    p50: Real
    p75: Real
    p95: Real


class ContactType(Part):
    """Contact events of one type.

    Attributes
    ----------
    events : int
        Number of events.
    fraction_of : mapping
        Fraction of each amount due to this type.
    intensity : mapping
        Distribution of duration, peak force and other measures of an event.
    """

    events: int
    fraction_of: Mapping[str, Estimate]
    intensity: Mapping[str, Quantiles]


class Profile(Part):
    """Sliding load per metre of path in bins of depth.

    Attributes
    ----------
    edges_m : tuple of float
        Edges of the bins, m.
    force_slide : EstimateColumns
        N m per m of path in each bin.
    """

    edges_m: tuple[float, ...]
    force_slide: EstimateColumns


class LoadClosure(Part):
    """Agreement of the sums over facets and events with the total force on the workpiece.

    Attributes
    ----------
    workpiece_relative_error : float
        Of the impulse on the workpiece, summed over the facets and from the total force.
    point_off_facet_max_m : float
        Largest distance of a contact point from its facet, m.
    """

    workpiece_relative_error: float
    point_off_facet_max_m: float


class Loading(Totals, Document):
    """Load, sliding and friction work on the workpiece of a process run.

    Attributes
    ----------
    confidence : float
        Confidence level of all intervals.
    samples, sample_interval_s : float
        Number of samples in the statistics, and time between two, s.
    time_s, path_m : float
        Time and path length of the statistics, s and m.
    contact_time_s : float
        Hertz contact time of an impact at the speed of the workpiece, s.
    impact_seen_fraction : float
        Probability that a sample records such an impact.
    limits : Thresholds
        Limits between the types of contact events.
    types : mapping of ContactType
        By type: impact, sliding, rolling, resting.
    by_depth : Profile
    closure : LoadClosure
        Check of the sums.
    """

    remedy = "make it with: ./run dragchain loading"

    run: str
    confidence: float
    samples: int
    sample_interval_s: float
    time_s: float
    path_m: float
    contact_time_s: float
    impact_seen_fraction: float
    limits: Thresholds
    types: Mapping[str, ContactType]
    by_depth: Profile
    closure: LoadClosure
