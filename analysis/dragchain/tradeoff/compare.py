"""Every setting against the reference, quantity by quantity.

The runs of a plan, each measured by `dragchain.tradeoff.measure_run`, are compared over the
stretch of path that all of them have. For each quantity the effects of modulus,
time step, speed and everything else are estimated together
(`dragchain.statistics.bed_effects`), for every combination by itself: no test decides from the
same runs which of them may be added up.
"""

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
from pydantic import JsonValue
from scipy import stats

from dragchain.arrays import Floats
from dragchain.errors import SeriesError, TableError
from dragchain.quantities.document import MEASURED_FILE, RunQuantities
from dragchain.quantities.registry import Quantity
from dragchain.run.case import changed_inputs
from dragchain.statistics.bed_effects import EffectsFit, Factors, fit_effects
from dragchain.statistics.estimate import CONFIDENCE, student_quantile
from dragdeck.records.tradeoff import ErrorEntry

_PARAMETERS = ("youngs_modulus_scale", "timestep_fraction", "speed_factor")
OTHER = "other"
"""The factor that holds all else a point changes."""

SILENT = (
    "seed",
    "motion.path.revolutions",
    "motion.path.length_m",
    "motion.path.fraction",
    "outputs.workpiece_contacts_hz",
    "outputs.network_hz",
)
"""Inputs that differ between runs without being a setting: what is written changes nothing."""


@dataclass(frozen=True)
class Setting:
    """What a point asks for, apart from seed and path."""

    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float
    other: str = ""

    def factors(self) -> dict[str, Hashable]:
        """Factor to level, as `Factors` wants them."""
        return {**self.parameters(), OTHER: self.other}

    @classmethod
    def of(cls, parameters: object, other: str = "") -> "Setting":
        """The setting of what has the parameters as attributes."""
        modulus, step, speed = (float(getattr(parameters, name)) for name in _PARAMETERS)
        return cls(modulus, step, speed, other)

    def parameters(self) -> dict[str, float]:
        """Fidelity parameter to level."""
        return {name: getattr(self, name) for name in _PARAMETERS}

    def __str__(self) -> str:
        parts = [
            f"E x {self.youngs_modulus_scale:g}",
            f"{100 * self.timestep_fraction:g} % of Rayleigh",
        ]
        if self.speed_factor != 1.0:
            parts.append(f"speed x {self.speed_factor:g}")
        return ", ".join([*parts, self.other] if self.other else parts)


@dataclass(frozen=True)
class PlanRun:
    """A run of the trade-off.

    Attributes
    ----------
    setting : Setting
    measures : RunQuantities
    stretches : sequence of mapping of str to float
        Quantity to the run's value over each stretch of its path that is as long as the common
        one, the first of them that path; empty if it failed.
    """

    setting: Setting
    measures: RunQuantities
    stretches: Sequence[Mapping[str, float]]

    @property
    def complete(self) -> bool:
        """Whether it ended well."""
        return self.measures.complete


def read_plan_runs(
    files: Sequence[Path], reference_run: Path
) -> tuple[list[PlanRun], Setting, float]:
    """Read the runs of a trade-off.

    Of runs that differ in the length of their path alone the longest counts; one that is
    several times as long as the common path counts as several runs from its bed.

    Parameters
    ----------
    files : sequence of Path
        Their ``quantities.json``.
    reference_run : Path
        Folder of a run at the reference.

    Returns
    -------
    runs : list of PlanRun
    reference : Setting
    arc_m : float
        The longest path that all complete runs have, m.

    Raises
    ------
    DocumentError
        If a file was written by another version.
    TableError
        If no run is complete, or the reference is not among them.
    """
    every = {file: RunQuantities.read(file) for file in files}
    standard = every.get(reference_run / MEASURED_FILE)
    if standard is None:
        raise TableError(f"{reference_run}: the reference is not among the runs of the trade-off")
    longest: dict[tuple[Setting, str | None], RunQuantities] = {}
    for measures in every.values():
        key = (_setting(measures, standard), measures.bed)
        if key not in longest or measures.arc_m > longest[key].arc_m:
            longest[key] = measures
    complete = [measures.arc_m for measures in longest.values() if measures.complete]
    if not complete:
        raise TableError("no run of the trade-off is complete, so there is nothing to compare")
    arc = min(complete)
    runs = [_run(setting, measures, arc) for (setting, _), measures in longest.items()]
    return runs, _setting(standard, standard), arc


def _inputs(measures: RunQuantities) -> dict[str, JsonValue]:
    fidelity = {f"fidelity.{name}": value for name, value in measures.fidelity}
    silent = {*SILENT, "fidelity.name", *(f"fidelity.{name}" for name in _PARAMETERS)}
    inputs = {**measures.study.inputs(), **fidelity}
    return {name: value for name, value in inputs.items() if name not in silent}


def differing_inputs(measures: RunQuantities, standard: RunQuantities) -> dict[str, JsonValue]:
    """Inputs and settings of a run, by dotted name, that differ from those of another.

    No parameter is among them.
    """
    return changed_inputs(_inputs(measures), _inputs(standard))


def _setting(measures: RunQuantities, standard: RunQuantities) -> Setting:
    changed = differing_inputs(measures, standard)
    other = [f"{name} {_shown(value)}" for name, value in changed.items()]
    return Setting.of(measures.fidelity, ", ".join(other))


