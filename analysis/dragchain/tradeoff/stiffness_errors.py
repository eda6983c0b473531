"""How much extrapolations to the physical Young's modulus err in scenes outside of the fit."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from dragchain.tradeoff.measures import Measures
from dragchain.tradeoff.quantities import QUANTITIES, Quantity
from dragchain.tradeoff.runs import by_scene, values_within
from dragchain.tradeoff.stiffness_document import ExtrapolationErrors, LawEntry
from dragchain.tradeoff.stiffness_law import ErrorIn, ScaledRuns, error_in

PLANS: Sequence[Mapping[float, int]] = ({1e-3: 1}, {1e-2: 1}, {1e-3: 1, 1e-2: 1})
"""Ways to extrapolate that are tried."""


def scaled_runs(runs: Sequence[Measures], quantity: Quantity) -> ScaledRuns | None:
    """The complete runs of a scene in a quantity; None if none has it or it changes its sign."""
    complete = [run for run in runs if run.complete]
    arc = min((run.arc_m for run in complete), default=0.0)
    rows = [(run, values_within(run, arc).get(quantity.name, math.nan)) for run in complete]
    rows = [(run, value) for run, value in rows if math.isfinite(value) and value != 0.0]
    if not rows or len({math.copysign(1.0, value) for _, value in rows}) > 1:
        return None
    return ScaledRuns(
        stiffness_number=complete[0].numbers["stiffness_number"],
        inertial_number=complete[0].numbers["inertial_number"],
        friction=complete[0].numbers[quantity.friction],
        scales=np.array([run.fidelity.youngs_modulus_scale for run, _ in rows]),
        logarithms=np.log(np.abs([value for _, value in rows])),
        path_to_particle=arc / complete[0].particle_diameter_m,
        stiffness_power=quantity.stiffness_power,
    )


def errors_entry(
    quantity: Quantity, plan: Mapping[float, int], found: Sequence[ErrorIn], quantile: float
) -> ExtrapolationErrors:
    """What the errors of a plan say.

    Parameters
    ----------
    quantity : Quantity
    plan : mapping of float to int
        Runs at each modulus scale.
    found : sequence of ErrorIn
        One for each scene.
    quantile : float
        Of the errors by the law.
    """
    errors, plain = np.array([(one.found.logarithm, one.raw) for one in found]).T
    return ExtrapolationErrors(
        quantity=quantity.name,
        runs={f"{level:g}": count for level, count in plan.items()},
        scenes=len(found),
        mean=math.expm1(errors.mean()),
        root_mean_square=math.sqrt(float(np.mean(np.expm1(errors) ** 2))),
        largest=float(np.abs(np.expm1(errors)).max()),
        inside=sum(abs(one.found.logarithm) <= one.found.half_width(quantile) for one in found),
        raw_root_mean_square=math.sqrt(float(np.mean(np.expm1(plain) ** 2))),
    )


def errors_in_new_scenes(
    runs: Sequence[Measures], laws: Mapping[str, LawEntry]
) -> Iterator[ExtrapolationErrors]:
    """What extrapolations err in scenes that were run after the laws were fitted.

    Parameters
    ----------
    runs : sequence of Measures
        With advised settings and at the physical Young's modulus.
    laws : mapping of str to LawEntry
    """
    scenes = [
        [run for run in everyone if run.asked is None or run.asked.extrapolated]
        for _, everyone in by_scene(runs)
        if any(run.asked and run.asked.extrapolated for run in everyone)
    ]
    for quantity in QUANTITIES:
        if (known := laws.get(quantity.name)) is None:
            continue
        scaled = [one for everyone in scenes if (one := scaled_runs(everyone, quantity))]
        for plan in PLANS:
            found = [error_in(one, known.law, plan) for one in scaled]
            rows = [row for row in found if row is not None]
            if rows:
                yield errors_entry(quantity, plan, rows, known.quantile)
