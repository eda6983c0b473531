"""Quantities at the true size of the particles, from runs with larger ones in the same scene.

Runs of a scene differ in `reduction.coarser`, the factor k on the diameters, and in the packing. A
quantity, or what its rule makes of it, is fitted as ``a + b (k - 1)`` by least squares, weighted by
the variances of the runs, which follow from the blocks of each; ``a`` is the value at the true
size. Its interval follows from these variances; where runs scatter more about the line, it is wider
by the root of the mean square of their residuals in standard errors (Birge 1932, Phys. Rev. 40,
207).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import chi2

from dragchain.arrays import Floats
from dragchain.quantities.document import RunQuantities
from dragchain.quantities.registry import REPORTED, Quantity
from dragchain.statistics.estimate import (
    NORMAL_QUANTILE,
    NOT_KNOWN,
    Estimate,
    birge_factor,
    flattened,
)

NO_RULE, TOO_FEW = "no rule is known", "fewer than two sizes with intervals"
_UNTESTED = "not tested: two sizes fit any line"
_LEAST_P = 0.05


@dataclass(frozen=True)
class Extrapolation:
    """A quantity at the true size of the particles.

    Attributes
    ----------
    scene : str
        Name of the first case of the scene.
    quantity : str
    label, unit : str
    value : Estimate or None
        None where it is not available.
    at_true_size : Estimate or None
        Of runs at the true size, where there are some: they are not part of the fit.
    sizes : str
        The factors, with the number of runs of each.
    linearity : str
        Whether the runs contradict the line; or why there is none.
    """

    scene: str
    quantity: str
    label: str
    unit: str
    value: Estimate | None
    at_true_size: Estimate | None
    sizes: str
    linearity: str


@dataclass(frozen=True)
class Line:
    """``a + b (k - 1)``: the value at k = 1, and how well runs lie on it."""

    value: Estimate
    standard_error: float
    sizes: int
    p: float

    @property
    def words(self) -> str:
        """Whether the runs contradict it."""
        if self.sizes < 3:
            return _UNTESTED
        verdict = "contradicted" if self.p < _LEAST_P else "not contradicted"
        return f"{verdict}, p = {self.p:.2g}"


def fit_line(factors: Floats, values: Floats, errors: Floats) -> Line | None:
    """The line through runs with larger particles; None for fewer than two sizes.

    Parameters
    ----------
    factors, values, errors : (N,) ndarray
        Factor on the diameters, value and its standard error, of each run.
    """
    known = np.isfinite(values) & np.isfinite(errors) & (errors > 0)
    k, y, error = factors[known], values[known], errors[known]
    sizes = len(np.unique(k))
    if sizes < 2:
        return None
    value, se, p = _fitted(np.column_stack([np.ones_like(k), k - 1.0]), y, error)
    return Line(value, se, sizes, p)


def _fitted(design: Floats, values: Floats, errors: Floats) -> tuple[Estimate, float, float]:
    """The first effect of weighted least squares, its standard error, and p of the residuals."""
    white, known = design / errors[:, None], values / errors
    covariance = np.linalg.inv(white.T @ white)
    effects = covariance @ white.T @ known
    square, left = float(np.sum((known - white @ effects) ** 2)), len(known) - len(effects)
    se = math.sqrt(covariance[0, 0]) * birge_factor(square, left)
    p = float(chi2.sf(square, left)) if left else math.nan
    return Estimate.around(float(effects[0]), NORMAL_QUANTILE * se), se, p


def coarse_grained(runs: Sequence[RunQuantities]) -> list[Extrapolation]:
    """The reported quantities of each scene with larger particles, at their true size."""
    scenes: dict[object, list[RunQuantities]] = {}
    for run in runs:
        if run.study.reduction is not None and run.study.reduction.coarser is not None:
            scenes.setdefault(_scene(run), []).append(run)
    return [
        _extrapolated(quantity, of_scene)
        for of_scene in scenes.values()
        if len({_factor(run) for run in of_scene} - {1.0}) > 1
        for quantity in REPORTED
    ]


def table_of_sizes(rows: Sequence[Extrapolation]) -> pd.DataFrame:
    """The same as a table, a row each."""
    return pd.DataFrame([flattened(dict(vars(row))) for row in rows])


def _factor(run: RunQuantities) -> float:
    reduction = run.study.reduction
    return (reduction and reduction.coarser) or 1.0


def _scene(run: RunQuantities) -> str:
    """All that runs of a scene have in common."""
    differ = ("media.", "reduction.coarser", "seed")
    inputs = run.study.inputs().items()
    common = {name: value for name, value in inputs if not name.startswith(differ)}
    media = run.study.media
    true_m = round(media.typical_radius_m / _factor(run), 12)
    chosen = run.fidelity
    settings = chosen.youngs_modulus_scale, chosen.timestep_fraction, chosen.speed_factor
    return f"{common} {true_m} {media.fill_height_m} {media.mass_kg} {settings}"


def _series(runs: Sequence[RunQuantities], name: str) -> tuple[Floats, Floats]:
    """Values and standard errors of a quantity, NaN where a run has none."""
    every = [run.values_of_run.get(name, NOT_KNOWN) for run in runs]
    errors = [estimate.half_width / NORMAL_QUANTILE for estimate in every]
    return np.array([estimate.value for estimate in every]), np.array(errors)


def _extrapolated(quantity: Quantity, runs: Sequence[RunQuantities]) -> Extrapolation:
    factors = np.array([_factor(run) for run in runs])
    larger = [run for run in runs if _factor(run) > 1.0]
    k = factors[factors > 1.0]
    value, linearity = None, NO_RULE
    if quantity.coarse == "by_drag":
        value, linearity = _by_drag(quantity.name, larger, k)
    elif quantity.coarse:
        line = _line(quantity.name, larger, k, squared=quantity.coarse == "inverse_square")
        value, linearity = (line.value, line.words) if line else (None, TOO_FEW)
    counts = {size: int((factors == size).sum()) for size in sorted({*k.tolist()})}
    return Extrapolation(
        scene=runs[0].run,
        quantity=quantity.name,
        label=quantity.label,
        unit=quantity.unit,
        value=value,
        at_true_size=mean_of_runs([run for run in runs if _factor(run) == 1.0], quantity.name),
        sizes=", ".join(f"{size:g} ({count})" for size, count in counts.items()),
        linearity=linearity,
    )


def _line(name: str, runs: Sequence[RunQuantities], k: Floats, *, squared: bool) -> Line | None:
    values, errors = _series(runs, name)
    scale = k**2 if squared else np.ones_like(k)
    return fit_line(k, scale * values, scale * errors)


def _by_drag(name: str, runs: Sequence[RunQuantities], k: Floats) -> tuple[Estimate | None, str]:
    """Force per contact: its product with the number over the drag does not depend on the size.

    Relative variances of this ratio, of the drag and of the number are added as if independent.
    """
    drag = _line("drag_mean", runs, k, squared=False)
    number = _line("workpiece_contacts", runs, k, squared=True)
    parts = {part: _series(runs, part) for part in (name, "workpiece_contacts", "drag_mean")}
    relative = np.sqrt(sum((error / value) ** 2 for value, error in parts.values()))
    (force, _), (contacts, _), (drags, _) = parts.values()
    ratios = np.log(np.abs(force * contacts / drags))
    known = np.isfinite(ratios) & (relative > 0)
    if drag is None or number is None or not known.any():
        return None, TOO_FEW
    weight = relative[known] ** -2.0
    ratio = float(np.average(ratios[known], weights=weight))
    errors = [
        math.sqrt(1 / weight.sum()),
        *(line.standard_error / abs(line.value.value) for line in (drag, number)),
    ]
    middle = math.log(abs(drag.value.value)) - math.log(abs(number.value.value)) + ratio
    spread = NORMAL_QUANTILE * math.hypot(*errors)
    ends = (math.exp(middle + part * spread) for part in (0, -1, 1))
    return Estimate(*ends), f"drag: {drag.words}"


def mean_of_runs(runs: Sequence[RunQuantities], name: str) -> Estimate | None:
    """Mean over packings, weighted by the variances of the runs, with an interval as a line's."""
    values, errors = _series(runs, name)
    known = np.isfinite(values) & (errors > 0)
    if not known.any():
        return None
    return _fitted(np.ones((int(known.sum()), 1)), values[known], errors[known])[0]
