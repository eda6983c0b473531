"""What every other setting of a validation does to the drag."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import pandas as pd
from pydantic import JsonValue

from dragchain.drag.force import read_counted
from dragchain.statistics.bed_effects import fit_effects
from dragchain.statistics.estimate import Estimate
from dragdeck.documents import Part
from evidence.validation.runs_by_bed import Point, Points


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


def effects(points: Points) -> list[Effect]:
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
        read_counted(point.folder, ("drag_n",))["drag_n"].to_numpy(np.float64)
        for point in points.all
    ]
    sizes = {
        "drag_mean": [abs(float(drag.mean())) for drag in drags],
        "drag_std": [float(drag.std(ddof=1)) for drag in drags],
    }
    return [row for name, values in sizes.items() for row in _of_quantity(points, name, values)]


def effect_table(rows: Sequence[Effect]) -> pd.DataFrame:
    """The effects as a table, one row per quantity and setting."""
    return pd.DataFrame([dict(row) for row in rows], columns=list(Effect.model_fields))


def _base(points: Points, point: Point) -> Point:
    """What a point is to be compared with."""
    alike = (one for one in points.all if one.fidelity == point.fidelity and not one.changed)
    return next(alike, points.all[0]) if point.changed else points.all[0]


def _of_quantity(points: Points, quantity: str, sizes: Sequence[float]) -> Iterator[Effect]:
    settings = list(dict.fromkeys(point.setting for point in points.all))
    units = dict(zip(settings, np.eye(len(settings)), strict=True))
    design = np.array([units[point.setting] for point in points.all])
    weights = np.sqrt([point.measures.arc_m for point in points.all])
    weights /= weights.max()
    fit = fit_effects(weights[:, None] * design, weights * np.log(sizes), range(len(weights)))
    for setting in settings[1:]:
        own = [point for point in points.all if point.setting == setting]
        point, base = own[0], _base(points, own[0])
        field, value = next(iter(point.changed.items()), ("", None))
        before = base.measures.inputs.get(field)
        logarithm = fit.estimate(units[point.setting] - units[base.setting])
        change = logarithm.mapped(math.expm1)
        exponent = _exponent(logarithm, value, before) if len(point.changed) == 1 else None
        yield Effect(
            quantity=quantity,
            **point.fidelity.parameters(),
            runs=len(own),
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
