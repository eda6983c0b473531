"""Force and load on the workpiece over several packings, and what other settings do to the drag."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd
from pydantic import JsonValue
from scipy import stats

from dragchain.drag import FORCES, find_drag_peaks, peak_separation_s, read_counted
from dragchain.loading.contact_events import Thresholds
from dragchain.loading.document import FILE, ContactType, Loading
from dragchain.quantities.document import RunQuantities
from dragchain.run.case import study_of
from dragchain.run.reference import reference_drags
from dragchain.statistics.bed_effects import fit_effects
from dragchain.statistics.correlated import MeanEstimate, estimate_mean
from dragchain.statistics.estimate import Estimate, Real
from dragdeck.documents import Part
from dragdeck.records.case import CaseOfRun
from evidence.validation.runs import MeasuredRun, RunsByBed, packing_mean

_PROMINENCES = (0.5, 1.0, 2.0)
"""Least prominence of a peak in standard deviations of the drag; the middle one is the rule."""


class PackingForce(Part):
    """The force of one packing: each component's mean with its interval, and what the run took."""

    run: str
    seed: int
    bed_height_m: Real
    arc_m: float
    steps: int
    cpu_time_s: float
    drag_n: MeanEstimate
    lateral_n: MeanEstimate
    vertical_n: MeanEstimate


class Together(Part):
    """A component's mean and standard deviation over the packings."""

    mean: Estimate
    std: Estimate


class Likeness(Part):
    """Cochran's Q test of whether the packings differ by more than their own standard errors."""

    statistic: Real
    p_value: Real
    std_between_n: float
    standard_error_within_n: Real


class Force(Part):
    """The force of every packing, and of all of them together by component.

    Peaks of the drag per metre are counted by their least prominence in standard deviations.
    """

    packings: tuple[PackingForce, ...]
    together: Mapping[str, Together]
    alike: Likeness
    peaks_per_m: Mapping[str, Estimate]


class Compared(Part):
    """The drag beside a reference figure of the study.

    Attributes
    ----------
    label, mean_n, std_n
        Of the reference.
    difference : Estimate
        Relative difference of our mean to it.
    std_ratio : Estimate or None
        Our standard deviation over it. Both intervals are those over packings alone: no source
        says how well it knows its own mean.
    """

    label: str
    mean_n: float
    std_n: float | None
    difference: Estimate
    std_ratio: Estimate | None


def force_of_packings(packings: Sequence[MeasuredRun]) -> Force:
    """The force of every packing, and of all of them together."""
    rows = [_packing_force(run) for run in packings]
    return Force(
        packings=tuple(rows),
        together={name: _together([getattr(row, name) for row in rows]) for name in FORCES},
        alike=_alike([row.drag_n for row in rows]),
        peaks_per_m=_peaks(packings),
    )


def _packing_force(run: MeasuredRun) -> PackingForce:
    samples, measures = read_counted(run.folder, FORCES), run.measures
    forces = {name: estimate_mean(samples[name]) for name in FORCES}
    numbers = {"seed": run.seed, "bed_height_m": measures.single["bed_height"]}
    return PackingForce.model_validate(
        {**dict(measures), **dict(measures.cost), **numbers, **forces}
    )


def _together(means: Sequence[MeanEstimate]) -> Together:
    return Together(
        mean=packing_mean([mean.mean for mean in means]),
        std=packing_mean([mean.std for mean in means], ratio=True),
    )


def _alike(drags: Sequence[MeanEstimate]) -> Likeness:
    """Cochran's Q.

    Cochran (1954), Biometrics 10, 101-129: the weighted sum of squares about the
    weighted mean follows chi squared with N - 1 degrees of freedom if the packings differ by
    no more than their standard errors.
    """
    means = np.array([drag.mean for drag in drags])
    weights = np.array([drag.se for drag in drags]) ** -2.0
    centre = float(weights @ means / weights.sum())
    statistic = float(weights @ (means - centre) ** 2)
    return Likeness(
        statistic=statistic,
        p_value=float(stats.chi2.sf(statistic, len(drags) - 1)),
        std_between_n=float(means.std(ddof=1)),
        standard_error_within_n=float(np.sqrt(np.mean(1.0 / weights))),
    )


