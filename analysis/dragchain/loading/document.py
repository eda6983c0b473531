"""The document ``loading.json`` of a run; docs/explanation/loading.md explains its numbers."""

from collections.abc import Mapping
from pathlib import Path
from typing import ClassVar

from dragchain.documents import Document, Part
from dragchain.loading.contact_events import Thresholds
from dragchain.statistics.estimate import Estimate, EstimateColumns, Real

FILE = Path("tables") / "loading.json"

Fractions = Mapping[str, Mapping[str, Real]]
"""Each type's fraction (by type) of an amount (by amount)."""


class Totals(Part):
    """Sums over all contacts and counted samples, and what follows from them.

    Attributes
    ----------
    totals, per_metre : mapping
        By amount, `AMOUNTS` and ``normal_work_j``, ``workpiece_work_j`` and ``events``; the latter
        per metre of the workpiece's path.
    front_fraction : mapping
        Fraction of each amount on the front half of the workpiece.
    friction_fraction_of_work, normal_fraction_of_work : Estimate
        Of the work that the workpiece does on the particles.
    load_while_sliding_fraction : Estimate
        Of the normal impulse.
    mean_contacts : Estimate
        Contacts with force at one time.
    """

    totals: Mapping[str, int | float]
    per_metre: Mapping[str, Estimate]
    front_fraction: Mapping[str, Estimate]
    friction_fraction_of_work: Estimate
    normal_fraction_of_work: Estimate
    load_while_sliding_fraction: Estimate
    mean_contacts: Estimate


class Quantiles(Part):
    """Quartiles and 95th percentile over the events of a type; unknown if it has none."""

    p25: Real
    p50: Real
    p75: Real
    p95: Real


class ContactType(Part):
    """Contact events of a type: their number, fractions of all amounts, and intensity."""

    events: int
    fraction_of: Mapping[str, Estimate]
    intensity: Mapping[str, Quantiles]


class Sensitivity(Part):
    """Fractions by type with one of the limits halved or doubled."""

    limits: str
    fraction_of: Fractions


class MobilisedLimit(Part):
    """Sums with another limit of a sliding contact, see `Thresholds.mobilised`."""

    limit: float
    load_while_sliding_fraction: float
    sliding_m: float
    force_slide_n_m: float


class Gap(Part):
    """Number of events if so many samples without force may lie within one."""

    samples: int
    events: int


class Profile(Part):
    """Force times sliding distance per metre of path in bins of depth (m) or azimuth (rad)."""

    edges: tuple[float, ...]
    force_slide: EstimateColumns


class Thinned(Part):
    """What every n-th sample alone would give.

    The errors of the sums are the largest over the n possible starts, the number of events is
    the mean over them; the fractions by type are those of the first start.
    """

    every: int
    samples_hz: float
    largest_relative_error: Mapping[str, Real]
    events: float
    fraction_of: Fractions


class Impulse(Part):
    """Impulse on the workpiece in its frame, N s."""

    drag: float
    lateral: float
    vertical: float


class Closure(Part):
    """How the sums over facets and events agree with those of the workpiece."""

    workpiece_impulse_n_s: Impulse
    facets_impulse_n_s: Impulse
    unplaced_impulse_n_s: Impulse
    workpiece_relative_error: float
    facets_relative_error: float
    events_relative_error: float
    point_off_facet_max_m: float


class Loading(Totals, Document):
    """Load, sliding and friction work on a workpiece."""

    made_by: ClassVar[str] = "dragchain loading"

    run: str
    confidence: float
    samples: int
    sample_interval_s: float
    time_s: float
    path_m: float
    friction_coefficient: float
    contact_time_s: float
    impact_seen_fraction: float
    limits: Thresholds
    types: Mapping[str, ContactType]
    sensitivity: tuple[Sensitivity, ...]
    mobilised: tuple[MobilisedLimit, ...]
    gaps: tuple[Gap, ...]
    profiles: Mapping[str, Profile]
    sampling: tuple[Thinned, ...]
    closure: Closure
