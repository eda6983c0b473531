"""Steps between frames of the outputs of a process."""

import math
from dataclasses import dataclass

from dragdeck.study.model import Study


@dataclass(frozen=True)
class Periods:
    """Steps between frames of each output, each a multiple of the one before."""

    force: int
    contacts: int
    network: int


def output_periods(study: Study, timestep_s: float) -> Periods:
    """Steps between frames: at least the asked rates, each a multiple of the faster one."""
    rates, factor = study.outputs, study.chosen_fidelity().speed_factor
    per_second = factor * timestep_s
    force = max(1, math.floor(1 / (rates.workpiece_force_hz * per_second)))
    contacts = force * max(1, math.floor(1 / (rates.workpiece_contacts_hz * per_second * force)))
    network = contacts * max(1, math.floor(1 / (rates.network_hz * per_second * contacts)))
    return Periods(force, contacts, network)