def _peaks(packings: Sequence[MeasuredRun]) -> dict[str, Estimate]:
    """Peaks by the rule of docs/reference/results.md, at three least prominences."""
    counts: dict[str, list[float]] = {f"{factor:g}": [] for factor in _PROMINENCES}
    for run in packings:
        samples = read_counted(run.folder, ("time_s", "drag_n"))
        time_s, drag = (samples[name].to_numpy(np.float64) for name in ("time_s", "drag_n"))
        for factor in _PROMINENCES:
            peaks = find_drag_peaks(
                time_s,
                drag,
                min_separation_s=peak_separation_s(run.case),
                min_prominence_n=factor * float(np.std(drag, ddof=1)),
            )
            counts[f"{factor:g}"].append(len(peaks.index) / run.measures.arc_m)
    return {factor: packing_mean(count) for factor, count in counts.items()}


def compare_drag(drag: Together, case: CaseOfRun) -> tuple[Compared, ...]:
    """Mean and standard deviation of the drag beside every reference figure of the study."""
    return tuple(
        Compared(
            **vars(reference),
            difference=reference.difference(drag.mean),
            std_ratio=drag.std.over(reference.std_n) if reference.std_n else None,
        )
        for reference in reference_drags(study_of(case).reference)
    )


# --- what every other setting does to the drag ---------------------------------------------


class Effect(Part):
    """The effect of a setting on a quantity.

    Attributes
    ----------
    quantity : str
        ``drag_mean`` or ``drag_std``.
    youngs_modulus_scale, timestep_fraction, speed_factor : float
        The fidelity.
    runs : int
    field, value, reference_value
        The input that it changes (empty if none), to what, and what it is at the same fidelity
        without the change.
    change, ci95_low, ci95_high : float
        Relative change, against the same fidelity without the changed input, or against the
        packings if it changes the fidelity alone.
    exponent, exponent_ci95_low, exponent_ci95_high : float or None
        Of the change over that of the input.
    """

    quantity: str
    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float
    runs: int
    field: str
    value: JsonValue
    reference_value: JsonValue
    change: float
    ci95_low: float
    ci95_high: float
    exponent: float | None
    exponent_ci95_low: float | None
    exponent_ci95_high: float | None


def setting_effects(runs: RunsByBed) -> list[Effect]:
    """The effect of every other setting on the mean drag and on its standard deviation.

    All runs are fitted together (`bed_effects`): one mean per setting, one variance for all, in
    inverse proportion to the path. What runs from one bed have in common is not made use of: it
    was measured to be little (docs/evidence/tradeoff.md), and these are too few runs to tell.

    Raises
    ------
    SeriesError
        If there are too few runs.
    """
    drags = [
        read_counted(run.folder, ("drag_n",))["drag_n"].to_numpy(np.float64) for run in runs.all
    ]
    sizes = {
        "drag_mean": [abs(float(drag.mean())) for drag in drags],
        "drag_std": [float(drag.std(ddof=1)) for drag in drags],
    }
    return [row for name, values in sizes.items() for row in _of_quantity(runs, name, values)]


def effect_table(rows: Sequence[Effect]) -> pd.DataFrame:
    """The effects as a table, one row per quantity and setting; values are text if any is."""
    table = pd.DataFrame([dict(row) for row in rows], columns=list(Effect.model_fields))
    for name in ("value", "reference_value"):
        if any(isinstance(value, str) for value in table[name]):
            table[name] = table[name].map(str, na_action="ignore")
    return table


def _base(runs: RunsByBed, run: MeasuredRun) -> MeasuredRun:
    """What a run is to be compared with."""
    alike = (other for other in runs.all if other.settings == run.settings and not other.changed)
    return next(alike, runs.all[0]) if run.changed else runs.all[0]