def _shown(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def _run(setting: Setting, measures: RunQuantities, arc_m: float) -> PlanRun:
    count = max(1, int(measures.arc_m / arc_m + 1e-9))
    values = [values_within(measures, arc_m, stretch) for stretch in range(count)]
    return PlanRun(setting, measures, values)


def values_within(measures: RunQuantities, arc_m: float, stretch: int = 0) -> dict[str, float]:
    """A run's values over a stretch of its path, the first if no other; blocks stay whole.

    What has one value a bed belongs to the first stretch.
    """
    if not measures.complete:
        return {}
    count = max(1, round(arc_m / measures.block_m))
    single = {} if stretch else measures.single
    return {**single, **measures.values(stretch * count, (stretch + 1) * count)}


# --- comparison ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class QuantityComparison:
    """All settings against the reference in one quantity.

    Attributes
    ----------
    quantity : Quantity
    reference : float
        Its value at the reference, estimated from all runs.
    se : float
        Of that, relative.
    factors : Factors
        How settings become columns of a design.
    fit : EffectsFit
        Of these; `residual_std` is the relative standard deviation of one run's value over the
        common path, `bed_fraction` the part of its square that runs from one bed have in common.
    settings : sequence of Setting
        Those that were run, that of the reference among them.
    standard : Setting
        The reference.
    """

    quantity: Quantity
    reference: float
    se: float
    factors: Factors = field(repr=False)
    fit: EffectsFit = field(repr=False)
    settings: Sequence[Setting] = field(repr=False)
    standard: Setting = field(repr=False)

    @cached_property
    def errors(self) -> Mapping[Setting, ErrorEntry]:
        """The error of each setting."""
        return {setting: self._error(setting, self.standard) for setting in self.settings}

    @property
    def reference_halfwidth(self) -> float:
        """Relative half-width of the reference's interval."""
        return self.fit.quantile * self.se

    def between(self, setting: Setting, base: Setting) -> ErrorEntry | None:
        """Difference of one setting to another; None if the runs cannot tell it."""
        known = all(self.factors.tells(compared.factors()) for compared in (setting, base))
        return self._error(setting, base) if known else None

    def _error(self, setting: Setting, base: Setting) -> ErrorEntry:
        weights = self.factors.row(setting.factors()) - self.factors.row(base.factors())
        return relative_error(*self.fit.contrast(weights), self.fit.degrees, self.quantity.signed)


def compare_quantity(
    quantity: Quantity, runs: Sequence[PlanRun], reference: Setting
) -> QuantityComparison:
    """Every setting against the reference in one quantity.

    Logarithms are compared, so that errors are relative; a quantity that may
    change its sign is compared as it is, in units of the mean drag.

    Raises
    ------
    SeriesError
        If too few runs have the quantity, or none at the reference does.
    """
    rows = [(run, stretch) for run in runs for stretch in run.stretches if quantity.name in stretch]
    settings = [run.setting for run, _ in rows]
    if reference not in settings:
        raise SeriesError("no run at the reference settings has this quantity")
    values = np.array([stretch[quantity.name] for _, stretch in rows])
    if quantity.signed:
        drags = [stretch["drag_mean"] for run, stretch in rows if run.setting == reference]
        scale = abs(float(np.mean(drags)))
        values = values / scale
    elif (values == 0.0).any() or len(set(np.sign(values))) > 1:
        raise SeriesError("it is zero or changes its sign, so no relative error exists")
    else:
        scale = float(np.sign(values[0]))
        values = np.log(np.abs(values))
    factors, fit = _fitted(settings, values, [run.measures.bed for run, _ in rows], reference)
    level, uncertainty = fit.contrast(factors.row(reference.factors()))
    return QuantityComparison(
        quantity=quantity,
        reference=scale * (level if quantity.signed else math.exp(level)),
        se=uncertainty,
        factors=factors,
        fit=fit,
        settings=list(dict.fromkeys(settings)),
        standard=reference,
    )


def _fitted(
    settings: Sequence[Setting], values: Floats, beds: Sequence[str | None], reference: Setting
) -> tuple[Factors, EffectsFit]:
    """An effect of every combination.

    If the runs do not allow it, effects that add up: without repetitions they are added up on
    trust, and what does not fit is scatter.
    """
    levels = [setting.factors() for setting in settings]
    separate, added = (Factors(levels, reference.factors(), additive) for additive in (False, True))
    try:
        return separate, fit_effects(separate.design(), values, beds)
    except SeriesError:
        return added, fit_effects(added.design(), values, beds)


def relative_error(
    difference: float, uncertainty: float, degrees: int, signed: bool = False
) -> ErrorEntry:
    """The relative error that a difference of logarithms is.

    Parameters
    ----------
    difference, uncertainty : float
        Difference to the reference and its standard error: of logarithms, or
        of values in mean drags if `signed`.
    degrees : int
        Degrees of freedom behind the standard error.
    signed : bool
    """
    shift = uncertainty * student_quantile(degrees)
    one_sided = uncertainty * stats.t.ppf(CONFIDENCE, degrees)

    def relative(value: float) -> float:
        return value if signed else math.expm1(value)

    low, high = relative(difference - shift), relative(difference + shift)
    ends = (relative(difference - one_sided), relative(difference + one_sided))
    return ErrorEntry(
        value=relative(difference),
        se=uncertainty * (1.0 if signed else math.exp(difference)),
        ci95_low=low,
        ci95_high=high,
        bound=max(abs(end) for end in ends),
        significant=bool(low > 0.0 or high < 0.0),
    )
