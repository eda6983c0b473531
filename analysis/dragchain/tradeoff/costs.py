"""What things that a deck leaves out would cost, and what a step costs at other settings."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dragchain.statistics.estimate import finite
from dragchain.tradeoff.changes import hub
from dragchain.tradeoff.outcome import StepCosts, Tradeoff
from dragchain.tradeoff.runs import Setting
from dragchain.tradeoff.tradeoff_document import CostEntry
from dragdeck.documents import Document, Part

_PLAIN = ("plain_full", "plain")
"""Names of the cost of the plain deck, that at full stiffness first."""


class StandardFidelity(Part):
    """Settings of the deck that the process entries were compared with."""

    youngs_modulus_scale: float
    timestep_fraction: float
    speed_factor: float = 1.0


class CostsFile(Document):
    """What is read of ``costs.json``."""

    remedy = "make it with: python benchmarks/costs"

    fidelity: StandardFidelity | None = None
    costs: tuple[CostEntry, ...]


@dataclass(frozen=True)
class Costs:
    """What things that a deck leaves out would cost.

    Attributes
    ----------
    entries : sequence of CostEntry
    standard : Setting or None
        Setting of the deck that the process entries were compared with, if the file says so.
    """

    entries: Sequence[CostEntry] = ()
    standard: Setting | None = None

    @property
    def plain_entry(self) -> CostEntry | None:
        """The cost of the plain deck, at full stiffness if that was timed."""
        by_name = {entry.name: entry for entry in self.entries}
        return next((by_name[name] for name in _PLAIN if name in by_name), None)

    def standard_in(self, tradeoff: Tradeoff) -> Setting:
        """The `standard`; a file that does not name it is taken to mean the `hub`."""
        return self.standard or hub(tradeoff)

    def plain(self, tradeoff: Tradeoff, setting: Setting) -> float | None:
        """How many times a setting is cheaper than the plain deck; None if that is not known.

        The plain deck was compared with the standard deck, and that with the setting.
        """
        entry, standard = self.plain_entry, self.standard_in(tradeoff)
        if entry is None or not tradeoff.of(standard):
            return None
        return finite(entry.ratio * tradeoff.cost(standard) / tradeoff.cost(setting))


def step_costs(costs: Costs) -> StepCosts | None:
    """What a step costs at other moduli, steps and speeds; None if that was not timed."""
    if costs.standard is None:
        return None
    levels: dict[str, dict[float, float]] = {}
    for entry in costs.entries:
        if entry.parameter and entry.level is not None and entry.per_step is not None:
            base = {float(getattr(costs.standard, entry.parameter)): 1.0}
            levels.setdefault(entry.parameter, base)[entry.level] = entry.per_step
    return StepCosts(levels) if levels else None


def read_costs(file: Path | None) -> Costs:
    """Read ``costs.json``; nothing without a file.

    Raises
    ------
    DocumentError
        It is not that document, or an entry lacks a key.
    """
    if file is None:
        return Costs()
    content = CostsFile.read(file)
    standard = Setting.of(content.fidelity) if content.fidelity else None
    return Costs(content.costs, standard)