def _of_quantity(runs: RunsByBed, quantity: str, sizes: Sequence[float]) -> Iterator[Effect]:
    settings = list(dict.fromkeys(run.but_for_bed for run in runs.all))
    units = dict(zip(settings, np.eye(len(settings)), strict=True))
    design = np.array([units[run.but_for_bed] for run in runs.all])
    weights = np.sqrt([run.measures.arc_m for run in runs.all])
    weights /= weights.max()
    fit = fit_effects(weights[:, None] * design, weights * np.log(sizes), range(len(weights)))
    for setting in settings[1:]:
        same = [run for run in runs.all if run.but_for_bed == setting]
        run, base = same[0], _base(runs, same[0])
        field, value = next(iter(run.changed.items()), ("", None))
        before = base.measures.study.inputs().get(field)
        logarithm = fit.estimate(units[run.but_for_bed] - units[base.but_for_bed])
        change = logarithm.mapped(math.expm1)
        exponent = _exponent(logarithm, value, before) if len(run.changed) == 1 else None
        yield Effect(
            quantity=quantity,
            **run.settings.parameters(),
            runs=len(same),
            field=field,
            value=value,
            reference_value=before,
            change=change.value,
            ci95_low=change.ci95_low,
            ci95_high=change.ci95_high,
            exponent=exponent and exponent.value,
            exponent_ci95_low=exponent and exponent.ci95_low,
            exponent_ci95_high=exponent and exponent.ci95_high,
        )


def _exponent(change: Estimate, new: JsonValue, old: JsonValue) -> Estimate | None:
    """Exponent of a change, in logarithms, over that of its input; None without a ratio of both."""
    if not (isinstance(new, int | float) and isinstance(old, int | float) and min(new, old) > 0):
        return None
    return change.over(math.log(new / old))


# --- load, sliding and friction on the workpiece -----------------------------------------------

_QUANTITIES = {
    "workpiece_contacts": "",
    "normal_impulse": "N s/m",
    "sliding_distance": "m/m",
    "force_slide": "N m/m",
    "friction_work": "J/m",
}
"""Quantities that are averaged, each with its unit."""

_SHARES = ("events", "normal_impulse_n_s", "force_slide_n_m", "friction_work_j")


class LoadingRow(Part):
    """A number over the packings; the page has its name in words."""

    label: str
    unit: str
    value: float
    ci95_low: float
    ci95_high: float


class LoadingOverPackings(Part):
    """The loading over the packings.

    Attributes
    ----------
    rows : sequence of LoadingRow
    types : mapping
        Type of contact event to its percentages of all events and of amounts.
    closure : float
        Largest relative error of the sums over facets against the force on the workpiece.
    limits, sample_interval_s
        Of the first packing.
    """

    rows: tuple[LoadingRow, ...]
    types: Mapping[str, Mapping[str, Estimate]]
    closure: float
    limits: Thresholds
    sample_interval_s: float


def load_of_packings(packings: Sequence[MeasuredRun]) -> LoadingOverPackings:
    """Average what `./run dragchain loading` found in every packing.

    Raises
    ------
    DocumentError
        If a packing has no ``loading.json``.
    """
    every = [Loading.read(run.folder / FILE) for run in packings]
    first = every[0]
    numbers = [_numbers(of, run.measures) for of, run in zip(every, packings, strict=True)]
    return LoadingOverPackings(
        rows=tuple(
            LoadingRow(label=key[0], unit=key[1], **vars(packing_mean([n[key] for n in numbers])))
            for key in numbers[0]
        ),
        types={kind: _shares([packing.types[kind] for packing in every]) for kind in first.types},
        closure=max(packing.closure.facets_relative_error for packing in every),
        limits=first.limits,
        sample_interval_s=first.sample_interval_s,
    )


def _numbers(loading: Loading, measures: RunQuantities) -> dict[tuple[str, str], float]:
    """The numbers that packings are compared by: name and unit to value."""
    front = loading.front_fraction
    fractions = {
        "friction_fraction_of_work": loading.friction_fraction_of_work,
        "front_fraction_normal_impulse": front["normal_impulse_n_s"],
        "front_fraction_force_slide": front["force_slide_n_m"],
        "load_while_sliding_fraction": loading.load_while_sliding_fraction,
    }
    return {
        **{key: measures.values_of_run[key[0]].value for key in _QUANTITIES.items()},
        **{(name, "%"): 100.0 * fraction.value for name, fraction in fractions.items()},
    }


def _shares(types: Sequence[ContactType]) -> dict[str, Estimate]:
    return {
        name: packing_mean([100.0 * kinds.fraction_of[name].value for kinds in types])
        for name in _SHARES
    }
