"""The laws of reduced moduli beside a trade-off, in a scene that they were not fitted to."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from dragchain.tradeoff.stiffness_document import CheckEntry, LawEntry
from dragchain.tradeoff.stiffness_law import NORMAL_95, ScaledRuns
from dragchain.tradeoff.tradeoff_document import TradeoffRecord

_STEP = 0.5
"""Time step over the Rayleigh time of the settings that are compared."""


def check_laws(laws: Mapping[str, LawEntry], tradeoff: TradeoffRecord) -> Iterator[CheckEntry]:
    """Every law against every reduced modulus of a trade-off at the study's own speed.

    Parameters
    ----------
    laws : mapping of str to LawEntry
        By quantity.
    tradeoff : TradeoffRecord
    """
    for setting in tradeoff.settings:
        scale = setting.youngs_modulus_scale
        plain = setting.timestep_fraction == _STEP and setting.speed_factor == 1.0
        if scale == 1.0 or not plain or setting.breaks:
            continue
        for quantity, known in laws.items():
            error = setting.errors.get(quantity)
            if error is None:
                continue
            run = ScaledRuns(
                stiffness_number=tradeoff.scene["stiffness_number"],
                inertial_number=tradeoff.scene["inertial_number"],
                friction=tradeoff.scene[known.friction],
                scales=np.array([scale]),
                logarithms=np.zeros(1),
                path_to_particle=1.0,
            )
            effect, covariance = known.law.effect(run)
            predicted = float(effect[0] + known.stiffness_power * run.softening[0])
            se = math.sqrt(float(covariance[0, 0]))
            apart = predicted - math.log1p(error.value)
            measured_se = error.se / (1.0 + error.value)
            yield CheckEntry(
                quantity=quantity,
                scale=scale,
                predicted=math.expm1(predicted),
                predicted_se=se,
                measured=error.value,
                ci95_low=error.ci95_low,
                ci95_high=error.ci95_high,
                inside=abs(apart) <= NORMAL_95 * math.hypot(se, measured_se),
            )
